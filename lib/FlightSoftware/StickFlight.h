/// The reference that a pilot's sticks ask for, in each of his modes.
#pragma once

#include "Mathpk.h"
#include "Parameters.h"
#include "PilotInput.h"
#include "VelocityPath.h"

namespace strix {

/// A change of mode goes on from the motion that is there. docs/pilot-modes.md has the modes.
class StickFlight {
 public:
  /// @param weight  N: what the throttle's middle gives in attitude mode
  explicit StickFlight(float weight) : weight_(weight) {}

  void configure(const Parameters& p) {
    tilt_ = p.stickTilt * kDegToRad;
    bounds_ = {p.fenceRadius - kInsideFence, p.fenceHeight - kInsideFence, {}};
    bounds_.limits.speedHorizontal = p.stickSpeed;
    bounds_.limits.speedVertical = p.stickClimb;
    bounds_.limits.yawRate = p.stickYaw * kDegToRad;
  }

  /// Goes on from the aircraft's own motion.
  void start(Micros now, const VehicleState& estimate) {
    last_ = now;
    Reference from;
    from.positionNed = estimate.positionNed;
    from.velocityNed = estimate.velocityNed;
    from.yaw = yawOf(estimate.attitude);
    path_.start(from);
    path_.followLevel(estimate, bounds_.limits.acceleration);
    places_ = true;
    reference_ = path_.reference();
  }

  /// The motion that another flight goes on from.
  [[nodiscard]] Reference motion(const VehicleState& estimate) {
    if (!places_) path_.followLevel(estimate, bounds_.limits.acceleration);
    return path_.reference();
  }

  /// @param mode  Attitude, AltitudeHold or PositionHold
  const Reference& fly(Micros now, const PilotInput& input, PilotMode mode,
                       const VehicleState& estimate) {
    const float dt = step(now);
    const Sticks sticks = sound(input);
    const float heading = yawOf(estimate.attitude);
    path_.turn(sticks.yaw * bounds_.limits.yawRate, heading, bounds_.limits, kHeadingLead, dt);
    const bool places = mode == PilotMode::PositionHold;
    if (!places) path_.copyLevel(estimate);
    if (places && !places_) path_.followLevel(estimate, bounds_.limits.acceleration);
    places_ = places;
    if (mode == PilotMode::Attitude) {
      path_.followHeight(estimate);
    } else {
      const Vector3f wanted = wantedVelocity(sticks, places ? heading : 0.0F);
      path_.move(wanted, bounds_, places, dt);
      path_.boundLead(estimate, kLead);
    }
    reference_ = path_.reference();
    if (places) return reference_;
    reference_.mode =
        mode == PilotMode::Attitude ? ReferenceMode::Attitude : ReferenceMode::AttitudeHeight;
    reference_.attitude =
        eulerToQuaternion({tilt_ * sticks.level.y(), -tilt_ * sticks.level.x(), reference_.yaw});
    reference_.thrust = 2.0F * weight_ * sticks.throttle;
    return reference_;
  }

  /// The throttle asks for more than the ground can carry: taking off begins here.
  [[nodiscard]] static bool lifts(const PilotInput& input, PilotMode mode) {
    const Sticks sticks = sound(input);
    return mode == PilotMode::Attitude ? sticks.throttle > kLift : climb(sticks.throttle) > 0.0F;
  }

  [[nodiscard]] const Reference& reference() const { return reference_; }

 private:
  static constexpr float kHeadingLead = 1.0F;  ///< rad, as Ugglan's (StickMapping.h)
  static constexpr float kLead = 1.5F;         ///< m, ours: within what the controller acts on
  static constexpr float kInsideFence = 1.0F;  ///< m, ours: what an estimate wanders
  static constexpr float kMiddle =
      0.2F;                              ///< of the half way, either side: PX4's MPC_HOLD_DZ is 0.1
  static constexpr float kLift = 0.15F;  ///< of the way, ours: more than a stick's slack

  struct Sticks {
    Vector2f level = Vector2f::Zero();  ///< forward and right, together within the unit circle
    float yaw = 0.0F;                   ///< right
    float throttle = 0.5F;              ///< 0 to 1
  };

  /// What is no number, or of no transmitter, is the middle. In a corner the sticks ask for no more
  /// than at a side: 45 deg of roll and of pitch would be 60 deg of tilt.
  [[nodiscard]] static Sticks sound(const PilotInput& input) {
    Sticks s;
    if (!input.valid) return s;
    const auto within = [](float stick) { return isFinite(stick) ? clamped(stick, 1.0F) : 0.0F; };
    s.level = {-within(input.pitch), within(input.roll)};  // pulled back is nose up
    s.level *= shortening(s.level, 1.0F);
    s.yaw = within(input.yaw);
    if (isFinite(input.throttle)) s.throttle = 0.5F + clamped(input.throttle - 0.5F, 0.5F);
    return s;
  }

  /// -1 to 1 of a throttle of 0 to 1, with a middle that holds.
  [[nodiscard]] static float climb(float throttle) {
    const float stick = 2.0F * throttle - 1.0F;
    if (stick > kMiddle) return (stick - kMiddle) / (1.0F - kMiddle);
    return stick < -kMiddle ? (stick + kMiddle) / (1.0F - kMiddle) : 0.0F;
  }

  /// m/s, NED: the sticks are those of somebody who looks where the nose does.
  [[nodiscard]] Vector3f wantedVelocity(const Sticks& sticks, float heading) const {
    const Vector2f level = bounds_.limits.speedHorizontal * turned(sinCos(heading), sticks.level);
    return {level.x(), level.y(), -bounds_.limits.speedVertical * climb(sticks.throttle)};
  }

  /// s since the last call; a gap of more than 0.1 s counts as 0.1 s.
  [[nodiscard]] float step(Micros now) {
    const Micros gap = elapsed(now, last_);
    last_ = now;
    return toSeconds(gap < 100'000 ? gap : 100'000);
  }

  float weight_;       ///< N
  float tilt_ = 0.0F;  ///< rad at full stick
  PathBounds bounds_;
  VelocityPath path_;
  Reference reference_;
  bool places_ = false;  ///< the path has a place
  Micros last_ = 0;
};

}  // namespace strix
