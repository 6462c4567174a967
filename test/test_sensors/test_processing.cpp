// Raw readings to body axes and SI: mounting, iron, knots, and which fixes are good enough.
#include <unity.h>

#include <cmath>

#include "AssertNear.h"
#include "FakeBoard.h"
#include "Random.h"
#include "Sensors.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

Matrix3f diagonal(float x, float y, float z) { return Vector3f{x, y, z}.asDiagonal(); }

struct Bench {
  explicit Bench(const SensorConfig& chosen) : config(chosen) {}
  SensorConfig config;
  FakeBoard board;
  Sensors<FakeBoard> sensors{board, config};
};

void test_gps_speed_in_knots_becomes_metres_per_second_along_the_course() {
  const Bench bench({});
  GpsRaw raw;
  raw.speedKnots = 10.0F;
  raw.courseDeg = 90.0F;
  // One knot is 1852 m an hour. Taken for m/s, 10 kn east would be 10 instead of 5.14.
  assertNear(1e-4F, Vector3f{0.0F, 10.0F * 1852.0F / 3600.0F, 0.0F},
             bench.sensors.processGPSMeas(raw).velocityNed);
  Random random(40);
  for (int i = 0; i < 1000; ++i) {
    raw.speedKnots = random.uniform(0.0F, 60.0F);
    raw.courseDeg = random.uniform(0.0F, 360.0F);
    const double speed = static_cast<double>(raw.speedKnots) * 1852.0 / 3600.0;
    const double course = static_cast<double>(raw.courseDeg) * 3.14159265358979 / 180.0;
    // 0.514444 has six digits: 1e-6 of 31 m/s, and the rounding of the course.
    assertNear(1e-4F,
               Vector3f{static_cast<float>(speed * std::cos(course)),
                        static_cast<float>(speed * std::sin(course)), 0.0F},
               bench.sensors.processGPSMeas(raw).velocityNed);
  }
}

void test_the_imu_is_turned_into_the_body_and_freed_of_its_biases() {
  SensorConfig config;
  // Mounted a quarter turn to the right: the sensor's x points right, its y points back.
  config.imu.sensorToBody << 0.0F, -1.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F;
  config.imu.accelBias = {0.1F, 0.2F, -0.3F};  // in the sensor's axes
  Bench bench(config);
  bench.sensors.setStartCalibration({0.01F, 0.02F, 0.03F}, 101325.0F);  // in the body's
  ImuRaw raw;
  raw.sampled = 1234;
  raw.accel = {1.1F, 2.2F, -10.3F};
  raw.gyro = {1.0F, 2.0F, 3.0F};
  const ImuSample sample = bench.sensors.processIMUMeas(raw);
  TEST_ASSERT_EQUAL_UINT32(1234, sample.sampled);
  assertNear(1e-6F, Vector3f{-2.0F, 1.0F, -10.0F}, sample.accel);
  assertNear(1e-6F, Vector3f{-2.01F, 0.98F, 2.97F}, sample.gyro);
}

void test_a_left_handed_magnetometer_shows_the_field_in_the_body() {
  // The LIS2MDL's axes are a mirror image of a right-handed set: no rotation undoes that, and one
  // that is tried anyway leaves one axis with the wrong sign. Here z is the mirrored one.
  SensorConfig config;
  config.mag.sensorToBody = diagonal(1.0F, -1.0F, -1.0F) * diagonal(1.0F, 1.0F, -1.0F);
  const Bench bench(config);
  TEST_ASSERT_TRUE(bench.sensors.mountingValid());
  Random random(41);
  for (int i = 0; i < 1000; ++i) {
    const Vector3f field = rotateToBody(random.rotation(), bench.board.fieldNed);
    MagRaw raw;
    raw.field = {field.x(), -field.y(), field.z()};  // as the mounted, mirrored sensor sees it
    assertNear(0.0F, field, bench.sensors.processMagMeas(raw, 0.0F));
  }
}

void test_hard_and_soft_iron_are_taken_out_in_the_sensors_axes() {
  SensorConfig config;
  config.mag.sensorToBody = diagonal(-1.0F, -1.0F, 1.0F);
  config.mag.hardIron = {12.0F, -30.0F, 5.0F};
  config.mag.softIron << 1.1F, 0.05F, -0.02F, 0.05F, 0.9F, 0.01F, -0.02F, 0.01F, 1.05F;
  const Bench bench(config);
  Random random(42);
  for (int i = 0; i < 1000; ++i) {
    MagRaw raw;
    raw.field = random.vector(80.0F);
    const Vector3f iron = config.mag.softIron * (raw.field - config.mag.hardIron);
    assertNear(1e-4F, Vector3f{-iron.x(), -iron.y(), iron.z()},
               bench.sensors.processMagMeas(raw, 0.0F));
  }
}

