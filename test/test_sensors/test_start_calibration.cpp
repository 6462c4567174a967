// Start-up calibration: what a still aircraft tells, and that a moving one tells nothing.
#include <unity.h>

#include "AssertNear.h"
#include "Random.h"
#include "StartCalibration.h"
#include "suites.h"

using namespace strix;

namespace {

const Vector3f kBias{0.05F, -0.03F, 0.02F};  // rad/s; the ICM20649 promises 0.087
const Vector3f kRest{0.3F, -0.2F, -9.8F};    // m/s^2, nearly level
const Vector3f kField{15.0F, 3.0F, 48.0F};   // uT
constexpr float kPressure = 100'800.0F;      // Pa
constexpr Micros kBeforeWrap = 0U - 1'000'000U;

/// An aircraft on the ground, its IMU at 1000 Hz, magnetometer 100 Hz, altimeter 50 Hz.
struct Ground {
  explicit Ground(Micros start = 0, std::uint32_t seed = 60) : now(start), random(seed) {}

  StartCalibrationConfig config;
  StartCalibration calibration{config};
  Micros now;
  Random random;
  int sample = 0;
  bool magAlive = true;
  bool altAlive = true;

  /// One millisecond. Noise is uniform, with the 1 sigma of DESIGN.md (times sqrt(3)).
  void step(const Vector3f& extraGyro = Vector3f::Zero(),
            const Vector3f& extraAccel = Vector3f::Zero()) {
    calibration.addImu(now, kRest + random.vector(0.05F) + extraAccel,
                       kBias + random.vector(0.0054F) + extraGyro);
    if (magAlive && sample % 10 == 0) calibration.addMag(kField + random.vector(0.5F));
    if (altAlive && sample % 20 == 0)
      calibration.addPressure(kPressure + random.uniform(-3.5F, 3.5F));
    ++sample;
    now += 1000;
  }

  /// Milliseconds until it is done, at most `limit`.
  int untilDone(int limit) {
    int count = 0;
    for (; count < limit && !calibration.done(); ++count) step();
    return count;
  }

