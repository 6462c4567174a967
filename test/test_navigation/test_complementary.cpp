/// The filter that runs beside the Kalman filter and stands in for it.
#include <unity.h>

#include "AssertNear.h"
#include "ComplementaryFilter.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kStep = 0.01F;  // s
const Vector3f kField(16.0F, 1.5F, 48.0F);

/// A filter that starts at `attitude`.
ComplementaryFilter filterAt(const Quaternion& attitude, const ComplementaryConfig& config = {}) {
  ComplementaryFilter filter(config);
  filter.initialize({attitude, kField}, kGravity);
  return filter;
}

/// Takes no steady error for gyro bias: what is left decays with one time constant.
ComplementaryConfig withoutBias() {
  ComplementaryConfig config;
  config.biasTime = 1e9F;
  return config;
}

Vector3f atRest(const Quaternion& truth) { return rotateToBody(truth, {0.0F, 0.0F, -kGravity}); }

/// Angle of the rotation between two attitudes, rad.
float between(const Quaternion& a, const Quaternion& b) {
  return quaternionLog(conjugate(a) * b).norm();
}

/// Angle between the two downs, rad. From the sine: exact where it is small.
float tiltBetween(const Quaternion& a, const Quaternion& b) {
  const Vector3f u = downInBody(a);
  const Vector3f v = downInBody(b);
  return arcTangent2(u.cross(v).norm(), u.dot(v));
}

/// `attitude` tilted by `angle` about a horizontal axis.
Quaternion tilted(const Quaternion& attitude, float angle, float axisYaw) {
  const SinCos s = sinCos(axisYaw);
  return quaternionExp(angle * Vector3f(s.cos, s.sin, 0.0F)) * attitude;
}

Quaternion turned(const Quaternion& attitude, float angle) {
  return quaternionExp({0.0F, 0.0F, angle}) * attitude;
}

void hold(ComplementaryFilter& filter, const Quaternion& truth, float seconds,
          const Vector3f& gyro = Vector3f::Zero()) {
  const int steps = static_cast<int>(seconds / kStep + 0.5F);
  for (int i = 0; i < steps; ++i) {
    filter.update(atRest(truth), gyro, kStep);
    filter.updateHeading(rotateToBody(truth, kField), kStep);
  }
}

void test_it_finds_back_from_60_deg_of_tilt_and_any_heading_at_every_attitude() {
  Random random(5);
  for (int trial = 0; trial < 24; ++trial) {
    const Quaternion truth = random.rotation();
    const float heading = (static_cast<float>(trial) - 11.5F) * (kPi / 12.0F);  // all round
    ComplementaryFilter filter =
        filterAt(turned(tilted(truth, kPi / 3.0F, random.uniform(-kPi, kPi)), heading));
    // The slowest part, the bias it took the error for, decays in 82 s (s^2 + s/10 + 1/600 = 0,
    // heading); 600 s of it leave e^-7 of a few degrees.
    hold(filter, truth, 600.0F);
    TEST_ASSERT_TRUE(between(truth, filter.attitude()) < 0.1F * kDegToRad);
  }
}

/// The sine of the error steers: tan(error/2) decays exponentially.
void test_tilt_decays_with_its_time_constant() {
  for (const float tau : {1.0F, 6.0F}) {
    ComplementaryConfig config = withoutBias();
    config.tiltTime = tau;
    for (const float start : {0.01F, kPi / 3.0F}) {
      const Quaternion truth = eulerToQuaternion({0.4F, -0.3F, 1.0F});
      ComplementaryFilter filter = filterAt(tilted(truth, start, 0.7F), config);
      for (int i = 0; i < static_cast<int>(tau / kStep + 0.5F); ++i) {
        filter.update(atRest(truth), Vector3f::Zero(), kStep);
      }
      const SinCos half = sinCos(0.5F * start);
      const float expected = 2.0F * arcTangent2(half.sin * 0.36788F, half.cos);  // 1/e
      // Steps of 10 ms instead of a flow: (1 - dt/tau)^(tau/dt) is 1/e (1 - dt/(2 tau)).
      TEST_ASSERT_FLOAT_WITHIN(0.5F * kStep / tau * expected + 1e-6F, expected,
                               tiltBetween(truth, filter.attitude()));
    }
  }
}

