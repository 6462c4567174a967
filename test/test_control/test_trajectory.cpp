#include <Trajectory.h>
#include <unity.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "AssertNear.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr Micros kStep = 2000;

Reference restAt(const Vector3f& position, float yaw) {
  Reference r;
  r.positionNed = position;
  r.yaw = yaw;
  return r;
}

/// Flies a trajectory and checks at every step what must always hold.
class Watched {
 public:
  explicit Watched(const Reference& start, const TrajectoryLimits& limits = {}, Micros from = 0)
      : path(limits), limits_(limits), now_(from) {
    path.reset(from, start);
    last_ = path.reference();
  }

  void step(Micros dt = kStep) {
    now_ += dt;
    const Reference next = path.update(now_);
    const float seconds = toSeconds(dt);
    // The speed may rise a little beyond its limit when a change of target meets an aircraft that
    // is still accelerating, as the jerk is limited too; peaks between the planner's eight samples
    // exceed what it saw. Both stay below the 5 % found by a search over 4000 changes of target.
    const Vector3f& v = next.velocityNed;
    TEST_ASSERT_TRUE(std::hypot(v.x(), v.y()) <= 1.05F * limits_.speedHorizontal);
    TEST_ASSERT_TRUE(std::abs(v.z()) <= 1.05F * limits_.speedVertical);
    TEST_ASSERT_TRUE(next.accelerationNed.norm() <= 1.05F * limits_.acceleration);
    TEST_ASSERT_TRUE(std::abs(next.yawRate) <= 1.05F * limits_.yawRate);
    // Continuous, and each the derivative of the one before: what the trapezoidal rule leaves out
    // is below jerk dt^3 / 12, with 30 % of jerk between samples, plus float rounding.
    const float jerk = 1.3F * limits_.jerk;
    const Vector3f& a = next.accelerationNed;
    TEST_ASSERT_TRUE((a - last_.accelerationNed).norm() <= jerk * seconds + 2e-5F);
    const Vector3f gained = 0.5F * seconds * (a + last_.accelerationNed);
    TEST_ASSERT_TRUE((v - last_.velocityNed - gained).norm() < jerk * seconds * seconds + 1e-5F);
    const Vector3f moved = 0.5F * seconds * (v + last_.velocityNed);
    const float left =
        jerk * seconds * seconds * seconds + limits_.acceleration * seconds * seconds;
    const float far = (next.positionNed - path.target()).norm();
    // Float: a rounding of the polynomial's 15 is 1e-6 of the way.
    TEST_ASSERT_TRUE((next.positionNed - last_.positionNed - moved).norm() <
                     left + 1e-5F + 2e-6F * far);
    const float turned = wrapAngle(next.yaw - last_.yaw);
    TEST_ASSERT_FLOAT_WITHIN(limits_.yawAcceleration * seconds * seconds + 1e-5F,
                             0.5F * seconds * (next.yawRate + last_.yawRate), turned);
    TEST_ASSERT_TRUE(std::abs(next.yawRate - last_.yawRate) <=
                     1.05F * limits_.yawAcceleration * seconds + 1e-5F);
    TEST_ASSERT_TRUE(next.yaw > -kPi && next.yaw <= kPi);
    last_ = next;
  }

  void fly(float seconds) {
    for (float t = 0.0F; t < seconds; t += toSeconds(kStep)) step();
  }

  /// Until it rests, at most 200 s. @return s
  float run() {
    const Micros start = now_;
    while (!path.arrived() && elapsed(now_, start) < 200'000'000U) step();
    TEST_ASSERT_TRUE(path.arrived());
    return toSeconds(elapsed(now_, start));
  }

  void assertRestsAt(const Vector3f& position, float yaw) {
    run();
    const Reference& r = path.reference();
    TEST_ASSERT_TRUE(r.positionNed == position);  // to the last bit
    TEST_ASSERT_TRUE(r.velocityNed == Vector3f::Zero());
    TEST_ASSERT_TRUE(r.accelerationNed == Vector3f::Zero());
    TEST_ASSERT_TRUE(r.yaw == yaw);
    TEST_ASSERT_TRUE(r.yawRate == 0.0F);
  }

  Trajectory path;

 private:
  TrajectoryLimits limits_;
  Micros now_;
  Reference last_;
};

