#include <ReferenceRamp.h>
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

VehicleState standing(const Vector3f& position, float yaw) {
  VehicleState state;
  state.positionNed = position;
  state.attitude = eulerToQuaternion({0.0F, 0.0F, yaw});
  return state;
}

/// Runs a ramp and checks at every step what must always hold.
class Watched {
 public:
  explicit Watched(const VehicleState& start, const RampLimits& limits = {}, Micros from = 0)
      : ramp(limits), limits_(limits), now_(from) {
    ramp.reset(from, start);
    last_ = ramp.update(from);
  }

  void step(Micros dt = kStep) {
    now_ += dt;
    const Reference next = ramp.update(now_);
    const float seconds = toSeconds(dt);
    const Vector3f& v = next.velocityNed;
    // Speeds: float rounding only.
    TEST_ASSERT_TRUE(std::hypot(v.x(), v.y()) <= limits_.speedHorizontal * 1.000001F);
    TEST_ASSERT_TRUE(std::abs(v.z()) <= limits_.speedVertical * 1.000001F);
    TEST_ASSERT_TRUE(std::abs(next.yawRate) <= limits_.yawRate * 1.000001F);
    // Accelerations: the end is met exactly, which takes the last step's rounding of the way,
    // 1e-6 m in 2 ms, out of the speed.
    TEST_ASSERT_TRUE((v - last_.velocityNed).norm() <= limits_.acceleration * seconds + 1e-3F);
    TEST_ASSERT_TRUE(std::abs(next.yawRate - last_.yawRate) <=
                     limits_.yawAcceleration * seconds + 1e-3F);
    // The velocity fed forward is the one the position moves with, to float rounding and what the
    // last step leaves out, less than a dt^2 / 2.
    const float half = 0.5F * seconds * seconds;
    const Vector3f moved = next.positionNed - last_.positionNed;
    const Vector3f expected = 0.5F * seconds * (v + last_.velocityNed);
    TEST_ASSERT_TRUE((moved - expected).norm() < 5e-6F + half * limits_.acceleration);
    const float turned = wrapAngle(next.yaw - last_.yaw);
    TEST_ASSERT_FLOAT_WITHIN(2e-6F + half * limits_.yawAcceleration,
                             0.5F * seconds * (next.yawRate + last_.yawRate), turned);
    // So is the acceleration.
    const Vector3f gained = v - last_.velocityNed;
    TEST_ASSERT_TRUE((gained - seconds * next.accelerationNed).norm() < 1e-6F);
    TEST_ASSERT_TRUE(next.yaw > -kPi && next.yaw <= kPi);
    last_ = next;
  }

  /// Until arrival, at most a minute. @return s
  float run(Micros dt = kStep) {
    const Micros start = now_;
    while (!ramp.arrived() && elapsed(now_, start) < 60'000'000U) step(dt);
    TEST_ASSERT_TRUE(ramp.arrived());
    return toSeconds(elapsed(now_, start));
  }

  ReferenceRamp ramp;

 private:
  RampLimits limits_;
  Micros now_;
  Reference last_;
};

void test_the_reference_starts_where_the_aircraft_is_and_stays_there() {
  Watched flight(standing({1.0F, 2.0F, -3.0F}, 2.0F));
  for (int k = 0; k < 100; ++k) flight.step();
  assertNear(0.0F, Vector3f(1.0F, 2.0F, -3.0F), flight.ramp.reference().positionNed);
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 2.0F, flight.ramp.reference().yaw);
  TEST_ASSERT_TRUE(flight.ramp.arrived());
}

void test_a_waypoint_is_met_exactly_at_rest_on_a_straight_line_and_in_time() {
  const Vector3f from(0.3F, -0.2F, -2.0F);
  const Vector3f to(5.3F, 2.8F, -2.0F);
  const Vector3f along = (to - from).normalized();
  Watched flight(standing(from, 0.0F));
  flight.ramp.setTarget(to, 0.0F);
  float furthest = 0.0F;
  while (!flight.ramp.arrived()) {
    flight.step();
    const Vector3f way = flight.ramp.reference().positionNed - from;
    TEST_ASSERT_TRUE(way.cross(along).norm() < 2e-6F);
    TEST_ASSERT_TRUE(way.dot(along) >= furthest - 1e-6F);  // never back, so never past the end
    furthest = way.dot(along);
  }
  assertNear(0.0F, to, flight.ramp.reference().positionNed);
  assertNear(0.0F, Vector3f(0.0F, 0.0F, 0.0F), flight.ramp.reference().velocityNed);
}

