/// What telemetry and console tell of the aircraft: one snapshot, made when it is asked for.
#pragma once

#include <array>
#include <cstdint>

#include "VehicleState.h"
#include "Wrench.h"

namespace strix {

struct FlightStatus {
  std::uint64_t time = 0;      ///< us since power-up
  std::uint8_t state = 0;      ///< FlightState
  const char* stateName = "";  ///< "BOOT"
  const char* refusal = "";    ///< of the first failing pre-arm check; empty: none fails
  bool motorsOn = false;
  bool flying = false;               ///< motors on and in the air, or taking off or landing
  bool critical = false;             ///< a flight was cut off
  bool failsafe = false;             ///< a hazard is ending, or has ended, the flight
  std::uint64_t conditions = 0;      ///< ConditionSet
  std::uint32_t preArm = 0;          ///< PreArmSet
  VehicleState estimate;             ///< NED from the start, body FRD
  bool positionValid = false;        ///< a GPS fix aids it
  std::int32_t originLatitude = 0;   ///< 1e-7 deg
  std::int32_t originLongitude = 0;  ///< 1e-7 deg
  std::int32_t originAltitude = 0;   ///< mm above mean sea level
  std::int32_t latitude = 0;         ///< 1e-7 deg, GPS's last
  std::int32_t longitude = 0;        ///< 1e-7 deg
  std::int32_t altitude = 0;         ///< mm above mean sea level
  float speed = 0.0F;                ///< m/s over ground
  float course = 0.0F;               ///< rad, clockwise from true north
  float hdop = 0.0F;
  std::uint8_t fix = 0;  ///< 0 none, 2 or 3 dimensions
  std::uint8_t satellites = 0;
  bool imuFresh = false;
  bool magFresh = false;
  bool altFresh = false;
  bool gpsFresh = false;
  bool estimatorHealthy = false;
  bool logGood = false;
  bool radioHeard = false;
  std::array<float, 4> motors{};    ///< M1..M4, 0 to 1 of the range of their speed command
  std::array<float, 4> commands{};  ///< M1..M4, the vehicle's command unit
  float voltage = 0.0F;             ///< V; 0: not known
  float current = 0.0F;             ///< A; 0: not known
  std::uint8_t cells = 0;
  float temperature = 0.0F;       ///< degC, of the IMU
  float pressure = 0.0F;          ///< Pa
  std::array<float, 3> accel{};   ///< m/s^2, body, the last sample
  std::array<float, 3> gyro{};    ///< rad/s, body
  std::array<float, 3> field{};   ///< uT, body
  std::uint32_t overruns = 0;     ///< periods missed since power-up
  std::uint32_t longestPass = 0;  ///< us, of the last second
  std::uint32_t logDropped = 0;   ///< records lost
  std::uint8_t legs = 0;          ///< of the mission
  std::uint8_t leg = 0;           ///< that is flown, from 1; 0: none
};

}  // namespace strix
