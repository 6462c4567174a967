/// Vectors of the plane and of space, and the cross-product matrix.
#pragma once

#include "EigenCore.h"

namespace strix {

using Vector2f = Eigen::Matrix<float, 2, 1>;
using Vector3f = Eigen::Matrix<float, 3, 1>;
using Matrix3f = Eigen::Matrix<float, 3, 3>;

/// Cross-product matrix: skew(a) b = a x b. Sola (2017), eq. 73.
[[nodiscard]] inline Matrix3f skew(const Vector3f& a) {
  Matrix3f s;
  s << 0.0F, -a.z(), a.y(),  //
      a.z(), 0.0F, -a.x(),   //
      -a.y(), a.x(), 0.0F;
  return s;
}

/// False for NaN and infinity: NaN - NaN and inf - inf are NaN.
[[nodiscard]] constexpr bool isFinite(float value) { return value - value == 0.0F; }

/// True when no element is NaN or infinite.
template <class Derived>
[[nodiscard]] bool isFinite(const Eigen::MatrixBase<Derived>& m) {
  for (Eigen::Index i = 0; i < m.size(); ++i) {
    if (!isFinite(m.derived().coeff(i))) return false;
  }
  return true;
}

}  // namespace strix
