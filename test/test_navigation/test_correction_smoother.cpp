// GPS's corrections on their way to guidance and control.
#include <unity.h>

#include <algorithm>
#include <cmath>

#include "CorrectionSmoother.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kPeriod = 0.002F;  // s

VehicleState at(float north, float east, float speed = 0.0F) {
  VehicleState state;
  state.positionNed = {north, east, -3.0F};
  state.velocityNed = {speed, 0.0F, 0.5F};
  return state;
}

/// What guidance and control see of the filter's state.
VehicleState seen(const CorrectionSmoother& smoother, VehicleState filter) {
  smoother.apply(filter);
  return filter;
}

void test_a_fix_does_not_move_the_output_and_is_given_back_without_overshoot() {
  CorrectionSmoother smoother(2.0F, kPeriod);
  smoother.correct(at(0.0F, 0.0F), at(0.3F, -0.1F));
  const VehicleState filter = at(0.3F, -0.1F);
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 0.0F, seen(smoother, filter).positionNed.x());
  float before = 0.0F;
  for (int k = 1; k <= 10'000; ++k) {
    smoother.advance();
    const VehicleState now = seen(smoother, filter);
    const float north = now.positionNed.x();
    TEST_ASSERT_TRUE(north >= before - 1e-6F && north <= 0.3F + 1e-6F);
    // Velocity is the derivative of the place; a step of Euler's method differs by its own.
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, (north - before) / kPeriod, now.velocityNed.x());
    TEST_ASSERT_FLOAT_WITHIN(1e-6F, -north / 3.0F, now.positionNed.y());
    // (1 + w t) e^-wt of it is still kept: to 0.3 % of the jump, which is Euler's step of w / 500.
    const float wt = 0.5F * kPeriod * static_cast<float>(k);
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, 0.3F * (1.0F - (1.0F + wt) * std::exp(-wt)), north);
    before = north;
  }
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, 0.3F, before);
}

void test_what_is_told_of_the_outputs_motion_is_its_derivative() {
  CorrectionSmoother smoother(0.7F, kPeriod);
  const VehicleState filter = at(0.3F, -0.1F, 0.2F);
  smoother.correct(at(0.0F, 0.0F), filter);
  VehicleState before = seen(smoother, filter);
  for (int k = 0; k < 2000; ++k) {
    smoother.advance();
    const VehicleState now = seen(smoother, filter);
    const Vector2f v = (now.velocityNed - before.velocityNed).head<2>() / kPeriod;
    // It changes by up to 3.5 m/s^3 times 2 ms.
    TEST_ASSERT_TRUE((now.correctionAcceleration - v).norm() < 0.01F);
    before = now;
  }
  TEST_ASSERT_TRUE(before.correctionAcceleration.norm() < 0.02F);
}

void test_height_attitude_and_rates_pass_as_they_are() {
  CorrectionSmoother smoother(2.0F, kPeriod);
  VehicleState from = at(0.0F, 0.0F);
  VehicleState to = at(1.0F, 1.0F);
  to.positionNed.z() = -4.0F;
  to.rateBody = {1.0F, 2.0F, 3.0F};
  smoother.correct(from, to);
  const VehicleState now = seen(smoother, to);
  TEST_ASSERT_EQUAL_FLOAT(-4.0F, now.positionNed.z());
  TEST_ASSERT_EQUAL_FLOAT(0.5F, now.velocityNed.z());
  TEST_ASSERT_TRUE(now.rateBody == to.rateBody);
}

void test_noise_of_fixes_hardly_reaches_the_velocity() {
  // Jumps of 4 cm RMS each tenth of a second, as of fixes of 3 m: taken after, they are a speed of
  // 0.4 m/s; smoothed by 2 s they are 0.4 sqrt(0.1 / (4 2)) = 0.045 m/s.
  Random random(3);
  CorrectionSmoother smoother(2.0F, kPeriod);
  VehicleState filter = at(0.0F, 0.0F);
  double square = 0.0;
  int count = 0;
  for (int k = 0; k < 500 * 600; ++k) {
    if (k % 50 == 0) {
      const VehicleState before = filter;
      filter.positionNed.x() += random.uniform(-0.0693F, 0.0693F);
      smoother.correct(before, filter);
    }
    smoother.advance();
    const float v = seen(smoother, filter).velocityNed.x();
    square += static_cast<double>(v * v);
    ++count;
  }
  // 600 s hold some 150 independent stretches of 4 s: 12 % of a sigma.
  TEST_ASSERT_FLOAT_WITHIN(0.3F * 0.045F, 0.045F, std::sqrt(static_cast<float>(square / count)));
}

void test_what_fixes_say_for_long_comes_in_beyond_its_bound() {
  CorrectionSmoother smoother(2.0F, kPeriod);
  VehicleState filter = at(0.0F, 0.0F);
  for (int k = 0; k < 20; ++k) {  // 10 m, to one side
    const VehicleState before = filter;
    filter.positionNed.x() += 0.5F;
    smoother.correct(before, filter);
    smoother.advance();
    TEST_ASSERT_TRUE(filter.positionNed.x() - seen(smoother, filter).positionNed.x() < 0.501F);
  }
}

void test_off_or_cleared_the_output_is_the_filters() {
  CorrectionSmoother off(0.0F, kPeriod);
  off.correct(at(0.0F, 0.0F), at(5.0F, 5.0F, 1.0F));
  off.advance();
  TEST_ASSERT_TRUE(seen(off, at(5.0F, 5.0F)).positionNed == at(5.0F, 5.0F).positionNed);
  TEST_ASSERT_TRUE(seen(off, at(5.0F, 5.0F)).correctionAcceleration.isZero());
  CorrectionSmoother cleared(2.0F, kPeriod);
  cleared.correct(at(0.0F, 0.0F), at(0.5F, 0.5F, 1.0F));
  cleared.clear();
  TEST_ASSERT_TRUE(seen(cleared, at(5.0F, 5.0F)).positionNed == at(5.0F, 5.0F).positionNed);
}

}  // namespace

void runCorrectionSmootherTests() {
  RUN_TEST(test_a_fix_does_not_move_the_output_and_is_given_back_without_overshoot);
  RUN_TEST(test_what_is_told_of_the_outputs_motion_is_its_derivative);
  RUN_TEST(test_height_attitude_and_rates_pass_as_they_are);
  RUN_TEST(test_noise_of_fixes_hardly_reaches_the_velocity);
  RUN_TEST(test_what_fixes_say_for_long_comes_in_beyond_its_bound);
  RUN_TEST(test_off_or_cleared_the_output_is_the_filters);
}