void test_the_way_takes_as_long_as_its_limits_say() {
  // Distance / speed + speed / acceleration, to two steps.
  Watched level(standing({0, 0, 0}, 0.0F));
  level.ramp.setTarget({3.0F, 4.0F, 0.0F}, 0.0F);
  TEST_ASSERT_FLOAT_WITHIN(0.004F, 5.0F / 1.0F + 1.0F / 1.0F, level.run());

  Watched up(standing({0, 0, 0}, 0.0F));
  up.ramp.setTarget({0.0F, 0.0F, -2.0F}, 0.0F);
  TEST_ASSERT_FLOAT_WITHIN(0.004F, 2.0F / 0.7F + 0.7F / 1.0F, up.run());

  // Along a slope of 45 deg the vertical limit counts.
  Watched slope(standing({0, 0, 0}, 0.0F));
  slope.ramp.setTarget({2.0F, 0.0F, -2.0F}, 0.0F);
  const float speed = 0.7F * std::sqrt(2.0F);
  TEST_ASSERT_FLOAT_WITHIN(0.004F, std::sqrt(8.0F) / speed + speed, slope.run());

  // Too short to reach full speed: 2 sqrt(distance / acceleration).
  Watched hop(standing({0, 0, 0}, 0.0F));
  hop.ramp.setTarget({0.25F, 0.0F, 0.0F}, 0.0F);
  TEST_ASSERT_FLOAT_WITHIN(0.004F, 2.0F * 0.5F, hop.run());

  Watched turn(standing({0, 0, 0}, 0.0F));
  turn.ramp.setTarget({0, 0, 0}, 90.0F * kDegToRad);
  TEST_ASSERT_FLOAT_WITHIN(0.004F, 90.0F / 45.0F + 45.0F / 90.0F, turn.run());
}

void test_yaw_goes_the_short_way_round() {
  Watched right(standing({0, 0, 0}, 170.0F * kDegToRad));
  right.ramp.setTarget({0, 0, 0}, -170.0F * kDegToRad);
  right.step();
  TEST_ASSERT_TRUE(right.ramp.reference().yawRate > 0.0F);
  TEST_ASSERT_TRUE(right.run() < 1.0F);  // 20 deg, not 340
  TEST_ASSERT_EQUAL_FLOAT(-170.0F * kDegToRad, right.ramp.reference().yaw);

  Watched left(standing({0, 0, 0}, -100.0F * kDegToRad));
  left.ramp.setTarget({0, 0, 0}, 470.0F * kDegToRad);  // 110 deg, and once around
  left.step();
  TEST_ASSERT_TRUE(left.ramp.reference().yawRate < 0.0F);
  left.run();
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 110.0F * kDegToRad, left.ramp.reference().yaw);
}

void test_a_new_target_on_the_way_brakes_first_and_is_then_met_exactly() {
  Watched flight(standing({0, 0, 0}, 0.0F));
  flight.ramp.setTarget({10.0F, 0.0F, 0.0F}, kPi);
  for (int k = 0; k < 1500; ++k) flight.step();
  const float atTurn = flight.ramp.reference().positionNed.x();
  flight.ramp.setTarget({-1.0F, 2.0F, -1.0F}, -0.5F);
  TEST_ASSERT_FALSE(flight.ramp.arrived());
  float furthest = 0.0F;
  while (!flight.ramp.arrived()) {
    flight.step();  // accelerations stay within limits through the change
    furthest = std::max(furthest, flight.ramp.reference().positionNed.x());
  }
  TEST_ASSERT_FLOAT_WITHIN(0.005F, atTurn + 0.5F, furthest);  // 1 m/s at 1 m/s^2
  assertNear(0.0F, Vector3f(-1.0F, 2.0F, -1.0F), flight.ramp.reference().positionNed);
  TEST_ASSERT_EQUAL_FLOAT(-0.5F, flight.ramp.reference().yaw);
}

void test_setting_the_same_target_again_changes_nothing() {
  Watched once(standing({0, 0, 0}, 0.0F));
  Watched often(standing({0, 0, 0}, 0.0F));
  once.ramp.setTarget({3.0F, 1.0F, -1.0F}, 1.0F);
  while (!once.ramp.arrived()) {
    often.ramp.setTarget({3.0F, 1.0F, -1.0F}, 1.0F);
    once.step();
    often.step();
    assertNear(0.0F, once.ramp.reference().positionNed, often.ramp.reference().positionNed);
  }
  TEST_ASSERT_TRUE(often.ramp.arrived());
}

void test_any_targets_at_any_pace_of_the_loop_keep_the_limits_and_are_met() {
  Random random(7);
  for (int flightNumber = 0; flightNumber < 40; ++flightNumber) {
    const RampLimits limits{random.uniform(0.2F, 5.0F), random.uniform(0.2F, 2.0F),
                            random.uniform(0.3F, 4.0F), random.uniform(0.2F, 3.0F),
                            random.uniform(0.5F, 9.0F)};
    Watched flight(standing(random.vector(5.0F), random.uniform(-3.0F, 3.0F)), limits, 0xFFF00000U);
    for (int target = 0; target < 4; ++target) {
      const Vector3f position = random.vector(5.0F);
      const float yaw = random.uniform(-3.1F, 3.1F);
      flight.ramp.setTarget(position, yaw);
      const auto steps = random.below(3000);
      for (std::uint32_t k = 0; k < steps; ++k) flight.step(2000 + random.below(4000));
      if (random.chance(0.5F)) continue;  // the next target comes on the way
      flight.run();
      assertNear(0.0F, position, flight.ramp.reference().positionNed);
      TEST_ASSERT_EQUAL_FLOAT(yaw, flight.ramp.reference().yaw);
    }
  }
}

