// Places and velocities by telemetry, holds that were asked for, and the way down without an IMU.
#include <cmath>
#include <initializer_list>

#include "GuidedFlight.h"
#include "StickRig.h"
#include "suites.h"

using namespace strix;

namespace {

struct Value {
  unsigned place;
  float value;
};

/// A setpoint of which only these values count; the others are nonsense.
VehicleCommand setpoint(std::initializer_list<Value> values) {
  VehicleCommand c;
  c.kind = CommandKind::Setpoint;
  c.values.fill(77.0F);
  for (const Value& v : values) {
    c.index = static_cast<std::uint16_t>(c.index | 1U << v.place);
    c.values[v.place] = v.value;
  }
  return c;
}

constexpr Fence kFence{30.0F, 15.0F};

/// Hovers 5 m up over the start, in GUIDED.
StickRig guided(float yaw, std::initializer_list<Value> values) {
  StickRig rig(FlightState::Manual, yaw);
  rig.run(0.1F);
  rig.enter(FlightState::Hold);
  rig.guidance.setSetpoint(setpoint(values), kFence);
  rig.enter(FlightState::Guided);
  return rig;
}

void test_a_place_is_flown_to_smoothly_and_turned_to_the_short_way() {
  for (const float yaw : {0.0F, 1.6F, 3.1F, -2.0F}) {
    StickRig rig = guided(yaw, {{0, 6.0F}, {1, -3.0F}, {2, 7.0F}, {3, -3.0F}});
    float fastest = 0.0F;
    double beyond = 0.0;
    const Eigen::Vector3d way = Eigen::Vector3d(6.0, -3.0, 0.0).normalized();
    rig.run(12.0F, [&] {
      fastest = std::max(fastest, rig.reference().velocityNed.head<2>().norm());
      beyond = std::max(beyond, rig.quad.position.dot(way) - std::hypot(6.0, 3.0));
      TEST_ASSERT_TRUE(rig.step().second <= 1.42F * 6.0F * StickRig::kPeriod);
    });
    assertNear(0.05F, Vector3f{6.0F, -3.0F, -7.0F}, rig.quad.state().positionNed);
    TEST_ASSERT_TRUE(fastest > 1.7F && fastest <= 2.001F);
    TEST_ASSERT_TRUE(beyond < 0.1);
    TEST_ASSERT_TRUE(std::abs(wrapAngle(static_cast<float>(rig.quad.yaw()) - -3.0F)) <
                     2.0F * kDegToRad);
  }
}

void test_a_velocity_is_flown_within_the_limits_and_the_rest_stays() {
  StickRig rig = guided(1.0F, {{4, 1.0F}, {5, -0.5F}});
  rig.run(3.0F);
  TEST_ASSERT_TRUE((rig.quad.velocity - Eigen::Vector3d(1.0, -0.5, 0.0)).norm() < 0.05);
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 1.0, rig.quad.yaw());
  rig.guidance.setSetpoint(setpoint({{4, 30.0F}, {5, 40.0F}, {6, 9.0F}, {7, 0.5F}}), kFence);
  rig.run(3.0F);
  // 2 m/s of the 50, in their direction; up 1 m/s.
  TEST_ASSERT_TRUE((rig.quad.velocity - Eigen::Vector3d(1.2, 1.6, -1.0)).norm() < 0.1);
  TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.5, rig.quad.rate.z());
}

void test_a_place_that_moves_is_followed_with_the_velocity_that_comes_with_it() {
  StickRig rig = guided(0.0F, {{0, 0.0F}, {1, 0.0F}, {2, 5.0F}});
  for (int i = 0; i < 80; ++i) {  // 10 a second, on a circle of 4 m at 1 m/s
    const float angle = 0.025F * static_cast<float>(i);
    const SinCos s = sinCos(angle);
    rig.guidance.setSetpoint(setpoint({{0, 4.0F * s.sin},
                                       {1, 4.0F - 4.0F * s.cos},
                                       {2, 5.0F},
                                       {4, s.cos},
                                       {5, s.sin},
                                       {6, 0.0F}}),
                             kFence);
    rig.run(0.1F);
    const SinCos now = sinCos(angle + 0.025F);
    const Vector3f there{4.0F * now.sin, 4.0F - 4.0F * now.cos, -5.0F};
    // It started late by half a second, and is given where it was 0.1 s ago.
    if (i > 40) assertNear(0.35F, there, rig.quad.state().positionNed);
  }
}

