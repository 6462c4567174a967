#include <gains/UgglanQ450Observer.h>
#include <unity.h>

#include <cmath>
#include <vector>

#include "AssertNear.h"
#include "ControlLoop.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kDeg = kDegToRad;

/// A pull that leans the aircraft by 10 deg: 1.44 N, on 0.83 kg.
constexpr double kPull = 1.44;

void test_a_steady_wind_is_leant_against_until_no_offset_is_left() {
  for (const float yaw : kHeadings) {
    for (const bool integral : {false, true}) {
      Gains gains = kFullDesign;
      if (!integral) gains.integral = {};
      Loop loop(kQuad5in, gains, yaw);
      // From the right rear, a little downwards, turning it a little.
      loop.quad.forceNed = fromStartFrame({0.8F, -0.6F, 0.5F}, yaw).cast<double>() * kPull;
      loop.quad.torqueBody = {0.0, 0.0, 0.004};
      loop.fly(at({0, 0, 0}, yaw), 30.0);
      const double turned = std::remainder(loop.quad.yaw() - yaw, 2.0 * kPi);
      if (integral) {
        TEST_ASSERT_TRUE(loop.quad.position.norm() < 0.01);
        // Leaning 8 and 6 deg, the nose points 0.4 deg beside the heading (halfHeadingOf).
        TEST_ASSERT_TRUE(std::abs(turned) < 0.5 * kDeg);
      } else {  // k_p e_p is k_alpha 10 deg; and 0.004 N m over the yaw gain
        TEST_ASSERT_TRUE(loop.quad.position.norm() > 0.5);
        TEST_ASSERT_TRUE(turned > 1.0 * kDeg);
      }
    }
  }
}

void test_the_wind_response_is_the_same_at_every_heading() {
  std::vector<Eigen::Vector3d> north;
  for (const float yaw : kHeadings) {
    Loop loop(kQuad5in, kFullDesign, yaw);
    loop.quad.forceNed = fromStartFrame({0.8F, -0.6F, 0.3F}, yaw).cast<double>() * kPull;
    const Reference reference = at(fromStartFrame({1.0F, 2.0F, -1.0F}, yaw), yaw + 0.6F);
    for (std::size_t k = 0; k < 5000; ++k) {
      loop.step(reference);
      const Eigen::Vector3d position = inStartFrame(loop.quad.position, yaw);
      if (yaw == 0.0F) {
        north.push_back(position);
      } else {  // float rounding of 2 m, as without wind
        TEST_ASSERT_TRUE((position - north[k]).norm() < 2e-5);
      }
    }
  }
}

void test_what_was_learnt_of_the_wind_stays_true_while_the_aircraft_turns() {
  Loop loop(kQuad5in, kFullDesign, 0.0F);
  loop.quad.forceNed = {kPull, 0.0, 0.0};
  loop.fly({}, 30.0);
  double furthest = 0.0;
  Reference reference;
  reference.yawRate = 0.8F;
  for (int k = 0; k < 5000; ++k) {  // 1.3 turns
    reference.yaw = wrapAngle(reference.yaw + 0.0016F);
    loop.step(reference);
    furthest = std::max(furthest, loop.quad.position.norm());
  }
  TEST_ASSERT_TRUE(furthest < 0.12);  // of 0.9 m without integral action
}

void test_a_heavier_aircraft_on_weaker_motors_comes_back_to_its_height() {
  Loop loop(kQuad5in, kFullDesign, 0.0F);
  loop.quad.forceNed = {0.0, 0.0, 0.45 * 0.83 * 9.80665};
  loop.fly({}, 25.0);
  TEST_ASSERT_TRUE(std::abs(loop.quad.position.z()) < 0.01);
}

void test_the_integrals_ask_for_no_more_than_allowed() {
  const ControlConfig config = unfiltered();
  Controller controller(kQuad5in, kFullDesign, config);
  controller.reset(0);
  // Held where it is, for two minutes, 1 m north of, 0.5 m below and right of its reference.
  const VehicleState state = facing(0.3F, {1.0F, 0.0F, 0.5F});
  for (Micros k = 0; k < 60000; ++k) {
    TEST_ASSERT_TRUE(controller.updateControl(k * kControlStep, at({0, 0, 0}, 0.0F), state));
    controller.setAchieved(controller.getControl());
  }
  const float tilt =
      kFullDesign.integral[1] / kFullDesign.k[1][6] * controller.integral().horizontalNed().norm();
  TEST_ASSERT_TRUE(tilt <= 20.0F * kDeg && tilt > 15.0F * kDeg);
  // What is left of it beside the feedback of w_hat.
  TEST_ASSERT_FLOAT_WITHIN(
      1e-4F, 0.5F * 0.83F * 9.80665F,
      -kFullDesign.integral[0] * controller.integral().down() / (1.0F + kFullDesign.lag[0]));
  // A quarter of 8.1 N times 7.51e-7 / 6.583e-5 m.
  TEST_ASSERT_FLOAT_WITHIN(
      1e-5F, 0.02321F,
      kFullDesign.integral[3] * controller.integral().yaw() / (1.0F + kFullDesign.lag[3]));
}