void test_a_long_way_takes_its_time_however_fast_the_loop() {
  for (const Micros pass : {Micros{20}, Micros{700}, Micros{2000}, Micros{5000}}) {
    ReferenceRamp ramp;
    Micros now = 0xFFFFFF00U;
    ramp.reset(now, standing({-150.0F, 0.0F, 0.0F}, 0.0F));
    ramp.setTarget({150.0F, 0.0F, 0.0F}, 0.0F);
    const Micros start = now;
    while (!ramp.arrived() && elapsed(now, start) < 400'000'000U) ramp.update(now += pass);
    // 300 m at 1 m/s. The way left is a float, of 3e-5 m at most: 1.5 % of 2 mm a step.
    TEST_ASSERT_FLOAT_WITHIN(4.5F, 301.0F, toSeconds(elapsed(now, start)));
  }
}

void test_a_target_a_hair_away_is_met() {
  ReferenceRamp ramp;
  Micros now = 0;
  ramp.reset(now, {});
  for (const float x : {1e-30F, 1e-20F, 1e-10F, 1e-6F}) {
    ramp.setTarget({x, 0.0F, 0.0F}, x);
    for (int k = 0; k < 10; ++k) ramp.update(now += kStep);
    TEST_ASSERT_TRUE(ramp.arrived());
    TEST_ASSERT_TRUE(ramp.reference().positionNed.x() == x);
  }
}

void test_a_gap_in_the_loop_does_not_make_the_reference_jump() {
  ReferenceRamp ramp;
  ramp.reset(0, {});
  ramp.setTarget({20.0F, 0.0F, 0.0F}, 0.0F);
  Micros now = 0;
  for (int k = 0; k < 2000; ++k) ramp.update(now += kStep);
  const float before = ramp.reference().positionNed.x();
  ramp.update(now += 5'000'000);
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, before + 0.1F, ramp.reference().positionNed.x());
}

void test_a_lower_speed_on_the_way_is_met_by_braking() {
  Watched flight(standing({0.0F, 0.0F, -3.0F}, 0.0F));  // checks the acceleration at every step
  flight.ramp.setTarget({0.0F, 0.0F, 0.0F}, 0.0F);
  for (int k = 0; k < 1000; ++k) flight.step();
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 0.7F, flight.ramp.reference().velocityNed.z());
  flight.ramp.setVerticalSpeed(0.3F);
  for (int k = 0; k < 250; ++k) flight.step();
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 0.3F, flight.ramp.reference().velocityNed.z());
  flight.run();
  assertNear(0.0F, Vector3f(0.0F, 0.0F, 0.0F), flight.ramp.reference().positionNed);
}

void test_a_target_that_is_not_a_number_is_ignored() {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  Watched flight(standing({1.0F, 0.0F, 0.0F}, 0.0F));
  flight.ramp.setTarget({kNaN, 0.0F, 0.0F}, 0.0F);
  flight.ramp.setTarget({2.0F, 0.0F, 0.0F}, kNaN);
  flight.ramp.setTarget({2.0F, 0.0F, 0.0F}, std::numeric_limits<float>::infinity());
  for (int k = 0; k < 100; ++k) flight.step();
  assertNear(0.0F, Vector3f(1.0F, 0.0F, 0.0F), flight.ramp.reference().positionNed);
}

}  // namespace

void runReferenceRampTests() {
  RUN_TEST(test_the_reference_starts_where_the_aircraft_is_and_stays_there);
  RUN_TEST(test_a_waypoint_is_met_exactly_at_rest_on_a_straight_line_and_in_time);
  RUN_TEST(test_the_way_takes_as_long_as_its_limits_say);
  RUN_TEST(test_yaw_goes_the_short_way_round);
  RUN_TEST(test_a_new_target_on_the_way_brakes_first_and_is_then_met_exactly);
  RUN_TEST(test_setting_the_same_target_again_changes_nothing);
  RUN_TEST(test_any_targets_at_any_pace_of_the_loop_keep_the_limits_and_are_met);
  RUN_TEST(test_a_long_way_takes_its_time_however_fast_the_loop);
  RUN_TEST(test_a_target_a_hair_away_is_met);
  RUN_TEST(test_a_gap_in_the_loop_does_not_make_the_reference_jump);
  RUN_TEST(test_a_lower_speed_on_the_way_is_met_by_braking);
  RUN_TEST(test_a_target_that_is_not_a_number_is_ignored);
}