void test_heading_decays_with_its_time_constant() {
  for (const float tau : {2.0F, 10.0F}) {
    ComplementaryConfig config = withoutBias();
    config.headingTime = tau;
    for (const float start : {0.02F, -1.5F, 3.1F}) {
      const Quaternion truth = eulerToQuaternion({-0.5F, 0.8F, -2.0F});
      ComplementaryFilter filter = filterAt(turned(truth, start), config);
      for (int i = 0; i < static_cast<int>(tau / kStep + 0.5F); ++i) {
        filter.updateHeading(rotateToBody(truth, kField), kStep);
      }
      const float expected = std::abs(start) * 0.36788F;
      TEST_ASSERT_FLOAT_WITHIN(0.6F * kStep / tau * expected + 1e-5F, expected,
                               between(truth, filter.attitude()));
    }
  }
}

void test_what_keeps_turning_it_becomes_gyro_bias() {
  const Vector3f bias(0.01F, -0.015F, 0.008F);
  const Quaternion truth = eulerToQuaternion({0.2F, 0.3F, 2.0F});
  ComplementaryFilter filter = filterAt(truth);
  hold(filter, truth, 900.0F, bias);
  // 11 times the slowest time constant of 82 s; rounding of 1e5 steps of unit quaternions.
  assertNear(1e-5F, bias, filter.gyroBias());
  TEST_ASSERT_TRUE(between(truth, filter.attitude()) < 1e-3F);
}

void test_it_turns_with_the_gyro_about_every_axis() {
  for (int axis = 0; axis < 3; ++axis) {
    for (const float direction : {1.0F, -1.0F}) {
      const Quaternion start = eulerToQuaternion({0.3F, -0.2F, 0.9F});
      ComplementaryFilter filter = filterAt(start);
      Vector3f rate = Vector3f::Zero();
      rate(axis) = direction;
      for (int i = 0; i < 150; ++i) filter.update({0.0F, 0.0F, -20.0F}, rate, kStep);
      const Quaternion expected = start * quaternionExp(1.5F * rate);
      assertSameRotation(1e-5F, expected, filter.attitude());  // 150 roundings of 6e-8
      for (int i = 0; i < 150; ++i) filter.update({0.0F, 0.0F, -20.0F}, -rate, kStep);
      assertSameRotation(1e-5F, start, filter.attitude());
    }
  }
}

void test_a_bent_field_turns_it_but_cannot_tilt_it() {
  Random random(6);
  for (int trial = 0; trial < 30; ++trial) {
    const Quaternion truth = random.rotation();
    ComplementaryFilter filter = filterAt(truth);
    for (int i = 0; i < 200; ++i) {
      filter.updateHeading(rotateToBody(truth, random.vector(60.0F)), kStep);
    }
    const Vector3f bent(-5.0F, 30.0F, -40.0F);  // other heading, other dip
    for (int i = 0; i < 2000; ++i) filter.updateHeading(rotateToBody(truth, bent), kStep);
    // Turns about down of at most pi dt/tau each; each rounds the quaternion by 6e-8.
    TEST_ASSERT_TRUE(tiltBetween(truth, filter.attitude()) < 1e-4F);
    TEST_ASSERT_TRUE(between(truth, filter.attitude()) > 0.5F);  // it did turn
  }
}

void test_a_field_straight_up_says_nothing() {
  const Quaternion level;
  ComplementaryFilter filter = filterAt(level);
  filter.updateHeading({0.0F, 0.0F, 50.0F}, kStep);
  filter.updateHeading(Vector3f::Zero(), kStep);
  assertNear(0.0F, level, filter.attitude());
}

/// 20 deg off in tilt, one sample of one second: the sample counts or it does not.
bool counts(float length) {
  const Quaternion truth = eulerToQuaternion({0.35F, 0.0F, 0.0F});
  ComplementaryFilter filter = filterAt(Quaternion{});
  filter.update(atRest(truth) * (length / kGravity), Vector3f::Zero(), 1.0F);
  TEST_ASSERT_TRUE(isFinite(filter.attitude().w));
  return tiltBetween(Quaternion{}, filter.attitude()) > 0.01F;
}