void test_a_calibrated_accelerometer_gives_the_true_force_in_any_mounting() {
  Random random(46);
  for (int i = 0; i < 500; ++i) {
    SensorConfig config;
    const Matrix3f skew = Vector3f{1.03F, 0.98F, 1.01F}.asDiagonal();
    Matrix3f distortion = skew;  // what the sensor makes of the truth: symmetric
    distortion(0, 1) = distortion(1, 0) = 0.02F;
    distortion(1, 2) = distortion(2, 1) = -0.01F;
    config.imu.sensorToBody = q2R(random.rotation());
    config.imu.accelScale = distortion.inverse();
    config.imu.accelBias = random.vector(0.5F);
    const Bench bench(config);
    const Vector3f force = random.vector(20.0F);
    ImuRaw raw;
    raw.accel = distortion * (config.imu.sensorToBody.transpose() * force) + config.imu.accelBias;
    assertNear(2e-5F, force, bench.sensors.processIMUMeas(raw).accel);  // rounding of 35 m/s^2
  }
}

void test_the_motors_field_is_taken_out_by_throttle() {
  SensorConfig config;
  config.mag.sensorToBody = diagonal(1.0F, -1.0F, 1.0F);
  config.mag.hardIron = {12.0F, -30.0F, 5.0F};
  config.mag.perThrottle = {30.0F, 8.0F, -20.0F};
  const Bench bench(config);
  MagRaw raw;
  const Vector3f field{15.0F, 2.0F, 45.0F};  // body
  for (const float throttle : {0.0F, 0.3F, 1.0F}) {
    raw.field =
        Vector3f{15.0F, -2.0F, 45.0F} + config.mag.hardIron + throttle * config.mag.perThrottle;
    assertNear(2e-5F, field, bench.sensors.processMagMeas(raw, throttle));
  }
}

void test_any_rotation_is_a_mounting_for_every_sensor() {
  Random random(43);
  for (int i = 0; i < 2000; ++i) {
    const Matrix3f rotation = q2R(random.rotation());
    TEST_ASSERT_TRUE(isMounting(rotation, false));
    TEST_ASSERT_TRUE(isMounting(rotation, true));
  }
  // One typed with four digits: a turn of 45 deg.
  Matrix3f typed;
  typed << 0.7071F, 0.7071F, 0.0F, -0.7071F, 0.7071F, 0.0F, 0.0F, 0.0F, 1.0F;
  TEST_ASSERT_TRUE(isMounting(typed, false));
}

void test_a_reflection_is_a_mounting_only_where_one_is_declared() {
  Random random(44);
  for (int i = 0; i < 2000; ++i) {
    const Matrix3f mirrored = diagonal(1.0F, -1.0F, 1.0F) * q2R(random.rotation());
    TEST_ASSERT_FALSE(isMounting(mirrored, false));
    TEST_ASSERT_TRUE(isMounting(mirrored, true));
  }
}

void test_a_matrix_that_stretches_or_projects_is_no_mounting() {
  Random random(45);
  for (const bool reflectionAllowed : {false, true}) {
    for (int i = 0; i < 2000; ++i) {
      // One element wrong by 1 % to 100 %, as a typing error is.
      Matrix3f m = q2R(random.rotation());
      const float error = random.uniform(0.01F, 1.0F);
      m(random.below(3), random.below(3)) += random.chance(0.5F) ? error : -error;
      const float wrong = (m * m.transpose() - Matrix3f::Identity()).norm();
      if (wrong > 2e-3F) TEST_ASSERT_FALSE(isMounting(m, reflectionAllowed));
      TEST_ASSERT_FALSE(isMounting(1.01F * q2R(random.rotation()), reflectionAllowed));
    }
    TEST_ASSERT_FALSE(isMounting(Matrix3f::Zero(), reflectionAllowed));
    TEST_ASSERT_FALSE(isMounting(diagonal(1.0F, 1.0F, 0.0F), reflectionAllowed));
    Matrix3f twice = Matrix3f::Identity();
    twice.row(1) = twice.row(0);  // the same axis typed twice
    TEST_ASSERT_FALSE(isMounting(twice, reflectionAllowed));
  }
}

void test_a_matrix_with_nan_or_infinity_in_any_place_is_no_mounting() {
  for (const bool reflectionAllowed : {false, true}) {
    for (const float bad : {kNaN, kInfinity, -kInfinity}) {
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          Matrix3f m = Matrix3f::Identity();
          m(row, column) = bad;
          TEST_ASSERT_FALSE(isMounting(m, reflectionAllowed));
        }
      }
    }
  }
}