void test_what_lies_outside_the_fence_is_flown_to_its_inside() {
  for (const auto& values : {setpoint({{0, 300.0F}, {1, 0.0F}, {2, 90.0F}}),
                             setpoint({{4, 2.0F}, {5, 0.0F}, {6, 1.0F}})}) {
    StickRig rig(FlightState::Manual, 2.0F);
    rig.enter(FlightState::Hold);
    rig.guidance.setSetpoint(values, kFence);
    rig.enter(FlightState::Guided);
    rig.run(30.0F, [&] { TEST_ASSERT_TRUE(kFence.contains(rig.quad.state().positionNed)); });
    assertNear(0.5F, Vector3f{29.0F, 0.0F, -14.0F}, rig.quad.state().positionNed);
  }
  StickRig low = guided(0.0F, {{0, 0.0F}, {1, 0.0F}, {2, -4.0F}});
  low.run(15.0F);
  TEST_ASSERT_DOUBLE_WITHIN(0.05, -1.0, low.quad.position.z());
}

void test_leaving_setpoints_stops_where_the_limits_allow() {
  StickRig rig = guided(0.0F, {{4, 2.0F}, {5, 0.0F}, {6, 0.0F}});
  rig.run(3.0F);
  const double left = rig.quad.position.x();
  rig.enter(FlightState::Hold);
  rig.run(6.0F, [&] { TEST_ASSERT_TRUE(rig.step().second <= 6.0F * StickRig::kPeriod * 1.3F); });
  TEST_ASSERT_TRUE(rig.levelSpeed() < 0.02);
  // The polynomial brake of WayToRest.h: 2.15 s from 2 m/s.
  TEST_ASSERT_DOUBLE_WITHIN(0.4, 2.15, rig.quad.position.x() - left);
}

bool goesOn(const GuidedFlight& flight) {
  return (flight.guidance.conditions(flight.now, flight.state) & condition::kHoldDone) != 0;
}

void test_a_hold_that_was_asked_for_lasts_until_somebody_resumes() {
  GuidedFlight flight("takeoff 3 1\nleg 10 0 3 0 1\nleg 0 0 3 0 1\n");
  flight.runUntil(FlightState::Waypoint);
  flight.run(2.0F);
  flight.guidance.enter(FlightState::Hold, flight.now, flight.state, true);
  for (int i = 0; i < 30'000; ++i) {
    flight.now += GuidedFlight::kStep;
    flight.state.positionNed = flight.guidance.update(flight.now, flight.state).positionNed;
    TEST_ASSERT_FALSE(goesOn(flight));
  }
  TEST_ASSERT_TRUE(flight.state.positionNed.x() < 6.0F);  // it stopped on the way
  flight.guidance.resume();
  TEST_ASSERT_TRUE(goesOn(flight));
  // With the leg that was left, not with the next one.
  flight.guidance.enter(FlightState::Waypoint, flight.now, flight.state);
  TEST_ASSERT_EQUAL_UINT(1, flight.guidance.leg());
}

void test_a_mission_taken_over_by_the_pilot_goes_on_when_he_hands_it_back() {
  GuidedFlight flight("takeoff 3 1\nleg 10 0 3 0 1\nleg 0 0 3 0 1\n");
  flight.runUntil(FlightState::Waypoint);
  flight.run(2.0F);
  flight.step(condition::kSticks | condition::kSticksEdge);
  TEST_ASSERT_TRUE(flight.at(FlightState::Manual));
  flight.step();  // no sticks any more
  TEST_ASSERT_TRUE(flight.at(FlightState::Hold));
  flight.runUntil(FlightState::Waypoint, 5.0F);
  TEST_ASSERT_EQUAL_UINT(1, flight.guidance.leg());
  flight.runUntil(FlightState::Land);
}

