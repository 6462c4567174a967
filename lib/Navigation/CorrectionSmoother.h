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
class CorrectionSmoother {
 public:
  using Level = Eigen::Matrix<float, 2, 1>;  ///< north, east

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
    velocity_ -= (period_ * frequency_) * (2.0F * velocity_ + frequency_ * position_);
    position_ += period_ * velocity_;
  }

  /// @param state  the filter's
  void apply(VehicleState& state) const {
    state.positionNed.head<2>() += position_;
    state.velocityNed.head<2>() += velocity_;
  }

  // What the output still keeps from the filter.
  [[nodiscard]] const Level& position() const { return position_; }  ///< m
  [[nodiscard]] const Level& velocity() const { return velocity_; }  ///< m/s

 private:
  // ours: some three times what fixes of 3 m and 0.3 m/s make of them with 2 s.
  static constexpr float kMostPosition = 1.0F;  ///< m
  static constexpr float kMostVelocity = 0.5F;  ///< m/s

  [[nodiscard]] static Level bounded(const Level& v, float most) {
    const float square = v.squaredNorm();
    return square > most * most ? Level((most / squareRoot(square)) * v) : v;
  }

  float frequency_;  ///< w, rad/s; 0: off
  float period_;     ///< s
  Level position_ = Level::Zero();
  Level velocity_ = Level::Zero();
};

}  // namespace strix
