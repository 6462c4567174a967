// Pressure to height and geodetic position to the local plane, against double precision.
#include <unity.h>

#include <cmath>

#include "Geodesy.h"
#include "Random.h"
#include "StartCalibration.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr double kPiDouble = 3.14159265358979323846;

/// The barometric formula of the International Standard Atmosphere, from its defining constants.
double heightOf(double pressure, double ground) {
  constexpr double kGas = 8.31432;         // J/(mol K), the standard's value
  constexpr double kMolar = 0.0289644;     // kg/mol
  constexpr double kLapse = 0.0065;        // K/m
  constexpr double kTemperature = 288.15;  // K
  return kTemperature / kLapse *
         (1.0 - std::pow(pressure / ground, kGas * kLapse / (9.80665 * kMolar)));
}

void test_height_follows_the_barometric_formula() {
  for (const float ground : {101325.0F, 85'000.0F, 104'000.0F}) {
    for (int i = 0; i < 10'000; ++i) {
      const float pressure = 40'000.0F + 6.83F * static_cast<float>(i);
      // exp and log are good to 1e-7, times 44 km.
      TEST_ASSERT_FLOAT_WITHIN(0.02F,
                               heightOf(static_cast<double>(pressure), static_cast<double>(ground)),
                               heightFromPressure(pressure, ground));
    }
  }
}

void test_height_near_the_ground_is_good_to_a_centimetre() {
  // Within 200 m, where the aircraft flies.
  for (int i = 0; i < 10'000; ++i) {
    const float pressure = 98'900.0F + 0.49F * static_cast<float>(i);
    TEST_ASSERT_FLOAT_WITHIN(0.01F, heightOf(static_cast<double>(pressure), 101325.0),
                             heightFromPressure(pressure, 101325.0F));
  }
  TEST_ASSERT_TRUE(heightFromPressure(101325.0F, 101325.0F) == 0.0F);
}

