/// The ICM20649 on its own I2C bus: 1125 samples a second, each stamped by its data-ready
/// interrupt.
///
/// Register names and range codes are Adafruit's; the set-up is not: Adafruit_ICM20649::begin_I2C
/// waits for the end of the reset without a limit, enableGyrolDLPF writes the accelerometer's
/// register, and nothing there turns on the data-ready pin. A register driver over any bus
/// (lib/Sensors/ICM20649.h) replaces this file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "Mathpk.h"
#include "RawSamples.h"

#include "I2cBus.h"
#include "Pins.h"

#include <Arduino.h>

namespace strix {

class ImuIcm20649 {
 public:
  static constexpr std::uint8_t kAddress = 0x68;  ///< Adafruit's breakout as it is sold

  explicit ImuIcm20649(I2cBus& bus) : device_(bus, kAddress) {}

  /// Identity, reset, settings, and every setting read back. False: absent, or it did not take
  /// them. Bound: 0.25 s.
  [[nodiscard]] bool begin();

  /// The newest sample, in the axes printed on the breakout. One burst of 14 bytes: 0.40 ms.
  /// Bound: I2cBus::transferBound(17) = 0.53 ms; 0.73 ms when it fails.
  [[nodiscard]] bool read(ImuRaw& out);

  /// Samples read by the clock because the data-ready wire was silent.
  [[nodiscard]] std::uint32_t polled() const { return polled_; }
  [[nodiscard]] std::uint32_t misses() const { return device_.misses(); }

 private:
  static constexpr std::size_t kBurst = 14;  // accelerometer, gyro, temperature
  using Burst = std::array<std::uint8_t, kBurst>;

  static constexpr Micros kSilence = 4000;  // four samples without an edge: the wire is broken
  static constexpr Micros kPollPeriod = 1000;

  static void dataReady();
  [[nodiscard]] bool configure();

  I2cDevice device_;
  Burst last_{};
  std::uint32_t seenEdges_ = 0;
  Micros lastEdge_ = 0;
  Micros lastPoll_ = 0;
  std::uint32_t polled_ = 0;

  static inline volatile std::uint32_t edges = 0;  // NOLINT: shared with the interrupt
  static inline volatile Micros edgeTime = 0;      // NOLINT
};

}  // namespace strix
