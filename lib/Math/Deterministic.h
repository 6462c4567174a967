/// Elementary functions whose every bit is the same on every target.
///
/// C libraries differ in the last bit of atan2f, asinf, sin, ... (docs/determinism.md), and a log
/// replayed on a laptop must reproduce the aircraft's bits. These use only + - * / and sqrt, which
/// IEEE 754 rounds correctly everywhere. Range reductions and minimax polynomials are those of the
/// Cephes Mathematical Library, single precision (S. L. Moshier, netlib.org/cephes). Errors are
/// below 3 ulp of float over the stated domains, sine and cosine below 1e-7 (checked in test_math
/// against double precision). NaN gives NaN, so that health checks see it; nothing hangs on it.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

namespace strix {

constexpr float kPi = 3.14159265358979F;
constexpr float kHalfPi = 0.5F * kPi;
constexpr float kDegToRad = kPi / 180.0F;
constexpr float kRadToDeg = 180.0F / kPi;

/// Largest angle that the range reductions take: below it the number of eighth turns times the
/// first part of pi/4 is exact, and no conversion to an integer can overflow.
constexpr float kAngleLimit = 50000.0F;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// IEEE 754 requires a correctly rounded square root, so the library's is the same everywhere.
[[nodiscard]] inline float squareRoot(float x) { return std::sqrt(x); }

/// Polynomial in x by Horner's rule, highest power first: polynomial(x, a, b, c) = (a x + b) x + c.
template <class... Lower>
[[nodiscard]] constexpr float polynomial(float x, float highest, Lower... lower) {
  float sum = highest;
  ((sum = sum * x + lower), ...);
  return sum;
}

struct SinCos {
  float sin;
  float cos;
};

/// Sine and cosine together. Domain |x| <= 8192 rad; beyond it the reduction loses bits, and beyond
/// kAngleLimit there is no answer: both are NaN.
[[nodiscard]] inline SinCos sinCos(float x) {
  const float magnitude = x < 0.0F ? -x : x;
  if (!(magnitude <= kAngleLimit)) return {kNaN, kNaN};
  // Octant, rounded up to even, so that the remainder lies in [-pi/4, pi/4].
  auto octant = static_cast<std::int32_t>(magnitude * (4.0F / kPi));
  octant += octant & 1;
  const auto y = static_cast<float>(octant);
  // pi/4 in three parts; the first two products are exact (Cody and Waite).
  const float r =
      ((magnitude - y * 0.78515625F) - y * 2.4187564849853515625e-4F) - y * 3.77489497744594108e-8F;
  const float z = r * r;
  const float sine =
      polynomial(z, -1.9515295891e-4F, 8.3321608736e-3F, -1.6666654611e-1F) * z * r + r;
  const float cosine =
      polynomial(z, 2.443315711809948e-5F, -1.388731625493765e-3F, 4.166664568298827e-2F) * z * z -
      0.5F * z + 1.0F;
  SinCos out{sine, cosine};
  switch ((octant >> 1) & 3) {
    case 1:
      out = {cosine, -sine};
      break;
    case 2:
      out = {-sine, -cosine};
      break;
    case 3:
      out = {-cosine, sine};
      break;
    default:
      break;
  }
  if (x < 0.0F) out.sin = -out.sin;
  return out;
}

[[nodiscard]] inline float sine(float x) { return sinCos(x).sin; }
[[nodiscard]] inline float cosine(float x) { return sinCos(x).cos; }

/// Inverse tangent, result in [-pi/2, pi/2].
[[nodiscard]] inline float arcTangent(float x) {
  const float magnitude = x < 0.0F ? -x : x;
  float offset = 0.0F;
  float t = magnitude;
  if (magnitude > 2.414213562373095F) {  // tan(3 pi / 8)
    offset = kHalfPi;
    t = -1.0F / magnitude;
  } else if (magnitude > 0.4142135623730950F) {  // tan(pi / 8)
    offset = 0.25F * kPi;
    t = (magnitude - 1.0F) / (magnitude + 1.0F);
  }
  const float z = t * t;
  const float p =
      polynomial(z, 8.05374449538e-2F, -1.38776856032e-1F, 1.99777106478e-1F, -3.33329491539e-1F);
  const float angle = offset + (p * z * t + t);
  return x < 0.0F ? -angle : angle;
}

/// Angle of the point (x, y), in [-pi, pi]. The origin gives 0.
[[nodiscard]] inline float arcTangent2(float y, float x) {
  if (x == 0.0F) {
    if (y > 0.0F) return kHalfPi;
    return y < 0.0F ? -kHalfPi : y;  // 0, or NaN
  }
  const float angle = arcTangent(y / x);
  if (x > 0.0F) return angle;
  return y < 0.0F ? angle - kPi : angle + kPi;
}

/// Inverse sine. Arguments beyond +-1, as rounding produces, are taken as +-1.
[[nodiscard]] inline float arcSine(float x) {
  float magnitude = x < 0.0F ? -x : x;
  if (magnitude > 1.0F) magnitude = 1.0F;
  const bool nearOne = magnitude > 0.5F;  // there: asin(a) = pi/2 - 2 asin(sqrt((1 - a) / 2))
  const float z = nearOne ? 0.5F * (1.0F - magnitude) : magnitude * magnitude;
  const float t = nearOne ? squareRoot(z) : magnitude;
  const float p = polynomial(z, 4.2163199048e-2F, 2.4181311049e-2F, 4.5470025998e-2F,
                             7.4953002686e-2F, 1.6666752422e-1F);
  float angle = p * z * t + t;
  if (nearOne) angle = kHalfPi - 2.0F * angle;
  return x < 0.0F ? -angle : angle;
}

/// Inverse cosine, in [0, pi], exact to the last bits near +-1. Arguments are clamped to +-1.
[[nodiscard]] inline float arcCosine(float x) {
  if (x > 0.5F) return 2.0F * arcSine(squareRoot(0.5F * (x > 1.0F ? 0.0F : 1.0F - x)));
  if (x < -0.5F) return kPi - 2.0F * arcSine(squareRoot(0.5F * (x < -1.0F ? 0.0F : 1.0F + x)));
  return kHalfPi - arcSine(x);
}

/// Natural logarithm of a positive, normal number. Zero and below give -88 (the log of the
/// smallest normal float is -87.3): callers check their input, this only keeps NaN out.
[[nodiscard]] inline float logarithm(float x) {
  if (!(x >= 1.17549435e-38F)) return -88.0F;
  std::uint32_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  auto exponent = static_cast<std::int32_t>(bits >> 23U) - 126;
  bits = (bits & 0x007FFFFFU) | 0x3F000000U;  // mantissa in [0.5, 1)
  float m = 0.0F;
  std::memcpy(&m, &bits, sizeof m);
  if (m < 0.707106781186547524F) {
    --exponent;
    m = m + m - 1.0F;
  } else {
    m = m - 1.0F;
  }
  const auto e = static_cast<float>(exponent);
  const float z = m * m;
  const float p = polynomial(m, 7.0376836292e-2F, -1.1514610310e-1F, 1.1676998740e-1F,
                             -1.2420140846e-1F, 1.4249322787e-1F, -1.6668057665e-1F,
                             2.0000714765e-1F, -2.4999993993e-1F, 3.3333331174e-1F);
  float y = p * m * z;
  y += -2.12194440e-4F * e;
  y += -0.5F * z;
  return m + y + 0.693359375F * e;
}

/// Exponential. Domain [-87, 88]; arguments are clamped to it.
[[nodiscard]] inline float exponential(float x) {
  if (x != x) return x;  // NaN has no integer part
  if (x > 88.0F) x = 88.0F;
  if (x < -87.0F) x = -87.0F;
  const float scaled = 1.44269504088896341F * x + 0.5F;
  auto n = static_cast<std::int32_t>(scaled);
  if (static_cast<float>(n) > scaled) --n;  // floor
  const auto k = static_cast<float>(n);
  const float r = (x - k * 0.693359375F) - k * -2.12194440e-4F;
  const float p = polynomial(r, 1.9875691500e-4F, 1.3981999507e-3F, 8.3334519073e-3F,
                             4.1665795894e-2F, 1.6666665459e-1F, 5.0000001201e-1F);
  const auto bits = static_cast<std::uint32_t>(n + 127) << 23U;  // 2^n
  float power = 0.0F;
  std::memcpy(&power, &bits, sizeof power);
  return (p * r * r + r + 1.0F) * power;
}

/// An angle brought into (-pi, pi]. Domain and NaN as sinCos; takes the same time for all.
[[nodiscard]] inline float wrapAngle(float angle) {
  if (angle <= kPi && angle > -kPi) return angle;
  if (!(angle <= kAngleLimit && angle >= -kAngleLimit)) return kNaN;
  const float turns = angle * (0.5F / kPi) + (angle < 0.0F ? -0.5F : 0.5F);
  const auto n = static_cast<float>(static_cast<std::int32_t>(turns));  // nearest
  // 2 pi in three parts, as in sinCos.
  float wrapped =
      ((angle - n * 6.28125F) - n * 1.93500518798828125e-3F) - n * 3.0199159819567529e-7F;
  if (wrapped > kPi) wrapped -= 2.0F * kPi;
  if (wrapped <= -kPi) wrapped += 2.0F * kPi;
  return wrapped;
}

}  // namespace strix
