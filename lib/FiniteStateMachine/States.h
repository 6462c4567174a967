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
};

constexpr std::size_t kStateCount = 10;

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

constexpr StateSet kFlying = in(FlightState::Takeoff, FlightState::Hold, FlightState::Waypoint,
                                FlightState::Land, FlightState::Return);
constexpr StateSet kMotorsOn = kFlying | in(FlightState::Armed, FlightState::AttitudeStand);

}  // namespace strix
