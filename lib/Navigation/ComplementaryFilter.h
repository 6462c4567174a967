/// Attitude without a covariance: the gyro for the short term, gravity and field for the long one.
///
/// After the Ugglan drone, whose angles are (1 - k)(angle + rate dt) + k measured at every sample;
/// here for any attitude: the quaternion turns with the gyro and then, by k = dt/tau, about the
/// axis that brings the estimated direction onto the measured one. It shares no state with the
/// Kalman filter, so it can tell that one wrong, and stand in for it.
#pragma once

#include "Alignment.h"
#include "Mathpk.h"

namespace strix {

struct ComplementaryConfig {
  float tiltTime = 6.0F;      ///< s, in which gravity takes over from the gyro
  float headingTime = 10.0F;  ///< s, in which the field takes over
  float biasTime = 60.0F;     ///< s, in which a steady correction becomes gyro bias
  float gate = 1.5F;          ///< m/s^2: gravity is used when | |a| - g | is below it
};

class ComplementaryFilter {
 public:
  explicit ComplementaryFilter(const ComplementaryConfig& config) : config_(config) {}

  void initialize(const Alignment& alignment, float gravity) {
    attitude_ = alignment.attitude;
    reference_ = alignment.magReference;
    gravity_ = gravity;
    bias_.setZero();
  }

  /// Goes on from this attitude; the bias stays.
  void restart(const Quaternion& attitude) { attitude_ = attitude; }

  /// @param accel  specific force, m/s^2, body    @param gyro  rad/s, body    @param dt  s
  void update(const Vector3f& accel, const Vector3f& gyro, float dt) {
    attitude_ = renormalized(attitude_ * quaternionExp((gyro - bias_) * dt));
    const float length = accel.norm();
    if (!(length > gravity_ - config_.gate && length < gravity_ + config_.gate)) return;
    // At rest -accel points down: the turn from the estimated down to the measured one.
    const Vector3f error = downInBody(attitude_).cross(-accel) / length;
    correct(-error, dt, config_.tiltTime);
  }

  /// @param mag  uT, body    @param dt  s since the last field
  void updateHeading(const Vector3f& mag, float dt) {
    const Vector3f level = rotateToNed(attitude_, mag);
    const float sine = level.x() * reference_.y() - level.y() * reference_.x();
    const float cosine = level.x() * reference_.x() + level.y() * reference_.y();
    if (sine == 0.0F && cosine == 0.0F) return;
    correct(arcTangent2(sine, cosine) * downInBody(attitude_), dt, config_.headingTime);
  }

  [[nodiscard]] const Quaternion& attitude() const { return attitude_; }
  [[nodiscard]] const Vector3f& gyroBias() const { return bias_; }  ///< rad/s, body

 private:
  /// Turns by the part dt/tau of `turn`, rad, body.
  void correct(const Vector3f& turn, float dt, float tau) {
    const float part = dt < tau ? dt / tau : 1.0F;
    attitude_ = renormalized(attitude_ * quaternionExp(part * turn));
    bias_ -= (part / config_.biasTime) * turn;
  }

  ComplementaryConfig config_;
  Quaternion attitude_;
  Vector3f reference_ = Vector3f::Zero();
  Vector3f bias_ = Vector3f::Zero();
  float gravity_ = kGravity;
};

}  // namespace strix
