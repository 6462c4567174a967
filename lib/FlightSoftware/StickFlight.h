/// The reference that a pilot's sticks, or velocities by telemetry, ask for.
#pragma once

#include "Mathpk.h"
#include "Parameters.h"
#include "PilotInput.h"
#include "VehicleState.h"

namespace strix {

/// Smooth in every mode: velocity follows what is asked with bounded acceleration and jerk, and a
/// change of mode goes on from the motion that is there. The heading turns by the yaw stick.
class StickFlight {
 public:
  /// @param weight  N: the throttle's middle in attitude mode
  explicit StickFlight(float weight) : weight_(weight) {}

  void configure(const Parameters& p) {
    tilt_ = p.stickTilt * kDegToRad;
    yawRate_ = p.stickYaw * kDegToRad;
    speed_ = p.stickSpeed;
    climb_ = p.stickClimb;
  }

  /// Goes on from the aircraft's own motion.
  void start(Micros now, const VehicleState& estimate) {
    last_ = now;
    reference_ = {};
    reference_.positionNed = estimate.positionNed;
    reference_.velocityNed = estimate.velocityNed;
    reference_.yaw = yawOf(estimate.attitude);
  }

  /// @param mode  Attitude, AltitudeHold or PositionHold
  const Reference& fly(Micros now, const PilotInput& sticks, PilotMode mode,
                       const VehicleState& estimate) {
    const float dt = step(now);
    const float heading = yawOf(estimate.attitude);
    turn(within(sticks.yaw) * yawRate_, heading, dt);
    if (mode == PilotMode::Attitude) {
      reference_.mode = ReferenceMode::Attitude;
      reference_.thrust = 2.0F * weight_ * upTo(sticks.throttle, 1.0F);
      follow(estimate);  // another mode begins where the aircraft is
    } else {
      const bool holds = mode == PilotMode::PositionHold;
      reference_.mode = holds ? ReferenceMode::Position : ReferenceMode::AttitudeHeight;
      Vector3f wanted{0.0F, 0.0F, -climb_ * climbStick(sticks.throttle)};
      if (holds) {
        const SinCos s = sinCos(heading);
        const float forward = -speed_ * within(sticks.pitch);
        const float right = speed_ * within(sticks.roll);
        wanted.x() = s.cos * forward - s.sin * right;
        wanted.y() = s.sin * forward + s.cos * right;
      }
      move(wanted, estimate, holds, dt);
    }
    if (mode != PilotMode::PositionHold) {
      reference_.attitude = eulerToQuaternion(
          {tilt_ * within(sticks.roll), tilt_ * within(sticks.pitch), reference_.yaw});
    }
    return reference_;
  }

  /// @param velocityNed  m/s    @param yawRate  rad/s
  const Reference& flyVelocity(Micros now, const Vector3f& velocityNed, float yawRate,
                               const VehicleState& estimate) {
    const float dt = step(now);
    turn(upTo(yawRate, yawRate_), yawOf(estimate.attitude), dt);
    reference_.mode = ReferenceMode::Position;
    Vector3f wanted = velocityNed;
    const float level = squareRoot(wanted.x() * wanted.x() + wanted.y() * wanted.y());
    if (level > speed_) wanted.head<2>() *= speed_ / level;
    wanted.z() = upTo(wanted.z(), climb_);
    move(wanted, estimate, true, dt);
    return reference_;
  }

  [[nodiscard]] const Reference& reference() const { return reference_; }

 private:
  static constexpr float kAcceleration = 2.5F;  ///< m/s^2, ours: 14 deg of tilt
  static constexpr float kJerk = 10.0F;         ///< m/s^3, ours
  static constexpr float kResponse = 0.4F;      ///< s, of velocity to what is asked
  static constexpr float kLead = 1.5F;          ///< m that the reference runs ahead of the aircraft
  static constexpr float kHeadingLead = 1.0F;   ///< rad, as Ugglan's (StickMapping.h)
  static constexpr float kMiddle = 0.1F;        ///< of the throttle's way, either side: no climb

  [[nodiscard]] static float upTo(float value, float most) {
    if (!isFinite(value)) return 0.0F;
    if (value > most) return most;
    return value < -most ? -most : value;
  }
  [[nodiscard]] static float within(float stick) { return upTo(stick, 1.0F); }

  /// -1 to 1 of a throttle of 0 to 1. One that is no number neither climbs nor sinks.
  [[nodiscard]] static float climbStick(float throttle) {
    const float stick = isFinite(throttle) ? within(2.0F * throttle - 1.0F) : 0.0F;
    const float size = stick < 0.0F ? -stick : stick;
    if (size <= 2.0F * kMiddle) return 0.0F;
    const float rest = (size - 2.0F * kMiddle) / (1.0F - 2.0F * kMiddle);
    return stick < 0.0F ? -rest : rest;
  }

  /// s since the last call; a gap of more than 0.1 s counts as 0.1 s.
  [[nodiscard]] float step(Micros now) {
    const Micros gap = elapsed(now, last_);
    last_ = now;
    return toSeconds(gap < 100'000 ? gap : 100'000);
  }

  /// With the stick let go the aircraft does not go on turning: the lead is bounded.
  void turn(float rate, float heading, float dt) {
    const float lead = upTo(wrapAngle(reference_.yaw + rate * dt - heading), kHeadingLead);
    reference_.yaw = wrapAngle(heading + lead);
    reference_.yawRate = rate;
  }

  void follow(const VehicleState& estimate) {
    reference_.positionNed = estimate.positionNed;
    reference_.velocityNed = estimate.velocityNed;
    reference_.accelerationNed.setZero();
    reference_.jerkNed.setZero();
  }

  /// One step of velocity and place towards the wanted velocity.
  /// @param level  north and east too; else they follow the aircraft
  void move(const Vector3f& wanted, const VehicleState& estimate, bool level, float dt) {
    Reference& r = reference_;
    if (!level) {
      r.positionNed.head<2>() = estimate.positionNed.head<2>();
      r.velocityNed.head<2>() = estimate.velocityNed.head<2>();
    }
    for (Eigen::Index i = level ? 0 : 2; i < 3; ++i) {
      const float asked = upTo((wanted(i) - r.velocityNed(i)) / kResponse, kAcceleration);
      const float before = r.accelerationNed(i);
      const float change = upTo(asked - before, kJerk * dt);
      r.accelerationNed(i) = before + change;
      r.velocityNed(i) += r.accelerationNed(i) * dt;
      const float ahead =
          upTo(r.positionNed(i) + r.velocityNed(i) * dt - estimate.positionNed(i), kLead);
      r.positionNed(i) = estimate.positionNed(i) + ahead;
    }
    if (!level) r.accelerationNed.head<2>().setZero();
  }

  float weight_;
  float tilt_ = 0.0F;     ///< rad at full stick
  float yawRate_ = 0.0F;  ///< rad/s
  float speed_ = 0.0F;    ///< m/s
  float climb_ = 0.0F;    ///< m/s
  Reference reference_;
  Micros last_ = 0;
};

}  // namespace strix
