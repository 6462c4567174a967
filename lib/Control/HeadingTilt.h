/// A rotation taken apart into a tilt and a heading, without an angle being computed.
#pragma once

#include "Mathpk.h"

namespace strix {

/// Factor that shortens v to `limit`; 1 when it is no longer than that.
[[nodiscard]] inline float shortening(const Vector2f& v, float limit) {
  const float square = v.squaredNorm();
  return square > limit * limit ? limit / squareRoot(square) : 1.0F;
}

[[nodiscard]] inline float clamped(float value, float limit) {
  if (value > limit) return limit;
  return value < -limit ? -limit : value;
}

/// Sine and cosine of twice an angle.
[[nodiscard]] inline SinCos doubled(const SinCos& half) {
  return {2.0F * half.sin * half.cos, half.cos * half.cos - half.sin * half.sin};
}

/// Level components turned by +angle: from a frame with its nose at `angle` into one at zero.
[[nodiscard]] inline Vector2f turned(const SinCos& angle, const Vector2f& v) {
  return {angle.cos * v.x() - angle.sin * v.y(), angle.sin * v.x() + angle.cos * v.y()};
}

/// North and east to forward and right at this heading.
[[nodiscard]] inline Vector2f toHeading(const SinCos& heading, const Vector2f& ned) {
  return turned({-heading.sin, heading.cos}, ned);
}

/// Half the heading of q: of the turn about down in q = q_heading (x) q_tilt, where q_tilt turns
/// about a level axis (swing and twist). Level, it is the yaw of Euler's angles. Tilted, it does
/// not move with roll or pitch, so that leaning diagonally asks for no yaw torque, the weakest; and
/// it is lost only upside down, where it is taken as north.
[[nodiscard]] inline SinCos halfHeadingOf(const Quaternion& q) {
  const float length = squareRoot(q.w * q.w + q.z * q.z);
  if (!(length > 1e-3F)) return {0.0F, 1.0F};
  const float scale = 1.0F / length;
  return {scale * q.z, scale * q.w};
}

/// Half the turn from one heading to another, the short way: its cosine is not negative.
[[nodiscard]] inline SinCos halfTurn(const SinCos& from, const SinCos& to) {
  const SinCos turn{to.sin * from.cos - to.cos * from.sin, to.cos * from.cos + to.sin * from.sin};
  return turn.cos < 0.0F ? SinCos{-turn.sin, -turn.cos} : turn;
}

/// Tilt of q: 2 sin(tilt/2) about the forward and the right axis at its own heading, the measure of
/// attitudeError. Positive: right side down, nose up.
[[nodiscard]] inline Vector2f tiltOf(const Quaternion& q, const SinCos& halfHeading) {
  // q_tilt = q_heading* (x) q has no z.
  return 2.0F * Vector2f{halfHeading.cos * q.x + halfHeading.sin * q.y,
                         halfHeading.cos * q.y - halfHeading.sin * q.x};
}

/// The tilt (as of tiltOf) whose thrust, along -z body, together with gravity gives a level
/// acceleration while the vertical one is `down`: forward needs the nose down, right the right side
/// down. m/s^2.
[[nodiscard]] inline Vector2f tiltFor(const Vector2f& acceleration, float down) {
  // The half-way vector of down and the thrust's opposite is the axis of cos(tilt/2).
  const float vertical = kGravity - down;
  const float square = acceleration.squaredNorm();
  const float whole = vertical + squareRoot(square + vertical * vertical);
  const float scale = 2.0F / squareRoot(whole * whole + square);
  return {scale * acceleration.y(), -scale * acceleration.x()};
}

/// q_heading (x) q_tilt, the inverse of halfHeadingOf and tiltOf.
[[nodiscard]] inline Quaternion compose(const SinCos& halfHeading, const Vector2f& tilt) {
  const float square = 0.25F * tilt.squaredNorm();
  const float cosHalfTilt = square < 1.0F ? squareRoot(1.0F - square) : 0.0F;
  const Vector2f half = 0.5F * turned(halfHeading, tilt);
  return {halfHeading.cos * cosHalfTilt, half.x(), half.y(), halfHeading.sin * cosHalfTilt};
}

}  // namespace strix
