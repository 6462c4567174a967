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

/// q brought back to length one when rounding has moved it off by a little: one Newton step for
/// 1/|q|, s = (3 - |q|^2)/2. An error e of the length leaves 1.5 e^2; NaN stays NaN.
[[nodiscard]] inline Quaternion renormalized(const Quaternion& q) {
  const float s = 1.5F - 0.5F * (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w * s, q.x * s, q.y * s, q.z * s};
}

/// The one of q and -q (the same rotation) with w >= 0: the short way round.
[[nodiscard]] inline Quaternion shortest(const Quaternion& q) {
  return q.w < 0.0F ? Quaternion{-q.w, -q.x, -q.y, -q.z} : q;
}

/// Rotation vector to unit quaternion, q = [cos(a/2), sin(a/2) v/a], a = |v|. Below half a radian,
/// where every IMU sample lies, by series of a^2: errors a^6/645120 and a^8/10321920, under one
/// float ulp. Sola (2017), eq. 101.
/// @param v  rotation vector, rad
[[nodiscard]] inline Quaternion quaternionExp(const Vector3f& v) {
  const float z = v.squaredNorm();
  if (z < 0.25F) {
    const float s = polynomial(z, 1.0F / 3840.0F, -1.0F / 48.0F, 0.5F);
    const float c = polynomial(z, -1.0F / 46080.0F, 1.0F / 384.0F, -0.125F, 1.0F);
    return {c, s * v.x(), s * v.y(), s * v.z()};
  }
  const float angle = squareRoot(z);
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
