/// Guidance: brings position and yaw to rest at a target, each smoothly and in its own time.
#pragma once

#include "WayToRest.h"

namespace strix {

/// Position and yaw, each on its own way to rest at a target.
class Trajectory {
 public:
  explicit Trajectory(const TrajectoryLimits& limits = {}) : limits_(limits), usual_(limits) {}

  /// Starts from the motion of `from`, with the place where that stops as target.
  void reset(Micros now, const Reference& from) {
    last_ = now;
    reference_ = from;
    reference_.mode = ReferenceMode::Position;
    reference_.yawAcceleration = 0.0F;
    reference_.yaw = wrapAngle(from.yaw);
    yaw_.planHalt({reference_.yaw, from.yawRate, 0.0F}, limits_);
    targetYaw_ = wrapAngle(yaw_.target());
    yawTime_ = 0;
    halt();
  }

  /// To rest as soon as the limits allow, wherever that is; yaw goes on to its target.
  void halt() {
    position_.planHalt(motion(), limits_);
    positionTime_ = 0;
  }

  /// From the next target on.
  void setLimits(const TrajectoryLimits& limits) { limits_ = usual_ = limits; }

  /// From the next target on. @param horizontal  m/s; zero: the usual one
  void setSpeed(float horizontal) {
    limits_.speedHorizontal = horizontal > 0.0F ? horizontal : usual_.speedHorizontal;
  }

  /// A target that is not finite is ignored; the present one again changes nothing.
  /// @param positionNed  m
  /// @param yaw  rad, any turn; the short way round
  void setTarget(const Vector3f& positionNed, float yaw) {
    if (!isFinite(positionNed) || !isFinite(yaw)) return;
    if (positionNed != position_.target()) {
      position_.plan(motion(), positionNed, limits_);
      positionTime_ = 0;
    }
    const float wrapped = wrapAngle(yaw);
    if (wrapped != targetYaw_) {
      targetYaw_ = wrapped;
      const float from = reference_.yaw;
      yaw_.plan({from, reference_.yawRate, reference_.yawAcceleration},
                from + wrapAngle(wrapped - from), limits_);
      yawTime_ = 0;
    }
  }

  /// The reference at `now`. A gap of more than 0.1 s counts as 0.1 s: it does not make it jump.
  const Reference& update(Micros now) {
    constexpr Micros kLongestStep = 100'000;
    const Micros gap = elapsed(now, last_);
    const Micros step = gap < kLongestStep ? gap : kLongestStep;
    last_ = now;
    if (positionTime_ < position_.duration()) {
      positionTime_ += step;
      const PathPoint<Vector3f> m = position_.at(positionTime_);
      reference_.positionNed = m.value;
      reference_.velocityNed = m.rate;
      reference_.accelerationNed = m.acceleration;
      reference_.jerkNed = positionTime_ < position_.duration() ? m.jerk : Vector3f::Zero();
    }
    if (yawTime_ < yaw_.duration()) {
      yawTime_ += step;
      const PathPoint<float> m = yaw_.at(yawTime_);
      reference_.yaw = yawTime_ < yaw_.duration() ? wrapAngle(m.value) : targetYaw_;
      reference_.yawRate = m.rate;
      reference_.yawAcceleration = m.acceleration;
    }
    return reference_;
  }

  /// The reference (not yet the aircraft) has come to rest at the target.
  [[nodiscard]] bool arrived() const {
    return positionTime_ >= position_.duration() && yawTime_ >= yaw_.duration();
  }

  [[nodiscard]] const Reference& reference() const { return reference_; }
  /// Where it ends.
  [[nodiscard]] const Vector3f& target() const { return position_.target(); }
  [[nodiscard]] float targetYaw() const { return targetYaw_; }

 private:
  [[nodiscard]] PathPoint<Vector3f> motion() const {
    return {reference_.positionNed, reference_.velocityNed, reference_.accelerationNed};
  }

  TrajectoryLimits limits_;
  TrajectoryLimits usual_;
  Micros last_ = 0;
  Reference reference_;
  WayToRest<Vector3f> position_;
  WayToRest<float> yaw_;
  float targetYaw_ = 0.0F;
  Micros positionTime_ = 0;  ///< us since the way was planned
  Micros yawTime_ = 0;
};

}  // namespace strix
