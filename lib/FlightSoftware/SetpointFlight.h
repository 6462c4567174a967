/// The reference for places and velocities that come by telemetry, and for the way down without an
/// IMU: each a wanted velocity that changes as it likes, and a smooth path that follows it.
#pragma once

#include "Mission.h"
#include "Parameters.h"
#include "VehicleCommand.h"
#include "VelocityPath.h"

namespace strix {

class SetpointFlight {
 public:
  void configure(const Parameters& p) {
    bounds_.limits.speedHorizontal = p.speedHorizontal;
    bounds_.limits.speedVertical = p.speedVertical;
  }

  /// CommandKind::Setpoint: what of it counts is flown until the next one comes. A place outside
  /// the fence is the nearest one inside.
  void take(const VehicleCommand& c, const Fence& fence) {
    setpoint_ = c;
    bounds_.radius = fence.radius - kInsideFence;
    bounds_.height = fence.height - kInsideFence;
  }

  /// Goes on from a motion.
  void start(Micros now, const Reference& from) {
    last_ = now;
    path_.start(from);
  }

  const Reference& fly(Micros now, const VehicleState& estimate) {
    const float dt = step(now);
    const TrajectoryLimits& limits = bounds_.limits;
    path_.turn(wantedYawRate(), yawOf(estimate.attitude), limits, kPi, dt);
    path_.move(wantedVelocity(), bounds_, true, dt);
    path_.boundLead(estimate, kLead);
    return path_.reference();
  }

  /// Down on a model of the aircraft that is good for seconds: as fast as it can be stopped again,
  /// and at the ground no faster than a leg takes without harm. Once there is an IMU again: slower,
  /// and what is too fast then is braked as hard.
  const Reference& descend(Micros now, const VehicleState& estimate, bool blind) {
    const float dt = step(now);
    float sink = kLandingSink;
    if (blind) {
      const float above = -estimate.positionNed.z() - kBrakeUntil;
      sink = kSinkAtGround;  // v^2 = v0^2 + 2 (a/2) s: half of what the path may brake with
      if (above > 0.0F) sink = squareRoot(sink * sink + kBlindAcceleration * above);
    }
    PathBounds b = bounds_;
    b.limits.speedVertical = kMostSink;
    b.limits.acceleration = kBlindAcceleration;
    b.limits.jerk = kBlindJerk;
    path_.turn(0.0F, yawOf(estimate.attitude), b.limits, kPi, dt);
    path_.move({0.0F, 0.0F, sink}, b, true, dt);
    path_.boundLead(estimate, kLead);
    return path_.reference();
  }

  [[nodiscard]] const Reference& reference() const { return path_.reference(); }

 private:
  static constexpr float kInsideFence = 1.0F;  ///< m, ours: what an estimate wanders
  static constexpr float kLead = 1.5F;         ///< m, ours: within what the controller acts on
  // ours, of flights without an IMU: docs/blind-flight.md.
  static constexpr float kLandingSink = 0.5F;        ///< m/s, as every landing's
  static constexpr float kSinkAtGround = 1.2F;       ///< m/s
  static constexpr float kMostSink = 4.0F;           ///< m/s
  static constexpr float kBrakeUntil = 0.6F;         ///< m above the start: the model's height errs
  static constexpr float kBlindAcceleration = 5.0F;  ///< m/s^2, up to half of what weight gives
  static constexpr float kBlindJerk = 50.0F;         ///< m/s^3

  [[nodiscard]] bool given(unsigned value) const { return (setpoint_.index >> value & 1U) != 0; }

  [[nodiscard]] float velocity(unsigned value) const {
    return given(value) ? setpoint_.values[value] : 0.0F;
  }

  /// m/s, NED. A place's comes on top of the velocity that may come with it.
  [[nodiscard]] Vector3f wantedVelocity() const {
    Vector3f wanted{velocity(4), velocity(5), -velocity(6)};
    const Vector3f& at = path_.reference().positionNed;
    const float braking = bounds_.limits.acceleration;
    if (given(0) && given(1)) {
      Vector2f place{setpoint_.values[0], setpoint_.values[1]};
      place *= shortening(place, bounds_.radius);
      const Vector2f way = place - at.head<2>();
      const float distance = way.norm();
      if (distance > 0.0F) wanted.head<2>() += (approachSpeed(distance, braking) / distance) * way;
    }
    if (given(2)) {
      float height = setpoint_.values[2] < bounds_.height ? setpoint_.values[2] : bounds_.height;
      if (height < kInsideFence) height = kInsideFence;  // landing is a command of its own
      const float down = -height - at.z();
      wanted.z() += down < 0.0F ? -approachSpeed(-down, braking) : approachSpeed(down, braking);
    }
    return wanted;
  }

  /// rad/s
  [[nodiscard]] float wantedYawRate() const {
    float rate = velocity(7);
    if (given(3)) {
      const float angle = wrapAngle(setpoint_.values[3] - path_.reference().yaw);
      const float braking = bounds_.limits.yawAcceleration;
      rate += angle < 0.0F ? -approachSpeed(-angle, braking) : approachSpeed(angle, braking);
    }
    return rate;
  }

  /// s since the last call; a gap of more than 0.1 s counts as 0.1 s.
  [[nodiscard]] float step(Micros now) {
    const Micros gap = elapsed(now, last_);
    last_ = now;
    return toSeconds(gap < 100'000 ? gap : 100'000);
  }

  PathBounds bounds_;
  VehicleCommand setpoint_;
  VelocityPath path_;
  Micros last_ = 0;
};

}  // namespace strix
