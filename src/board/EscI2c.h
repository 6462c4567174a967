/// Four ESCs on one I2C bus, commanded each control tick, read in turn.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "AfroEsc.h"
#include "RawSamples.h"
#include "Time.h"
#include "Vehicle.h"

#include "I2cBus.h"

#include <Arduino.h>

namespace strix {

/// One ESC's registers. Unlike I2cDevice it does not rest after a miss: the next command may be the
/// one that stops the motor.
class EscWire {
 public:
  constexpr EscWire(I2cBus& bus, std::uint8_t address) : bus_(bus), address_(address) {}

  [[nodiscard]] bool read(std::uint8_t reg, std::uint8_t* data, std::size_t count) {
    return bus_.read(address_, reg, data, count);
  }
  [[nodiscard]] bool write(std::uint8_t reg, const std::uint8_t* data, std::size_t count) {
    return bus_.write(address_, reg, data, count);
  }

 private:
  I2cBus& bus_;
  std::uint8_t address_;
};

/// M1 is ESC 0, at `firstAddress`. The bus carries nothing else: a sensor that holds it low would
/// keep `off` from the motors, which then run on for 4.2 s (AfroEsc.h).
class EscI2c {
 public:
  static constexpr Micros kReadPeriod = 50'000;  ///< between two ESCs: each at 5 Hz

  EscI2c(I2cBus& bus, std::uint8_t polePairs, std::uint8_t firstAddress = afro::kFirstAddress)
      : bus_(bus),
        wires_{{{bus, firstAddress},
                {bus, static_cast<std::uint8_t>(firstAddress + 1)},
                {bus, static_cast<std::uint8_t>(firstAddress + 2)},
                {bus, static_cast<std::uint8_t>(firstAddress + 3)}}},
        escs_{{{wires_[0], polePairs},
               {wires_[1], polePairs},
               {wires_[2], polePairs},
               {wires_[3], polePairs}}} {}

  EscI2c(const EscI2c&) = delete;
  EscI2c& operator=(const EscI2c&) = delete;

  /// Sends `off`, which arms the ESCs, and asks who they are. Bound: 2.9 ms, on the ground.
  /// @return the motors whose ESC is missing or something else, bit 0 for M1
  std::uint8_t begin() {
    stop();
    std::uint8_t missing = 0;
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      if (escs_[i].identify() != afro::Answer::Good) {
        missing = static_cast<std::uint8_t>(missing | (1U << i));
      }
    }
    reading_.postpone(::micros());
    return missing;
  }

  /// Four writes of 4 bytes: 0.38 ms. Bound: 4 I2cBus::transferBound(4) + I2cBus::kFailureBound =
  /// 0.82 ms. An ESC that does not acknowledge is passed over; when the bus itself fails, the rest
  /// of this tick is given up, and the next one begins behind the ESC that was being addressed.
  void write(const EscCommands& commands) {
    for (std::size_t k = 0; k < kMotorCount; ++k) {
      const std::size_t i = (first_ + k) % kMotorCount;
      const std::uint32_t before = busFaults();
      if (!escs_[i].write(afro::throttleOf(commands[i])) && busFaults() != before) {
        first_ = (i + 1) % kMotorCount;
        givenUp_ += static_cast<std::uint32_t>(kMotorCount - 1 - k);
        return;
      }
    }
  }

  void stop() { write(EscCommands{}); }

  /// One ESC every kReadPeriod: 0.28 ms. Bound: I2cBus::transferBound(12) + I2cBus::kFailureBound =
  /// 0.59 ms. True when the round is complete and at least one of the four answered.
  [[nodiscard]] bool read(EscRaw& out) {
    const Micros now = ::micros();
    if (!reading_.run(now)) return false;
    afro::Status status;
    if (escs_[next_].read(now, status) == afro::Answer::Good) answered_ = true;
    round_.revolutions[next_] = status.revolutions;
    round_.voltage[next_] = status.voltage;
    round_.temperature[next_] = status.temperature;
    round_.current[next_] = status.current;
    next_ = (next_ + 1) % kMotorCount;
    if (next_ != 0) return false;
    const bool answered = answered_;
    answered_ = false;
    round_.sampled = now;
    if (answered) out = round_;
    return answered;
  }

  [[nodiscard]] const afro::Faults& faults(std::size_t motor) const {
    return escs_[motor].faults();
  }
  /// Commands not sent because the bus had just failed.
  [[nodiscard]] std::uint32_t givenUp() const { return givenUp_; }

 private:
  /// Of the bus, not of one device.
  [[nodiscard]] std::uint32_t busFaults() const {
    return bus_.faults().held + bus_.faults().late + bus_.faults().lost;
  }

  I2cBus& bus_;
  std::array<EscWire, kMotorCount> wires_;
  std::array<AfroEsc<EscWire>, kMotorCount> escs_;
  std::size_t first_ = 0;  ///< to be commanded first
  std::size_t next_ = 0;   ///< to be read next
  bool answered_ = false;  ///< one at least, in this round
  EscRaw round_;
  PeriodicTask reading_{kReadPeriod};
  std::uint32_t givenUp_ = 0;
};

}  // namespace strix
