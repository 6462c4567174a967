/// What commands by telemetry or console do: members of FlightSoftware.
#pragma once

#include "FlightSoftware.h"

namespace strix {

template <class Board, int States>
CommandRefusal FlightSoftware<Board, States>::obey(const VehicleCommand& c) {
  const FlightState state = fsm_.state();
  const bool on = motors_.armed();
  switch (c.kind) {
    case CommandKind::Arm:
      if (on) return "the motors are on already";
      pilot_.askArm(c.source);  // the state machine says it to everybody
      return preArm_ != 0 ? firstRefusal(preArm_) : nullptr;
    case CommandKind::Disarm:
      if ((in(state) & kFlying) != 0 && !has(condition::kOnGround)) {
        return "in the air: land, or kill";
      }
      pilot_.askDisarm();
      return nullptr;
    case CommandKind::Kill:
      pilot_.askKill(true);
      return nullptr;
    case CommandKind::KillOff:
      if (on) return "the motors are on";
      pilot_.askKill(false);
      return nullptr;
    case CommandKind::Start:
      if (state != FlightState::Armed) return "arm first";
      pilot_.askStart();
      return nullptr;
    case CommandKind::Land:
      return wish(condition::kLandAsked);
    case CommandKind::Return:
      return wish(condition::kReturn);
    case CommandKind::Hold:
      guidedKnown_ = false;  // until another position comes
      return wish(condition::kHoldAsked);
    case CommandKind::Resume:
      if (state != FlightState::Hold) return "there is nothing to go on with";
      guidance_.resume();
      return nullptr;
    case CommandKind::Setpoint:
      return takeSetpoint(c);
    case CommandKind::SetParameter: {
      if (const CommandRefusal wrong = checkParameter(c.index, c.values[0], on)) return wrong;
      config_.parameters.*kParameterTable[c.index].member = c.values[0];
      applyParameters();
      return nullptr;
    }
    case CommandKind::MissionClear:
    case CommandKind::MissionLeg:
    case CommandKind::MissionDone:
      return on ? "the mission can be changed with the motors off only" : upload(c);
    case CommandKind::Calibrate:
      return wish(condition::kCalibrateAsked);
    case CommandKind::MotorTest:
      return takeMotorTest(c);
    case CommandKind::LinkAlive:
      linkHeard_ = true;
      return nullptr;
  }
  return "unknown command";
}

/// One motor, on the bench: everything that forbids arming but the mission's matters does not
/// count.
template <class Board, int States>
CommandRefusal FlightSoftware<Board, States>::takeMotorTest(const VehicleCommand& c) {
  if (c.time == 0) {
    testEnds_ = now_;
    return nullptr;
  }
  if (c.index >= kMotorCount) return "there is no such motor";
  if (!(c.values[0] >= 0.0F && c.values[0] <= kMostTest)) return "a motor test goes to 30 %";
  if (c.time > kLongestTest) return "a motor test lasts 10 s at most";
  if (pilot_.killSwitch() || pilot_.killAsked()) return "a kill is on: take it back";
  const CommandRefusal refusal = wish(condition::kMotorTestAsked);
  if (refusal != nullptr) return refusal;
  testedMotor_ = static_cast<std::uint8_t>(c.index);
  testShare_ = c.values[0];
  testEnds_ = now_ + c.time;
  return nullptr;
}

/// For what the state machine does in some states only.
template <class Board, int States>
CommandRefusal FlightSoftware<Board, States>::wish(ConditionSet bit) {
  if (!answers(fsm_.state(), bit)) return "not possible in this state";
  pilot_.ask(bit);
  return nullptr;
}

template <class Board, int States>
CommandRefusal FlightSoftware<Board, States>::takeSetpoint(const VehicleCommand& c) {
  if (!answers(fsm_.state(), condition::kGuided) && fsm_.state() != FlightState::Guided) {
    return "positions are flown from HOLD and WAYPOINT only";
  }
  for (const float value : c.values) {
    if (!isFinite(value)) return "a value is no number";
  }
  guidance_.setSetpoint(c, fence_);
  guidedAt_ = now_;
  guidedKnown_ = true;
  return nullptr;
}

template <class Board, int States>
CommandRefusal FlightSoftware<Board, States>::upload(const VehicleCommand& c) {
  if (c.kind == CommandKind::MissionClear) {
    upload_.clear();
    return nullptr;
  }
  if (c.kind == CommandKind::MissionLeg) return upload_.addLeg(c, fence_);
  Mission mission;
  if (const CommandRefusal wrong = upload_.finish(c, fence_, mission)) return wrong;
  takeMission(mission);
  return nullptr;
}

}  // namespace strix
