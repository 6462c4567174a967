/// Guidance: brings position and yaw to a target in a straight line at constant speed: take-off and
/// landing.
#pragma once

#include "Mathpk.h"

namespace strix {

struct RampLimits {
  float speedHorizontal = 1.0F;               ///< m/s
  float speedVertical = 0.7F;                 ///< m/s
  float acceleration = 1.0F;                  ///< m/s^2, along the path
  float yawRate = 45.0F * kDegToRad;          ///< rad/s
  float yawAcceleration = 90.0F * kDegToRad;  ///< rad/s^2
};

/// Distance still to go at a bounded speed and acceleration, from rest to rest.
class TrapezoidalRamp {
 public:
  void start(float distance) {
    remaining_ = distance;
    speed_ = 0.0F;
    acceleration_ = 0.0F;
  }

  /// Gives up the rest of the way: what remains is the braking distance v^2 / (2 a).
  void brake(float acceleration) {
    const float braking = speed_ * speed_ / (2.0F * acceleration);
    if (braking < remaining_) remaining_ = braking;
  }

  /// Moves on by dt with constant acceleration. The new speed v1 is the largest that still stops in
  /// time: v1^2 / (2 a) + (v + v1) dt / 2 = remaining, so the end is met, whatever dt.
  void advance(float dt, float speedMax, float acceleration) {
    if (done()) {
      acceleration_ = 0.0F;
      return;
    }
    const float half = 0.5F * acceleration * dt;
    const float square = half * half + acceleration * (2.0F * remaining_ - speed_ * dt);
    float next = square > half * half ? squareRoot(square) - half : 0.0F;
    if (next > speedMax) {  // a limit lowered on the way is met by braking
      const float braked = speed_ - 2.0F * half;
      next = braked > speedMax ? braked : speedMax;
    }
    if (next > speed_ + 2.0F * half) next = speed_ + 2.0F * half;
    const float moved = 0.5F * (speed_ + next) * dt;
    remaining_ = next > 0.0F && moved < remaining_ ? remaining_ - moved : 0.0F;
    const float speed = remaining_ > 0.0F ? next : 0.0F;
    acceleration_ = (speed - speed_) / dt;
    speed_ = speed;
  }

  [[nodiscard]] float remaining() const { return remaining_; }
  [[nodiscard]] float speed() const { return speed_; }
  [[nodiscard]] float acceleration() const { return acceleration_; }
  [[nodiscard]] bool done() const { return remaining_ <= 0.0F; }

 private:
  float remaining_ = 0.0F;
  float speed_ = 0.0F;
  float acceleration_ = 0.0F;  ///< of the last step, negative when braking
};

/// Position moves along a straight line in space, yaw the short way round, each at its own pace.
/// A target set on the way stops the aircraft first and then takes it straight to the new one.
class ReferenceRamp {
 public:
  explicit ReferenceRamp(const RampLimits& limits = {}) : limits_(limits) {}

  /// Starts at rest where the aircraft is, with that as its target.
  void reset(Micros now, const VehicleState& state) {
    reset(now, state.positionNed, yawOf(state.attitude));
  }

  /// Starts at rest at this place and heading, rad in (-pi, pi], with that as its target.
  void reset(Micros now, const Vector3f& positionNed, float yaw) {
    last_ = now;
    position_.start(0.0F);
    yaw_.start(0.0F);
    targetPosition_ = legEnd_ = positionNed;
    targetYaw_ = yawEnd_ = yaw;
    reference_ = {legEnd_, Vector3f::Zero(), yawEnd_, 0.0F, Vector3f::Zero()};
  }

  /// A target that is not finite is ignored.
  /// @param positionNed  m
  /// @param yaw  rad, any turn
  void setTarget(const Vector3f& positionNed, float yaw) {
    if (!isFinite(positionNed) || !isFinite(yaw)) return;
    const float wrapped = wrapAngle(yaw);
    if (positionNed != targetPosition_) {
      targetPosition_ = positionNed;
      position_.brake(limits_.acceleration);
      legEnd_ = reference_.positionNed + direction_ * position_.remaining();
    }
    if (wrapped != targetYaw_) {
      targetYaw_ = wrapped;
      yaw_.brake(limits_.yawAcceleration);
      yawEnd_ = wrapAngle(reference_.yaw + turn_ * yaw_.remaining());
    }
  }

