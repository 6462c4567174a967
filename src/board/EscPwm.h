/// Four ESCs by pulse width, 500 pulses a second.
#pragma once

#include <cstddef>
#include <cstdint>

#include "Pins.h"
#include "Vehicle.h"

#include <Arduino.h>

namespace strix {

class EscPwm {
 public:
  static constexpr std::uint32_t kFrequency = 500;  ///< Hz, one pulse for each control period
  static constexpr float kOff = 1150.0F;            ///< us, motors stopped
  static constexpr float kMax = 1950.0F;            ///< us, leaves 50 us between two pulses
  static constexpr float kNonsense = 2200.0F;       ///< us, no servo pulse is that long

  /// Starts sending `off`. Before it the pins are inputs: no pulse, no motor.
  void begin() {
    analogWriteResolution(16);
    for (const std::uint8_t pin : pins::kEsc) analogWriteFrequency(pin, kFrequency);
    stop();
  }

  /// Takes effect when the running period ends. Bound: 2 us.
  void write(const EscCommands& commands) {
    for (std::size_t i = 0; i < kMotorCount; ++i) send(i, pulse(commands[i]));
  }

  void stop() {
    for (std::size_t i = 0; i < kMotorCount; ++i) send(i, kOff);
  }

  /// The pulse that a command becomes: off below the range, full above it; and off for what cannot
  /// be meant as a pulse width (NaN, or the int16 of a vehicle with other ESCs).
  [[nodiscard]] static constexpr float pulse(float command) {
    if (!(command > kOff) || command > kNonsense) return kOff;
    return command < kMax ? command : kMax;
  }

  /// Timer counts of a pulse: 18.75 a us.
  [[nodiscard]] static constexpr std::uint32_t counts(float pulse_us) {
    return static_cast<std::uint32_t>(pulse_us * kCountsPerMicro + 0.5F);
  }

  /// The value that makes the core's analogWrite choose exactly these counts: it computes
  /// (value * kPeriod) >> 16, so rounding up undoes its rounding down.
  [[nodiscard]] static constexpr std::uint32_t analogValue(std::uint32_t counts) {
    return ((counts << 16U) + kPeriod - 1) / kPeriod;
  }

 private:
  // The core halves the 150 MHz bus clock until a period fits 16 bits: three times at 500 Hz.
  static constexpr std::uint32_t kTimerClock = 150'000'000 / 8;
  static constexpr std::uint32_t kPeriod = kTimerClock / kFrequency;  // 37500 counts
  static constexpr float kCountsPerMicro = static_cast<float>(kTimerClock) * 1e-6F;

  static void send(std::size_t motor, float pulse_us) {
    analogWrite(pins::kEsc[motor], static_cast<int>(analogValue(counts(pulse_us))));
  }
};

static_assert(EscPwm::counts(EscPwm::kOff) == 21563 && EscPwm::counts(EscPwm::kMax) == 36563);
static_assert((EscPwm::analogValue(36563) * 37500U) >> 16U == 36563);
static_assert(EscPwm::analogValue(36563) <= 65535);

}  // namespace strix
