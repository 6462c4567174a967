/// Linear-quadratic regulator of position, velocity, attitude and rate (DESIGN.md, 5).
#pragma once

#include <cstdint>

#include "Gains.h"
#include "Mathpk.h"
#include "Vehicle.h"

namespace strix {

/// Estimate minus reference, as the gain's columns are ordered. Positive: too far forward, right,
/// down; rolled right, nose up, nose right.
using ControlError = Eigen::Matrix<float, static_cast<int>(kErrorCount), 1>;

/// What a far reference may ask for. The horizontal limits are on the length of the error, so that
/// its direction is kept and no heading is favoured.
struct ControlLimits {
  float positionHorizontal = 2.0F;  ///< m
  float positionVertical = 1.0F;    ///< m
  float velocityHorizontal = 3.0F;  ///< m/s, above the speed at which the position limit balances
  float velocityVertical = 2.0F;    ///< m/s
  float acceleration = 3.0F;        ///< m/s^2, fed forward: 17 deg of tilt
  float yaw = 0.5F;                 ///< rad
  float cosTilt = 0.7F;             ///< thrust is raised for tilts up to 45 deg, by 1/0.7 at most
};

class Controller {
 public:
  static constexpr std::uint32_t kRateHz = 500;

  Controller(const Vehicle& vehicle, const Gains& gains, const ControlLimits& limits = {})
      : gains_(gains), limits_(limits), mass_(vehicle.mass) {}

  /// Forgets everything and starts the 500 Hz phase at `now`.
  void reset(Micros now) {
    task_.start(now);
    reference_ = {};
    attitudeReference_ = {};
    error_.setZero();
    control_ = Wrench::none();
    achieved_ = Wrench::none();
  }

  [[nodiscard]] bool due(Micros now) const { return task_.due(now); }

  /// One control step when it is due.
  /// @return true when getControl() is new
  bool updateControl(Micros now, const Reference& reference, const VehicleState& state) {
    if (!task_.run(now)) return false;
    if (!finite(reference, state)) {  // an estimate that is lost commands nothing
      ++invalid_;
      control_ = Wrench::none();
      return true;
    }
    updateRef(reference, state);
    updateError(state);

    std::array<float, kControlCount> u{nominalThrust_, 0.0F, 0.0F, 0.0F};  // u_nom
    for (std::size_t row = 0; row < kControlCount; ++row) {
      for (std::size_t column = 0; column < kErrorCount; ++column) {
        u[row] -= gains_.k[row][column] * error_[static_cast<Eigen::Index>(column)];
      }
    }
    // u[0] is the vertical force; thrust points along the tilted body axis.
    const float tilt = cosTilt(state.attitude);
    control_.thrust = u[0] / (tilt > limits_.cosTilt ? tilt : limits_.cosTilt);
    control_.torque = {u[1], u[2], u[3]};
    return true;
  }

  /// Takes the reference. Its attitude is at the reference yaw (approached at the limit when it is
  /// further away than that), and level but for the tilt that gives the reference acceleration.
  void updateRef(const Reference& reference, const VehicleState& state) {
    reference_ = reference;
    yaw_ = yawOf(state.attitude);
    const float yawReference = yaw_ + clamp(wrapAngle(reference.yaw - yaw_), limits_.yaw);
    // Thrust points along -z body: forward needs the nose down, to the right the right side down.
    const Vector3f a = limited(toHeading(reference.accelerationNed, yawReference),
                               limits_.acceleration, limits_.acceleration);
    attitudeReference_ = eulerToQuaternion(
        {arcTangent(a.y() / kGravity), -arcTangent(a.x() / kGravity), yawReference});
    nominalThrust_ = mass_ * (kGravity - a.z());
  }

  /// Errors of `state` from the reference last taken.
  void updateError(const VehicleState& state) {
    // K is designed at yaw 0: the horizontal errors are turned into the aircraft's own heading.
    const Vector3f position = limited(toHeading(state.positionNed - reference_.positionNed, yaw_),
                                      limits_.positionHorizontal, limits_.positionVertical);
    const Vector3f velocity = limited(toHeading(state.velocityNed - reference_.velocityNed, yaw_),
                                      limits_.velocityHorizontal, limits_.velocityVertical);
    // The reference turns about down, not about the body's z axis.
    const Vector3f rateReference = rotateToBody(state.attitude, {0.0F, 0.0F, reference_.yawRate});
    error_ << position, velocity, attitudeError(attitudeReference_, state.attitude),
        state.rateBody - rateReference;
  }

  /// The wrench wanted: thrust in N, torque in N m.
  [[nodiscard]] const Wrench& getControl() const { return control_; }

  /// Reports what the motors made of the wanted wrench.
  void setAchieved(const Wrench& achieved) { achieved_ = achieved; }

  [[nodiscard]] const Wrench& achieved() const { return achieved_; }
  [[nodiscard]] const ControlError& error() const { return error_; }
  [[nodiscard]] const Quaternion& attitudeReference() const { return attitudeReference_; }
  [[nodiscard]] const Gains& gains() const { return gains_; }
  [[nodiscard]] std::uint32_t overruns() const { return task_.overruns(); }
  /// Steps with NaN or infinity in the estimate or the reference.
  [[nodiscard]] std::uint32_t invalid() const { return invalid_; }

 private:
  [[nodiscard]] static float clamp(float value, float limit) {
    if (value > limit) return limit;
    return value < -limit ? -limit : value;
  }

  /// Shortens the horizontal part to `horizontal` and clamps the vertical part.
  [[nodiscard]] static Vector3f limited(const Vector3f& v, float horizontal, float vertical) {
    const float length = squareRoot(v.x() * v.x() + v.y() * v.y());
    const float scale = length > horizontal ? horizontal / length : 1.0F;
    return {scale * v.x(), scale * v.y(), clamp(v.z(), vertical)};
  }

  /// North, east, down to forward, right, down of the level frame at this heading, rad.
  [[nodiscard]] static Vector3f toHeading(const Vector3f& ned, float heading) {
    const SinCos h = sinCos(heading);
    return {h.cos * ned.x() + h.sin * ned.y(), -h.sin * ned.x() + h.cos * ned.y(), ned.z()};
  }

  [[nodiscard]] static bool finite(const Reference& r, const VehicleState& s) {
    return isFinite(s.attitude.w) && isFinite(s.attitude.vec()) && isFinite(s.positionNed) &&
           isFinite(s.velocityNed) && isFinite(s.rateBody) && isFinite(r.positionNed) &&
           isFinite(r.velocityNed) && isFinite(r.accelerationNed) && isFinite(r.yaw) &&
           isFinite(r.yawRate);
  }

  const Gains& gains_;
  ControlLimits limits_;
  float mass_;  ///< kg
  PeriodicTask task_{periodFromHz(kRateHz)};
  Reference reference_;
  Quaternion attitudeReference_;
  float yaw_ = 0.0F;            ///< rad, of the estimate
  float nominalThrust_ = 0.0F;  ///< N: what the reference needs if all is well
  ControlError error_ = ControlError::Zero();
  Wrench control_;
  Wrench achieved_;
  std::uint32_t invalid_ = 0;
};

}  // namespace strix
