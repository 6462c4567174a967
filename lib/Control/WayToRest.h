/// A way to rest at a target with continuous acceleration and bounded jerk, from rest or from any
/// motion.
///
/// From rest the way is the quintic of least jerk (Flash and Hogan 1985): of the way D in the time
/// T is left, with r the share of the time left,
///     D r^3 (10 - 15 r + 6 r^2):  peak speed 1.875 D/T, acceleration 10/sqrt(3) D/T^2,
///                                 jerk 60 D/T^3.
/// From motion two parts are added: one brings the present velocity and acceleration to zero, which
/// takes the quantity on to a place where it would stop; the other is the quintic from there to the
/// target, begun as soon as the sum keeps the limits: at the latest when all has stopped, so a plan
/// within the limits always exists. (One quintic from motion has none near the limits: the longer
/// it takes, the further its speed overshoots.) Both parts are counted back from their ends, where
/// they vanish, so the target is met to the last bit.
#pragma once

#include "Mathpk.h"

namespace strix {

/// Tracked without strain by either vehicle, ours: 2 m/s^2 is 12 deg of tilt, and 6 m/s^3 lets it
/// build up in a third of a second; yaw needs 0.01 N m of Quad5in's 0.09, 0.05 of UgglanQ450's 0.2.
struct TrajectoryLimits {
  float speedHorizontal = 2.0F;                ///< m/s
  float speedVertical = 1.0F;                  ///< m/s
  float acceleration = 2.0F;                   ///< m/s^2
  float jerk = 6.0F;                           ///< m/s^3
  float yawRate = 60.0F * kDegToRad;           ///< rad/s
  float yawAcceleration = 120.0F * kDegToRad;  ///< rad/s^2
  float yawJerk = 480.0F * kDegToRad;          ///< rad/s^3
};

namespace trajectory {

template <class T>
[[nodiscard]] T zero();
template <>
[[nodiscard]] inline float zero<float>() {
  return 0.0F;
}
template <>
[[nodiscard]] inline Vector3f zero<Vector3f>() {
  return Vector3f::Zero();
}

constexpr float kPeakSpeed = 1.875F;
constexpr float kPeakAcceleration = 5.773503F;  // 10 / sqrt(3)
constexpr float kPeakJerk = 60.0F;

[[nodiscard]] inline float larger(float a, float b) { return a > b ? a : b; }
[[nodiscard]] inline float magnitude(float x) { return x < 0.0F ? -x : x; }
[[nodiscard]] inline float magnitude(const Vector3f& v) { return v.norm(); }

[[nodiscard]] inline float accelerationLimit(float /*yaw*/, const TrajectoryLimits& l) {
  return l.yawAcceleration;
}
[[nodiscard]] inline float accelerationLimit(const Vector3f&, const TrajectoryLimits& l) {
  return l.acceleration;
}
[[nodiscard]] inline float jerkLimit(float /*yaw*/, const TrajectoryLimits& l) { return l.yawJerk; }
[[nodiscard]] inline float jerkLimit(const Vector3f&, const TrajectoryLimits& l) { return l.jerk; }

/// A velocity as a share of its limits.
[[nodiscard]] inline float speedShare(float yawRate, const TrajectoryLimits& l) {
  return magnitude(yawRate) / l.yawRate;
}
[[nodiscard]] inline float speedShare(const Vector3f& v, const TrajectoryLimits& l) {
  return larger(squareRoot(v.x() * v.x() + v.y() * v.y()) / l.speedHorizontal,
                magnitude(v.z()) / l.speedVertical);
}

/// A duration in whole microseconds, at most 50 min, so that it never comes near the clock's wrap.
[[nodiscard]] inline Micros toMicros(float seconds) {
  constexpr float kLongest = 3000.0F;
  return static_cast<Micros>((seconds < kLongest ? seconds : kLongest) * 1e6F) + 1U;
}

}  // namespace trajectory

/// A quantity and its first three derivatives in time.
template <class T>
struct PathPoint {
  T value;
  T rate;
  T acceleration;
  T jerk = trajectory::zero<T>();
};

/// One quantity's way to rest at a target.
/// @tparam T  float for yaw, Vector3f for a position
template <class T>
class WayToRest {
 public:
  /// To rest at `target`.
  void plan(const PathPoint<T>& from, const T& target, const TrajectoryLimits& limits) {
    planStop(from, limits);
    target_ = target;
    way_ = stop_ - target;
    moveTime_ = trajectory::toMicros(moveSeconds(limits));
    startTime_ = 0;
    if (stopTime_ == 0) return;
    for (Micros quarter = 0; quarter < 4; ++quarter) {
      startTime_ = stopTime_ / 4U * quarter;
      if (keepsLimits(limits)) return;
    }
    startTime_ = stopTime_;
  }

  /// To rest as soon as the limits allow, wherever that is.
  void planHalt(const PathPoint<T>& from, const TrajectoryLimits& limits) {
    planStop(from, limits);
    target_ = stop_;
    startTime_ = moveTime_ = 0;
  }

  [[nodiscard]] Micros duration() const {
    const Micros moved = startTime_ + moveTime_;
    return moved > stopTime_ ? moved : stopTime_;
  }

  [[nodiscard]] const T& target() const { return target_; }

