/// The filter's equations once more, in double precision and with dense matrices: what the tests
/// compare ESKF.h with. Written from DESIGN.md section 4, not from the header. Matrices have their
/// size at run time: that compiles in a tenth of the time.
#pragma once

#include <unity.h>

#include "ESKF.h"

#include <Eigen/Cholesky>
#include <vector>

// Compiled once for the whole suite, in test_main.cpp.
extern template class strix::ESKF<9>;
extern template class strix::ESKF<18>;

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Vector3d = Eigen::Vector3d;
using Matrix3d = Eigen::Matrix3d;
using Quaterniond = Eigen::Quaterniond;  // body to NED

constexpr double kG = 9.80665;
constexpr double kDeg = 3.14159265358979323846 / 180.0;

/// The tuning of these tests: what they check does not move when a default does. Every bias lives.
inline strix::NavigationConfig testConfig() {
  strix::NavigationConfig c;
  c.accelNoise = 0.05F;
  c.gyroNoise = 0.004F;
  c.accelBiasWalk = 0.001F;
  c.gyroBiasWalk = 3e-5F;
  c.magBiasWalk = 0.01F;
  c.tilt = {0.05F, 0.25F};
  c.tiltGate = 0.5F;
  c.magFusion = strix::MagFusion::ThreeAxis;
  c.mag = {0.5F, 1.25F};
  c.heading = {0.0F, 0.1F};
  c.alt = {0.3F, 0.0F};
  c.gpsPositionSigma = 3.0F;
  c.gpsVelocitySigma = 0.3F;
  c.standstillSigma = 0.05F;
  c.nisGate = 6.635F;
  c.readmitAfter = 1'000'000;
  c.positionSigma0 = 0.5F;
  c.velocitySigma0 = 0.1F;
  c.tiltSigma0 = 0.03F;
  c.headingSigma0 = 0.1F;
  c.accelBiasSigma0 = 0.1F;
  c.gyroBiasSigma0 = 0.003F;
  c.magBiasSigma0 = 1.0F;
  return c;
}

inline Quaterniond toDouble(const strix::Quaternion& q) {
  return Quaterniond(static_cast<double>(q.w), static_cast<double>(q.x), static_cast<double>(q.y),
                     static_cast<double>(q.z));
}

template <int N>
MatrixXd toDouble(const Eigen::Matrix<float, N, N>& m) {
  return m.template cast<double>();
}

