/// The states of the aircraft, and what is switched on in each.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace strix {

/// The log holds these numbers: new states go to the end.
enum class FlightState : std::uint8_t {
  Boot,
  Idle,
  Armed,
  Takeoff,
  Hold,
  Waypoint,
  Land,
  Safe,
  AttitudeStand,  ///< fixed to a gimbal, turning through a sequence of attitudes
  Return,         ///< on the way home
  Manual,         ///< the pilot's sticks fly, with the help of his mode
  Guided,         ///< positions by telemetry are flown
  Blind,          ///< down without an IMU, on the model of the aircraft, for seconds
  MotorTest,      ///< one motor turns, on the bench
};

constexpr std::size_t kStateCount = 14;

struct StateProperties {
  FlightState state;
  const char* name;
  bool motors;      ///< motors may turn
  bool controller;  ///< the controller's wrench reaches them; else they idle
};

constexpr std::array<StateProperties, kStateCount> kStates{{
    {FlightState::Boot, "BOOT", false, false},
    {FlightState::Idle, "IDLE", false, false},
    {FlightState::Armed, "ARMED", true, false},
    {FlightState::Takeoff, "TAKEOFF", true, true},
    {FlightState::Hold, "HOLD", true, true},
    {FlightState::Waypoint, "WAYPOINT", true, true},
    {FlightState::Land, "LAND", true, true},
    {FlightState::Safe, "SAFE", false, false},
    {FlightState::AttitudeStand, "ATTITUDE_STAND", true, true},
    {FlightState::Return, "RETURN", true, true},
    {FlightState::Manual, "MANUAL", true, true},
    {FlightState::Guided, "GUIDED", true, true},
    {FlightState::Blind, "BLIND", true, true},
    {FlightState::MotorTest, "MOTOR_TEST", true, false},
}};

[[nodiscard]] constexpr const StateProperties& propertiesOf(FlightState state) {
  return kStates[static_cast<std::size_t>(state)];
}

/// A set of states, one bit each.
using StateSet = std::uint16_t;

template <class... States>
[[nodiscard]] constexpr StateSet in(States... states) {
  return static_cast<StateSet>(((1U << static_cast<unsigned>(states)) | ...));
}

constexpr StateSet kFlying =
    in(FlightState::Takeoff, FlightState::Hold, FlightState::Waypoint, FlightState::Land,
       FlightState::Return, FlightState::Manual, FlightState::Guided, FlightState::Blind);
constexpr StateSet kMotorsOn =
    kFlying | in(FlightState::Armed, FlightState::AttitudeStand, FlightState::MotorTest);
/// Flown by a plan, whose maker may be far away.
constexpr StateSet kAutomatic = in(FlightState::Takeoff, FlightState::Hold, FlightState::Waypoint,
                                   FlightState::Return, FlightState::Guided);
/// Of these, those that may turn home.
constexpr StateSet kUnderWay = in(FlightState::Hold, FlightState::Waypoint, FlightState::Guided);

}  // namespace strix
