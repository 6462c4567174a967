/// Lets GPS into the control loop gently.
#pragma once

#include "Mathpk.h"
#include "VehicleState.h"

namespace strix {

/// With fixes of 3 m the best estimate of the place moves by some 4 cm with each of them, ten times
/// a second and at random: right on the average, and nothing to jump after. So what a fix moves the
/// filter by is taken off again, and given back as a critically damped second order,
///     d'' = -2 w d' - w^2 d,    output = filter + (d, d')
/// with which place and velocity stay smooth, the one the derivative of the other. PX4's EKF2 and
/// ArduPilot's EKF3 have output predictors with gains of their own for this. Where fixes correct to
/// the same side for long, because an acceleration is measured wrong by a, d would grow to a / w^2:
/// it is bounded, and what is beyond comes in at once.
///
/// d'' is no motion of the aircraft, and known: the controller flies against it, so that the output
/// stays on the reference while the aircraft moves to where the fixes say it should be.
class CorrectionSmoother {
 public:
  /// @param timeConstant  1/w, s; 0: off    @param period  of advance(), s
  CorrectionSmoother(float timeConstant, float period)
      : frequency_(timeConstant > 0.0F ? 1.0F / timeConstant : 0.0F), period_(period) {}

  /// The output is the filter's.
  void clear() {
    position_.setZero();
    velocity_.setZero();
  }

  /// The filter was corrected from one state to another.
  void correct(const VehicleState& from, const VehicleState& to) {
    if (!(frequency_ > 0.0F)) return;
    position_ = bounded(position_ + (from.positionNed - to.positionNed).head<2>(), kMostPosition);
    velocity_ = bounded(velocity_ + (from.velocityNed - to.velocityNed).head<2>(), kMostVelocity);
  }

  /// One period.
  void advance() {
    velocity_ += period_ * acceleration();
    position_ += period_ * velocity_;
  }

  /// @param state  the filter's
  void apply(VehicleState& state) const {
    state.positionNed.head<2>() += position_;
    state.velocityNed.head<2>() += velocity_;
    state.correctionAcceleration = acceleration();
  }

  // What the output still keeps from the filter.
  [[nodiscard]] const Vector2f& position() const { return position_; }  ///< m
  [[nodiscard]] const Vector2f& velocity() const { return velocity_; }  ///< m/s

 private:
  // ours: some four times what fixes of 3 m and 0.3 m/s make of them with 0.7 s.
  static constexpr float kMostPosition = 0.5F;  ///< m
  static constexpr float kMostVelocity = 0.5F;  ///< m/s

  [[nodiscard]] Vector2f acceleration() const {
    return -frequency_ * (2.0F * velocity_ + frequency_ * position_);
  }

  [[nodiscard]] static Vector2f bounded(const Vector2f& v, float most) {
    const float square = v.squaredNorm();
    return square > most * most ? Vector2f((most / squareRoot(square)) * v) : v;
  }

  float frequency_;  ///< w, rad/s; 0: off
  float period_;     ///< s
  Vector2f position_ = Vector2f::Zero();
  Vector2f velocity_ = Vector2f::Zero();
};

}  // namespace strix