  /// @param t  us since plan()
  [[nodiscard]] PathPoint<T> at(Micros t) const {
    PathPoint<T> m{target_, trajectory::zero<T>(), trajectory::zero<T>()};
    if (t < startTime_ + moveTime_) {
      const float perSecond = 1.0F / toSeconds(moveTime_);
      const float r =
          t > startTime_ ? toSeconds(startTime_ + moveTime_ - t) * perSecond : 1.0F;  // time left
      const float gone = 1.0F - r;
      m.value += way_ * (r * r * r * ((6.0F * r - 15.0F) * r + 10.0F));
      m.rate -= way_ * (30.0F * r * r * gone * gone * perSecond);
      m.acceleration += way_ * (60.0F * r * gone * (1.0F - 2.0F * r) * perSecond * perSecond);
      if (t >= startTime_) {
        m.jerk -= way_ * (trajectory::kPeakJerk * (1.0F - 6.0F * r * gone) *
                          (perSecond * perSecond * perSecond));
      }
    }
    if (t < stopTime_) {
      const float perSecond = 1.0F / toSeconds(stopTime_);
      const float r = toSeconds(stopTime_ - t) * perSecond;
      m.value += (cube_ + quart_ * r) * (r * r * r);
      m.rate -= (3.0F * cube_ + (4.0F * r) * quart_) * (r * r * perSecond);
      m.acceleration += (6.0F * cube_ + (12.0F * r) * quart_) * (r * perSecond * perSecond);
      m.jerk -= (6.0F * cube_ + (24.0F * r) * quart_) * (perSecond * perSecond * perSecond);
    }
    return m;
  }

 private:
  /// Velocity as the cubic from (v, a) to (0, 0) in the time T: Hermite. The quantity moves on by
  /// v T/2 + a T^2/12; with r the share of the time left, r^3 (c + d r) of it is still to go,
  /// c = -v T - a T^2/3, d = v T/2 + a T^2/4.
  void planStop(const PathPoint<T>& from, const TrajectoryLimits& limits) {
    using trajectory::magnitude;
    stop_ = from.value;
    stopTime_ = 0;
    const float v = magnitude(from.rate);
    const float a = magnitude(from.acceleration);
    if (!(v > 0.0F || a > 0.0F)) return;
    // Jerk is largest at the ends, at most (6 v + 4 a T) / T^2: solved for T. Acceleration never
    // exceeds the larger of a and the limit for T >= 2.15 v / limit, whatever the directions.
    const float jerk = trajectory::jerkLimit(from.rate, limits);
    const float forJerk = (2.0F * a + squareRoot(4.0F * a * a + 6.0F * jerk * v)) / jerk;
    const float forAcceleration = 2.15F * v / trajectory::accelerationLimit(from.rate, limits);
    stopTime_ = trajectory::toMicros(trajectory::larger(forJerk, forAcceleration));
    const float time = toSeconds(stopTime_);
    const T vT = from.rate * time;
    const T aTT = from.acceleration * (time * time);
    stop_ = from.value + 0.5F * vT + (1.0F / 12.0F) * aTT;
    cube_ = -vT - (1.0F / 3.0F) * aTT;
    quart_ = 0.5F * vT + 0.25F * aTT;
  }

  /// The time from rest to rest in which all peaks keep their limits.
  [[nodiscard]] float moveSeconds(const TrajectoryLimits& limits) const {
    using trajectory::larger;
    const float distance = trajectory::magnitude(way_);
    const float forSpeed = trajectory::kPeakSpeed * trajectory::speedShare(way_, limits);
    const float forAcceleration = squareRoot(trajectory::kPeakAcceleration * distance /
                                             trajectory::accelerationLimit(way_, limits));
    const float forJerk =
        cubeRoot(trajectory::kPeakJerk * distance / trajectory::jerkLimit(way_, limits));
    return larger(kShortest, larger(forSpeed, larger(forAcceleration, forJerk)));
  }

  /// Both parts together, at eight times while both move. Where the motion to be stopped is beyond
  /// a limit, it may stay there.
  [[nodiscard]] bool keepsLimits(const TrajectoryLimits& limits) const {
    using trajectory::larger;
    constexpr float kRounding = 1.001F;
    const PathPoint<T> from = at(0);
    const float speedLimit = kRounding * larger(1.0F, trajectory::speedShare(from.rate, limits));
    const float accelerationLimit =
        kRounding * larger(trajectory::accelerationLimit(from.rate, limits),
                           trajectory::magnitude(from.acceleration));
    const float jerkLimit = kRounding * trajectory::jerkLimit(from.rate, limits);
    const Micros step = (stopTime_ - startTime_) / 8U;
    for (Micros i = 0; i <= 8; ++i) {
      // The last one just before the stop's end: its jerk ends with it.
      const Micros t = i < 8 ? startTime_ + step * i : stopTime_ - 1U;
      const PathPoint<T> m = at(t);
      if (trajectory::speedShare(m.rate, limits) > speedLimit) return false;
      if (trajectory::magnitude(m.acceleration) > accelerationLimit) return false;
      if (trajectory::magnitude(m.jerk) > jerkLimit) return false;
    }
    return true;
  }

  [[nodiscard]] static float cubeRoot(float x) { return exponential(logarithm(x) * (1.0F / 3.0F)); }

  static constexpr float kShortest = 0.01F;  ///< s, ours: five control periods

  T target_ = trajectory::zero<T>();
  T way_ = trajectory::zero<T>();    ///< from the target back to where the quintic begins
  T stop_ = trajectory::zero<T>();   ///< where the present motion alone would end
  T cube_ = trajectory::zero<T>();   ///< coefficients of the stop
  T quart_ = trajectory::zero<T>();  ///
  Micros stopTime_ = 0;  ///< the stop lasts from 0 to here; 0: there was nothing to stop
  Micros startTime_ = 0;
  Micros moveTime_ = 0;
};

}  // namespace strix