void test_an_integral_stops_where_its_control_is_at_its_limit_and_leaves_it_at_once() {
  Controller controller(kQuad5in, kFullDesign, unfiltered());
  controller.reset(0);
  Micros now = 0;
  // 0.3 m too low, with motors that give 9 N whatever is asked for; too far left, held.
  const VehicleState low = facing(0.0F, {0.0F, 0.0F, 0.3F});
  const VehicleState high = facing(0.0F, {0.0F, 0.0F, -0.3F});
  const auto step = [&](const VehicleState& state, float thrust, float yawTorque) {
    TEST_ASSERT_TRUE(controller.updateControl(now, at({0, 0, 0}, 0.0F), state));
    const Vector3f torque = controller.getControl().torque;
    controller.setAchieved({thrust, {torque.x(), torque.y(), yawTorque}});
    now += kControlStep;
  };
  for (int k = 0; k < 10000; ++k) step(low, 8.2F, 0.0F);
  TEST_ASSERT_TRUE(controller.getControl().thrust > 8.3F);
  TEST_ASSERT_TRUE(controller.integral().down() < 0.01F);  // 20 s x 0.3 m would be 6
  const float stuck = controller.integral().down();
  step(high, 8.2F, 0.0F);
  TEST_ASSERT_TRUE(controller.integral().down() < stuck);
  // At the lower limit it is the other way round.
  for (int k = 0; k < 10000; ++k) step(high, 8.1F, 0.0F);
  TEST_ASSERT_TRUE(controller.integral().down() > -0.01F);
  // Yaw, 0.2 rad too far right and no torque to be had.
  const VehicleState right = facing(0.2F);
  for (int k = 0; k < 10000; ++k) step(right, 8.14F, 0.0F);
  TEST_ASSERT_TRUE(std::abs(controller.integral().yaw()) < 0.01F);
  // With what was asked for it moves.
  for (int k = 0; k < 1000; ++k) step(right, 8.14F, controller.getControl().torque.z());
  TEST_ASSERT_TRUE(controller.integral().yaw() > 0.3F);
}

/// Largest overshoot beyond the reference after a disturbance has ended, m.
double overshootAfter(const Eigen::Vector3d& force, double seconds, const ControlConfig& config) {
  Loop loop(kQuad5in, kFullDesign, 0.5F, config);
  loop.quad.forceNed = force;
  loop.fly(at({0, 0, 0}, 0.5F), seconds);
  loop.quad.forceNed.setZero();
  TEST_ASSERT_TRUE(loop.quad.position.norm() > 2.0);
  double most = 0.0;
  for (int k = 0; k < 20000; ++k) {
    loop.step(at({0, 0, 0}, 0.5F));
    most = std::max(most, -loop.quad.position.dot(force.normalized()));
  }
  TEST_ASSERT_TRUE(loop.quad.position.norm() < 0.05);
  return most;
}

void test_a_long_saturation_is_recovered_from_without_the_integral_paying_back() {
  // A downdraught of 22 N, against the 10 N that errors at their limits ask for beside the weight.
  TEST_ASSERT_TRUE(overshootAfter({0.0, 0.0, 22.0}, 1.0, ControlConfig{}) < 0.4);
  // A gale of 7 N that the tilt limit, 5.7 N, does not hold. It leaves at 7 m/s.
  TEST_ASSERT_TRUE(overshootAfter({4.2, -5.6, 0.0}, 3.0, ControlConfig{}) < 0.6);
}

