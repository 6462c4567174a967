/// Driver of an ESC that is commanded over I2C and answers: the register protocol of SimonK's
/// firmware for Afro ESCs and the BlueESC.
///
/// The registers are those of Blue Robotics' fork of tgy.asm (SIMPLE_I2C; "A simple I2C protocol
/// with telemetry feedback") and their scales those of bluerobotics/Arduino_I2C_ESC. SimonK's own
/// tgy.asm speaks MikroKopter's protocol at another address and has none of them.
///
/// What the ESC does by itself: it arms when it hears a zero, turns only after that, and keeps the
/// last command for 4.2 s (64 overflows of 65.5 ms) when the bus falls silent. A bus that dies in
/// flight therefore leaves the motors running that long: the ESCs need a bus of their own.
///
/// A Device is one chip on one bus, its transfers bounded by the bus:
///   bool read(uint8_t reg, uint8_t* data, size_t count);         false: nothing is known of data
///   bool write(uint8_t reg, const uint8_t* data, size_t count);
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "Deterministic.h"
#include "Time.h"

namespace strix {

namespace afro {

constexpr std::uint8_t kFirstAddress = 0x29;  ///< of ESC 0; the next ones count up

// Two bytes each, the high one first. The address counts up within a transfer.
constexpr std::uint8_t kThrottle = 0x00;     ///< write only; the sign is the direction
constexpr std::uint8_t kRevolutions = 0x02;  ///< of the field, since the last reading
constexpr std::uint8_t kVoltage = 0x04;      ///< ADC, 10 bits at the top of the word, as the next
constexpr std::uint8_t kTemperature = 0x06;  ///< thermistor
constexpr std::uint8_t kCurrent = 0x08;      ///< BlueESC only: an Afro leaves it at 0
constexpr std::uint8_t kIdentityReg = 0x0A;  ///< one byte
constexpr std::uint8_t kIdentity = 0xAB;
constexpr std::size_t kBlock = 9;  ///< bytes from kRevolutions to the identity
constexpr std::int16_t kFullThrottle = 32767;

/// The fastest that the firmware commutates: 32 us a step (TIMING_MAX), six steps to a turn of the
/// field. Whatever counts faster is not this ESC; and after 65536 such turns, 12.6 s, a count may
/// have wrapped, so what was counted for longer tells nothing.
constexpr Micros kShortestFieldTurn = 192;
constexpr Micros kLongestCount = 65536 * kShortestFieldTurn;

/// What one reading tells; NaN for what it does not.
struct Status {
  float revolutions = kNaN;  ///< rev/s of the rotor, mean since the reading before
  float voltage = kNaN;      ///< V, at the ESC
  float temperature = kNaN;  ///< degC, beside the transistors
  float current = kNaN;      ///< A
};

/// Counted since the start.
struct Faults {
  std::uint32_t failedWrites = 0;
  std::uint32_t failedReads = 0;
  std::uint32_t wrongIdentity = 0;  ///< something answered that is no such ESC, or with noise
  std::uint32_t implausible = 0;    ///< counts that no motor can make
};

enum class Answer : std::uint8_t { Good, Silent, WrongIdentity };

/// Battery through 18 kOhm over 3.3 kOhm, against 5 V.
[[nodiscard]] constexpr float voltageOf(std::uint16_t word) {
  return static_cast<float>(word) * (5.0F * 6.45F / 65536.0F);
}

/// A Hall sensor of 14.706 A/V with its zero at half scale. The word 0, -37 A, is what an ESC
/// without such a sensor says.
[[nodiscard]] constexpr float currentOf(std::uint16_t word) {
  if (word == 0) return kNaN;
  return (static_cast<float>(word) - 32767.0F) * (5.0F * 14.706F / 65535.0F);
}

/// A thermistor to ground, 10 kOhm at 25 degC with B = 3900 K, 3.3 kOhm to the reference:
/// 1/T = 1/T0 + ln(R/R0)/B. NaN for one that is open or short.
[[nodiscard]] inline float temperatureOf(std::uint16_t word) {
  constexpr std::uint16_t kOpen = 0xFFC0;  // all ten bits
  if (word == 0 || word >= kOpen) return kNaN;
  const auto share = static_cast<float>(word);
  const float ohm = 3300.0F * share / (65535.0F - share);
  return 1.0F / (1.0F / 298.15F + logarithm(ohm / 10000.0F) / 3900.0F) - 273.15F;
}

/// The word for a vehicle's command. Backwards, NaN and infinity are off: an aircraft's propeller
/// never turns backwards, and what cannot be meant stops it.
[[nodiscard]] constexpr std::int16_t throttleOf(float command) {
  constexpr float kFull = kFullThrottle;
  if (!(command > 0.0F) || command > 2.0F * kFull) return 0;
  return command < kFull ? static_cast<std::int16_t>(command) : kFullThrottle;
}

}  // namespace afro

template <class Device>
class AfroEsc {
 public:
  /// @param polePairs  magnets of the motor's bell by two
  constexpr AfroEsc(Device& device, std::uint8_t polePairs)
      : device_(device), polePairs_(polePairs) {}

