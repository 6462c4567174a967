/// Turns the mission and the flight state into a moving reference, and tells what it has reached.
#pragma once

#include "Conditions.h"
#include "Mission.h"
#include "ReferenceRamp.h"
#include "States.h"

namespace strix {

struct GuidanceConfig {
  RampLimits ramp{1.0F, 0.5F, 1.0F, 45.0F * kDegToRad, 90.0F * kDegToRad};
  float arrivalRadius = 0.5F;            ///< m
  float arrivalSpeed = 0.4F;             ///< m/s
  float arrivalYaw = 10.0F * kDegToRad;  ///< rad
  float landingDepth = 3.0F;             ///< m below the start the landing ramp aims at
};

class Guidance {
 public:
  Guidance(const Mission& mission, const GuidanceConfig& config)
      : mission_(mission), config_(config), ramp_(config.ramp) {}

  /// Called when the state machine has just entered `state`.
  void enter(FlightState state, Micros now, const VehicleState& estimate) {
    entered_ = now;
    switch (state) {
      case FlightState::Takeoff:
        leg_ = 0;
        holdTime_ = mission_.takeoffHoldTime;
        startYaw_ = yawOf(estimate.attitude);
        ramp_.reset(now, estimate);
        setTarget({0.0F, 0.0F, -mission_.takeoffHeight}, startYaw_);
        break;
      case FlightState::Waypoint: {
        const Leg& leg = mission_.legs[leg_++];
        holdTime_ = leg.holdTime;
        setTarget({leg.north, leg.east, -leg.height}, startYaw_ + leg.turn);
        break;
      }
      case FlightState::Land:
        // Below the ground, so that the descent goes on until touch-down whatever the altimeter
        // says.
        setTarget({target_.x(), target_.y(), config_.landingDepth}, targetYaw_);
        break;
      default:
        break;
    }
  }

  /// The reference at `now`.
  const Reference& update(Micros now) { return ramp_.update(now); }

  /// kArrived, kHoldDone and kLegsRemain as they are now.
  [[nodiscard]] ConditionSet conditions(Micros now, const VehicleState& estimate) const {
    ConditionSet set = condition::kNone;
    if (ramp_.arrived() && near(estimate)) set |= condition::kArrived;
    if (elapsed(now, entered_) >= holdTime_) set |= condition::kHoldDone;
    if (leg_ < mission_.legCount) set |= condition::kLegsRemain;
    return set;
  }

  [[nodiscard]] const Reference& reference() const { return ramp_.reference(); }

 private:
  void setTarget(const Vector3f& positionNed, float yaw) {
    target_ = positionNed;
    targetYaw_ = wrapAngle(yaw);
    ramp_.setTarget(target_, targetYaw_);
  }

  [[nodiscard]] bool near(const VehicleState& estimate) const {
    const float yawError = wrapAngle(yawOf(estimate.attitude) - targetYaw_);
    return (estimate.positionNed - target_).norm() < config_.arrivalRadius &&
           estimate.velocityNed.norm() < config_.arrivalSpeed && yawError < config_.arrivalYaw &&
           yawError > -config_.arrivalYaw;
  }

  Mission mission_;
  GuidanceConfig config_;
  ReferenceRamp ramp_;
  Vector3f target_ = Vector3f::Zero();
  float targetYaw_ = 0.0F;
  float startYaw_ = 0.0F;
  Micros entered_ = 0;
  Micros holdTime_ = 0;
  std::uint8_t leg_ = 0;
};

}  // namespace strix