void test_both_mountings_are_checked_and_only_the_magnetometer_may_be_mirrored() {
  TEST_ASSERT_TRUE(Bench({}).sensors.mountingValid());
  SensorConfig imu;
  imu.imu.sensorToBody = diagonal(1.0F, 1.0F, -1.0F);
  TEST_ASSERT_FALSE(Bench(imu).sensors.mountingValid());
  SensorConfig mag;
  mag.mag.sensorToBody = diagonal(1.0F, 1.0F, -1.0F);
  TEST_ASSERT_TRUE(Bench(mag).sensors.mountingValid());
  mag.mag.sensorToBody = diagonal(1.0F, 1.0F, -2.0F);
  TEST_ASSERT_FALSE(Bench(mag).sensors.mountingValid());
}

void test_only_a_sharp_three_dimensional_fix_is_navigated_by() {
  const Bench bench({});
  GpsRaw good;
  good.fix = 3;
  good.satellites = 6;
  good.hdop = 2.5F;
  TEST_ASSERT_TRUE(bench.sensors.gpsUsable(good));
  const auto refused = [&](auto&& spoil) {
    GpsRaw raw = good;
    spoil(raw);
    TEST_ASSERT_FALSE(bench.sensors.gpsUsable(raw));
  };
  refused([](GpsRaw& raw) { raw.fix = 2; });
  refused([](GpsRaw& raw) { raw.fix = 0; });
  refused([](GpsRaw& raw) { raw.satellites = 5; });
  refused([](GpsRaw& raw) { raw.hdop = 2.6F; });
  refused([](GpsRaw& raw) { raw.hdop = kNaN; });
  refused([](GpsRaw& raw) { raw.latitude = 900'000'001; });
  refused([](GpsRaw& raw) { raw.latitude = -900'000'001; });
  refused([](GpsRaw& raw) { raw.longitude = 1'800'000'001; });
  refused([](GpsRaw& raw) { raw.longitude = -1'800'000'001; });
  refused([](GpsRaw& raw) { raw.altitude = 20'000'001; });
  refused([](GpsRaw& raw) { raw.altitude = -1'000'001; });
  TEST_ASSERT_FALSE(bench.sensors.gpsUsable(GpsRaw{}));  // nothing heard yet
}

void test_the_altimeter_counts_from_the_ground_it_started_on() {
  Bench bench({});
  bench.sensors.setStartCalibration(Vector3f::Zero(), 95'000.0F);
  AltRaw raw;
  raw.pressure = 95'000.0F;
  TEST_ASSERT_TRUE(bench.sensors.processAltMeas(raw) == 0.0F);
  raw.pressure = 94'977.0F;  // about 2 m: 11.5 Pa/m at this height
  TEST_ASSERT_FLOAT_WITHIN(0.1F, 2.0F, bench.sensors.processAltMeas(raw));
}

void test_position_counts_from_the_origin() {
  Bench bench({});
  bench.sensors.setOrigin({574'200'000, 119'700'000, 40'000});
  GpsRaw raw = bench.board.gps.reading;
  assertNear(0.0F, Vector3f::Zero(), bench.sensors.processGPSMeas(raw).positionNed);
  raw.latitude += 1000;
  raw.altitude += 2000;
  const Vector3f p = bench.sensors.processGPSMeas(raw).positionNed;
  TEST_ASSERT_FLOAT_WITHIN(0.1F, 11.1F,
                           p.x());  // 1e-4 deg: 1/900 000 of a quarter meridian, 10^7 m
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, -2.0F, p.z());
}

}  // namespace

void runProcessingTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_gps_speed_in_knots_becomes_metres_per_second_along_the_course);
  RUN_TEST(test_the_imu_is_turned_into_the_body_and_freed_of_its_biases);
  RUN_TEST(test_a_left_handed_magnetometer_shows_the_field_in_the_body);
  RUN_TEST(test_hard_and_soft_iron_are_taken_out_in_the_sensors_axes);
  RUN_TEST(test_a_calibrated_accelerometer_gives_the_true_force_in_any_mounting);
  RUN_TEST(test_the_motors_field_is_taken_out_by_throttle);
  RUN_TEST(test_any_rotation_is_a_mounting_for_every_sensor);
  RUN_TEST(test_a_reflection_is_a_mounting_only_where_one_is_declared);
  RUN_TEST(test_a_matrix_that_stretches_or_projects_is_no_mounting);
  RUN_TEST(test_a_matrix_with_nan_or_infinity_in_any_place_is_no_mounting);
  RUN_TEST(test_both_mountings_are_checked_and_only_the_magnetometer_may_be_mirrored);
  RUN_TEST(test_only_a_sharp_three_dimensional_fix_is_navigated_by);
  RUN_TEST(test_the_altimeter_counts_from_the_ground_it_started_on);
  RUN_TEST(test_position_counts_from_the_origin);
}
