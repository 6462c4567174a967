/// Where the aircraft goes when no IMU says so any more: the rigid body under the wrench that its
/// motors give. Good for seconds, as long as the wind and the aircraft stay as they were.
#pragma once

#include <array>

#include "Mathpk.h"
#include "Vehicle.h"
#include "VehicleState.h"

namespace strix {

/// What steady flight needed - torque against a shifted mass, thrust against the weight, tilt
/// against the wind - is kept as a slow mean while the IMU lives, and taken off: at rest the model
/// stays at rest.
class ModelFlight {
 public:
  using WrenchRows = std::array<float, 4>;  ///< thrust N; torque N m, body

  explicit ModelFlight(const Vehicle& vehicle)
      : inertia_(vehicle.inertia[0], vehicle.inertia[1], vehicle.inertia[2]),
        hoverThrust_(vehicle.mass * kGravity),
        thrust_(hoverThrust_) {}

  /// On the ground: nothing is known of the next flight.
  void reset() {
    torque_.setZero();
    wind_.setZero();
    thrust_ = hoverThrust_;
  }

  /// In each control tick of a flight with an IMU.
  void observe(const WrenchRows& wrench, const VehicleState& estimate, float dt) {
    const Vector3f up = rotateToNed(estimate.attitude, {0.0F, 0.0F, -1.0F});  // of the thrust
    const Vector3f& v = estimate.velocityNed;
    const bool steady = up.z() < -kLevel && v.z() < kSlow && v.z() > -kSlow &&
                        estimate.rateBody.squaredNorm() < kStill * kStill && wrench[0] > 0.0F;
    if (!steady) return;
    const float share = dt / kMean;
    thrust_ += share * (wrench[0] * -up.z() - thrust_);
    torque_ += share * (Vector3f{wrench[1], wrench[2], wrench[3]} - torque_);
    const float specific = kGravity * wrench[0] / thrust_;
    wind_ += share * (specific * up.head<2>() - wind_);
  }

  /// From the last estimate that an IMU was part of.
  void start(const VehicleState& estimate) {
    state_ = estimate;
    below_ = 0.0F;
  }

  /// One control period further, under this wrench.
  const VehicleState& update(const WrenchRows& wrench, float dt) {
    const Vector3f torque = Vector3f{wrench[1], wrench[2], wrench[3]} - torque_;
    Vector3f& w = state_.rateBody;
    const Vector3f spin = inertia_.cwiseProduct(w);
    w += dt * (torque - w.cross(spin)).cwiseQuotient(inertia_);
    state_.attitude = normalized(state_.attitude * quaternionExp(w * dt));
    const Vector3f up = rotateToNed(state_.attitude, {0.0F, 0.0F, -1.0F});
    Vector3f a = (kGravity * wrench[0] / thrust_) * up;
    a.z() += kGravity;
    a.head<2>() -= wind_;
    state_.positionNed += dt * state_.velocityNed + (0.5F * dt * dt) * a;
    state_.velocityNed += dt * a;
    below_ = state_.positionNed.z() > 0.0F ? below_ + dt : 0.0F;
    return state_;
  }

  [[nodiscard]] const VehicleState& state() const { return state_; }

  /// The model is on the ground, or is not to be believed any more.
  [[nodiscard]] bool over() const {
    return below_ > kDown || !(cosTilt(state_.attitude) > kBelieved) ||
           !isFinite(state_.positionNed);
  }

 private:
  static constexpr float kMean = 2.0F;      ///< s
  static constexpr float kLevel = 0.94F;    ///< cosine of 20 deg
  static constexpr float kSlow = 0.5F;      ///< m/s
  static constexpr float kStill = 0.5F;     ///< rad/s
  static constexpr float kBelieved = 0.7F;  ///< cosine of 45 deg
  static constexpr float kDown = 0.3F;      ///< s below the ground of the start

  Vector3f inertia_;                    ///< kg m^2, diagonal
  float hoverThrust_;                   ///< N, of the vehicle file
  float thrust_;                        ///< N that carries the aircraft
  Vector3f torque_ = Vector3f::Zero();  ///< N m that keeps it from turning
  Vector2f wind_ = Vector2f::Zero();    ///< m/s^2 that keep it in place, north and east
  VehicleState state_;
  float below_ = 0.0F;  ///< s
};

}  // namespace strix