void test_gravity_counts_only_while_the_specific_force_is_nearly_g_long() {
  const float gate = ComplementaryConfig{}.gate;
  TEST_ASSERT_TRUE(counts(kGravity));
  TEST_ASSERT_TRUE(counts(kGravity + 0.99F * gate));
  TEST_ASSERT_TRUE(counts(kGravity - 0.99F * gate));
  TEST_ASSERT_FALSE(counts(kGravity + 1.01F * gate));
  TEST_ASSERT_FALSE(counts(kGravity - 1.01F * gate));
  TEST_ASSERT_FALSE(counts(1e38F));  // its length overflows
  TEST_ASSERT_FALSE(counts(kNaN));
}

/// The gate is about the gravity measured at the start, which is not everywhere 9.80665.
void test_the_gate_is_about_the_gravity_found_at_the_start() {
  ComplementaryFilter filter{ComplementaryConfig{}};
  filter.initialize({Quaternion{}, kField}, 12.0F);
  filter.update({1.0F, 0.0F, -kGravity}, Vector3f::Zero(), 1.0F);  // 2.1 m/s^2 short
  assertNear(0.0F, Quaternion{}, filter.attitude());
}

void test_a_longer_step_than_the_time_constant_overshoots_nothing() {
  const Quaternion truth = eulerToQuaternion({0.0F, 0.0F, 2.0F});
  ComplementaryFilter filter = filterAt(Quaternion{}, withoutBias());
  filter.updateHeading(rotateToBody(truth, kField), 1000.0F);
  assertSameRotation(1e-5F, truth, filter.attitude());
}

void test_what_is_not_a_number_stays_visible() {
  const Vector3f nan = Vector3f::Constant(kNaN);
  ComplementaryFilter turnedByNan = filterAt(Quaternion{});
  turnedByNan.update(atRest(Quaternion{}), nan, kStep);
  TEST_ASSERT_FALSE(isFinite(turnedByNan.attitude().w));
  hold(turnedByNan, Quaternion{}, 10.0F);
  TEST_ASSERT_FALSE(isFinite(turnedByNan.attitude().w));

  ComplementaryFilter wild = filterAt(Quaternion{});
  wild.update(atRest(Quaternion{}), {1e30F, 0.0F, 0.0F}, kStep);
  TEST_ASSERT_FALSE(isFinite(wild.attitude().w));

  ComplementaryFilter headed = filterAt(Quaternion{});
  headed.updateHeading(nan, kStep);
  TEST_ASSERT_FALSE(isFinite(headed.attitude().w));
}

void test_a_new_start_forgets_attitude_and_bias() {
  ComplementaryFilter filter = filterAt(Quaternion{});
  hold(filter, eulerToQuaternion({0.3F, 0.2F, 0.1F}), 20.0F, {0.01F, 0.01F, 0.01F});
  TEST_ASSERT_TRUE(filter.gyroBias().norm() > 1e-3F);
  const Quaternion start = eulerToQuaternion({0.0F, 0.1F, -3.0F});
  filter.initialize({start, kField}, kGravity);
  assertNear(0.0F, start, filter.attitude());
  TEST_ASSERT_TRUE(filter.gyroBias().isZero(0.0F));
}

}  // namespace

void runComplementaryTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_it_finds_back_from_60_deg_of_tilt_and_any_heading_at_every_attitude);
  RUN_TEST(test_tilt_decays_with_its_time_constant);
  RUN_TEST(test_heading_decays_with_its_time_constant);
  RUN_TEST(test_what_keeps_turning_it_becomes_gyro_bias);
  RUN_TEST(test_it_turns_with_the_gyro_about_every_axis);
  RUN_TEST(test_a_bent_field_turns_it_but_cannot_tilt_it);
  RUN_TEST(test_a_field_straight_up_says_nothing);
  RUN_TEST(test_gravity_counts_only_while_the_specific_force_is_nearly_g_long);
  RUN_TEST(test_the_gate_is_about_the_gravity_found_at_the_start);
  RUN_TEST(test_a_longer_step_than_the_time_constant_overshoots_nothing);
  RUN_TEST(test_what_is_not_a_number_stays_visible);
  RUN_TEST(test_a_new_start_forgets_attitude_and_bias);
}
