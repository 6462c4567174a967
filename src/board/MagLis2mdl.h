/// The LIS2MDL: 100 readings a second, set up by Adafruit's driver, read without it.
#pragma once

#include <cstdint>

#include "RawSamples.h"

#include "I2cBus.h"

#include <Arduino.h>

#include <Adafruit_LIS2MDL.h>

namespace strix {

class MagLis2mdl {
 public:
  static constexpr std::uint8_t kAddress = 0x1E;

  explicit MagLis2mdl(I2cBus& bus) : device_(bus, kAddress) {}

  /// Identity, Adafruit's reset and settings, which are read back.
  /// Takes 0.2 s; bound: 0.2 ms without the device. Adafruit's driver goes through Wire: a bus that
  /// is held low from just after the identity check on costs up to 3 s, on the ground.
  [[nodiscard]] bool begin();

  /// Status and field in one burst of 7 bytes: 0.24 ms. Looked for at most every 2 ms.
  /// Bound: I2cBus::transferBound(10) = 0.33 ms; 0.53 ms when it fails.
  [[nodiscard]] bool read(MagRaw& out);

  [[nodiscard]] std::uint32_t misses() const { return device_.misses(); }

 private:
  static constexpr Micros kPollPeriod = 2000;

  I2cDevice device_;
  Adafruit_LIS2MDL driver_;
  Micros lastPoll_ = 0;
};

}  // namespace strix
