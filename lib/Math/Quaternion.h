/// Hamilton quaternions, stored [w x y z], that rotate body vectors into NED (DESIGN.md, 2).
#pragma once

#include "Deterministic.h"
#include "Vector3f.h"

namespace strix {

/// Unit quaternion q with v_ned = q v_body q*. Default is the identity.
struct Quaternion {
  float w = 1.0F;
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;

  /// Vector part, [x y z].
  [[nodiscard]] Vector3f vec() const { return {x, y, z}; }
};

/// Inverse rotation of a unit quaternion.
[[nodiscard]] inline Quaternion conjugate(const Quaternion& q) { return {q.w, -q.x, -q.y, -q.z}; }

/// Hamilton product p (x) q. Sola (2017), eq. 12.
[[nodiscard]] inline Quaternion operator*(const Quaternion& p, const Quaternion& q) {
  return {
      p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
      p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}

[[nodiscard]] inline float norm(const Quaternion& q) {
  return squareRoot(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
}

/// q scaled to length one. A zero or non-finite quaternion gives the identity.
[[nodiscard]] inline Quaternion normalized(const Quaternion& q) {
  const float length = norm(q);
  if (!(length > 0.0F) || !isFinite(length)) return {};
  const float s = 1.0F / length;
  return {q.w * s, q.x * s, q.y * s, q.z * s};
}

/// The one of q and -q (the same rotation) with w >= 0: the short way round.
[[nodiscard]] inline Quaternion shortest(const Quaternion& q) {
  return q.w < 0.0F ? Quaternion{-q.w, -q.x, -q.y, -q.z} : q;
}

/// Rotation vector to unit quaternion, q = [cos(a/2), sin(a/2) v/a], a = |v|.
/// Second-order series below 1e-3 rad: its error a^4/384 is under one float ulp.
/// Sola (2017), eq. 101.
/// @param v  rotation vector, rad
[[nodiscard]] inline Quaternion quaternionExp(const Vector3f& v) {
  const float angle2 = v.squaredNorm();
  if (angle2 < 1e-6F) {
    const float s = 0.5F - angle2 * (1.0F / 48.0F);
    return {1.0F - angle2 * 0.125F, s * v.x(), s * v.y(), s * v.z()};
  }
  const float angle = squareRoot(angle2);
  const SinCos half = sinCos(0.5F * angle);
  const float s = half.sin / angle;
  return {half.cos, s * v.x(), s * v.y(), s * v.z()};
}

/// Unit quaternion to rotation vector in rad, |v| <= pi: the inverse of quaternionExp.
/// Sola (2017), eq. 103.
[[nodiscard]] inline Vector3f quaternionLog(const Quaternion& q) {
  const Quaternion s = shortest(q);
  const float sineHalf = s.vec().norm();
  if (sineHalf < 1e-4F) return 2.0F * s.vec();
  return (2.0F * arcTangent2(sineHalf, s.w) / sineHalf) * s.vec();
}

/// Small-angle correction applied on the right, q (x) [1, alpha/2], then normalised: how the filter
/// injects its local attitude error (DESIGN.md, 2).
/// @param alpha  rad, body frame
[[nodiscard]] inline Quaternion injectRight(const Quaternion& q, const Vector3f& alpha) {
  return normalized(q * Quaternion{1.0F, 0.5F * alpha.x(), 0.5F * alpha.y(), 0.5F * alpha.z()});
}

/// Attitude error of `estimate` from `reference`, local (body) frame: alpha = 2 vec(ref* (x) est),
/// sign chosen so that w >= 0 (DESIGN.md, 2). Its length is 2 sin(angle/2) <= 2.
[[nodiscard]] inline Vector3f attitudeError(const Quaternion& reference,
                                            const Quaternion& estimate) {
  return 2.0F * shortest(conjugate(reference) * estimate).vec();
}

}  // namespace strix