template <std::size_t N>
VectorXd toDouble(const std::array<float, N>& v) {
  return Eigen::Map<const Eigen::VectorXf>(v.data(), static_cast<Eigen::Index>(N)).cast<double>();
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

/// F of d(dx)/dt = F dx with 9 or 18 states.
/// @param q  body to NED    @param force  m/s^2, body    @param rate  rad/s, body
inline MatrixXd systemMatrix(int states, const Quaterniond& q, const Vector3d& force,
                             const Vector3d& rate) {
  const Matrix3d toNed = q.toRotationMatrix();
  MatrixXd f = MatrixXd::Zero(states, states);
  f.block<3, 3>(0, 3).setIdentity();
  f.block<3, 3>(3, 6) = -toNed * cross(force);
  f.block<3, 3>(6, 6) = -cross(rate);
  if (states == 18) {
    f.block<3, 3>(3, 9) = -toNed;
    f.block<3, 3>(6, 12) = -Matrix3d::Identity();
  }
  return f;
}

/// Q_c: white noise on v and alpha, random walks of the biases.
inline MatrixXd noiseDensity(int states, const strix::NavigationConfig& config) {
  const std::array<float, 6> sigma = {0.0F,
                                      config.accelNoise,
                                      config.gyroNoise,
                                      config.accelBiasWalk,
                                      config.gyroBiasWalk,
                                      config.magBiasWalk};
  VectorXd diagonal(states);
  for (int i = 0; i < states; ++i) {
    const auto s = static_cast<double>(sigma[static_cast<std::size_t>(i / 3)]);
    diagonal(i) = s * s;
  }
  return diagonal.asDiagonal();
}

/// Integral of (I + F s) Q_c (I + F s)^T ds over dt by Simpson's rule: exact, it is a parabola.
inline MatrixXd processNoise(const MatrixXd& f, const MatrixXd& qc, double dt) {
  const auto integrand = [&](double s) -> MatrixXd {
    const MatrixXd phi = MatrixXd::Identity(f.rows(), f.rows()) + f * s;
    return phi * qc * phi.transpose();
  };
  return dt / 6.0 * (integrand(0.0) + 4.0 * integrand(0.5 * dt) + integrand(dt));
}

/// By how much predict's trapezoidal rule makes too much of Q_d: F Q_c F^T dt^3/6
/// (ErrorDynamics.h).
inline MatrixXd trapezoidalExcess(const MatrixXd& f, const MatrixXd& qc, double dt) {
  return dt * dt * dt / 6.0 * (f * qc * f.transpose());
}

/// dx and P after measurements.
struct Posterior {
  VectorXd error;
  MatrixXd covariance;
};

/// The scalars of one loop pass as the textbook sees them: H, z - h(x) and R, row by row.
struct Batch {
  std::vector<VectorXd> rows;
  std::vector<double> innovations;
  std::vector<double> variances;

  void add(const VectorXd& row, double innovation, double variance) {
    rows.push_back(row);
    innovations.push_back(innovation);
    variances.push_back(variance);
  }

  /// A direction seen in the body: H_alpha = [R ref x], and its sensor's bias where there is one.
  /// @param bias  first state of that bias
  void addDirection(int states, int bias, const Vector3d& measured, const Vector3d& predicted,
                    double variance) {
    const Matrix3d h = cross(predicted);
    for (int axis = 0; axis < 3; ++axis) {
      VectorXd row = VectorXd::Zero(states);
      row.segment<3>(6) = h.row(axis).transpose();
      if (bias < states) row(bias + axis) = 1.0;
      add(row, measured(axis) - predicted(axis), variance);
    }
  }

  /// The textbook update with a dense gain, from dx = 0.
  [[nodiscard]] Posterior update(const MatrixXd& p) const {
    const auto n = static_cast<Eigen::Index>(rows.size());
    MatrixXd h(n, p.rows());
    for (Eigen::Index i = 0; i < n; ++i) h.row(i) = rows[static_cast<std::size_t>(i)].transpose();
    const VectorXd r = Eigen::Map<const VectorXd>(variances.data(), n);
    const VectorXd z = Eigen::Map<const VectorXd>(innovations.data(), n);
    const MatrixXd ph = p * h.transpose();
    const MatrixXd s = h * ph + MatrixXd(r.asDiagonal());
    const MatrixXd gain = s.llt().solve(ph.transpose()).transpose();
    return {gain * z, p - gain * ph.transpose()};
  }
};

/// Largest difference of two covariances, each element relative to sqrt(P_ii P_jj). What `known`
/// explains of it is not counted.
inline double relativeDifference(const MatrixXd& expected, const MatrixXd& found,
                                 const MatrixXd& known) {
  double worst = 0.0;
  for (int i = 0; i < expected.rows(); ++i) {
    for (int j = 0; j < expected.rows(); ++j) {
      const double difference = std::abs(expected(i, j) - found(i, j)) - std::abs(known(i, j));
      if (difference <= 0.0) continue;
      const double relative = difference / std::sqrt(expected(i, i) * expected(j, j));
      if (!(relative <= worst)) worst = relative;  // NaN stays
    }
  }
  return worst;
}
inline double relativeDifference(const MatrixXd& expected, const MatrixXd& found) {
  return relativeDifference(expected, found, MatrixXd::Zero(expected.rows(), expected.rows()));
}

/// Largest difference of two blocks of three by three, relative to the norm of the expected one:
/// for small blocks between large ones. A block that should be zero must be.
inline double blockDifference(const MatrixXd& expected, const MatrixXd& found) {
  double worst = 0.0;
  for (int i = 0; i < expected.rows(); i += 3) {
    for (int j = 0; j < expected.rows(); j += 3) {
      const Matrix3d wanted = expected.block<3, 3>(i, j);
      const Matrix3d difference = found.block<3, 3>(i, j) - wanted;
      if (difference.isZero(0.0)) continue;
      const double relative = difference.norm() / wanted.norm();
      if (!(relative <= worst)) worst = relative;
    }
  }
  return worst;
}

/// Symmetric to the bit, and Cholesky's decomposition succeeds. A state that is known exactly has a
/// row of zeros, which is left out.
template <int N>
bool isCovariance(const Eigen::Matrix<float, N, N>& p) {
  if (p != p.transpose()) return false;
  std::vector<int> unsure;
  for (int i = 0; i < N; ++i) {
    if (p(i, i) == 0.0F && p.col(i).isZero(0.0F)) continue;
    unsure.push_back(i);
  }
  const auto n = static_cast<Eigen::Index>(unsure.size());
  MatrixXd left(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      left(i, j) = static_cast<double>(
          p(unsure[static_cast<std::size_t>(i)], unsure[static_cast<std::size_t>(j)]));
    }
  }
  return left.llt().info() == Eigen::Success;
}

/// No bit of state, biases, dx or P differs.
template <int States>
bool same(const strix::ESKF<States>& a, const strix::ESKF<States>& b) {
  const strix::VehicleState& s = a.state();
  const strix::VehicleState& t = b.state();
  return s.positionNed == t.positionNed && s.velocityNed == t.velocityNed &&
         s.attitude.w == t.attitude.w && s.attitude.vec() == t.attitude.vec() &&
         a.accelBias() == b.accelBias() && a.gyroBias() == b.gyroBias() &&
         a.magBias() == b.magBias() && a.error() == b.error() &&
         a.packedCovariance().elements() == b.packedCovariance().elements();
}

/// A filter at rest with a known attitude, before its first sample.
template <int States>
strix::ESKF<States> filterAt(const Quaterniond& q, const strix::Vector3f& magReference,
                             const strix::NavigationConfig& config = testConfig()) {
  strix::ESKF<States> filter(config);
  filter.initialize({toFloat(q), magReference}, strix::kGravity);
  return filter;
}

/// Specific force of a body at rest, m/s^2.
inline Vector3d restForce(const Quaterniond& q) { return q.conjugate() * Vector3d(0.0, 0.0, -kG); }
