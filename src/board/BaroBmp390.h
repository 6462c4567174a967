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

  explicit BaroBmp390(I2cBus& bus) : device_(bus, kAddress) {}

  /// Identity, reset, the factory's coefficients (read twice: the bus has no checksum), settings,
  /// which are read back. Bound: 40 ms.
  [[nodiscard]] bool begin();

  /// Status (0.11 ms), and when there is a new reading six bytes (0.22 ms) and their compensation.
  /// Looked for at most every 2 ms. Bound: transferBound(4) + transferBound(9) = 0.46 ms;
  /// 0.66 ms when it fails.
  [[nodiscard]] bool read(AltRaw& out);

  [[nodiscard]] std::uint32_t misses() const { return device_.misses(); }

  /// Readings outside what the sensor can measure.
  [[nodiscard]] std::uint32_t implausible() const { return implausible_; }

 private:
  static constexpr Micros kPollPeriod = 2000;

  static std::int8_t readRegisters(std::uint8_t reg, std::uint8_t* data, std::uint32_t count,
                                   void* device);
  static std::int8_t writeRegisters(std::uint8_t reg, const std::uint8_t* data, std::uint32_t count,
                                    void* device);
  [[nodiscard]] bool readCoefficients();
  [[nodiscard]] bool configure();

  I2cDevice device_;
  bmp3_dev bosch_{};
  Micros lastPoll_ = 0;
  std::uint32_t implausible_ = 0;
};

}  // namespace strix
