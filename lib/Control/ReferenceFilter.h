/// Makes jumps of the reference smooth, and leaves smooth references alone.
#pragma once

#include "ControlRate.h"
#include "HeadingTilt.h"

namespace strix {

/// Time constants of a critically damped second order: a jump is 95 % made up after 4.7 of them,
/// without overshoot. 0: off; others from 0.02 s, ten control periods. The values are ours.
struct ReferenceFilterConfig {
  float position = 0.7F;  ///< s: slow beside the attitude loop, which has to follow it
  float yaw = 0.15F;      ///< s: 30 deg well within a second
  float tilt = 0.0F;      ///< s: the attitude gains follow a step without help
  // A jump is made up no faster than this, whatever the reference itself does meanwhile.
  float speedHorizontal = 2.0F;     ///< m/s
  float speedVertical = 1.0F;       ///< m/s
  float acceleration = 2.0F;        ///< m/s^2, each; below 0.37 speed/time constant it overshoots
  float yawRate = 1.5F;             ///< rad/s
  float yawAcceleration = 4.0F;     ///< rad/s^2: UgglanQ450's motors can give 5 in hover
  float tiltRate = 4.0F;            ///< rad/s
  float tiltAcceleration = 200.0F;  ///< rad/s^2: 0.6 of the 1.1 N m that Quad5in can give
};

/// A reference of N numbers with rate and acceleration: an angle (1), a tilt (2) or a place (3).
/// The output is the target plus an offset: what a jump of the target leaves behind, dying out as
/// d'' = -2 w d' - w^2 d. A target that moves as its own rate and acceleration say passes
/// unchanged.
template <int N>
class SmoothReference {
 public:
  using Vector = Eigen::Matrix<float, N, 1>;

  /// How fast an offset may die out. The limits are on lengths, of a place on that of its
  /// horizontal part; `vertical` is the rest of a place.
  struct Limit {
    float most = 0.0F;
    float vertical = 0.0F;
  };

  SmoothReference(float timeConstant, const Limit& rate, const Limit& acceleration)
      : rateLimit_(rate), accelerationLimit_(acceleration) {
    if (timeConstant > 0.0F) frequency_ = 1.0F / timeConstant;
  }

  [[nodiscard]] bool on() const { return frequency_ > 0.0F; }

  /// Puts the output where `value` is, moving at `rate`, wherever the target is.
  void start(const Vector& target, const Vector& targetRate, const Vector& value,
             const Vector& rate) {
    offset_ = shortWay(value - target);
    offsetRate_ = rate - targetRate;
    lastValue_ = target;
    lastRate_ = targetRate;
  }

  /// One control period: replaces the target by the smooth reference.
  void follow(Vector& value, Vector& rate, Vector& acceleration) {
    // The bracket first: far from home, position has not the digits of a small offset.
    offset_ =
        shortWay(offset_ + ((lastValue_ - value) + 0.5F * kControlPeriod * (rate + lastRate_)));
    offsetRate_ += lastRate_ - rate + kControlPeriod * acceleration;
    lastValue_ = value;
    lastRate_ = rate;
    if (offset_.squaredNorm() + offsetRate_.squaredNorm() < kRest) {
      offset_.setZero();
      offsetRate_.setZero();
      return;
    }
    // Without its limits this is -2 w d' - w^2 d; the first limits the speed the offset asks for.
    const Vector wantedRate = limited(-0.5F * frequency_ * offset_, rateLimit_);
    const Vector change =
        limited(2.0F * frequency_ * (wantedRate - offsetRate_), accelerationLimit_);
    offset_ += kControlPeriod * offsetRate_ + 0.5F * kControlPeriod * kControlPeriod * change;
    offsetRate_ += kControlPeriod * change;
    value += offset_;
    rate += offsetRate_;
    acceleration += change;
  }

 private:
  /// Square of an offset, of 1e-5, that is rounding: such jumps pass.
  static constexpr float kRest = 1e-10F;

  [[nodiscard]] static Vector shortWay(const Vector& difference) {
    if constexpr (N == 1) return Vector(wrapAngle(difference[0]));
    return difference;
  }

  [[nodiscard]] static Vector limited(const Vector& v, const Limit& limit) {
    if constexpr (N == 3) {
      const float scale = shortening(v.template head<2>(), limit.most);
      return {scale * v.x(), scale * v.y(), clamped(v.z(), limit.vertical)};
    } else if constexpr (N == 2) {
      return shortening(v, limit.most) * v;
    } else {
      return Vector(clamped(v[0], limit.most));
    }
  }

