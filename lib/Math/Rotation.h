/// Rotation matrices and Euler angles. Every conversion between attitude forms is here.
#pragma once

#include "Quaternion.h"

namespace strix {

/// NED-to-body matrix of a body-to-NED unit quaternion: v_body = q2R(q) v_ned. It is the transpose
/// of Sola (2017), eq. 115.
[[nodiscard]] inline Matrix3f q2R(const Quaternion& q) {
  const float xx = q.x * q.x;
  const float yy = q.y * q.y;
  const float zz = q.z * q.z;
  const float xy = q.x * q.y;
  const float xz = q.x * q.z;
  const float yz = q.y * q.z;
  const float wx = q.w * q.x;
  const float wy = q.w * q.y;
  const float wz = q.w * q.z;
  Matrix3f r;
  r << 1.0F - 2.0F * (yy + zz), 2.0F * (xy + wz), 2.0F * (xz - wy),  //
      2.0F * (xy - wz), 1.0F - 2.0F * (xx + zz), 2.0F * (yz + wx),   //
      2.0F * (xz + wy), 2.0F * (yz - wx), 1.0F - 2.0F * (xx + yy);
  return r;
}

/// Inverse of q2R. Takes the largest of |w|, |x|, |y|, |z| as pivot, so no turn is ill-conditioned
/// (S. W. Shepperd, 1978).
/// @param r  NED-to-body rotation matrix
[[nodiscard]] inline Quaternion R2q(const Matrix3f& r) {
  const float trace = r(0, 0) + r(1, 1) + r(2, 2);
  Quaternion q;
  if (trace >= r(0, 0) && trace >= r(1, 1) && trace >= r(2, 2)) {
    q = {1.0F + trace, r(1, 2) - r(2, 1), r(2, 0) - r(0, 2), r(0, 1) - r(1, 0)};
  } else if (r(0, 0) >= r(1, 1) && r(0, 0) >= r(2, 2)) {
    q = {r(1, 2) - r(2, 1), 1.0F + r(0, 0) - r(1, 1) - r(2, 2), r(0, 1) + r(1, 0),
         r(0, 2) + r(2, 0)};
  } else if (r(1, 1) >= r(2, 2)) {
    q = {r(2, 0) - r(0, 2), r(0, 1) + r(1, 0), 1.0F - r(0, 0) + r(1, 1) - r(2, 2),
         r(1, 2) + r(2, 1)};
  } else {
    q = {r(0, 1) - r(1, 0), r(0, 2) + r(2, 0), r(1, 2) + r(2, 1),
         1.0F - r(0, 0) - r(1, 1) + r(2, 2)};
  }
  return shortest(normalized(q));
}

/// Body vector to NED: q v q*.
[[nodiscard]] inline Vector3f rotateToNed(const Quaternion& q, const Vector3f& vBody) {
  const Vector3f t = 2.0F * q.vec().cross(vBody);
  return vBody + q.w * t + q.vec().cross(t);
}

/// NED vector to body: q* v q.
[[nodiscard]] inline Vector3f rotateToBody(const Quaternion& q, const Vector3f& vNed) {
  return rotateToNed(conjugate(q), vNed);
}

/// Down in the body frame: the last column of q2R(q).
[[nodiscard]] inline Vector3f downInBody(const Quaternion& q) {
  return {2.0F * (q.x * q.z - q.w * q.y), 2.0F * (q.y * q.z + q.w * q.x),
          1.0F - 2.0F * (q.x * q.x + q.y * q.y)};
}

/// Aerospace angles in rad: yaw about down, then pitch about right, then roll about forward.
struct EulerAngles {
  float roll = 0.0F;   ///< positive: right side down
  float pitch = 0.0F;  ///< positive: nose up
  float yaw = 0.0F;    ///< positive: nose to the right (clockwise from above), zero at north
};

[[nodiscard]] inline Quaternion eulerToQuaternion(const EulerAngles& e) {
  const SinCos r = sinCos(0.5F * e.roll);
  const SinCos p = sinCos(0.5F * e.pitch);
  const SinCos y = sinCos(0.5F * e.yaw);
  return Quaternion{y.cos, 0.0F, 0.0F, y.sin} * Quaternion{p.cos, 0.0F, p.sin, 0.0F} *
         Quaternion{r.cos, r.sin, 0.0F, 0.0F};
}

/// Heading of the body x axis, rad in (-pi, pi].
[[nodiscard]] inline float yawOf(const Quaternion& q) {
  return arcTangent2(2.0F * (q.w * q.z + q.x * q.y), 1.0F - 2.0F * (q.y * q.y + q.z * q.z));
}

[[nodiscard]] inline EulerAngles quaternionToEuler(const Quaternion& q) {
  return {arcTangent2(2.0F * (q.w * q.x + q.y * q.z), 1.0F - 2.0F * (q.x * q.x + q.y * q.y)),
          arcSine(2.0F * (q.w * q.y - q.z * q.x)), yawOf(q)};
}

/// Cosine of the angle between the body z axis and down: 1 level, 0 on its side, -1 inverted.
[[nodiscard]] inline float cosTilt(const Quaternion& q) {
  return 1.0F - 2.0F * (q.x * q.x + q.y * q.y);
}

}  // namespace strix
