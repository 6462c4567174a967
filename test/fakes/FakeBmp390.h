/// The registers of a BMP390, from Bosch's datasheet BST-BMP390-DS002: identity, the factory's
/// coefficients, sleep, forced and normal mode, data rate, oversampling, status and data. Given Pa
/// and degC it has the raw counts that the datasheet's compensation turns into them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "FakeClock.h"
#include "FakeI2cWire.h"

namespace strix {

class FakeBmp390 final : public I2cChip {
 public:
  static constexpr std::uint8_t kAddress = 0x77;
  static constexpr std::uint8_t kError = 0x02;
  static constexpr std::uint8_t kStatus = 0x03;
  static constexpr std::uint8_t kData = 0x04;
  static constexpr std::uint8_t kEvent = 0x10;
  static constexpr std::uint8_t kPower = 0x1B;
  static constexpr std::uint8_t kOversampling = 0x1C;
  static constexpr std::uint8_t kDataRate = 0x1D;
  static constexpr std::uint8_t kFilter = 0x1F;
  static constexpr std::uint8_t kCoefficients = 0x31;
  static constexpr std::uint8_t kCommand = 0x7E;

  explicit FakeBmp390(FakeClock& clock) : clock_(clock) { powerUp(); }

  // Set by the test.
  double pressure = 101'325.0;  ///< Pa
  double temperature = 25.0;    ///< degC
  bool frozen = false;          ///< measures on time, but always the same
  std::uint8_t identity = 0x60;
  std::uint8_t deaf = 0;          ///< a register that does not take what is written
  bool flipsCoefficient = false;  ///< the bus damages one bit, once, as they are read

  [[nodiscard]] bool writesInPairs() const override { return true; }

  void powerUp() override {
    registers_.fill(0);
    registers_[0x01] = 0x01;  // revision
    registers_[kStatus] = kReady;
    registers_[kEvent] = 0x01;  // power-on reset seen
    registers_[kOversampling] = 0x02;
    std::size_t at = kCoefficients;
    for (const auto& [value, bytes] : kNvm) {
      for (unsigned i = 0; i < bytes; ++i) {
        registers_[at++] = static_cast<std::uint8_t>(static_cast<unsigned>(value) >> 8U * i);
      }
    }
    begun_ = clock_.now();
    taken_ = 0;
  }

  std::uint8_t readRegister(std::uint8_t reg) override {
    if (reg == 0) return identity;
    measure();
    const std::uint8_t value = registers_[reg];
    if (reg == kError || reg == kEvent) registers_[reg] = 0;  // 4.3.3, 4.3.9: cleared by reading
    if (reg >= kData && reg < kData + 6) registers_[kStatus] = kReady;  // 4.3.4
    if (reg == kCoefficients + 5 && flipsCoefficient) {
      flipsCoefficient = false;
      return value ^ 0x10U;
    }
    return value;
  }

  void writeRegister(std::uint8_t reg, std::uint8_t value) override {
    if (reg == deaf) return;
    if (reg == kCommand) {
      if (value == 0xB6) powerUp();
      return;
    }
    if (reg < 0x15 || reg > 0x1F) return;
    registers_[reg] = value;
    if (reg != kPower) return;
    begun_ = clock_.now();
    taken_ = 0;
    if (mode() == 3 && conversionTime() > period()) registers_[kError] |= 0x04U;
  }

  /// ns; section 3.9.2, the longest: table 23 and the formula above it.
  [[nodiscard]] FakeClock::Nanos conversionTime() const {
    const std::uint8_t osr = registers_[kOversampling];
    const std::uint32_t us = 234U + ((power() & 1U) != 0 ? 392U + (2020U << (osr & 7U)) : 0U) +
                             ((power() & 2U) != 0 ? 163U + (2020U << (osr >> 3U & 7U)) : 0U);
    return nanosFromMicros(us);
  }
  [[nodiscard]] FakeClock::Nanos period() const {
    return nanosFromMicros(5000ULL << (registers_[kDataRate] & 0x1FU));
  }
  /// Conversions that ended.
  [[nodiscard]] std::uint64_t measured() const {
    const FakeClock::Nanos running = clock_.now() - begun_;
    if (mode() == 0 || (power() & 3U) == 0 || running < conversionTime()) return 0;
    return mode() == 3 ? (running - conversionTime()) / period() + 1 : 1;
  }