void test_a_trajectory_starts_where_the_aircraft_is_and_stays_there() {
  Watched flight(restAt({1.0F, 2.0F, -3.0F}, 2.0F));
  TEST_ASSERT_TRUE(flight.path.arrived());
  flight.fly(0.1F);
  flight.assertRestsAt({1.0F, 2.0F, -3.0F}, 2.0F);
}

void test_the_way_is_straight_and_never_turns_back() {
  const Vector3f from(0.3F, -0.2F, -2.0F);
  const Vector3f to(5.3F, 2.8F, -3.0F);
  const Vector3f along = (to - from).normalized();
  Watched flight(restAt(from, 0.0F));
  flight.path.setTarget(to, 0.0F);
  float furthest = 0.0F;
  while (!flight.path.arrived()) {
    flight.step();
    const Vector3f way = flight.path.reference().positionNed - from;
    TEST_ASSERT_TRUE(way.cross(along).norm() < 6e-6F);  // rounding of 6 m
    TEST_ASSERT_TRUE(way.dot(along) >= furthest - 6e-6F);
    furthest = way.dot(along);
  }
  flight.assertRestsAt(to, 0.0F);
}

void test_from_rest_the_way_takes_as_long_as_its_peaks_say() {
  // Each against the closed form of the quintic, to two steps.
  const auto takes = [](const Vector3f& to, const TrajectoryLimits& limits) {
    Watched flight(restAt({0, 0, 0}, 0.0F), limits);
    flight.path.setTarget(to, 0.0F);
    return flight.run();
  };
  TrajectoryLimits free;
  free.acceleration = free.jerk = 1e3F;
  TEST_ASSERT_FLOAT_WITHIN(0.004F, 1.875F * 5.0F / 2.0F, takes({3.0F, 4.0F, 0.0F}, free));
  TEST_ASSERT_FLOAT_WITHIN(0.004F, 1.875F * 2.0F / 1.0F, takes({0.0F, 0.0F, -2.0F}, free));
  TrajectoryLimits gentle;
  gentle.acceleration = 0.5F;
  TEST_ASSERT_FLOAT_WITHIN(0.004F, std::sqrt(5.7735F * 2.0F / 0.5F), takes({2, 0, 0}, gentle));
  TrajectoryLimits smooth;
  smooth.jerk = 0.5F;
  TEST_ASSERT_FLOAT_WITHIN(0.004F, std::cbrt(60.0F * 1.0F / 0.5F), takes({1, 0, 0}, smooth));
  Watched turn(restAt({0, 0, 0}, 0.0F));
  turn.path.setTarget({0, 0, 0}, kHalfPi);
  TEST_ASSERT_FLOAT_WITHIN(0.004F, 1.875F * 90.0F / 60.0F, turn.run());
}

void test_the_jerk_is_the_derivative_of_the_acceleration() {
  Trajectory path;
  path.reset(0, restAt(Vector3f::Zero(), 0.0F));
  path.setTarget({3.0F, -2.0F, -1.0F}, 1.0F);
  Micros now = 0;
  Reference before = path.update(now += kStep);
  Reference here = path.update(now += kStep);
  int compared = 0;
  while (!path.arrived()) {
    if (now == 1'000'000) path.setTarget({0.0F, 4.0F, -2.0F}, 0.5F);  // then a stop is added to it
    const Reference next = path.update(now += kStep);
    const Vector3f slope =
        (next.accelerationNed - before.accelerationNed) / (2.0F * toSeconds(kStep));
    // Central difference of a polynomial: what it leaves out is below 60 D / T^5 dt^2; rounding of
    // 2 m/s^2 over 4 ms is 1e-4. Not where a part begins or ends: there the jerk jumps.
    if ((next.jerkNed - here.jerkNed).norm() < 0.1F &&
        (here.jerkNed - before.jerkNed).norm() < 0.1F) {
      TEST_ASSERT_TRUE((slope - here.jerkNed).norm() < 0.01F);
      ++compared;
    }
    before = here;
    here = next;
  }
  TEST_ASSERT_TRUE(compared > 1000);
  TEST_ASSERT_TRUE(path.reference().jerkNed.isZero() && path.reference().yawAcceleration == 0.0F);
}

