/// The BMP390 in normal mode: 50 readings a second, pressure averaged over 8.
///
/// Bosch's driver, which Adafruit_BMP3XX wraps, does set-up and compensation on our bus.
/// Adafruit's own class is not used: it knows the forced mode only, where a reading is the
/// conversion before, and one that is still running is waited for with a delay of 5 ms.
#pragma once

#include <cstdint>

#include "RawSamples.h"

#include "I2cBus.h"

#include <bmp3.h>

namespace strix {

class BaroBmp390 {
 public:
  static constexpr std::uint8_t kAddress = 0x77;  ///< Adafruit's breakout as it is sold
  static constexpr Micros kPeriod = 20'000;       ///< us between two readings

  explicit BaroBmp390(I2cBus& bus) : device_(bus, kAddress) {}

  /// Identity, reset, the factory's coefficients (read twice: the bus has no checksum), settings,
  /// which are read back. Bound: 40 ms.
  [[nodiscard]] bool begin();

  /// Status (0.10 ms), and when there is a new reading six bytes (0.21 ms) and their compensation.
  /// Looked for at most every 2 ms, and not in the first three quarters of a period, which gives
  /// the sensor's clock 25 %. Bound: transferBound(4) + transferBound(9) = 0.46 ms;
  /// 0.66 ms when it fails.
  ///
  /// Nothing is read from a sensor that begin() did not find as it should be. One that answers but
  /// measures nothing for kSilence has lost its power and its settings: it gets them again instead
  /// of one look.
  [[nodiscard]] bool read(AltRaw& out);

  [[nodiscard]] std::uint32_t misses() const { return device_.misses(); }
  /// Readings outside what the sensor can measure: 300 to 1250 hPa, -40 to 85 degC.
  [[nodiscard]] std::uint32_t implausible() const { return implausible_; }
  /// Readings that were the same as the kStuckAfter before.
  [[nodiscard]] std::uint32_t stuck() const { return stuck_; }
  /// Times it was given its settings again in flight.
  [[nodiscard]] std::uint32_t restarts() const { return restarts_; }

 private:
  static constexpr Micros kPollPeriod = 2000;
  static constexpr Micros kPause = kPeriod * 3 / 4;
  static constexpr Micros kSilence = 5 * kPeriod;
  static_assert(kPause + kPollPeriod < kPeriod, "a reading would be overwritten before it is seen");

  /// One count is 0.015 Pa and the noise some 50 counts: equal readings come by chance once in
  /// hundreds, ten in a row never.
  static constexpr std::uint32_t kStuckAfter = 10;

  static std::int8_t readRegisters(std::uint8_t reg, std::uint8_t* data, std::uint32_t count,
                                   void* device);
  static std::int8_t writeRegisters(std::uint8_t reg, const std::uint8_t* data, std::uint32_t count,
                                    void* device);
  [[nodiscard]] bool readCoefficients();
  [[nodiscard]] bool configure();
  [[nodiscard]] bool due(Micros now) const;
  void restart();
  [[nodiscard]] bool isGood(const bmp3_data& data);

  I2cDevice device_;
  bool begun_ = false;
  bmp3_dev bosch_{};
  bmp3_data last_{};
  std::uint32_t repeated_ = 0;
  Micros lastPoll_ = 0;
  Micros lastReading_ = 0;
  bool silent_ = false;
  std::uint32_t implausible_ = 0;
  std::uint32_t stuck_ = 0;
  std::uint32_t restarts_ = 0;
};

}  // namespace strix
