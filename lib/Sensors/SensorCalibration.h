/// What is known of each sensor before power-up: how it is mounted and what it adds to the truth.
#pragma once

#include "Vector3f.h"

namespace strix {

/// body = sensorToBody accelScale (raw - accelBias)
struct ImuCalibration {
  Matrix3f sensorToBody = Matrix3f::Identity();  ///< a rotation: +1 determinant
  Matrix3f accelScale = Matrix3f::Identity();    ///< scale and skew, symmetric: it turns nothing
  Vector3f accelBias = Vector3f::Zero();         ///< m/s^2, sensor axes
};

/// body = sensorToBody softIron (raw - hardIron - perThrottle throttle)
struct MagCalibration {
  /// May be a reflection (determinant -1): the LIS2MDL's axes are left-handed.
  Matrix3f sensorToBody = Matrix3f::Identity();
  Vector3f hardIron = Vector3f::Zero();  ///< uT, sensor axes
  Matrix3f softIron = Matrix3f::Identity();
  Vector3f perThrottle =
      Vector3f::Zero();  ///< uT, sensor axes: the motors' current at full throttle
};

/// True when m turns vectors without stretching them: m m^T = I within 1e-4 (a matrix typed with
/// four digits), and its determinant is +1, or -1 where a reflection is declared.
[[nodiscard]] inline bool isMounting(const Matrix3f& m, bool reflectionAllowed) {
  if (!isFinite(m)) return false;  // Eigen's maxCoeff may step over a NaN
  if (!((m * m.transpose() - Matrix3f::Identity()).cwiseAbs().maxCoeff() < 1e-4F)) return false;
  const float determinant = m.row(0).dot(m.row(1).cross(m.row(2)));
  return determinant > 0.0F || reflectionAllowed;
}

}  // namespace strix
