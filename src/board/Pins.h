/// Which wire goes to which Teensy 4.1 pin. The same table with the wiring is in docs/board.md.
#pragma once

#include <array>
#include <cstdint>

#include "Vehicle.h"

namespace strix::pins {

/// ESC signal M1..M4: FlexPWM3.1B, 2.3B, 3.1A and 2.3A, which share no counter with another use.
constexpr std::array<std::uint8_t, kMotorCount> kEsc{28, 37, 29, 36};

struct I2cPins {
  std::uint8_t sda;
  std::uint8_t scl;
};

/// The IMU has a bus of its own (LPI2C1, Wire): a magnetometer that holds its lines low must not
/// take the attitude with it.
constexpr I2cPins kImuBus{18, 19};
constexpr std::uint8_t kImuDataReady = 20;

/// Magnetometer and barometer (LPI2C3, Wire1).
constexpr I2cPins kSlowBus{17, 16};

/// GPS: Serial2.
constexpr std::uint8_t kGpsRx = 7;
constexpr std::uint8_t kGpsTx = 8;

/// Radio receiver: Serial1. Its other pin (1) belongs to the port and stays unconnected.
constexpr std::uint8_t kRadioRx = 0;
constexpr std::uint8_t kRadioTx = 1;

/// Telemetry radio: Serial8.
constexpr std::uint8_t kTelemetryRx = 34;
constexpr std::uint8_t kTelemetryTx = 35;

/// Only for an airframe whose ESCs answer over I2C (LPI2C4, Wire2): docs/board.md.
constexpr I2cPins kEscBus{25, 24};

/// Battery voltage by a divider on A17. Without one the ratio is 0 and the pin is not read.
constexpr std::uint8_t kBattery = 41;
constexpr float kBatteryRatio = 0.0F;  ///< (R1 + R2) / R2, battery over pin

/// Pilot's switches, each between its pin and ground, with the Teensy's pull-up (about 22 kOhm).
/// Arm and start close to switch on, so a broken wire is off. Kill is a loop that is closed in
/// normal use: a broken wire, or a plug pulled out, kills. A kill that can fail without being seen
/// is none; the price is that a loose kill wire ends the flight, so use a locking plug.
constexpr std::uint8_t kArmSwitch = 30;
constexpr std::uint8_t kKillSwitch = 31;
constexpr std::uint8_t kStartSwitch = 32;

}  // namespace strix::pins
