/// A motion that follows a wanted velocity, turning rate and fence smoothly: what sticks and
/// setpoints are flown by.
#pragma once

#include "HeadingTilt.h"
#include "WayToRest.h"

namespace strix {

/// The speed at which a place so far ahead is approached: it is met without overshoot by braking
/// with half of `acceleration`, and in a time constant at the end. The other half is for the path,
/// which follows later. 0 when it is passed.
/// @param distance  m or rad    @param acceleration  m/s^2 or rad/s^2
[[nodiscard]] inline float approachSpeed(float distance, float acceleration) {
  constexpr float kAtEnd = 1.0F;  ///< 1/s, ours: slow beside VelocityFollower's own
  if (!(distance > 0.0F)) return 0.0F;
  const float braking = squareRoot(acceleration * distance);
  const float closing = kAtEnd * distance;
  return braking < closing ? braking : closing;
}

/// Brings a velocity of N components to a wanted one with bounded acceleration and jerk, both
/// limits on lengths so that no direction is favoured:
///     asked a = min(k dv, sqrt(2 j (dv - j / (2 k^2))), a_most),  a' = towards it, j at most
/// The square root is the acceleration from which j still ends at dv = 0 with a = 0 (ArduPilot's
/// sqrt_controller); the linear part, below dv = j / k^2, keeps that from chattering.
template <int N>
class VelocityFollower {
 public:
  using Vector = Eigen::Matrix<float, N, 1>;

  void start(const Vector& velocity, const Vector& acceleration) {
    velocity_ = velocity;
    acceleration_ = acceleration;
    jerk_.setZero();
  }

  /// One step. @return the way made in it, m
  Vector follow(const Vector& wanted, float most, float jerk, float dt) {
    const Vector lacking = wanted - velocity_;
    const float size = lengthOf(lacking);
    Vector change = -acceleration_;
    if (size > 0.0F) change += (asked(size, most, jerk) / size) * lacking;
    const float length = lengthOf(change);
    const float longest = jerk * dt;
    if (length > longest) change *= longest / length;
    if (size < kRest && wanted.squaredNorm() == 0.0F && length <= longest) {  // rests
      start(wanted, wanted);
      return wanted;
    }
    if (dt > 0.0F) jerk_ = change / dt;
    acceleration_ += change;
    const Vector before = velocity_;
    velocity_ += dt * acceleration_;
    return (0.5F * dt) * (before + velocity_);
  }

  [[nodiscard]] const Vector& velocity() const { return velocity_; }
  [[nodiscard]] const Vector& acceleration() const { return acceleration_; }
  [[nodiscard]] const Vector& jerk() const { return jerk_; }

 private:
  static constexpr float kGain = 5.0F;   ///< 1/s, ours: slower than the attitude loop
  static constexpr float kRest = 1e-3F;  ///< m/s

  [[nodiscard]] static float lengthOf(const Vector& v) {
    if constexpr (N == 1) return v[0] < 0.0F ? -v[0] : v[0];
    return v.norm();
  }

  [[nodiscard]] static float asked(float size, float most, float jerk) {
    const float linear = jerk / (kGain * kGain);
    const float a = size < linear ? kGain * size : squareRoot(2.0F * jerk * (size - 0.5F * linear));
    return a < most ? a : most;
  }

  Vector velocity_ = Vector::Zero();      ///< m/s
  Vector acceleration_ = Vector::Zero();  ///< m/s^2
  Vector jerk_ = Vector::Zero();          ///< m/s^3
};

/// The cylinder that a path stays in, and how it may move. A wanted velocity that leads out of it
/// is slowed down in time, and slides along it.
struct PathBounds {
  float radius = 0.0F;  ///< m from the start
  float height = 0.0F;  ///< m above it
  TrajectoryLimits limits{};
};

/// A place that moves as its velocity says, and a heading.
class VelocityPath {
 public:
  /// Goes on from a motion.
  void start(const Reference& from) {
    reference_ = from;
    reference_.mode = ReferenceMode::Position;
    reference_.yawAcceleration = 0.0F;
    level_.start(from.velocityNed.head<2>(), from.accelerationNed.head<2>());
    vertical_.start(from.velocityNed.tail<1>(), from.accelerationNed.tail<1>());
  }