  float frequency_ = 0.0F;  ///< rad/s, of both poles; 0 is off
  Limit rateLimit_;
  Limit accelerationLimit_;
  Vector offset_ = Vector::Zero();
  Vector offsetRate_ = Vector::Zero();
  Vector lastValue_ = Vector::Zero();
  Vector lastRate_ = Vector::Zero();
};

/// How a reference attitude turns: of the tilt about forward and right, of the heading about down.
struct AttitudeMotion {
  Vector2f tiltRate = Vector2f::Zero();      ///< rad/s; yaw's rate is in the reference
  Vector3f acceleration = Vector3f::Zero();  ///< rad/s^2, what the filter makes
};

/// The filter of everything a reference holds. It starts where the aircraft is, as it moves.
class ReferenceFilter {
 public:
  explicit ReferenceFilter(const ReferenceFilterConfig& c)
      : position_(c.position, {c.speedHorizontal, c.speedVertical},
                  {c.acceleration, c.acceleration}),
        yaw_(c.yaw, {c.yawRate}, {c.yawAcceleration}),
        tilt_(c.tilt, {c.tiltRate}, {c.tiltAcceleration}) {}

  /// Starts anew at the next step.
  void restart() { started_ = false; }

  /// The reference of one control step; smooths what its mode controls.
  /// @param reference  position, velocity, acceleration, yaw and yaw rate are replaced
  /// @param halfHeading  of the reference's attitude, and is replaced; in Position by that of its
  /// yaw
  /// @param tilt  of the reference, as of tiltOf, and is replaced; not in Position
  AttitudeMotion follow(Reference& reference, SinCos& halfHeading, Vector2f& tilt,
                        const VehicleState& state, const SinCos& stateHalfHeading) {
    AttitudeMotion motion;
    const bool start = !started_ || mode_ != reference.mode;
    started_ = true;
    mode_ = reference.mode;
    if (position_.on() && mode_ != ReferenceMode::Attitude) {
      Reference& r = reference;
      if (start) {
        position_.start(r.positionNed, r.velocityNed, state.positionNed, state.velocityNed);
      }
      position_.follow(r.positionNed, r.velocityNed, r.accelerationNed);
    }
    if (yaw_.on()) {
      motion.acceleration.z() = followYaw(reference, halfHeading, state, stateHalfHeading, start);
    } else if (mode_ == ReferenceMode::Position) {
      halfHeading = sinCos(0.5F * reference.yaw);
      motion.acceleration.z() = reference.yawAcceleration;
    }
    if (tilt_.on() && mode_ != ReferenceMode::Position) {
      if (start) {
        tilt_.start(tilt, motion.tiltRate, tiltOf(state.attitude, stateHalfHeading),
                    state.rateBody.head<2>());
      }
      Vector2f acceleration = Vector2f::Zero();
      tilt_.follow(tilt, motion.tiltRate, acceleration);
      const float square = 0.25F * tilt.squaredNorm();  // rate is that of 2 sin(angle/2)
      if (square < 0.75F) motion.tiltRate /= squareRoot(1.0F - square);
      motion.acceleration.head<2>() = acceleration;
    }
    return motion;
  }

 private:
  float followYaw(Reference& reference, SinCos& halfHeading, const VehicleState& state,
                  const SinCos& stateHalfHeading, bool start) {
    using Angle = Eigen::Matrix<float, 1, 1>;
    // In Position the angle is given.
    if (mode_ != ReferenceMode::Position) reference.yaw = angleOf(halfHeading);
    Angle yaw(reference.yaw);
    Angle rate(reference.yawRate);
    if (start) {
      yaw_.start(yaw, rate, Angle(angleOf(stateHalfHeading)), Angle(state.rateBody.z()));
    }
    Angle acceleration(reference.yawAcceleration);
    yaw_.follow(yaw, rate, acceleration);
    reference.yaw = wrapAngle(yaw[0]);
    reference.yawRate = rate[0];
    halfHeading = sinCos(0.5F * reference.yaw);
    return acceleration[0];
  }

  [[nodiscard]] static float angleOf(const SinCos& half) {
    return wrapAngle(2.0F * arcTangent2(half.sin, half.cos));
  }

  SmoothReference<3> position_;
  SmoothReference<1> yaw_;
  SmoothReference<2> tilt_;
  ReferenceMode mode_ = ReferenceMode::Position;
  bool started_ = false;
};

}  // namespace strix