void test_yaw_takes_the_short_way_round() {
  Watched right(restAt({0, 0, 0}, 170.0F * kDegToRad));
  right.path.setTarget({0, 0, 0}, -170.0F * kDegToRad);
  right.fly(0.1F);
  TEST_ASSERT_TRUE(right.path.reference().yawRate > 0.0F);
  TEST_ASSERT_TRUE(right.run() < 2.0F);  // 20 deg, not 340
  right.assertRestsAt({0, 0, 0}, -170.0F * kDegToRad);

  Watched left(restAt({0, 0, 0}, -100.0F * kDegToRad));
  left.path.setTarget({0, 0, 0}, 470.0F * kDegToRad);  // 110 deg, and once around
  left.fly(0.1F);
  TEST_ASSERT_TRUE(left.path.reference().yawRate < 0.0F);
  left.assertRestsAt({0, 0, 0}, wrapAngle(470.0F * kDegToRad));
}

void test_a_new_target_on_the_way_is_taken_without_a_jump_and_met_exactly() {
  Watched flight(restAt({0, 0, 0}, 0.0F));
  flight.path.setTarget({10.0F, 0.0F, 0.0F}, kPi);
  flight.fly(3.0F);
  flight.path.setTarget({-1.0F, 2.0F, -1.0F}, -0.5F);
  TEST_ASSERT_FALSE(flight.path.arrived());
  flight.assertRestsAt({-1.0F, 2.0F, -1.0F}, -0.5F);
}

void test_any_targets_at_any_time_keep_the_limits_and_are_met() {
  Random random(7);
  for (int number = 0; number < 60; ++number) {
    TrajectoryLimits limits;
    limits.speedHorizontal = random.uniform(0.3F, 5.0F);
    limits.speedVertical = random.uniform(0.3F, 2.0F);
    limits.acceleration = random.uniform(0.5F, 4.0F);
    limits.jerk = limits.acceleration * random.uniform(1.0F, 6.0F);
    Watched flight(restAt(random.vector(5.0F), random.uniform(-3.0F, 3.0F)), limits, 0xFFF00000U);
    for (int target = 0; target < 4; ++target) {
      const float size = random.chance(0.3F) ? 0.3F : 8.0F;
      const Vector3f position = random.vector(size);
      const float yaw = random.uniform(-3.1F, 3.1F);
      flight.path.setTarget(position, yaw);
      flight.fly(random.uniform(0.0F, 4.0F));
      if (random.chance(0.7F)) continue;  // the next target comes on the way
      flight.assertRestsAt(position, yaw);
    }
  }
}

void test_a_halt_ends_within_the_braking_distance() {
  Watched flight(restAt({0, 0, 0}, 0.0F));
  flight.path.setTarget({20.0F, 0.0F, 0.0F}, 0.0F);
  flight.fly(9.0F);
  const Reference at = flight.path.reference();
  TEST_ASSERT_TRUE(at.velocityNed.x() > 1.8F);
  flight.path.halt();
  const float time = flight.run();
  const float way = flight.path.reference().positionNed.x() - at.positionNed.x();
  // Half the speed on average; the time that 2 m/s takes at 2 m/s^2 and 6 m/s^3 is 2.15 s.
  TEST_ASSERT_FLOAT_WITHIN(0.1F, 2.15F, time);
  TEST_ASSERT_FLOAT_WITHIN(0.1F * time, 0.5F * at.velocityNed.x() * time, way);
}

void test_a_motion_beyond_the_limits_is_brought_within_them() {
  Reference fast = restAt({0.0F, 0.0F, -3.0F}, 0.0F);
  fast.velocityNed = {5.0F, -3.0F, 2.5F};  // an attitude flown for a while
  Trajectory path;
  path.reset(0, fast);
  path.setTarget({0.0F, 0.0F, -3.0F}, 0.0F);
  float speed = fast.velocityNed.norm();
  Micros now = 0;
  for (; !path.arrived() && now < 60'000'000; now += kStep) {
    const Reference& r = path.update(now);
    TEST_ASSERT_TRUE(r.accelerationNed.norm() <= 2.1F);
    TEST_ASSERT_TRUE(r.velocityNed.norm() <= speed * 1.0001F);
    if (now > 10'000'000) speed = std::hypot(2.0F, 1.0F);  // stopped by 2.15 v / a = 6.8 s
  }
  TEST_ASSERT_TRUE(path.arrived());
  TEST_ASSERT_TRUE(path.reference().positionNed == Vector3f(0.0F, 0.0F, -3.0F));
}