  /// One step by the wanted velocity, shortened to its limits.
  /// @param level  north and east too; else only up and down
  void move(const Vector3f& wantedNed, const PathBounds& b, bool level, float dt) {
    Reference& r = reference_;
    const TrajectoryLimits& l = b.limits;
    float down = clamped(wantedNed.z(), l.speedVertical);
    if (down < 0.0F) {
      const float most = approachSpeed(b.height + r.positionNed.z(), l.acceleration);
      if (-down > most) down = -most;
    }
    using Down = VelocityFollower<1>::Vector;
    r.positionNed.z() += vertical_.follow(Down(down), l.acceleration, l.jerk, dt).x();
    r.velocityNed.z() = vertical_.velocity().x();
    r.accelerationNed.z() = vertical_.acceleration().x();
    r.jerkNed.z() = vertical_.jerk().x();
    if (!level) return;
    Vector2f wanted = wantedNed.head<2>();
    wanted *= shortening(wanted, l.speedHorizontal);
    wanted = keptInside(wanted, b);
    r.positionNed.head<2>() += level_.follow(wanted, l.acceleration, l.jerk, dt);
    r.velocityNed.head<2>() = level_.velocity();
    r.accelerationNed.head<2>() = level_.acceleration();
    r.jerkNed.head<2>() = level_.jerk();
  }

  /// North and east are the aircraft's.
  void copyLevel(const VehicleState& estimate) {
    reference_.positionNed.head<2>() = estimate.positionNed.head<2>();
    reference_.velocityNed.head<2>() = estimate.velocityNed.head<2>();
    reference_.accelerationNed.head<2>().setZero();
    reference_.jerkNed.head<2>().setZero();
  }

  /// So that they go on from there: its tilt is their acceleration.
  void followLevel(const VehicleState& estimate, float most) {
    const Vector3f up = rotateToNed(estimate.attitude, {0.0F, 0.0F, -1.0F});
    Vector2f acceleration = Vector2f::Zero();
    if (up.z() < -0.5F) acceleration = (kGravity / -up.z()) * up.head<2>();
    acceleration *= shortening(acceleration, most);
    level_.start(estimate.velocityNed.head<2>(), acceleration);
    copyLevel(estimate);
    reference_.accelerationNed.head<2>() = acceleration;
  }

  /// Height and climb are the aircraft's.
  void followHeight(const VehicleState& estimate) {
    using Down = VelocityFollower<1>::Vector;
    vertical_.start(estimate.velocityNed.tail<1>(), Down::Zero());
    reference_.positionNed.z() = estimate.positionNed.z();
    reference_.velocityNed.z() = estimate.velocityNed.z();
    reference_.accelerationNed.z() = 0.0F;
    reference_.jerkNed.z() = 0.0F;
  }

  /// A place that moves runs no further ahead of the aircraft than this: where that cannot follow,
  /// letting go means here. One that rests is kept, however far the wind has blown the aircraft.
  void boundLead(const VehicleState& estimate, float most) {
    Vector3f& p = reference_.positionNed;
    if (level_.velocity().squaredNorm() > 0.0F) {
      Vector2f ahead = p.head<2>() - estimate.positionNed.head<2>();
      ahead *= shortening(ahead, most);
      p.head<2>() = estimate.positionNed.head<2>() + ahead;
    }
    if (vertical_.velocity().x() != 0.0F) {
      p.z() = estimate.positionNed.z() + clamped(p.z() - estimate.positionNed.z(), most);
    }
  }

  /// One step of the heading by the wanted rate, which changes with bounded acceleration and leads
  /// the nose by no more than `lead`: with the stick let go the aircraft does not go on turning.
  /// @param rate  rad/s    @param heading  of the aircraft, rad
  void turn(float rate, float heading, const TrajectoryLimits& limits, float lead, float dt) {
    Reference& r = reference_;
    r.yawRate += clamped(clamped(rate, limits.yawRate) - r.yawRate, limits.yawAcceleration * dt);
    r.yaw = wrapAngle(heading + clamped(wrapAngle(r.yaw + r.yawRate * dt - heading), lead));
  }

  [[nodiscard]] const Reference& reference() const { return reference_; }

 private:
  [[nodiscard]] Vector2f keptInside(const Vector2f& wanted, const PathBounds& b) const {
    // From so far away the full speed may be flown (approachSpeed): most of the time.
    const float speedMost = b.limits.speedHorizontal;
    const float braking = speedMost * speedMost / b.limits.acceleration;
    const float free = b.radius - (speedMost > braking ? speedMost : braking);
    const Vector2f place = reference_.positionNed.head<2>();
    const float square = place.squaredNorm();
    if (free > 0.0F && square < free * free) return wanted;
    const float distance = squareRoot(square);
    if (!(distance > 0.0F)) return wanted;
    const Vector2f outward = place / distance;
    const float most = approachSpeed(b.radius - distance, b.limits.acceleration);
    const float speed = wanted.dot(outward);
    return speed > most ? Vector2f(wanted - (speed - most) * outward) : wanted;
  }

  Reference reference_;
  VelocityFollower<2> level_;
  VelocityFollower<1> vertical_;
};

}  // namespace strix