  /// Shifts the whole way level, so that it is nowhere further from here than `most`, m.
  void stayNear(const Vector3f& positionNed, float most) {
    const Vector2f ahead = (reference_.positionNed - positionNed).head<2>();
    const float square = ahead.squaredNorm();
    if (!(square > most * most)) return;  // also when it is no number
    const Vector2f shift = (most / squareRoot(square) - 1.0F) * ahead;
    reference_.positionNed.head<2>() += shift;
    legEnd_.head<2>() += shift;
    targetPosition_.head<2>() += shift;
  }

  /// From now on, also on the way. @param speed  m/s
  void setVerticalSpeed(float speed) {
    limits_.speedVertical = speed;
    legSpeed_ = speedAlong(direction_);
  }

  /// The reference at `now`. It moves in steps of 2 ms or more, in which the way is long enough to
  /// be counted in float however fast the loop; a gap of more than 0.1 s counts as 0.1 s.
  const Reference& update(Micros now) {
    const Micros gap = elapsed(now, last_);
    if (gap < kShortestStep) return reference_;
    last_ = now;
    const float dt = toSeconds(gap < kLongestStep ? gap : kLongestStep);
    if (position_.done() && legEnd_ != targetPosition_) startLeg();
    if (yaw_.done() && yawEnd_ != targetYaw_) startTurn();
    position_.advance(dt, legSpeed_, limits_.acceleration);
    yaw_.advance(dt, limits_.yawRate, limits_.yawAcceleration);

    // Counted back from the end, so that the end is met to the last bit.
    reference_.positionNed = legEnd_ - direction_ * position_.remaining();
    reference_.velocityNed = direction_ * position_.speed();
    reference_.accelerationNed = direction_ * position_.acceleration();
    reference_.yaw = yaw_.done() ? yawEnd_ : wrapAngle(yawEnd_ - turn_ * yaw_.remaining());
    reference_.yawRate = turn_ * yaw_.speed();
    return reference_;
  }

  /// The reference (not yet the aircraft) has come to rest at the target.
  [[nodiscard]] bool arrived() const {
    return position_.done() && yaw_.done() && legEnd_ == targetPosition_ && yawEnd_ == targetYaw_;
  }

  [[nodiscard]] const Reference& reference() const { return reference_; }

 private:
  static constexpr Micros kShortestStep = 2'000;
  static constexpr Micros kLongestStep = 100'000;

  void startLeg() {
    const Vector3f way = targetPosition_ - legEnd_;
    const float distance = way.norm();
    legEnd_ = targetPosition_;
    if (!(distance > 0.0F)) return;  // the square of a tiny way underflows
    direction_ = way / distance;
    position_.start(distance);
    legSpeed_ = speedAlong(direction_);
  }

  /// The speed whose horizontal and vertical parts both keep their limits.
  [[nodiscard]] float speedAlong(const Vector3f& direction) const {
    const float horizontal =
        squareRoot(direction.x() * direction.x() + direction.y() * direction.y());
    const float vertical = direction.z() < 0.0F ? -direction.z() : direction.z();
    if (!(horizontal + vertical > 0.0F)) return 0.0F;  // no leg yet
    return limits_.speedHorizontal * vertical < limits_.speedVertical * horizontal
               ? limits_.speedHorizontal / horizontal
               : limits_.speedVertical / vertical;
  }

  void startTurn() {
    const float angle = wrapAngle(targetYaw_ - yawEnd_);
    yawEnd_ = targetYaw_;
    turn_ = angle < 0.0F ? -1.0F : 1.0F;
    yaw_.start(turn_ * angle);
  }

  RampLimits limits_;
  Micros last_ = 0;
  Reference reference_;
  Vector3f targetPosition_ = Vector3f::Zero();
  Vector3f legEnd_ = Vector3f::Zero();  ///< end of the line now followed
  Vector3f direction_ = Vector3f::Zero();
  float legSpeed_ = 0.0F;
  TrapezoidalRamp position_;
  float targetYaw_ = 0.0F;
  float yawEnd_ = 0.0F;
  float turn_ = 1.0F;  ///< +1 to the right
  TrapezoidalRamp yaw_;
};

}  // namespace strix
