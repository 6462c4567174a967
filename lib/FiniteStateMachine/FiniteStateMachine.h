/// The state machine: one constexpr table, read top to bottom, first match wins.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "Conditions.h"
#include "States.h"

namespace strix {

/// Who is asked, what must be there and what must not, and where it leads.
struct Transition {
  StateSet from;
  ConditionSet when;    ///< all of these
  ConditionSet unless;  ///< none of these
  FlightState to;
  bool failsafe;  ///< a hazard ends the flight: after landing, SAFE
  const char* said;
};

/// Hazards that would end a flight as soon as it has begun: nobody takes off with one.
constexpr ConditionSet kGrounding =
    condition::kOutsideFence | condition::kFarOutsideFence | condition::kGpsLost |
    condition::kMagLost | condition::kAltLost | condition::kImuSaturated | condition::kBatteryLow |
    condition::kBatteryCritical | condition::kRadioLost | condition::kLinkLost |
    condition::kOverrun | condition::kLogFailed | condition::kMotorsSaturated;

/// The states in which a flight that a hazard ends is, and where it comes to. Whoever leaves them
/// flies again: the pilot who takes over, or the next flight.
constexpr StateSet kFailsafeStates =
    in(FlightState::Return, FlightState::Land, FlightState::Blind, FlightState::Safe);

// clang-format off
constexpr std::array<Transition, 77> kTransitions{{
    // from                                              when (all of)                                    unless (any of)                                             to                          failsafe  said
    // Motors off at once. Nothing below can keep them on.
    {kMotorsOn,                                          condition::kKill,                                condition::kNone,                                           FlightState::Safe,          true,     "killed: motors off"},
    {kMotorsOn,                                          condition::kUpset,                               condition::kNone,                                           FlightState::Safe,          true,     "tilt past 90 deg: motors off"},
    {kMotorsOn,                                          condition::kTiltLimit,                           condition::kNone,                                           FlightState::Safe,          true,     "tilted beyond its limit: motors off"},
    {kMotorsOn,                                          condition::kEstimatorUnhealthy,                  condition::kNone,                                           FlightState::Safe,          true,     "estimator unhealthy: motors off"},
    {kFlying,                                            condition::kCrash,                               condition::kNone,                                           FlightState::Safe,          true,     "hit something: motors off"},
    {kFlying,                                            condition::kFreeFall,                            condition::kNone,                                           FlightState::Safe,          true,     "falls with its motors on: motors off"},
    {kMotorsOn & ~kFlying,                               condition::kImuLost,                             condition::kNone,                                           FlightState::Safe,          true,     "IMU lost: motors off"},
    {in(FlightState::Blind),                             condition::kBlindOver,                           condition::kNone,                                           FlightState::Safe,          true,     "down without an IMU: motors off"},
    {in(FlightState::Blind),                             condition::kTouchDown,                           condition::kNone,                                           FlightState::Safe,          true,     "down without an IMU, on the ground: motors off"},
    // A stand has no place: indoors its position is a guess.
    {in(FlightState::Armed),                             condition::kOutsideFence,                        condition::kStandMission,                                   FlightState::Safe,          true,     "outside the fence: motors off"},
    // Disarmed, by whoever armed. On the ground no hazard may make the sticks' aircraft fly off.
    {in(FlightState::Manual),                            condition::kDisarm | condition::kOnGround,       condition::kNone,                                           FlightState::Idle,          false,    "disarmed"},
    {in(FlightState::Manual),                            condition::kRadioLost | condition::kOnGround,    condition::kNone,                                           FlightState::Idle,          false,    "transmitter lost on the ground: disarmed"},
    {in(FlightState::Manual),                            condition::kOutsideFence | condition::kOnGround, condition::kNone,                                           FlightState::Idle,          false,    "outside the fence, on the ground: disarmed"},
    {in(FlightState::Manual),                            condition::kOnGround,                            condition::kSticks,                                         FlightState::Idle,          false,    "no sticks, on the ground: disarmed"},
    {kFlying,                                            condition::kDisarm,                              condition::kNone,                                           FlightState::Safe,          true,     "disarmed in flight: motors off"},
    {in(FlightState::AttitudeStand),                     condition::kDisarm,                              condition::kNone,                                           FlightState::Safe,          true,     "disarmed on the stand: motors off"},
    {in(FlightState::Armed, FlightState::MotorTest),     condition::kDisarm,                              condition::kNone,                                           FlightState::Idle,          false,    "disarmed"},
    {in(FlightState::Armed, FlightState::AttitudeStand), condition::kRadioLost,                           condition::kNone,                                           FlightState::Idle,          false,    "transmitter lost: disarmed"},
    {in(FlightState::Armed, FlightState::AttitudeStand), condition::kLinkLost,                            condition::kNone,                                           FlightState::Idle,          false,    "ground station lost: disarmed"},
    // On the ground.
    {in(FlightState::Boot),                              condition::kCalibrated,                          condition::kNone,                                           FlightState::Idle,          false,    "calibrated"},
    {in(FlightState::Boot),                              condition::kArmEdge,                             condition::kNone,                                           FlightState::Boot,          false,    "arming refused"},
    {in(FlightState::Idle),                              condition::kArmEdge,                             condition::kPreArmFailure | condition::kKill,               FlightState::Armed,         false,    "armed"},
    {in(FlightState::Idle),                              condition::kArmEdge,                             condition::kNone,                                           FlightState::Idle,          false,    "arming refused"},
    {in(FlightState::Safe),                              condition::kArmEdge,                             condition::kPreArmFailure | condition::kKill,               FlightState::Armed,         false,    "re-armed on the ground"},
    {in(FlightState::Safe),                              condition::kArmEdge,                             condition::kNone,                                           FlightState::Safe,          false,    "arming refused"},
    {in(FlightState::Idle),                              condition::kCalibrateAsked,                      condition::kNone,                                           FlightState::Boot,          false,    "calibrating again: let it stand still"},
    {in(FlightState::Idle),                              condition::kMotorTestAsked,                      condition::kKill,                                           FlightState::MotorTest,     false,    "motor test"},
    {in(FlightState::MotorTest),                         condition::kArmEdge,                             condition::kNone,                                           FlightState::Idle,          false,    "motor test ended"},
    {in(FlightState::MotorTest),                         condition::kMotorTestDone,                       condition::kNone,                                           FlightState::Idle,          false,    "motor test done"},
    {in(FlightState::Armed),                             condition::kStart | condition::kStandMission,    condition::kNone,                                           FlightState::AttitudeStand, false,    "stand sequence starts"},
    {in(FlightState::Armed),                             condition::kStart,                               condition::kStandMission | condition::kSticks | kGrounding, FlightState::Takeoff,       false,    "take-off"},
    {in(FlightState::Armed),                             condition::kSticks | condition::kThrottleUp,     condition::kStandMission | kGrounding,                      FlightState::Manual,        false,    "take-off by the sticks"},
    {in(FlightState::Armed),                             condition::kStart,                               condition::kStandMission | condition::kSticks,              FlightState::Idle,          false,    "not fit to take off: disarmed"},
    {in(FlightState::Armed),                             condition::kSticks | condition::kThrottleUp,     condition::kStandMission,                                   FlightState::Idle,          false,    "not fit to take off: disarmed"},
    {in(FlightState::Armed),                             condition::kArmedTooLong,                        condition::kNone,                                           FlightState::Idle,          false,    "armed too long without take-off: disarmed"},
    {in(FlightState::AttitudeStand),                     condition::kStandDone,                           condition::kNone,                                           FlightState::Idle,          false,    "stand sequence done: disarmed"},
    // Hazards that leave the attitude in doubt, then those that leave no time or no place.
    {in(FlightState::Manual),                            condition::kImuLost | condition::kOnGround,      condition::kNone,                                           FlightState::Safe,          true,     "IMU lost on the ground: motors off"},
    {kFlying & ~in(FlightState::Blind),                  condition::kImuLost,                             condition::kNone,                                           FlightState::Blind,         true,     "IMU lost: down on the model"},
    {in(FlightState::Blind),                             condition::kImuBack,                             condition::kNone,                                           FlightState::Land,          true,     "IMU is back: landing"},
    {kAutomatic | in(FlightState::Manual),               condition::kFarOutsideFence,                     condition::kNone,                                           FlightState::Land,          true,     "far outside the fence: landing"},
    {kAutomatic | in(FlightState::Manual),               condition::kBatteryCritical,                     condition::kNone,                                           FlightState::Land,          true,     "battery critical: landing"},
    {kAutomatic,                                         condition::kGpsLost,                             condition::kNone,                                           FlightState::Land,          true,     "GPS lost: landing"},
    {kAutomatic,                                         condition::kAltLost,                             condition::kNone,                                           FlightState::Land,          true,     "altimeter lost: landing"},
    {kAutomatic,                                         condition::kImuSaturated,                        condition::kNone,                                           FlightState::Land,          true,     "IMU saturated: landing"},
    {kAutomatic,                                         condition::kMotorsSaturated,                     condition::kNone,                                           FlightState::Land,          true,     "motors at their limits: landing"},
    {kAutomatic,                                         condition::kOverrun,                             condition::kNone,                                           FlightState::Land,          true,     "loop too slow: landing"},
    {kAutomatic,                                         condition::kAstray,                              condition::kNone,                                           FlightState::Land,          true,     "does not get there: landing"},
    {kAutomatic | in(FlightState::Manual),               condition::kLandAsked,                           condition::kNone,                                           FlightState::Land,          false,    "landing, as asked"},
    // Hazards that leave time to fly home; a take-off that meets one lands.
    {in(FlightState::Takeoff),                           condition::kOutsideFence,                        condition::kNone,                                           FlightState::Land,          true,     "outside the fence: landing"},
    {kUnderWay,                                          condition::kOutsideFence,                        condition::kNone,                                           FlightState::Return,        true,     "outside the fence: returning home"},
    {in(FlightState::Takeoff),                           condition::kRadioLost,                           condition::kNone,                                           FlightState::Land,          true,     "transmitter lost: landing"},
    {kUnderWay,                                          condition::kRadioLost,                           condition::kNone,                                           FlightState::Return,        true,     "transmitter lost: returning home"},
    {in(FlightState::Takeoff),                           condition::kLinkLost,                            condition::kNone,                                           FlightState::Land,          true,     "ground station lost: landing"},
    {kUnderWay,                                          condition::kLinkLost,                            condition::kNone,                                           FlightState::Return,        true,     "ground station lost: returning home"},
    {in(FlightState::Takeoff),                           condition::kBatteryLow,                          condition::kNone,                                           FlightState::Land,          true,     "battery low: landing"},
    {kUnderWay,                                          condition::kBatteryLow,                          condition::kNone,                                           FlightState::Return,        true,     "battery low: returning home"},
    {in(FlightState::Takeoff),                           condition::kMagLost,                             condition::kNone,                                           FlightState::Land,          true,     "magnetometer lost: landing"},
    {kUnderWay,                                          condition::kMagLost,                             condition::kNone,                                           FlightState::Return,        true,     "magnetometer lost: returning home"},
    {in(FlightState::Takeoff),                           condition::kLogFailed,                           condition::kNone,                                           FlightState::Land,          true,     "log card failed: landing"},
    {kUnderWay,                                          condition::kLogFailed,                           condition::kNone,                                           FlightState::Return,        true,     "log card failed: returning home"},
    {in(FlightState::Manual),                            condition::kOutsideFence,                        condition::kGpsLost,                                        FlightState::Return,        true,     "outside the fence: returning home"},
    {in(FlightState::Manual),                            condition::kOutsideFence,                        condition::kNone,                                           FlightState::Land,          true,     "outside the fence, without GPS: landing"},
    {in(FlightState::Manual),                            condition::kRadioLost,                           condition::kGpsLost,                                        FlightState::Return,        true,     "transmitter lost: returning home"},
    {in(FlightState::Manual),                            condition::kRadioLost,                           condition::kNone,                                           FlightState::Land,          true,     "transmitter lost, without GPS: landing"},
    // The pilot, and the ground station.
    {kAutomatic | in(FlightState::Land),                 condition::kSticksEdge,                          condition::kNone,                                           FlightState::Manual,        false,    "the pilot has the sticks"},
    {in(FlightState::Manual),                            condition::kNone,                                condition::kSticks,                                         FlightState::Hold,          false,    "the pilot hands over"},
    {in(FlightState::Takeoff) | kUnderWay,               condition::kReturn,                              condition::kNone,                                           FlightState::Return,        false,    "returning home"},
    {kAutomatic & ~in(FlightState::Hold),                condition::kHoldAsked,                           condition::kNone,                                           FlightState::Hold,          false,    "holding, as asked"},
    {in(FlightState::Hold, FlightState::Waypoint),       condition::kGuided,                              condition::kNone,                                           FlightState::Guided,        false,    "flying to positions that are sent"},
    {in(FlightState::Guided),                            condition::kNone,                                condition::kGuided,                                         FlightState::Hold,          false,    "no positions are sent: holding"},
    // The mission.
    {in(FlightState::Takeoff),                           condition::kArrived,                             condition::kNone,                                           FlightState::Hold,          false,    "at take-off height"},
    {in(FlightState::Hold),                              condition::kHoldDone | condition::kLegsRemain,   condition::kNone,                                           FlightState::Waypoint,      false,    "next leg"},
    {in(FlightState::Hold),                              condition::kHoldDone,                            condition::kLegsRemain,                                     FlightState::Land,          false,    "mission done: landing"},
    {in(FlightState::Waypoint),                          condition::kArrived,                             condition::kNone,                                           FlightState::Hold,          false,    "at the waypoint"},
    {in(FlightState::Return),                            condition::kArrived,                             condition::kNone,                                           FlightState::Land,          false,    "home: landing"},
    {in(FlightState::Land),                              condition::kTouchDown | condition::kFailsafe,    condition::kNone,                                           FlightState::Safe,          false,    "landed after a failsafe: motors off"},
    {in(FlightState::Land),                              condition::kTouchDown,                           condition::kNone,                                           FlightState::Idle,          false,    "landed: disarmed"},
}};
// clang-format on

/// Rows, each once for every state it concerns.
[[nodiscard]] constexpr std::size_t countUses() {
  std::size_t uses = 0;
  for (const Transition& row : kTransitions) {
    for (StateSet left = row.from; left != 0; left = static_cast<StateSet>(left & (left - 1U))) {
      ++uses;
    }
  }
  return uses;
}

/// The rows that concern each state, and the conditions that they name: no tick looks at others.
struct RowIndex {
  std::array<std::uint8_t, countUses()> rows{};
  std::array<std::uint16_t, kStateCount + 1> begin{};  ///< of each state, in `rows`
  std::array<ConditionSet, kStateCount> named{};
};

[[nodiscard]] constexpr RowIndex makeRowIndex() {
  RowIndex index;
  std::size_t used = 0;
  for (std::size_t state = 0; state < kStateCount; ++state) {
    index.begin[state] = static_cast<std::uint16_t>(used);
    for (std::size_t i = 0; i < kTransitions.size(); ++i) {
      if ((kTransitions[i].from >> state & 1U) == 0) continue;
      index.rows[used++] = static_cast<std::uint8_t>(i);
      index.named[state] |= kTransitions[i].when | kTransitions[i].unless;
    }
  }
  index.begin[kStateCount] = static_cast<std::uint16_t>(used);
  return index;
}

constexpr RowIndex kRowIndex = makeRowIndex();
static_assert(kTransitions.size() <= 256);

/// The row that applies, or nullptr when the state stays.
[[nodiscard]] constexpr const Transition* findTransition(FlightState state,
                                                         ConditionSet conditions) {
  const auto s = static_cast<std::size_t>(state);
  for (std::size_t i = kRowIndex.begin[s]; i < kRowIndex.begin[s + 1]; ++i) {
    const Transition& row = kTransitions[kRowIndex.rows[i]];
    if ((row.when & ~conditions) == 0 && (row.unless & conditions) == 0) return &row;
  }
  return nullptr;
}

/// True when the table has a row for this condition in this state.
[[nodiscard]] constexpr bool answers(FlightState state, ConditionSet condition) {
  for (const Transition& row : kTransitions) {
    if ((row.from & in(state)) != 0 && (row.when & condition) != 0) return true;
  }
  return false;
}

class FiniteStateMachine {
 public:
  /// Takes at most one transition.
  /// @param conditions  all that hold now but kFailsafe, which is its own
  /// @return the row taken, for the log and the pilot; nullptr when nothing happened
  const Transition* update(ConditionSet conditions) {
    conditions &= ~condition::kFailsafe;
    if (failsafe_) conditions |= condition::kFailsafe;
    // As in the tick before, as far as this state is concerned, and then nothing happened.
    const ConditionSet named = kRowIndex.named[static_cast<std::size_t>(state_)];
    if (idle_ && ((conditions ^ last_) & named) == 0) return nullptr;
    const Transition* row = findTransition(state_, conditions);
    idle_ = row == nullptr;
    last_ = conditions;
    if (row == nullptr) return nullptr;
    failsafe_ = row->failsafe || (failsafe_ && (in(row->to) & kFailsafeStates) != 0);
    constexpr ConditionSet kLanded = condition::kTouchDown;
    if (row->to == FlightState::Safe && (row->from & in(FlightState::Safe)) == 0 &&
        (row->when & kLanded) == 0) {
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
  /// The motors were cut off, not on the ground after landing, and nobody has re-armed since.
  [[nodiscard]] bool getCriticalErrorFlag() const { return criticalError_; }
  /// A hazard is ending, or has ended, the flight.
  [[nodiscard]] bool getFailsafeFlag() const { return failsafe_; }

 private:
  FlightState state_ = FlightState::Boot;
  ConditionSet last_ = condition::kNone;  ///< the conditions of the last tick
  bool idle_ = false;                     ///< nothing happened in it
  bool criticalError_ = false;
  bool failsafe_ = false;
};

}  // namespace strix
