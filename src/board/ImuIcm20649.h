/// The ICM20649 on its own bus: 1125 samples a second, each stamped by its data-ready interrupt.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "ICM20649.h"
#include "RawSamples.h"

#include "I2cBus.h"
#include "Pins.h"
#include "SpiBus.h"

#include <Arduino.h>

namespace strix {

class ImuIcm20649 {
 public:
  /// The wire: false for I2C (Pins.h), true for SPI (SpiBus.h). Data-ready is the same on both.
  static constexpr bool kOnSpi = false;
  /// True: the sensor keeps its samples until they are read, so that a pass of the loop that takes
  /// 2 or 20 ms loses none. They come out one a call, older but each with its own time.
  static constexpr bool kFifo = false;

  static constexpr icm20649::Config kConfig = [] {
    icm20649::Config config;
    config.spi = kOnSpi;
    config.fifo = kFifo;
    return config;
  }();
  static constexpr Micros kPeriod = kConfig.period();

  static constexpr std::uint8_t kAddress = 0x68;  ///< Adafruit's breakout as it is sold

  explicit ImuIcm20649(I2cBus& bus);

  /// Identity, reset, settings, and every setting read back. False: absent, or it did not take
  /// them. Bound: 0.37 s.
  [[nodiscard]] bool begin();
  /// How begin ended.
  [[nodiscard]] icm20649::Setup setup() const { return setup_; }

  /// The newest sample, in the axes printed on the breakout; with the FIFO the oldest. One burst of
  /// 14 bytes: 0.39 ms on I2C, 0.02 ms on SPI.
  /// Bound: I2cBus::transferBound(17) = 0.53 ms; 0.73 ms when it fails. With the FIFO up to eight
  /// samples at once: 3.6 ms and 0.17 ms on SPI.
  [[nodiscard]] bool read(ImuRaw& out);

  /// The factory's self-test: 0.5 s, on the ground, at rest. Without `completed`, begin again.
  [[nodiscard]] icm20649::SelfTest selfTest();

  /// Samples read by the clock because the data-ready wire was silent.
  [[nodiscard]] std::uint32_t polled() const { return polled_; }
  [[nodiscard]] const icm20649::Faults& faults() const { return driver_.faults(); }

 private:
  using Device = std::conditional_t<kOnSpi, SpiDevice, I2cDevice>;

  // Slower than the sensor, so that each look finds a sample. Four without an edge: a broken wire.
  static constexpr Micros kPollPeriod = kPeriod + kPeriod / 8;
  static constexpr Micros kSilence = 4 * kPollPeriod;

  static void dataReady();
  [[nodiscard]] static icm20649::DataReady newestEdge();
  [[nodiscard]] bool readOne(bool isNew, Micros sampled, ImuRaw& out);
  [[nodiscard]] bool refill(bool edge);

  Device device_;
  ICM20649<Device> driver_;
  icm20649::Setup setup_ = icm20649::Setup::NoAnswer;
  std::uint32_t seenEdges_ = 0;
  Micros lastEdge_ = 0;
  Micros lastPoll_ = 0;
  std::uint32_t polled_ = 0;
  std::array<ImuRaw, ICM20649<Device>::kFifoBatch> batch_;  // from the FIFO
  std::size_t filled_ = 0;
  std::size_t taken_ = 0;

  static inline volatile std::uint32_t edges = 0;  // NOLINT: shared with the interrupt
  static inline volatile Micros edgeTime = 0;      // NOLINT
};

}  // namespace strix
