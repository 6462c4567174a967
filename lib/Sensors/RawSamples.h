/// Sensor readings as a board delivers them: SI units, the sensor's own axes, nothing corrected.
/// These are the inputs of the flight code; the log keeps every one of them.
#pragma once

#include <array>

#include "Time.h"
#include "Vector3f.h"

namespace strix {

struct ImuRaw {
  Micros sampled = 0;                 ///< when the sensor measured, on the board's micros()
  Vector3f accel = Vector3f::Zero();  ///< specific force, m/s^2
  Vector3f gyro = Vector3f::Zero();   ///< rad/s
  float temperature = 0.0F;           ///< degC
};

struct MagRaw {
  Micros sampled = 0;
  Vector3f field = Vector3f::Zero();  ///< uT
};

struct AltRaw {
  Micros sampled = 0;
  float pressure = 0.0F;     ///< Pa
  float temperature = 0.0F;  ///< degC
};

/// One fix, in the receiver's units: an MTK3333 speaks NMEA, so speed comes in knots.
struct GpsRaw {
  Micros sampled = 0;
  std::int32_t latitude = 0;   ///< 1e-7 deg, north positive
  std::int32_t longitude = 0;  ///< 1e-7 deg, east positive
  std::int32_t altitude = 0;   ///< mm above mean sea level
  float speedKnots = 0.0F;     ///< over ground
  float courseDeg = 0.0F;      ///< over ground, clockwise from true north
  float hdop = 99.0F;
  std::uint8_t fix = 0;  ///< 0 none, 2 two-dimensional, 3 three-dimensional
  std::uint8_t satellites = 0;
};

/// What the battery gives, where the board can measure it.
struct BatteryRaw {
  Micros sampled = 0;
  float voltage = 0.0F;  ///< V
  float current = 0.0F;  ///< A; 0 when it is not measured
};

/// What ESCs that answer tell of M1..M4; NaN for what one does not tell.
struct EscRaw {
  Micros sampled = 0;
  std::array<float, 4> revolutions{};  ///< rev/s of the rotor
  std::array<float, 4> voltage{};      ///< V
  std::array<float, 4> temperature{};  ///< degC
  std::array<float, 4> current{};      ///< A
};

}  // namespace strix
