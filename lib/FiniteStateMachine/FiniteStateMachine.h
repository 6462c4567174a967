/// The state machine: one constexpr table, read top to bottom, first match wins.
#pragma once

#include "Conditions.h"
#include "States.h"

namespace strix {

struct Transition {
  StateSet from;
  ConditionSet when;    ///< all of these
  ConditionSet unless;  ///< none of these
  FlightState to;
  const char* said;
};

// clang-format off
constexpr std::array<Transition, 26> kTransitions{{
    // from                      when (all of)                   unless (any of)            to                     said
    // Critical errors come first: nothing below can keep the motors on.
    {kMotorsOn,                  condition::kKill,               condition::kNone,          FlightState::Safe,     "killed: motors off"},
    {kMotorsOn,                  condition::kUpset,              condition::kNone,          FlightState::Safe,     "tilt past 90 deg: motors off"},
    {kMotorsOn,                  condition::kImuLost,            condition::kNone,          FlightState::Safe,     "IMU lost: motors off"},
    {kMotorsOn,                  condition::kEstimatorUnhealthy, condition::kNone,          FlightState::Safe,     "estimator unhealthy: motors off"},
    {kFlying,                    condition::kOutsideFence,       condition::kNone,          FlightState::Safe,     "outside the fence: motors off"},
    // A stand has no place: indoors its position is a guess.
    {in(FlightState::Armed),     condition::kOutsideFence,       condition::kStandMission,  FlightState::Safe,     "outside the fence: motors off"},
    {kFlying,                    condition::kDisarm,             condition::kNone,          FlightState::Safe,     "disarmed in flight: motors off"},
    {in(FlightState::AttitudeStand), condition::kDisarm,         condition::kNone,          FlightState::Safe,     "disarmed on the stand: motors off"},
    {in(FlightState::Armed),     condition::kDisarm,             condition::kNone,          FlightState::Idle,     "disarmed"},
    // On the ground.
    {in(FlightState::Boot),      condition::kCalibrated,         condition::kNone,          FlightState::Idle,     "calibrated"},
    {in(FlightState::Boot),      condition::kArmEdge,            condition::kNone,          FlightState::Boot,     "arming refused"},
    {in(FlightState::Idle),      condition::kArmEdge,            condition::kPreArmFailure, FlightState::Armed,    "armed"},
    {in(FlightState::Idle),      condition::kArmEdge,            condition::kNone,          FlightState::Idle,     "arming refused"},
    {in(FlightState::Safe),      condition::kArmEdge,            condition::kPreArmFailure, FlightState::Armed,    "re-armed on the ground"},
    {in(FlightState::Safe),      condition::kArmEdge,            condition::kNone,          FlightState::Safe,     "arming refused"},
    {in(FlightState::Armed),     condition::kStart | condition::kStandMission, condition::kNone, FlightState::AttitudeStand, "stand sequence starts"},
    {in(FlightState::Armed),     condition::kStart,              condition::kStandMission,  FlightState::Takeoff,  "take-off"},
    {in(FlightState::Armed),     condition::kArmedTooLong,       condition::kNone,          FlightState::Idle,     "armed too long without take-off: disarmed"},
    {in(FlightState::AttitudeStand), condition::kStandDone,      condition::kNone,          FlightState::Idle,     "stand sequence done: disarmed"},
    // In flight.
    {in(FlightState::Takeoff),   condition::kArrived,            condition::kNone,          FlightState::Hold,     "at take-off height"},
    {in(FlightState::Hold, FlightState::Waypoint), condition::kReturn, condition::kNone,    FlightState::Return,   "returning home"},
    {in(FlightState::Hold),      condition::kHoldDone | condition::kLegsRemain, condition::kNone, FlightState::Waypoint, "next leg"},
    {in(FlightState::Hold),      condition::kHoldDone,           condition::kLegsRemain,    FlightState::Land,     "mission done: landing"},
    {in(FlightState::Waypoint),  condition::kArrived,            condition::kNone,          FlightState::Hold,     "at the waypoint"},
    {in(FlightState::Return),    condition::kArrived,            condition::kNone,          FlightState::Land,     "home: landing"},
    {in(FlightState::Land),      condition::kTouchDown,          condition::kNone,          FlightState::Idle,     "landed: disarmed"},
}};
// clang-format on

/// The row that applies, or nullptr when the state stays.
[[nodiscard]] constexpr const Transition* findTransition(FlightState state,
                                                         ConditionSet conditions) {
  for (const Transition& row : kTransitions) {
    if ((row.from & in(state)) == 0) continue;
    if ((conditions & row.when) != row.when) continue;
    if ((conditions & row.unless) != 0) continue;
    return &row;
  }
  return nullptr;
}

class FiniteStateMachine {
 public:
  /// Takes at most one transition.
  /// @return the row taken, for the log and the pilot; nullptr when nothing happened
  const Transition* update(ConditionSet conditions) {
    const Transition* row = findTransition(state_, conditions);
    if (row == nullptr) return nullptr;
    if (row->to == FlightState::Safe && (row->from & in(FlightState::Safe)) == 0) {
      criticalError_ = true;
    }
    if (row->to == FlightState::Armed) criticalError_ = false;
    state_ = row->to;
    return row;
  }

  [[nodiscard]] FlightState state() const { return state_; }
  [[nodiscard]] const char* name() const { return propertiesOf(state_).name; }
  /// The controller's wrench reaches the motors.
  [[nodiscard]] bool getControlFlag() const { return propertiesOf(state_).controller; }
  /// The motors may turn.
  [[nodiscard]] bool getMotorFlag() const { return propertiesOf(state_).motors; }
  /// A flight was ended by a critical error and nobody has re-armed since.
  [[nodiscard]] bool getCriticalErrorFlag() const { return criticalError_; }

 private:
  FlightState state_ = FlightState::Boot;
  bool criticalError_ = false;
};

}  // namespace strix