  void assertFoundTheTruth() const {
    // Means of 2000 samples: noise / sqrt(2000), five times over. 100 samples of pressure.
    assertNear(5e-4F, kBias, calibration.gyroBias());
    assertNear(5e-3F, kRest, calibration.accel());
    assertNear(0.2F, kField, calibration.mag());
    TEST_ASSERT_FLOAT_WITHIN(1.0F, kPressure, calibration.groundPressure());
  }
};

void test_two_seconds_of_standstill_give_biases_and_references() {
  for (const Micros start : {Micros{0}, Micros{12345}, kBeforeWrap}) {
    Ground ground(start);
    TEST_ASSERT_INT_WITHIN(2, 2000, ground.untilDone(10'000));
    TEST_ASSERT_TRUE(ground.calibration.done());
    TEST_ASSERT_EQUAL_UINT32(0, ground.calibration.restarts());
    ground.assertFoundTheTruth();
  }
}

void test_a_constant_bias_is_recovered_to_the_last_digits() {
  StartCalibration calibration{StartCalibrationConfig{}};
  for (Micros now = 0; !calibration.done(); now += 1000) {
    TEST_ASSERT_TRUE(now < 10'000'000);
    calibration.addMag(kField);
    calibration.addPressure(kPressure);
    calibration.addImu(now, kRest, kBias);
  }
  assertNear(0.0F, kBias, calibration.gyroBias());
  assertNear(0.0F, kRest, calibration.accel());
  assertNear(0.0F, kField, calibration.mag());
  TEST_ASSERT_TRUE(calibration.groundPressure() == kPressure);
}

void test_a_knock_at_any_moment_starts_it_over() {
  // A rotation or a shove in a single sample, at every 37th millisecond.
  for (const bool rotation : {true, false}) {
    for (int moment = 0; moment < 1990; moment += 37) {
      Ground ground;
      for (int i = 0; i < moment; ++i) ground.step();
      const Vector3f direction = ground.random.direction();
      ground.step(rotation ? Vector3f(0.3F * direction) : Vector3f::Zero(),
                  rotation ? Vector3f::Zero() : Vector3f(3.0F * direction));
      const int left = ground.untilDone(10'000);
      TEST_ASSERT_EQUAL_UINT32(1, ground.calibration.restarts());
      TEST_ASSERT_INT_WITHIN(20, 2000, left);
      ground.assertFoundTheTruth();
    }
  }
}

void test_an_aircraft_carried_about_is_never_done_and_then_gets_it_right() {
  Ground ground;
  for (int i = 0; i < 20'000; ++i) {
    ground.step(ground.random.vector(0.5F), ground.random.vector(2.0F));
    TEST_ASSERT_FALSE(ground.calibration.done());
  }
  TEST_ASSERT_TRUE(ground.calibration.restarts() > 100);
  ground.untilDone(10'000);
  ground.assertFoundTheTruth();
}

void test_a_slow_steady_turn_is_not_taken_for_a_bias() {
  // 0.3 rad/s without any change in it looks as still as a bias does, to the gyro.
  for (const float rate : {0.3F, -0.3F, 1.0F}) {
    Ground ground;
    for (int i = 0; i < 20'000; ++i) {
      ground.step({0.0F, 0.0F, rate});
      TEST_ASSERT_FALSE(ground.calibration.done());
    }
  }
}

void test_a_turn_that_begins_gently_is_noticed() {
  Ground ground;
  for (int i = 0; i < 20'000; ++i) {
    // Swings of 0.2 rad/s and 4 s, as of an aircraft held in the hand.
    ground.step({0.2F * sine(static_cast<float>(i % 4000) * (2.0F * kPi / 4000.0F)), 0.0F, 0.0F});
    TEST_ASSERT_FALSE(ground.calibration.done());
  }
}

void test_nan_from_the_imu_starts_it_over_and_leaves_no_trace() {
  for (int moment = 0; moment < 1990; moment += 199) {
    for (int element = 0; element < 6; ++element) {
      Ground ground;
      for (int i = 0; i < moment; ++i) ground.step();
      Vector3f bad[2] = {Vector3f::Zero(), Vector3f::Zero()};
      bad[element / 3](element % 3) = kNaN;
      ground.step(bad[0], bad[1]);
      ground.untilDone(10'000);
      TEST_ASSERT_EQUAL_UINT32(1, ground.calibration.restarts());
      ground.assertFoundTheTruth();
    }
  }
}

void test_nan_from_magnetometer_or_altimeter_does_not_poison_the_means() {
  // A ground pressure of NaN would make every height of the flight wrong.
  Ground ground;
  for (int i = 0; i < 1000; ++i) ground.step();
  ground.calibration.addMag({kNaN, 0.0F, 0.0F});
  ground.calibration.addMag({0.0F, std::numeric_limits<float>::infinity(), 0.0F});
  for (const float bad : {kNaN, std::numeric_limits<float>::infinity(), 0.0F, -5.0F}) {
    ground.calibration.addPressure(bad);
  }
  ground.untilDone(10'000);
  ground.assertFoundTheTruth();
}

void test_it_waits_for_magnetometer_and_altimeter() {
  for (const bool mag : {true, false}) {
    Ground ground;
    (mag ? ground.magAlive : ground.altAlive) = false;
    TEST_ASSERT_EQUAL_INT(10'000, ground.untilDone(10'000));
    ground.magAlive = ground.altAlive = true;
    // 20 samples of the one that woke up: 0.2 s and 0.4 s.
    TEST_ASSERT_INT_WITHIN(22, mag ? 200 : 390, ground.untilDone(10'000));
    ground.assertFoundTheTruth();
  }
}

void test_readings_from_before_the_last_motion_are_forgotten() {
  Ground ground;
  for (int i = 0; i < 1000; ++i) ground.step();
  ground.calibration.addMag({500.0F, 0.0F, 0.0F});  // past a steel door
  ground.calibration.addPressure(99'000.0F);        // from upstairs
  ground.step({2.0F, 0.0F, 0.0F});
  ground.untilDone(10'000);
  ground.assertFoundTheTruth();
}

void test_a_few_samples_over_two_seconds_are_not_enough() {
  StartCalibration calibration{StartCalibrationConfig{}};
  for (int i = 0; i < 150; ++i) {  // 150 in 7.5 s
    calibration.addMag(kField);
    calibration.addPressure(kPressure);
    calibration.addImu(static_cast<Micros>(i) * 50'000U, kRest, kBias);
  }
  TEST_ASSERT_FALSE(calibration.done());
}

void test_what_comes_after_the_end_changes_nothing() {
  Ground ground;
  ground.untilDone(10'000);
  const Vector3f bias = ground.calibration.gyroBias();
  const Vector3f field = ground.calibration.mag();
  for (int i = 0; i < 100; ++i) ground.step({5.0F, 5.0F, 5.0F}, {5.0F, 5.0F, 5.0F});
  ground.calibration.addMag({0.0F, 0.0F, 0.0F});
  ground.calibration.addPressure(90'000.0F);
  TEST_ASSERT_TRUE(ground.calibration.done());
  assertNear(0.0F, bias, ground.calibration.gyroBias());
  assertNear(0.0F, field, ground.calibration.mag());
  ground.assertFoundTheTruth();
}

}  // namespace

void runStartCalibrationTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_two_seconds_of_standstill_give_biases_and_references);
  RUN_TEST(test_a_constant_bias_is_recovered_to_the_last_digits);
  RUN_TEST(test_a_knock_at_any_moment_starts_it_over);
  RUN_TEST(test_an_aircraft_carried_about_is_never_done_and_then_gets_it_right);
  RUN_TEST(test_a_slow_steady_turn_is_not_taken_for_a_bias);
  RUN_TEST(test_a_turn_that_begins_gently_is_noticed);
  RUN_TEST(test_nan_from_the_imu_starts_it_over_and_leaves_no_trace);
  RUN_TEST(test_nan_from_magnetometer_or_altimeter_does_not_poison_the_means);
  RUN_TEST(test_it_waits_for_magnetometer_and_altimeter);
  RUN_TEST(test_readings_from_before_the_last_motion_are_forgotten);
  RUN_TEST(test_a_few_samples_over_two_seconds_are_not_enough);
  RUN_TEST(test_what_comes_after_the_end_changes_nothing);
}