void test_less_pressure_is_never_less_height() {
  // 1 Pa is 8 cm; rounding must not turn that round. The barometer's own noise is 2 Pa.
  float last = heightFromPressure(108'000.0F, 101325.0F);
  for (int pressure = 107'999; pressure > 60'000; --pressure) {
    const float height = heightFromPressure(static_cast<float>(pressure), 101325.0F);
    TEST_ASSERT_TRUE(height > last + 0.05F);
    last = height;
  }
}

struct Ecef {
  double x, y, z;
};

double radians(std::int32_t unit) { return static_cast<double>(unit) * 1e-7 * kPiDouble / 180.0; }

/// Geodetic to earth-centred coordinates, WGS-84.
Ecef ecefOf(const GeoPoint& p) {
  constexpr double kA = 6378137.0;
  constexpr double kF = 1.0 / 298.257223563;
  constexpr double kE2 = kF * (2.0 - kF);
  const double lat = radians(p.latitude);
  const double lon = radians(p.longitude);
  const double h = static_cast<double>(p.altitude) * 1e-3;
  const double n = kA / std::sqrt(1.0 - kE2 * std::sin(lat) * std::sin(lat));
  return {(n + h) * std::cos(lat) * std::cos(lon), (n + h) * std::cos(lat) * std::sin(lon),
          (n * (1.0 - kE2) + h) * std::sin(lat)};
}

struct Ned {
  double north, east, down;
};

/// The straight line from the origin to the point, turned into the origin's north, east and down.
Ned nedOf(const GeoPoint& origin, const GeoPoint& point) {
  const Ecef o = ecefOf(origin);
  const Ecef p = ecefOf(point);
  const double dx = p.x - o.x;
  const double dy = p.y - o.y;
  const double dz = p.z - o.z;
  const double sLat = std::sin(radians(origin.latitude));
  const double cLat = std::cos(radians(origin.latitude));
  const double sLon = std::sin(radians(origin.longitude));
  const double cLon = std::cos(radians(origin.longitude));
  return {-sLat * cLon * dx - sLat * sLon * dy + cLat * dz, -sLon * dx + cLon * dy,
          -cLat * cLon * dx - cLat * sLon * dy - sLat * dz};
}

// Equator, Malmo, Tromso, Cape Town, Ushuaia, Fiji on either side of the date line, Null Island.
constexpr GeoPoint kPlaces[] = {
    {0, 0, 0},
    {556'050'000, 130'010'000, 20'000},
    {696'490'000, 189'560'000, 100'000},
    {-339'250'000, 184'240'000, 15'000},
    {-548'020'000, -683'030'000, 2'000'000},
    {-168'000'000, 1'799'999'000, 5'000},
    {-168'000'000, -1'799'999'000, 5'000},
    {400'000'000, -1'050'000'000, 1'600'000},
};

/// Largest difference, in m, between the local frame and the exact one for points up to `reach`.
double worstError(const GeoPoint& origin, double reach) {
  Random random(50);
  const LocalFrame frame(origin);
  const double unitNorth = 0.0111;  // m per 1e-7 deg
  const double unitEast = unitNorth * std::cos(radians(origin.latitude));
  double worst = 0.0;
  for (int i = 0; i < 5000; ++i) {
    const double north = static_cast<double>(random.uniform(-1.0F, 1.0F)) * reach;
    const double east = static_cast<double>(random.uniform(-1.0F, 1.0F)) * reach;
    std::int64_t longitude = origin.longitude + static_cast<std::int64_t>(east / unitEast);
    if (longitude > 1'800'000'000) longitude -= 3'600'000'000;
    if (longitude < -1'800'000'000) longitude += 3'600'000'000;
    const GeoPoint point{origin.latitude + static_cast<std::int32_t>(north / unitNorth),
                         static_cast<std::int32_t>(longitude),
                         origin.altitude + static_cast<std::int32_t>(random.uniform(-5e4F, 5e4F))};
    const Ned exact = nedOf(origin, point);
    const Vector3f ned = frame.toNed(point);
    for (const double error :
         {exact.north - static_cast<double>(ned.x()), exact.east - static_cast<double>(ned.y()),
          exact.down - static_cast<double>(ned.z())}) {
      if (!(std::fabs(error) <= worst)) worst = std::fabs(error);
    }
  }
  return worst;
}

void test_the_local_plane_is_good_to_a_centimetre_in_the_fence_anywhere_on_earth() {
  // Curvature within 100 m: 100^2 / R = 1.6 mm, times tan(70 deg) = 2.7 east-west.
  for (const GeoPoint& place : kPlaces) TEST_ASSERT_TRUE(worstError(place, 100.0) < 0.01);
}

void test_the_local_plane_is_good_to_half_a_metre_at_a_kilometre() {
  // What the header says: tan(70 deg) times 16 cm.
  for (const GeoPoint& place : kPlaces) TEST_ASSERT_TRUE(worstError(place, 1000.0) < 0.5);
}

void test_north_east_and_down_have_their_signs_in_all_quarters_of_the_earth() {
  for (const GeoPoint& place : kPlaces) {
    const LocalFrame frame(place);
    GeoPoint point = place;
    point.latitude += 1000;
    TEST_ASSERT_FLOAT_WITHIN(0.1F, 11.1F, frame.toNed(point).x());
    point = place;
    point.longitude += 500;
    TEST_ASSERT_TRUE(frame.toNed(point).y() > 1.0F && frame.toNed(point).y() < 5.6F);
    point = place;
    point.altitude += 2500;
    TEST_ASSERT_TRUE(frame.toNed(point).z() == -2.5F);
    TEST_ASSERT_TRUE(frame.toNed(place).isZero(0.0F));
  }
}

void test_a_step_across_the_date_line_is_a_step_and_not_a_trip_around_the_earth() {
  const LocalFrame frame(GeoPoint{-168'000'000, 1'799'999'990, 0});
  const Vector3f across = frame.toNed(GeoPoint{-168'000'000, -1'799'999'990, 0});
  TEST_ASSERT_FLOAT_WITHIN(0.01F, 0.213F, across.y());  // 20 units of 1.066 cm
}

void test_the_smallest_step_of_the_receiver_is_seen_everywhere() {
  for (const GeoPoint& place : kPlaces) {
    GeoPoint point = place;
    point.latitude += 1;
    TEST_ASSERT_FLOAT_WITHIN(1e-4F, 0.0111F, LocalFrame(place).toNed(point).x());
  }
}

void test_the_origin_is_the_mean_of_the_fixes() {
  Random random(51);
  for (const GeoPoint& place : kPlaces) {
    OriginAverage average;
    double latitude = 0.0;
    double longitude = 0.0;
    double altitude = 0.0;
    constexpr int kFixes = 600;  // a minute
    for (int i = 0; i < kFixes; ++i) {
      const auto scatter = [&random] {
        return static_cast<std::int32_t>(random.uniform(-500.0F, 500.0F));  // 5.5 m
      };
      const GeoPoint offset{scatter(), scatter(), scatter()};
      std::int64_t east = std::int64_t{place.longitude} + offset.longitude;
      if (east > 1'800'000'000) east -= 3'600'000'000;
      if (east < -1'800'000'000) east += 3'600'000'000;
      average.add({place.latitude + offset.latitude, static_cast<std::int32_t>(east),
                   place.altitude + offset.altitude});
      latitude += offset.latitude;
      longitude += offset.longitude;
      altitude += offset.altitude;
    }
    TEST_ASSERT_EQUAL_UINT32(kFixes, average.count());
    const GeoPoint mean = average.origin();
    // Rounded to whole units, after a running mean in float.
    TEST_ASSERT_INT_WITHIN(1, std::lround(latitude / kFixes), mean.latitude - place.latitude);
    TEST_ASSERT_INT_WITHIN(1, std::lround(altitude / kFixes), mean.altitude - place.altitude);
    std::int64_t apart = std::int64_t{mean.longitude} - place.longitude;
    if (apart > 1'800'000'000) apart -= 3'600'000'000;
    if (apart < -1'800'000'000) apart += 3'600'000'000;
    TEST_ASSERT_INT_WITHIN(1, std::lround(longitude / kFixes), apart);
    TEST_ASSERT_TRUE(mean.longitude <= 1'800'000'000 && mean.longitude >= -1'800'000'000);
  }
}

void test_one_fix_is_its_own_mean() {
  OriginAverage average;
  average.add(kPlaces[4]);
  TEST_ASSERT_EQUAL_INT32(kPlaces[4].latitude, average.origin().latitude);
  TEST_ASSERT_EQUAL_INT32(kPlaces[4].longitude, average.origin().longitude);
  TEST_ASSERT_EQUAL_INT32(kPlaces[4].altitude, average.origin().altitude);
  TEST_ASSERT_EQUAL_UINT32(1, average.count());
}

}  // namespace

void runGeodesyTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_height_follows_the_barometric_formula);
  RUN_TEST(test_height_near_the_ground_is_good_to_a_centimetre);
  RUN_TEST(test_less_pressure_is_never_less_height);
  RUN_TEST(test_the_local_plane_is_good_to_a_centimetre_in_the_fence_anywhere_on_earth);
  RUN_TEST(test_the_local_plane_is_good_to_half_a_metre_at_a_kilometre);
  RUN_TEST(test_north_east_and_down_have_their_signs_in_all_quarters_of_the_earth);
  RUN_TEST(test_a_step_across_the_date_line_is_a_step_and_not_a_trip_around_the_earth);
  RUN_TEST(test_the_smallest_step_of_the_receiver_is_seen_everywhere);
  RUN_TEST(test_the_origin_is_the_mean_of_the_fixes);
  RUN_TEST(test_one_fix_is_its_own_mean);
}