void test_the_speed_of_a_leg_is_its_own() {
  Watched flight(restAt({0, 0, 0}, 0.0F));
  const auto fastest = [&flight](const Vector3f& to) {
    flight.path.setTarget(to, 0.0F);
    float speed = 0.0F;
    while (!flight.path.arrived()) {
      flight.step();
      speed = std::max(speed, flight.path.reference().velocityNed.norm());
    }
    return speed;
  };
  flight.path.setSpeed(0.7F);
  TEST_ASSERT_FLOAT_WITHIN(0.001F, 0.7F, fastest({10.0F, 0.0F, 0.0F}));
  flight.path.setSpeed(0.0F);
  TEST_ASSERT_FLOAT_WITHIN(0.001F, 2.0F, fastest({0.0F, 0.0F, 0.0F}));
}

void test_the_same_target_again_changes_nothing_and_nan_is_ignored() {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  Watched once(restAt({0, 0, 0}, 0.0F));
  Watched often(restAt({0, 0, 0}, 0.0F));
  once.path.setTarget({3.0F, 1.0F, -1.0F}, 1.0F);
  while (!once.path.arrived()) {
    often.path.setTarget({3.0F, 1.0F, -1.0F}, 1.0F);
    often.path.setTarget({kNaN, 0.0F, 0.0F}, 0.0F);
    often.path.setTarget({2.0F, 0.0F, 0.0F}, kNaN);
    once.step();
    often.step();
    TEST_ASSERT_TRUE(once.path.reference().positionNed == often.path.reference().positionNed);
    TEST_ASSERT_TRUE(once.path.reference().yaw == often.path.reference().yaw);
  }
}

void test_targets_a_hair_away_and_far_away_are_met() {
  for (const float x : {1e-30F, 1e-20F, 1e-10F, 1e-6F, 200.0F}) {
    Watched flight(restAt({0, 0, 0}, 0.0F), {}, 0xFFFFFF00U);
    flight.path.setTarget({x, 0.0F, 0.0F}, 0.0F);
    flight.assertRestsAt({x, 0.0F, 0.0F}, 0.0F);
  }
}

void test_a_reference_at_rest_does_not_start_again_when_the_clock_wraps() {
  Trajectory path;
  path.reset(0, {});
  path.setTarget({1.0F, 0.0F, 0.0F}, 0.5F);
  Micros now = 0;
  for (std::uint64_t t = 0; t < 3ULL << 32U; t += 100'000) {
    const Reference& r = path.update(now += 100'000);
    if (t > 10'000'000) TEST_ASSERT_TRUE(r.positionNed == Vector3f(1.0F, 0.0F, 0.0F));
  }
}

void test_a_gap_in_the_loop_does_not_make_the_trajectory_jump() {
  Trajectory path;
  path.reset(0, {});
  path.setTarget({20.0F, 0.0F, 0.0F}, 0.0F);
  Micros now = 0;
  for (int k = 0; k < 4000; ++k) path.update(now += kStep);
  const Reference before = path.reference();
  path.update(now += 5'000'000);
  TEST_ASSERT_FLOAT_WITHIN(0.01F, before.positionNed.x() + 0.1F * before.velocityNed.x(),
                           path.reference().positionNed.x());
}

}  // namespace

void runTrajectoryTests() {
  RUN_TEST(test_a_trajectory_starts_where_the_aircraft_is_and_stays_there);
  RUN_TEST(test_the_way_is_straight_and_never_turns_back);
  RUN_TEST(test_from_rest_the_way_takes_as_long_as_its_peaks_say);
  RUN_TEST(test_the_jerk_is_the_derivative_of_the_acceleration);
  RUN_TEST(test_yaw_takes_the_short_way_round);
  RUN_TEST(test_a_new_target_on_the_way_is_taken_without_a_jump_and_met_exactly);
  RUN_TEST(test_any_targets_at_any_time_keep_the_limits_and_are_met);
  RUN_TEST(test_a_halt_ends_within_the_braking_distance);
  RUN_TEST(test_a_motion_beyond_the_limits_is_brought_within_them);
  RUN_TEST(test_the_speed_of_a_leg_is_its_own);
  RUN_TEST(test_the_same_target_again_changes_nothing_and_nan_is_ignored);
  RUN_TEST(test_targets_a_hair_away_and_far_away_are_met);
  RUN_TEST(test_a_reference_at_rest_does_not_start_again_when_the_clock_wraps);
  RUN_TEST(test_a_gap_in_the_loop_does_not_make_the_trajectory_jump);
}