void test_on_the_ground_nothing_is_integrated() {
  Controller controller(kQuad5in, kFullDesign, unfiltered());
  controller.reset(0);
  const VehicleState state = facing(0.2F, {0.5F, -0.5F, 0.3F});
  Micros now = 0;
  const auto run = [&](int steps) {
    for (int k = 0; k < steps; ++k, now += kControlStep) {
      TEST_ASSERT_TRUE(controller.updateControl(now, at({0, 0, 0}, 0.0F), state));
      controller.setAchieved(controller.getControl());
    }
  };
  controller.setGrounded(true);
  run(5000);
  assertNear(0.0F, Vector2f(0.0F, 0.0F), controller.integral().horizontalNed());
  TEST_ASSERT_EQUAL_FLOAT(0.0F, controller.integral().down());
  TEST_ASSERT_EQUAL_FLOAT(0.0F, controller.integral().yaw());
  controller.setGrounded(false);
  run(500);  // 1 s
  assertNear(1e-4F, Vector2f(0.5F, -0.5F), controller.integral().horizontalNed());
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 0.3F, controller.integral().down());
  controller.setGrounded(true);  // landed
  TEST_ASSERT_EQUAL_FLOAT(0.0F, controller.integral().down());
  controller.setGrounded(false);
  run(500);
  controller.reset(now);
  assertNear(0.0F, Vector2f(0.0F, 0.0F), controller.integral().horizontalNed());
  TEST_ASSERT_EQUAL_FLOAT(0.0F, controller.integral().yaw());
}

void test_a_change_of_mode_keeps_yaw_and_height_and_forgets_the_place() {
  Loop loop(kQuad5in, kFullDesign, 0.0F);
  loop.quad.forceNed = {kPull, 0.0, 1.0};
  loop.quad.torqueBody = {0.0, 0.0, 0.004};
  loop.fly({}, 20.0);
  const float yaw = loop.controller.integral().yaw();
  const float down = loop.controller.integral().down();
  TEST_ASSERT_TRUE(yaw > 0.1F && down > 0.5F);
  loop.step(leaning(0.0F, 0.0F, 0.0F));
  assertNear(0.0F, Vector2f(0.0F, 0.0F), loop.controller.integral().horizontalNed());
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, yaw, loop.controller.integral().yaw());
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, down, loop.controller.integral().down());
  // Blown away level for 2 s, at its height and heading.
  loop.fly(leaning(0.0F, 0.0F, 0.0F), 2.0);
  assertNear(0.0F, Vector2f(0.0F, 0.0F), loop.controller.integral().horizontalNed());
  TEST_ASSERT_TRUE(loop.quad.position.x() > 2.0);
  TEST_ASSERT_TRUE(std::abs(loop.quad.position.z()) < 0.1);
  TEST_ASSERT_TRUE(std::abs(loop.quad.yaw()) < 1.0 * kDeg);
}

void test_ugglans_law_under_the_position_loop_holds_its_place_in_wind() {
  ControlConfig config;
  config.reducedObserver = &kUgglanQ450ObserverGains;
  for (const float yaw : {0.0F, 2.0F}) {
    Loop loop(kUgglanQ450, kUgglanQ450Gains, yaw, config);
    loop.fly(at({1.0F, 0.0F, -1.0F}, yaw + 0.5F), 20.0);
    TEST_ASSERT_TRUE((loop.quad.position - Eigen::Vector3d(1.0, 0.0, -1.0)).norm() < 0.05);
    TEST_ASSERT_TRUE(std::abs(std::remainder(loop.quad.yaw() - yaw - 0.5, 2.0 * kPi)) < 0.02);
    loop.quad.forceNed = {0.0, 1.0, 0.0};
    loop.fly(at({1.0F, 0.0F, -1.0F}, yaw + 0.5F), 40.0);
    TEST_ASSERT_TRUE((loop.quad.position - Eigen::Vector3d(1.0, 0.0, -1.0)).norm() < 0.05);
    TEST_ASSERT_TRUE(loop.largestTilt < 25.0 * kDeg);
  }
}

}  // namespace

void runIntegralActionTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_steady_wind_is_leant_against_until_no_offset_is_left);
  RUN_TEST(test_the_wind_response_is_the_same_at_every_heading);
  RUN_TEST(test_what_was_learnt_of_the_wind_stays_true_while_the_aircraft_turns);
  RUN_TEST(test_a_heavier_aircraft_on_weaker_motors_comes_back_to_its_height);
  RUN_TEST(test_the_integrals_ask_for_no_more_than_allowed);
  RUN_TEST(test_an_integral_stops_where_its_control_is_at_its_limit_and_leaves_it_at_once);
  RUN_TEST(test_a_long_saturation_is_recovered_from_without_the_integral_paying_back);
  RUN_TEST(test_on_the_ground_nothing_is_integrated);
  RUN_TEST(test_a_change_of_mode_keeps_yaw_and_height_and_forgets_the_place);
  RUN_TEST(test_ugglans_law_under_the_position_loop_holds_its_place_in_wind);
}
