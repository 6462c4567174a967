/// The registers of an Afro ESC, from the TWI interrupt of Blue Robotics' tgy.asm (SIMPLE_I2C):
/// what each byte of a transfer does, the counter that reading clears, arming and the time-out.
#pragma once

#include <cmath>
#include <cstdint>

#include "FakeClock.h"
#include "FakeI2cWire.h"

namespace strix {

class FakeAfroEsc final : public I2cChip {
 public:
  explicit FakeAfroEsc(FakeClock& clock) : clock_(clock) { powerUp(); }

  // Set by the test.
  double polePairs = 7.0;
  double batteryVoltage = 11.4;  ///< V
  double celsius = 40.0;
  bool hasCurrentSensor = true;  ///< a BlueESC has, an Afro has not
  double amperes = 6.0;
  std::uint8_t identity = 0xAB;

  /// The rotor turns so fast from now on, rev/s; up to now it turned as before.
  void turn(double revolutionsPerSecond) {
    settle();
    speed_ = revolutionsPerSecond;
  }

  [[nodiscard]] bool armed() const { return armed_; }
  /// What it drives the motor with: the last command until 64 overflows of 65.536 ms have passed.
  [[nodiscard]] int driven() const {
    const bool fresh = clock_.now() - commanded_ < 64ULL * 65'536'000ULL;
    return armed_ && fresh ? command_ : 0;
  }
  [[nodiscard]] std::uint32_t commands() const { return commands_; }

  void powerUp() override {
    armed_ = false;
    command_ = 0;
    high_ = 0;
    turns_ = 0.0;
    taken_ = 0;
    last_ = clock_.now();
  }

  std::uint8_t readRegister(std::uint8_t reg) override {
    // A high byte is an even register here; its low byte is kept for the next transfer of one.
    if (reg % 2 == 1) return cache_;
    settle();
    std::uint16_t word = static_cast<std::uint16_t>(identity << 8U | identity);
    if (reg == 0x02) {
      const auto whole = static_cast<std::uint64_t>(turns_);
      word = static_cast<std::uint16_t>((whole - taken_) & 0xFFFFU);  // the counter has 16 bits
      taken_ = whole;
    } else if (reg == 0x04) {
      word = tenBits(batteryVoltage * 3.3 / 21.3 / 5.0);
    } else if (reg == 0x06) {
      const double ohm = 1e4 * std::exp(3900.0 * (1.0 / (celsius + 273.15) - 1.0 / 298.15));
      word = tenBits(ohm / (ohm + 3300.0));
    } else if (reg == 0x08) {
      word = hasCurrentSensor ? tenBits(0.5 + amperes / 14.706 / 5.0) : std::uint16_t{0};
    }
    cache_ = static_cast<std::uint8_t>(word & 0xFFU);
    return static_cast<std::uint8_t>(word >> 8U);
  }

  void writeRegister(std::uint8_t reg, std::uint8_t value) override {
    if (reg == 0x00) high_ = value;
    if (reg != 0x01) return;
    command_ = static_cast<std::int16_t>(static_cast<std::uint16_t>(high_ << 8U | value));
    commanded_ = clock_.now();
    ++commands_;
    if (command_ == 0) armed_ = true;
  }

 private:
  /// An AVR's converter, left-adjusted: 1024 steps in the upper ten bits.
  [[nodiscard]] static std::uint16_t tenBits(double share) {
    const double steps = std::floor(share * 1024.0);
    const double limited = std::fmin(std::fmax(steps, 0.0), 1023.0);
    return static_cast<std::uint16_t>(static_cast<unsigned>(limited) << 6U);
  }

  void settle() {
    const FakeClock::Nanos now = clock_.now();
    turns_ += speed_ * polePairs * 1e-9 * static_cast<double>(now - last_);
    last_ = now;
  }

  FakeClock& clock_;
  double speed_ = 0.0;
  double turns_ = 0.0;  ///< of the field, since power-up
  std::uint64_t taken_ = 0;
  FakeClock::Nanos last_ = 0;
  bool armed_ = false;
  int command_ = 0;
  FakeClock::Nanos commanded_ = 0;
  std::uint32_t commands_ = 0;
  std::uint8_t high_ = 0;
  std::uint8_t cache_ = 0;
};

}  // namespace strix