 private:
  static constexpr std::uint8_t kReady = 0x10;  // for a command
  static constexpr std::uint8_t kNewData = 0x60;

  // Coefficients of the size that real parts have; these are no part's. Table 24: T1, T2 uint16,
  // T3 int8; P1, P2 int16, P3, P4 int8, P5, P6 uint16, P7, P8 int8, P9 int16, P10, P11 int8.
  static constexpr int kT1 = 27'400, kT2 = 18'900, kT3 = -7;
  static constexpr int kP1 = -540, kP2 = -2'050, kP3 = 35, kP4 = 1, kP5 = 25'000, kP6 = 30'300;
  static constexpr int kP7 = -12, kP8 = -9, kP9 = 16'100, kP10 = 25, kP11 = -60;
  struct Coefficient {
    int value;
    unsigned bytes;
  };
  static constexpr Coefficient kNvm[] = {{kT1, 2}, {kT2, 2}, {kT3, 1},  {kP1, 2}, {kP2, 2},
                                         {kP3, 1}, {kP4, 1}, {kP5, 2},  {kP6, 2}, {kP7, 1},
                                         {kP8, 1}, {kP9, 2}, {kP10, 1}, {kP11, 1}};

  [[nodiscard]] std::uint8_t power() const { return registers_[kPower]; }
  [[nodiscard]] unsigned mode() const { return power() >> 4U & 3U; }

  /// Section 8.5, as a polynomial of the raw temperature.
  [[nodiscard]] static double temperatureOf(double raw) {
    const double over = raw - std::ldexp(kT1, 8);
    return over * (std::ldexp(kT2, -30) + over * std::ldexp(kT3, -48));
  }
  /// Section 8.6, as a polynomial of the raw pressure whose coefficients depend on t.
  [[nodiscard]] static double pressureOf(double raw, double t) {
    const double constant =
        std::ldexp(kP5, 3) +
        t * (std::ldexp(kP6, -6) + t * (std::ldexp(kP7, -8) + t * std::ldexp(kP8, -15)));
    const double linear =
        std::ldexp(kP1 - 16'384, -20) +
        t * (std::ldexp(kP2 - 16'384, -29) + t * (std::ldexp(kP3, -32) + t * std::ldexp(kP4, -37)));
    const double square = std::ldexp(kP9, -48) + t * std::ldexp(kP10, -48);
    return constant + raw * (linear + raw * (square + raw * std::ldexp(kP11, -65)));
  }

  /// The counts of 24 bits at which a function that only rises, or only falls, has this value.
  template <class Function>
  [[nodiscard]] static std::uint32_t inverse(Function function, double value) {
    double below = 0.0;
    double above = 16'777'215.0;
    const bool rises = function(above) > function(below);
    while (above - below > 0.01) {
      const double middle = (below + above) / 2.0;
      ((function(middle) < value) == rises ? below : above) = middle;
    }
    return static_cast<std::uint32_t>(std::lround(below));
  }

  void measure() {
    const std::uint64_t number = measured();
    if (number == taken_) return;
    taken_ = number;
    const std::uint32_t rawT = inverse(temperatureOf, temperature);
    const double t = temperatureOf(rawT);
    const auto pressureAtT = [t](double raw) { return pressureOf(raw, t); };
    std::uint32_t rawP = inverse(pressureAtT, pressure);
    // +-30 counts, 0.5 Pa: no reading is equal to the one before.
    if (!frozen) rawP = rawP + static_cast<std::uint32_t>(number * 17 % 61) - 30U;
    put(kData, rawP);
    put(kData + 3, rawT);
    registers_[kStatus] = kReady | kNewData;
    if (mode() != 3) registers_[kPower] = power() & 0x0FU;  // a forced conversion ends in sleep
  }

  void put(std::size_t reg, std::uint32_t counts) {
    for (std::size_t i = 0; i < 3; ++i) {
      registers_[reg + i] = static_cast<std::uint8_t>(counts >> 8U * i & 0xFFU);
    }
  }

  FakeClock& clock_;
  std::array<std::uint8_t, 256> registers_{};
  FakeClock::Nanos begun_ = 0;
  std::uint64_t taken_ = 0;
};

}  // namespace strix
