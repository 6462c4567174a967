/// The registers of a LIS2MDL, from ST's datasheet DS12144 (chapter 8): identity, modes, data rate,
/// status and data, temperature.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "FakeClock.h"
#include "FakeI2cWire.h"

namespace strix {

class FakeLis2mdl final : public I2cChip {
 public:
  static constexpr std::uint8_t kAddress = 0x1E;
  static constexpr std::uint8_t kWhoAmI = 0x4F;
  static constexpr std::uint8_t kConfigA = 0x60;
  static constexpr std::uint8_t kConfigB = 0x61;
  static constexpr std::uint8_t kConfigC = 0x62;
  static constexpr std::uint8_t kStatus = 0x67;
  static constexpr std::uint8_t kData = 0x68;
  static constexpr std::uint8_t kTemperature = 0x6E;

  explicit FakeLis2mdl(FakeClock& clock) : clock_(clock) { powerUp(); }

  // Set by the test.
  /// uT, along the axes printed on the breakout. These are left-handed: no rotation takes them to
  /// the aircraft's, a reflection must be in it.
  std::array<double, 3> field{};
  double temperature = 25.0;  ///< degC
  bool frozen = false;        ///< measures on time, but always the same
  std::uint8_t identity = 0x40;
  std::uint8_t deaf = 0;  ///< a register that does not take what is written

  /// Measurements so far.
  [[nodiscard]] std::uint64_t measured() const { return measuring() ? sampleNumber() : 0; }

  void powerUp() override {
    registers_.fill(0);
    registers_[kConfigA] = 0x03;  // idle
    begun_ = clock_.now();
    taken_ = 0;
  }

  std::uint8_t readRegister(std::uint8_t reg) override {
    if (reg == kWhoAmI) return identity;
    // Block data update keeps the two bytes of an axis together, not the three axes.
    const bool upper = reg > kData && reg < kData + 6 && (reg - kData) % 2 == 1;
    const bool held = (registers_[kConfigC] & 0x10U) != 0 && upper;
    if (!held) measure();
    const std::uint8_t value = registers_[reg];
    if (reg == kData + 5) registers_[kStatus] = 0;  // the last of the axes has been read
    return value;
  }

  void writeRegister(std::uint8_t reg, std::uint8_t value) override {
    constexpr std::uint8_t kSoftReset = 0x20;
    constexpr std::uint8_t kReboot = 0x40;
    if (reg < kConfigA || reg > kConfigC || reg == deaf) return;
    if (reg == kConfigA && (value & kSoftReset) != 0) {
      powerUp();
      return;
    }
    if (reg == kConfigA) {
      value = static_cast<std::uint8_t>(value & ~kReboot);
      if (value != registers_[kConfigA]) {
        begun_ = clock_.now();
        taken_ = 0;
      }
    }
    registers_[reg] = value;
  }

 private:
  static constexpr double kMicroTeslaACount = 0.15;  // 1.5 mgauss, table 3

  [[nodiscard]] bool measuring() const { return (registers_[kConfigA] & 3U) == 0; }
  [[nodiscard]] std::uint64_t sampleNumber() const {
    constexpr std::array<FakeClock::Nanos, 4> kPeriods{100'000'000, 50'000'000, 20'000'000,
                                                       10'000'000};
    return (clock_.now() - begun_) / kPeriods[registers_[kConfigA] >> 2U & 3U];
  }

  void measure() {
    const std::uint64_t number = measured();
    if (number == taken_) return;
    constexpr std::uint8_t kNew = 0x0F;
    constexpr std::uint8_t kOverrun = 0xF0;
    registers_[kStatus] =
        static_cast<std::uint8_t>(registers_[kStatus] != 0 ? kNew | kOverrun : kNew);
    taken_ = number;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Two counts of noise, as the datasheet has: no reading is equal to the one before.
      const double noise = frozen ? 0.0 : static_cast<double>((number + axis) % 5) - 2.0;
      put(kData + 2 * axis, field[axis] / kMicroTeslaACount + noise);
    }
    put(kTemperature, (temperature - 25.0) * 8.0);  // table 4: 8 counts a degree, 0 at 25 degC
  }

  void put(std::size_t reg, double counts) {
    const double limited = std::fmin(std::fmax(counts, -32768.0), 32767.0);
    const auto word = static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(limited)));
    registers_[reg] = static_cast<std::uint8_t>(word & 0xFFU);
    registers_[reg + 1] = static_cast<std::uint8_t>(word >> 8U);
  }

  FakeClock& clock_;
  std::array<std::uint8_t, 256> registers_{};
  FakeClock::Nanos begun_ = 0;
  std::uint64_t taken_ = 0;  ///< newest measurement that is in the registers
};

}  // namespace strix
