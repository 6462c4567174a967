/// Four ESCs by pulse width.
#pragma once

#include <cstddef>
#include <cstdint>

#include "Pins.h"
#include "Vehicle.h"

#include <Arduino.h>

namespace strix {

/// How an ESC is told. It listens for one of them at power-up: switch its battery off and on after
/// a change, and teach it its range anew (docs/bring-up.md).
enum class EscProtocol : std::uint8_t {
  /// 1000 to 2000 us, 500 times a second. Every ESC with a signal wire.
  Pwm,
  /// The same eight times shorter, 125 to 250 us, 2000 times a second. ESCs with BLHeli from
  /// revision 13, BLHeli_S and BLHeli_32, and KISS (betaflight.com/docs/development/oneshot); few
  /// with SimonK. What it buys is time: a command waits for the end of the running period,
  /// up to 0.5 instead of 2 ms, and then for the end of its pulse. Faster than that no ESC is asked
  /// for (Betaflight keeps 0.5 ms between two OneShot125 updates).
  OneShot125,
};

/// The ESCs on pins::kEsc.
constexpr EscProtocol kEscProtocol = EscProtocol::Pwm;

template <EscProtocol Protocol>
class EscPulses {
 public:
  static constexpr bool kOneShot = Protocol == EscProtocol::OneShot125;
  static constexpr std::uint32_t kFrequency = kOneShot ? 2000 : 500;  ///< Hz
  // Commands are widths of PWM pulses with either.
  static constexpr float kOff = 1150.0F;       ///< us, motors stopped
  static constexpr float kMax = 1950.0F;       ///< us, leaves 50 us between two pulses of PWM
  static constexpr float kNonsense = 2200.0F;  ///< us, no servo pulse is that long

  /// Starts sending `off`. Before it the pins are inputs: no pulse, no motor.
  void begin() {
    analogWriteResolution(16);
    for (const std::uint8_t pin : pins::kEsc) analogWriteFrequency(pin, kFrequency);
    stop();
  }

  /// Takes effect when the running period ends. Bound: 2 us.
  void write(const EscCommands& commands) {
    turning_ = false;
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      const float wanted = pulse(commands[i]);
      turning_ = turning_ || wanted > kOff;
      send(i, wanted);
    }
  }

  void stop() {
    turning_ = false;
    for (std::size_t i = 0; i < kMotorCount; ++i) send(i, kOff);
  }

  /// A motor was told to turn.
  [[nodiscard]] bool turning() const { return turning_; }

  /// The PWM pulse that a command becomes: off below the range, full above it; and off for what
  /// cannot be meant as a pulse width (NaN, or the int16 of a vehicle with other ESCs).
  [[nodiscard]] static constexpr float pulse(float command) {
    if (!(command > kOff) || command > kNonsense) return kOff;
    return command < kMax ? command : kMax;
  }

  /// Timer counts of a PWM pulse: 18.75 a us, and 9.375 when it is sent eight times shorter.
  [[nodiscard]] static constexpr std::uint32_t counts(float pulse_us) {
    return static_cast<std::uint32_t>(pulse_us * kCountsPerMicro + 0.5F);
  }

  /// The value that makes the core's analogWrite choose exactly these counts: it computes
  /// (value * kPeriod) >> 16, so rounding up undoes its rounding down.
  [[nodiscard]] static constexpr std::uint32_t analogValue(std::uint32_t counts) {
    return ((counts << 16U) + kPeriod - 1) / kPeriod;
  }

 private:
  // The core halves the 150 MHz bus clock until a period fits 16 bits: three times at 500 Hz, once
  // at 2000 Hz. The period is 37500 counts either way.
  static constexpr std::uint32_t kTimerClock = 150'000'000 / (kOneShot ? 2 : 8);
  static constexpr std::uint32_t kPeriod = kTimerClock / kFrequency;
  static constexpr float kCountsPerMicro =
      static_cast<float>(kTimerClock) * 1e-6F / (kOneShot ? 8.0F : 1.0F);

  static_assert(kPeriod <= 65535 && kPeriod > 65535 / 2,
                "the core would halve its clock otherwise");

  static void send(std::size_t motor, float pulse_us) {
    analogWrite(pins::kEsc[motor], static_cast<int>(analogValue(counts(pulse_us))));
  }

  bool turning_ = false;
};

using EscPwm = EscPulses<kEscProtocol>;

}  // namespace strix
