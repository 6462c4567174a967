/// What is true now, for the state machine and for arming: members of FlightSoftware.
#pragma once

#include "FlightSoftware.h"

namespace strix {

/// Everything that forbids arming now.
template <class Board, int States>
PreArmSet FlightSoftware<Board, States>::preArmFailures(Micros now, const VehicleState& estimate,
                                                        float cosine) const {
  if (motors_.armed()) return 0;  // nobody asks
  PreArmSet set = wrongConfig_;
  const auto refuseIf = [&set](bool bad, PreArmSet bit) { set |= bad ? bit : 0U; };
  refuseIf(!missionGood_, prearm::kMission);
  refuseIf(calibrating(), prearm::kNotCalibrated);
  refuseIf(!found_.imu || !sensors().imuFresh(now), prearm::kImu);
  refuseIf(!found_.mag || !sensors().magFresh(now), prearm::kMag);
  refuseIf(!found_.alt || !sensors().altFresh(now), prearm::kAlt);
  if (!config_.mission.onStand()) {  // which has no place, and may be under a roof
    refuseIf(!sensors().gpsFresh(now) || !sensors().gpsUsable(sensors().getGPSMeas()),
             prearm::kGps);
    refuseIf(estimation_.originFixes() < config_.originFixes, prearm::kOrigin);
    refuseIf(!fence_.contains(estimate.positionNed), prearm::kFence);
  }
  refuseIf((navigation().health() & health::kNoArming) != 0, prearm::kEstimator);
  refuseIf(!(cosine > cosArmTilt_), prearm::kTilt);
  refuseIf(!navigation().standsStill(), prearm::kMoving);
  refuseIf(pilot_.killSwitch(), prearm::kKillSwitch);
  refuseIf(pilot_.killAsked(), prearm::kKillCommand);
  refuseIf(pilot_.starts(), prearm::kStartSwitch);
  refuseIf(pilot_.usesRadio() && pilot_.radioLost(), prearm::kRadio);
  refuseIf(!pilot_.throttleLow(), prearm::kThrottle);
  refuseIf(has(condition::kBatteryLow), prearm::kBattery);
  refuseIf(has(condition::kOverrun), prearm::kOverrun);
  refuseIf(!found_.card || logger_.failed(), prearm::kLog);
  return set;
}

template <class Board, int States>
HazardSigns FlightSoftware<Board, States>::signs(Micros now, const VehicleState& estimate,
                                                 float cosine, bool fixed) const {
  HazardSigns s;
  s.state = fsm_.state();
  s.motorsOn = motors_.armed();
  s.cosTilt = cosine;
  // Not smoothed: what is outside is outside.
  const Vector3f& place =
      s.state == FlightState::Blind ? estimate.positionNed : navigation().state().positionNed;
  s.north = place.x();
  s.east = place.y();
  s.height = -place.z();
  s.specificForce = squareRoot(estimation_.specificForce().squaredNorm());
  s.imuFresh = sensors().imuFresh(now);
  s.imuClipped = sensors().clipped();
  s.magFresh = sensors().magFresh(now);
  s.altFresh = sensors().altFresh(now);
  s.gpsUsed = fixed;
  s.estimatorLost = !navigation().healthy();
  s.cellVoltage = battery_.voltage() / static_cast<float>(config_.vehicle.batteryCells);
  s.radioKnown = pilot_.radioKnown();
  s.radioLost = pilot_.radioLost();
  s.linkFlies = s.motorsOn && (pilot_.linkArmed() || s.state == FlightState::Guided);
  s.linkHeard = linkHeard_;
  s.overruns = controller_.overruns();
  s.logFailed = logger_.failed();
  s.lowestMotor = motors_.lowestShare();
  s.highestMotor = motors_.highestShare();
  return s;
}

/// What neither pilot, guidance nor hazards know.
template <class Board, int States>
ConditionSet FlightSoftware<Board, States>::ownConditions(Micros now,
                                                          const VehicleState& estimate) {
  ConditionSet set = condition::kNone;
  const auto setIf = [&set](bool present, ConditionSet bit) {
    set |= present ? bit : condition::kNone;
  };
  const Micros inState = elapsed(now, entered_);
  setIf(estimation_.calibrated(), condition::kCalibrated);
  setIf(preArm_ != 0, condition::kPreArmFailure);
  setIf(inState >= config_.armedTimeout, condition::kArmedTooLong);
  setIf(guidedKnown_ && elapsed(now, guidedAt_) < kSetpointFresh, condition::kGuided);
  setIf(static_cast<std::int32_t>(now - testEnds_) >= 0, condition::kMotorTestDone);
  const bool down = standsOnGround(now, estimate);
  setIf(down && fsm_.state() != FlightState::Manual, condition::kTouchDown);
  setIf(down && fsm_.state() == FlightState::Manual, condition::kOnGround);
  if (fsm_.state() == FlightState::Blind) {
    setIf(inState >= toMicros(config_.parameters.blindTime) || estimation_.blind().over(),
          condition::kBlindOver);
    setIf(imuBack_.update(now, sensors().imuFresh(now) && estimation_.agreesWithModel()),
          condition::kImuBack);
  }
  return set;
}

/// Where the aircraft may come down: little thrust is left, and it neither sinks nor falls.
template <class Board, int States>
bool FlightSoftware<Board, States>::standsOnGround(Micros now, const VehicleState& estimate) {
  const FlightState state = fsm_.state();
  const bool may =
      state == FlightState::Land || (state == FlightState::Manual && pilot_.throttleLow());
  const TouchDownConfig& c = config_.touchDown;
  const float thrust = motors_.achieved().thrust;
  const float force = c.fallForce * kGravity;
  const bool sinks = estimate.velocityNed.z() >= c.sinkRate;
  const bool carried =
      thrust < c.fallThrust * weight() && estimation_.specificForce().squaredNorm() > force * force;
  return touchDown_.update(now, may && thrust < c.thrustFraction * weight() && (!sinks || carried));
}

}  // namespace strix
