/// The LIS2MDL: 100 readings a second, set up by Adafruit's driver, read without it.
#pragma once

#include <array>
#include <cstdint>

#include "RawSamples.h"

#include "I2cBus.h"

#include <Arduino.h>

#include <Adafruit_LIS2MDL.h>

namespace strix {

class MagLis2mdl {
 public:
  static constexpr std::uint8_t kAddress = 0x1E;
  static constexpr Micros kPeriod = 10'000;  ///< us between two readings

  explicit MagLis2mdl(I2cBus& bus) : device_(bus, kAddress) {}

  /// Identity, Adafruit's reset and settings, which are read back.
  /// Takes 0.2 s; bound: 0.2 ms without the device, 0.36 ms on a held bus. Adafruit's driver goes
  /// through Wire, where each of 21 phases may wait 17 ms for a bus that is not idle and then 51 ms
  /// for its end: with a device that lets go of the lines just so, 1.7 s. On the ground, motors
  /// off.
  [[nodiscard]] bool begin();

  /// Status and field in one burst of 7 bytes: 0.24 ms. Looked for at most every 2 ms, and not in
  /// the first three quarters of a period, which gives the sensor's clock 25 %.
  /// Bound: I2cBus::transferBound(10) = 0.33 ms; 0.53 ms when it fails.
  ///
  /// Nothing is read from a sensor that begin() did not find as it should be. One that answers but
  /// measures nothing for kSilence has lost its power and its settings: it gets them again instead
  /// of one look.
  [[nodiscard]] bool read(MagRaw& out);

  [[nodiscard]] std::uint32_t misses() const { return device_.misses(); }
  /// Readings above kHighestField: noise on the bus, or a magnet that saturates the sensor.
  [[nodiscard]] std::uint32_t implausible() const { return implausible_; }
  /// Readings that were the same as the kStuckAfter before.
  [[nodiscard]] std::uint32_t stuck() const { return stuck_; }
  /// Times it was given its settings again in flight.
  [[nodiscard]] std::uint32_t restarts() const { return restarts_; }

 private:
  using Burst = std::array<std::uint8_t, 7>;

  static constexpr Micros kPollPeriod = 2000;
  static constexpr Micros kPause = kPeriod * 3 / 4;
  static constexpr Micros kSilence = 5 * kPeriod;
  static_assert(kPause + kPollPeriod < kPeriod, "a reading would be overwritten before it is seen");

  /// 2 counts of noise on each axis repeat a reading by chance three times in a thousand; ten in a
  /// row never.
  static constexpr std::uint32_t kStuckAfter = 10;

  [[nodiscard]] bool due(Micros now) const;
  void restart();
  [[nodiscard]] bool isGood(const Burst& burst);

  I2cDevice device_;
  bool begun_ = false;
  Adafruit_LIS2MDL driver_;
  Burst last_{};
  std::uint32_t repeated_ = 0;
  Micros lastPoll_ = 0;
  Micros lastReading_ = 0;
  bool arrived_ = false;
  bool silent_ = false;
  std::uint32_t implausible_ = 0;
  std::uint32_t stuck_ = 0;
  std::uint32_t restarts_ = 0;
};

}  // namespace strix
