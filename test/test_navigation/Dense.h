/// The filter's equations once more, in double precision and with dense matrices: what the tests
/// compare ESKF.h with. Written from DESIGN.md section 4, not from the header.
#pragma once

#include <unity.h>

#include "ESKF.h"

#include <Eigen/Cholesky>

using Vector3d = Eigen::Vector3d;
using Matrix3d = Eigen::Matrix3d;
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Quaterniond = Eigen::Quaterniond;  // body to NED

constexpr double kG = 9.80665;
constexpr double kDeg = 3.14159265358979323846 / 180.0;

inline Quaterniond toDouble(const strix::Quaternion& q) {
  return Quaterniond(static_cast<double>(q.w), static_cast<double>(q.x), static_cast<double>(q.y),
                     static_cast<double>(q.z));
}

inline strix::Quaternion toFloat(const Quaterniond& q) {
  return {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
          static_cast<float>(q.z())};
}

inline strix::Vector3f toFloat(const Vector3d& v) { return v.cast<float>(); }

/// Yaw about down, then pitch, then roll, in deg.
inline Quaterniond fromEuler(double rollDeg, double pitchDeg, double yawDeg) {
  return Quaterniond(Eigen::AngleAxisd(yawDeg * kDeg, Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(pitchDeg * kDeg, Vector3d::UnitY()) *
                     Eigen::AngleAxisd(rollDeg * kDeg, Vector3d::UnitX()));
}

inline Quaterniond expOf(const Vector3d& rotation) {
  const double angle = rotation.norm();
  return angle == 0.0 ? Quaterniond::Identity()
                      : Quaterniond(Eigen::AngleAxisd(angle, rotation / angle));
}

/// Angle of the rotation from a to b, deg. Near zero the vector part keeps the digits that the
/// scalar part loses.
inline double angleDeg(const Quaterniond& a, const Quaterniond& b) {
  return 2.0 * std::asin(std::min(1.0, (a.conjugate() * b).vec().norm())) / kDeg;
}

/// Angle between the two attitudes' verticals, deg.
inline double tiltBetweenDeg(const Quaterniond& a, const Quaterniond& b) {
  const Vector3d down = Vector3d::UnitZ();
  return std::asin((a.conjugate() * down).cross(b.conjugate() * down).norm()) / kDeg;
}

/// Angle about the vertical from `truth` to `estimate`, deg.
inline double headingBetweenDeg(const Quaterniond& truth, const Quaterniond& estimate) {
  const Quaterniond e = estimate * truth.conjugate();
  return 2.0 * std::atan(e.z() / e.w()) / kDeg;
}

inline Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// F of d(dx)/dt = F dx: dp' = dv, dv' = -R^T [f x] alpha, alpha' = -[w x] alpha.
inline Matrix9d systemMatrix(const Quaterniond& q, const Vector3d& accel, const Vector3d& gyro) {
  Matrix9d f = Matrix9d::Zero();
  f.block<3, 3>(0, 3).setIdentity();
  f.block<3, 3>(3, 6) = -q.toRotationMatrix() * cross(accel);
  f.block<3, 3>(6, 6) = -cross(gyro);
  return f;
}

/// Integral of (I + F s) Q_c (I + F s)^T ds over dt by Simpson's rule: exact, it is a cubic.
inline Matrix9d processNoise(const Matrix9d& f, double accelNoise, double gyroNoise, double dt) {
  Matrix9d qc = Matrix9d::Zero();
  qc.block<3, 3>(3, 3).diagonal().setConstant(accelNoise * accelNoise);
  qc.block<3, 3>(6, 6).diagonal().setConstant(gyroNoise * gyroNoise);
  const auto integrand = [&](double s) -> Matrix9d {
    const Matrix9d phi = Matrix9d::Identity() + f * s;
    return phi * qc * phi.transpose();
  };
  return dt / 6.0 * (integrand(0.0) + 4.0 * integrand(0.5 * dt) + integrand(dt));
}

/// dx and P after a batch of scalars z = H dx + v: the textbook update with a dense gain.
struct Posterior {
  Vector9d error;
  Matrix9d covariance;
};

inline Posterior batchUpdate(const Matrix9d& p, const Eigen::MatrixXd& h,
                             const Eigen::VectorXd& innovation, const Eigen::VectorXd& variance) {
  const Eigen::MatrixXd r = variance.asDiagonal();
  const Eigen::MatrixXd s = h * p * h.transpose() + r;
  const Eigen::MatrixXd gain =
      p * h.transpose() * s.llt().solve(Eigen::MatrixXd::Identity(s.rows(), s.rows()));
  return {gain * innovation, (Matrix9d::Identity() - gain * h) * p};
}

/// Largest difference of two covariances, each element relative to sqrt(P_ii P_jj).
inline double relativeDifference(const Matrix9d& expected, const strix::Matrix9f& found) {
  double worst = 0.0;
  for (int i = 0; i < 9; ++i) {
    for (int j = 0; j < 9; ++j) {
      const double scale = std::sqrt(expected(i, i) * expected(j, j));
      const double difference = std::abs(expected(i, j) - static_cast<double>(found(i, j)));
      worst = std::max(worst, difference / scale);
    }
  }
  return worst;
}

/// Symmetric to the bit, and Cholesky's decomposition succeeds.
inline bool isCovariance(const strix::Matrix9f& p) {
  if (p != p.transpose()) return false;
  return p.cast<double>().eval().llt().info() == Eigen::Success;
}

/// A filter at rest with a known attitude, before its first sample.
inline strix::ESKF filterAt(const Quaterniond& q, const strix::Vector3f& magReference,
                            const strix::NavigationConfig& config = {}) {
  strix::ESKF filter(config);
  filter.initialize({toFloat(q), magReference}, strix::kGravity);
  return filter;
}

/// Specific force of a body at rest, m/s^2.
inline Vector3d restForce(const Quaterniond& q) { return q.conjugate() * Vector3d(0.0, 0.0, -kG); }
