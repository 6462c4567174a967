/// Pressure to height and geodetic position to the local tangent plane.
#pragma once

#include "Mathpk.h"

namespace strix {

/// Height above the level where the pressure was `ground`, m. International Standard Atmosphere,
/// troposphere: h = T0/L (1 - (p/p0)^(R L / g)) with T0 = 288.15 K, L = 6.5 mK/m.
/// @param pressure  Pa, positive    @param ground  Pa, positive
[[nodiscard]] inline float heightFromPressure(float pressure, float ground) {
  constexpr float kScale = 288.15F / 0.0065F;  // m
  constexpr float kExponent = 0.190263F;       // R L / (g M)
  return kScale * (1.0F - exponential(kExponent * logarithm(pressure / ground)));
}

/// A point on the earth in the receiver's integers: 1e-7 deg is 11 mm, a float would be 1 m.
struct GeoPoint {
  std::int32_t latitude = 0;   ///< 1e-7 deg
  std::int32_t longitude = 0;  ///< 1e-7 deg
  std::int32_t altitude = 0;   ///< mm
};

/// False for numbers that no receiver near the ground can mean.
[[nodiscard]] constexpr bool isOnEarth(const GeoPoint& p) {
  return p.latitude >= -900'000'000 && p.latitude <= 900'000'000 &&  //
         p.longitude >= -1'800'000'000 && p.longitude <= 1'800'000'000 &&
         p.altitude >= -1'000'000 && p.altitude <= 20'000'000;  // 1 km below the sea to 20 km up
}

/// The way east from one longitude to another, the short way round the earth, 1e-7 deg.
[[nodiscard]] constexpr std::int64_t longitudeStep(std::int64_t to, std::int64_t from) {
  constexpr std::int64_t kHalfTurn = 1'800'000'000;
  const std::int64_t east = to - from;
  if (east > kHalfTurn) return east - 2 * kHalfTurn;
  return east < -kHalfTurn ? east + 2 * kHalfTurn : east;
}

/// Local tangent plane at an origin (WGS-84). Differences are taken in integers, so precision does
/// not depend on where on earth the origin lies. Curvature is neglected: at 1 km it is 8 cm down
/// and up to 16 cm times tan(latitude) sideways.
class LocalFrame {
 public:
  LocalFrame() = default;

  explicit LocalFrame(const GeoPoint& origin) : origin_(origin) {
    constexpr float kSemiMajor = 6378137.0F;          // m
    constexpr float kEccentricity2 = 6.69437999e-3F;  // first eccentricity squared
    const SinCos lat = sinCos(static_cast<float>(origin.latitude) * kUnit);
    const float height = static_cast<float>(origin.altitude) * 1e-3F;
    const float w2 = 1.0F - kEccentricity2 * lat.sin * lat.sin;
    const float primeVertical = kSemiMajor / squareRoot(w2);
    const float meridian = primeVertical * (1.0F - kEccentricity2) / w2;
    northPerUnit_ = (meridian + height) * kUnit;
    eastPerUnit_ = (primeVertical + height) * lat.cos * kUnit;
  }

  [[nodiscard]] const GeoPoint& origin() const { return origin_; }

  /// @return m, north east down of the origin. Right across the date line.
  [[nodiscard]] Vector3f toNed(const GeoPoint& point) const {
    const std::int64_t east = longitudeStep(point.longitude, origin_.longitude);
    const std::int64_t north = static_cast<std::int64_t>(point.latitude) - origin_.latitude;
    const std::int64_t down = static_cast<std::int64_t>(origin_.altitude) - point.altitude;
    return {static_cast<float>(north) * northPerUnit_, static_cast<float>(east) * eastPerUnit_,
            static_cast<float>(down) * 1e-3F};
  }

  /// The inverse, to the nearest unit.
  /// @param ned  m, within tens of kilometres
  [[nodiscard]] GeoPoint toGeo(const Vector3f& ned) const {
    constexpr std::int64_t kTurn = 3'600'000'000;
    std::int64_t longitude = origin_.longitude + rounded(ned.y() / eastPerUnit_);
    if (longitude > kTurn / 2) longitude -= kTurn;
    if (longitude < -kTurn / 2) longitude += kTurn;
    return {origin_.latitude + rounded(ned.x() / northPerUnit_),
            static_cast<std::int32_t>(longitude), origin_.altitude - rounded(ned.z() * 1e3F)};
  }

 private:
  static constexpr float kUnit = 1e-7F * kDegToRad;  // rad per 1e-7 deg

  /// Of what no flight reaches, a number that is still one on the earth's scale.
  [[nodiscard]] static std::int32_t rounded(float value) {
    constexpr float kMost = 1e8F;
    if (!(value > -kMost)) return static_cast<std::int32_t>(-kMost);
    if (!(value < kMost)) return static_cast<std::int32_t>(kMost);
    return static_cast<std::int32_t>(value + (value < 0.0F ? -0.5F : 0.5F));
  }

  GeoPoint origin_;
  float northPerUnit_ = 0.0F;  ///< m per 1e-7 deg
  float eastPerUnit_ = 0.0F;
};

}  // namespace strix
