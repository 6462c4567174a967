/// A quadcopter as a rigid body with four lagging rotors, in still air and without a ground, for
/// tests that close the loop. In double precision; shares the airframe's numbers with the flight
/// code and no formula.
#pragma once

#include <Vehicle.h>
#include <VehicleState.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

class RigidQuad {
 public:
  /// Hovers at rest in the origin, with its nose at `yaw`, rad.
  RigidQuad(const strix::Vehicle& vehicle, double yaw)
      : vehicle_(vehicle), attitude_(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())) {
    speeds_.fill(std::sqrt(vehicle.mass * kGravity / (4.0 * vehicle.thrustConstant)));
  }

  void step(const strix::EscCommands& commands, double dt) {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque = torqueBody;
    for (std::size_t i = 0; i < 4; ++i) {
      speeds_[i] += (speedOf(commands[i]) - speeds_[i]) * (1.0 - std::exp(-dt / lag()));
      const double square = speeds_[i] * speeds_[i];
      const strix::Rotor& rotor = vehicle_.rotors[i];
      const Eigen::Vector3d pull(0.0, 0.0, -vehicle_.thrustConstant * square);
      force += pull;
      torque += Eigen::Vector3d(rotor.x, rotor.y, 0.0).cross(pull);
      // Clockwise from above is positive about z, down; the air's drag on the propeller is not.
      torque.z() +=
          (rotor.spin == strix::Spin::Clockwise ? -1.0 : 1.0) * vehicle_.torqueConstant * square;
    }
    const Eigen::Vector3d inertia(vehicle_.inertia[0], vehicle_.inertia[1], vehicle_.inertia[2]);
    const Eigen::Vector3d momentum = inertia.cwiseProduct(rate);
    rate += dt * (torque - rate.cross(momentum)).cwiseQuotient(inertia);
    force = attitude_ * force + forceNed;
    velocity += dt * (force / vehicle_.mass + Eigen::Vector3d(0.0, 0.0, kGravity));
    position += dt * velocity;
    const double angle = rate.norm() * dt;
    if (angle > 0.0) attitude_ = attitude_ * Eigen::AngleAxisd(angle, rate.normalized());
    attitude_.normalize();
  }

  /// What a perfect estimator would say.
  [[nodiscard]] strix::VehicleState state() const {
    const Eigen::Quaternionf q = attitude_.cast<float>();
    return {position.cast<float>(),
            velocity.cast<float>(),
            {q.w(), q.x(), q.y(), q.z()},
            rate.cast<float>()};
  }

  [[nodiscard]] const Eigen::Quaterniond& attitude() const { return attitude_; }

  /// rad from upright
  [[nodiscard]] double tilt() const {
    return std::acos(std::min(1.0, (attitude_ * Eigen::Vector3d::UnitZ()).z()));
  }

  /// rad, clockwise from north
  [[nodiscard]] double yaw() const {
    const Eigen::Vector3d nose = attitude_ * Eigen::Vector3d::UnitX();
    return std::atan2(nose.y(), nose.x());
  }

  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, NED
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s, NED
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();      ///< rad/s, FRD
  // What disturbs it.
  Eigen::Vector3d forceNed = Eigen::Vector3d::Zero();    ///< N
  Eigen::Vector3d torqueBody = Eigen::Vector3d::Zero();  ///< N m, FRD

 private:
  static constexpr double kGravity = 9.80665;

  [[nodiscard]] double lag() const { return vehicle_.motorTimeConstant; }

  [[nodiscard]] double speedOf(float command) const {
    const strix::CommandCurve& c = vehicle_.command;
    if (!(command > vehicle_.commandOff) || command < c.offset) return 0.0;
    const double above = static_cast<double>(command) - c.offset;
    return c.quadratic == 0.0F ? above / c.linear : std::sqrt(above / c.quadratic);
  }

  const strix::Vehicle& vehicle_;
  std::array<double, 4> speeds_{};
  Eigen::Quaterniond attitude_;  ///< body to NED
};