  /// Zero stops, and arms after power-up. One transfer of 4 bytes on the wire, no waiting.
  bool write(std::int16_t throttle) {
    if (throttle < -afro::kFullThrottle) throttle = -afro::kFullThrottle;  // -32768 has no opposite
    const auto word = static_cast<std::uint16_t>(throttle);
    const std::array<std::uint8_t, 2> bytes{static_cast<std::uint8_t>(word >> 8U),
                                            static_cast<std::uint8_t>(word & 0xFFU)};
    if (device_.write(afro::kThrottle, bytes.data(), bytes.size())) return true;
    ++faults_.failedWrites;
    return false;
  }

  /// Is it there, and is it one. One transfer of 4 bytes.
  [[nodiscard]] afro::Answer identify() {
    std::uint8_t found = 0;
    const bool answered = device_.read(afro::kIdentityReg, &found, 1);
    return judge(answered, found);
  }

  /// One transfer of 12 bytes on the wire, no waiting. Reading clears the ESC's counter with its
  /// first byte: the first reading, and one behind a reading that failed, whose counter may be
  /// cleared or not, tells no revolutions.
  /// @param now  when the transfer begins
  [[nodiscard]] afro::Answer read(Micros now, afro::Status& out) {
    out = afro::Status{};
    std::array<std::uint8_t, afro::kBlock> block{};
    const bool answered = device_.read(afro::kRevolutions, block.data(), block.size());
    const afro::Answer answer = judge(answered, block.back());
    if (answer != afro::Answer::Good) {
      counting_ = false;
      return answer;
    }
    if (counting_) out.revolutions = revolutions(word(&block[0]), elapsed(now, last_));
    out.voltage = afro::voltageOf(word(&block[2]));
    out.temperature = afro::temperatureOf(word(&block[4]));
    out.current = afro::currentOf(word(&block[6]));
    last_ = now;
    counting_ = true;
    return answer;
  }

  [[nodiscard]] const afro::Faults& faults() const { return faults_; }

 private:
  [[nodiscard]] static constexpr std::uint16_t word(const std::uint8_t* bytes) {
    return static_cast<std::uint16_t>(bytes[0] << 8U | bytes[1]);
  }

  [[nodiscard]] afro::Answer judge(bool answered, std::uint8_t identity) {
    if (!answered) {
      ++faults_.failedReads;
      return afro::Answer::Silent;
    }
    if (identity != afro::kIdentity) {
      ++faults_.wrongIdentity;
      return afro::Answer::WrongIdentity;
    }
    return afro::Answer::Good;
  }

  [[nodiscard]] float revolutions(std::uint16_t fieldTurns, Micros time) {
    if (time == 0 || time > afro::kLongestCount) return kNaN;
    // One turn may have been under way at either end.
    if (fieldTurns > time / afro::kShortestFieldTurn + 1U) {
      ++faults_.implausible;
      return kNaN;
    }
    return static_cast<float>(fieldTurns) / (static_cast<float>(polePairs_) * toSeconds(time));
  }

  Device& device_;
  std::uint8_t polePairs_;
  bool counting_ = false;  ///< the counter was cleared at last_
  Micros last_ = 0;
  afro::Faults faults_;
};

}  // namespace strix