void test_a_mission_not_begun_waits_for_the_start_after_a_flight_by_the_sticks() {
  StickRig rig(FlightState::Armed);
  rig.enter(FlightState::Manual);
  rig.run(1.0F);
  rig.sticks.mode = PilotMode::Mission;
  rig.enter(FlightState::Hold);
  const auto done = [&rig] {
    return (rig.guidance.conditions(rig.now, rig.quad.state()) & condition::kHoldDone) != 0;
  };
  rig.run(20.0F, [&] { TEST_ASSERT_FALSE(done()); });
  rig.sticks.start = true;
  rig.run(0.1F);
  TEST_ASSERT_TRUE(done());
}

void test_a_start_switch_that_is_still_on_ends_no_hold() {
  StickRig rig(FlightState::Takeoff);
  rig.sticks.mode = PilotMode::Mission;
  rig.sticks.start = true;
  rig.run(0.1F);
  rig.guidance.enter(FlightState::Hold, rig.now, rig.quad.state(), true);
  rig.run(5.0F);
  TEST_ASSERT_TRUE((rig.guidance.conditions(rig.now, rig.quad.state()) & condition::kHoldDone) ==
                   0);
}

void test_without_an_imu_the_descent_is_quick_and_ends_gently() {
  for (const double height : {0.5, 2.0, 5.0, 14.0}) {
    StickRig rig(FlightState::Manual, 1.0F);
    rig.quad.position.z() = -height;
    rig.quad.velocity = {1.5, -1.0, 0.0};
    rig.enter(FlightState::Blind);
    float time = 0.0F;
    float fastest = 0.0F;
    while (rig.quad.position.z() < 0.0 && time < 20.0F) {
      rig.run(StickRig::kPeriod);
      time += StickRig::kPeriod;
      fastest = std::max(fastest, rig.reference().velocityNed.z());
    }
    // Well below the 3 m/s that a leg takes, whatever the height, and without drift.
    TEST_ASSERT_TRUE(rig.quad.velocity.z() < 2.0);
    if (height > 1.5) TEST_ASSERT_TRUE(rig.levelSpeed() < 0.5);
    TEST_ASSERT_TRUE(fastest <= 4.01F);
    TEST_ASSERT_TRUE(time < 1.2F + 0.42F * static_cast<float>(height));
  }
}

void test_an_imu_that_comes_back_in_the_descent_still_means_a_gentle_landing() {
  for (const double height : {1.5, 2.5, 5.0, 10.0}) {
    for (const float blind : {0.03F, 0.3F, 0.6F, 1.0F}) {
      StickRig rig(FlightState::Manual, 1.0F);
      rig.quad.position.z() = -height;
      rig.enter(FlightState::Blind);
      rig.run(blind);
      const Reference before = rig.reference();
      rig.enter(FlightState::Land);
      rig.run(StickRig::kPeriod);
      assertNear(0.02F, before.velocityNed, rig.reference().velocityNed);
      float time = 0.0F;
      while (rig.quad.position.z() < 0.0 && time < 30.0F) {
        rig.run(StickRig::kPeriod);
        time += StickRig::kPeriod;
      }
      TEST_ASSERT_TRUE(time < 30.0F);
      // 0.5 m/s as every landing, unless there is no height left to brake in.
      TEST_ASSERT_TRUE(rig.quad.velocity.z() < (height < 3.0 ? 1.8 : 0.7));
    }
  }
}

}  // namespace

void runSetpointTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_place_is_flown_to_smoothly_and_turned_to_the_short_way);
  RUN_TEST(test_a_velocity_is_flown_within_the_limits_and_the_rest_stays);
  RUN_TEST(test_a_place_that_moves_is_followed_with_the_velocity_that_comes_with_it);
  RUN_TEST(test_what_lies_outside_the_fence_is_flown_to_its_inside);
  RUN_TEST(test_leaving_setpoints_stops_where_the_limits_allow);
  RUN_TEST(test_a_hold_that_was_asked_for_lasts_until_somebody_resumes);
  RUN_TEST(test_a_mission_taken_over_by_the_pilot_goes_on_when_he_hands_it_back);
  RUN_TEST(test_a_mission_not_begun_waits_for_the_start_after_a_flight_by_the_sticks);
  RUN_TEST(test_a_start_switch_that_is_still_on_ends_no_hold);
  RUN_TEST(test_without_an_imu_the_descent_is_quick_and_ends_gently);
  RUN_TEST(test_an_imu_that_comes_back_in_the_descent_still_means_a_gentle_landing);
}
