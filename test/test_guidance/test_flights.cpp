// Missions flown from take-off to landing by an aircraft that is always where it should be.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

#include "GuidedFlight.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr const char* kSquare =
    "takeoff 3 1\nspeed 2\nleg 10 0 3 0 0 1\nleg 10 10 3 0 0 1\nleg 0 10 3 0 0 1\nleg 0 0 3 0 2\n";

void assertStates(const GuidedFlight& flight, std::initializer_list<FlightState> expected) {
  TEST_ASSERT_EQUAL_UINT(expected.size(), flight.states.size());
  TEST_ASSERT_TRUE(std::equal(expected.begin(), expected.end(), flight.states.begin()));
}

/// Largest change of the reference in one tick while `flight` runs until a state.
struct Smoothness {
  float position = 0.0F;
  float velocity = 0.0F;
  float acceleration = 0.0F;
};

template <class Done>
Smoothness watch(GuidedFlight& flight, Done&& done) {
  Smoothness most;
  for (int i = 0; i < 100'000 && !done(); ++i) {
    const Reference before = flight.reference();
    flight.step();
    const Reference& r = flight.reference();
    most.position = std::max(most.position, (r.positionNed - before.positionNed).norm());
    most.velocity = std::max(most.velocity, (r.velocityNed - before.velocityNed).norm());
    most.acceleration =
        std::max(most.acceleration, (r.accelerationNed - before.accelerationNed).norm());
  }
  TEST_ASSERT_TRUE(done());
  return most;
}

void test_each_leg_is_reached_held_and_turned_from_the_heading_at_take_off() {
  for (const float yaw : {0.0F, 2.0F, -2.5F}) {
    GuidedFlight flight("takeoff 2 2\nleg 5 3 2 0 2\nleg 5 3 2 90 2\nleg 0 0 2 90 2\n", yaw);
    flight.runUntil(FlightState::Hold);
    assertNear(1e-3F, Vector3f{0.0F, 0.0F, -2.0F}, flight.state.positionNed);
    struct Place {
      Vector3f position;
      float turn;
    };
    for (const Place& place : {Place{{5.0F, 3.0F, -2.0F}, 0.0F}, Place{{5.0F, 3.0F, -2.0F}, 90.0F},
                               Place{{0.0F, 0.0F, -2.0F}, 90.0F}}) {
      TEST_ASSERT_FLOAT_WITHIN(0.003F, 2.0F, flight.runUntil(FlightState::Waypoint));
      flight.runUntil(FlightState::Hold);
      assertNear(0.0F, place.position, flight.reference().positionNed);
      TEST_ASSERT_FLOAT_WITHIN(
          1e-4F, 0.0F, wrapAngle(yawOf(flight.state.attitude) - yaw - place.turn * kDegToRad));
    }
    TEST_ASSERT_FLOAT_WITHIN(0.003F, 2.0F, flight.runUntil(FlightState::Land));
  }
}

void test_corners_with_no_hold_are_flown_through_near_enough_and_smoothly() {
  GuidedFlight flight(kSquare);
  flight.runUntil(FlightState::Waypoint);
  const Smoothness most = watch(flight, [&flight] {
    if (flight.at(FlightState::Hold) &&
        flight.guidance.conditions(flight.now, flight.state) & condition::kLegsRemain) {
      // At a corner: no nearer than it has to be, and not stopped.
      const Vector3f& p = flight.reference().positionNed;
      const auto gap = [](float x) { return std::min(std::abs(x), std::abs(x - 10.0F)); };
      TEST_ASSERT_FLOAT_WITHIN(0.02F, 1.0F, std::hypot(gap(p.x()), gap(p.y())));
      TEST_ASSERT_TRUE(flight.reference().velocityNed.norm() > 0.8F);
    }
    return flight.at(FlightState::Land);
  });
  // Every tick keeps the speed; the acceleration changes by at most the jerk limit (1.3 times it
  // between the planner's samples) in 2 ms.
  TEST_ASSERT_TRUE(most.position <= 2.0F * 0.002F * 1.05F);
  TEST_ASSERT_TRUE(most.velocity <= 2.0F * 0.002F * 1.05F);
  TEST_ASSERT_TRUE(most.acceleration <= 6.0F * 0.002F * 1.3F);
  assertNear(1e-4F, Vector3f{0.0F, 0.0F, -3.0F}, flight.state.positionNed);
  using S = FlightState;
  assertStates(flight, {S::Hold, S::Waypoint, S::Hold, S::Waypoint, S::Hold, S::Waypoint, S::Hold,
                        S::Waypoint, S::Hold, S::Land});
}

void test_a_corner_waits_for_an_aircraft_that_lags_behind_the_reference() {
  GuidedFlight flight(kSquare);
  flight.runUntil(FlightState::Waypoint);
  const auto arrived = [&flight] {
    return (flight.guidance.conditions(flight.now, flight.state) & condition::kArrived) != 0;
  };
  flight.state.positionNed = {8.9F, 0.0F, -3.0F};  // held there while the reference goes on
  for (int i = 0; i < 6000; ++i) {
    flight.guidance.update(flight.now += GuidedFlight::kStep, flight.state);
    TEST_ASSERT_FALSE(arrived());
  }
  TEST_ASSERT_TRUE(flight.reference().positionNed.x() == 10.0F);
  flight.state.positionNed.x() = 9.1F;
  flight.state.velocityNed = {1.5F, 0.0F, 0.0F};  // no stop
  TEST_ASSERT_TRUE(arrived());
}

void test_an_aircraft_that_does_not_get_there_is_astray_10_s_after_its_path_has_ended() {
  struct Case {
    FlightState state;
    Vector3f away;
  };
  for (const Case& c : {Case{FlightState::Takeoff, {0.0F, 0.0F, 0.6F}},
                        Case{FlightState::Waypoint, {0.0F, -0.6F, 0.0F}},
                        Case{FlightState::Return, {0.6F, 0.0F, 0.0F}}}) {
    GuidedFlight flight("takeoff 3 1\nleg 4 0 3 0 1\nhome\n");
    flight.runUntil(c.state);
    const auto astray = [&flight] {
      return (flight.guidance.conditions(flight.now, flight.state) & condition::kAstray) != 0;
    };
    Micros ended = flight.now;  // the last tick in which the reference moved
    int ticks = 0;
    for (; ticks < 30'000 && !astray(); ++ticks) {
      const Reference r = flight.guidance.update(flight.now += GuidedFlight::kStep, flight.state);
      flight.state.positionNed = r.positionNed + c.away;
      flight.state.velocityNed = r.velocityNed;
      if (r.velocityNed.norm() > 0.0F) ended = flight.now;
    }
    TEST_ASSERT_TRUE(astray());
    TEST_ASSERT_UINT32_WITHIN(4 * GuidedFlight::kStep, 10'000'000, elapsed(flight.now, ended));
    flight.state.positionNed -= c.away;  // there after all
    flight.guidance.update(flight.now += GuidedFlight::kStep, flight.state);
    TEST_ASSERT_FALSE(astray());
  }
}

void test_the_landing_goes_straight_down_slower_near_the_ground_and_on_below_it() {
  GuidedFlight flight("takeoff 3 0\nleg 4 -2 3 0 1\n");
  flight.runUntil(FlightState::Land);
  float fastest = 0.0F;
  for (int i = 0; i < 10'000; ++i) {
    flight.step();
    const Reference& r = flight.reference();
    TEST_ASSERT_FLOAT_WITHIN(1e-4F, 4.0F, r.positionNed.x());
    TEST_ASSERT_FLOAT_WITHIN(1e-4F, -2.0F, r.positionNed.y());
    // 0.5 m/s, and from 1 m on 0.3 m/s after braking at 1 m/s^2, which takes 0.08 m.
    const float most = -r.positionNed.z() > 0.9F ? 0.5F : 0.3F;
    TEST_ASSERT_TRUE(r.velocityNed.z() <= most + 1e-4F);
    fastest = std::max(fastest, r.velocityNed.z());
  }
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 0.5F, fastest);
  TEST_ASSERT_TRUE(flight.reference().positionNed.z() > 1.0F);
  flight.step(condition::kTouchDown);
  TEST_ASSERT_TRUE(flight.at(FlightState::Idle));
}

void test_an_aircraft_pushed_aside_while_it_lands_is_not_sent_back() {
  GuidedFlight flight("takeoff 3 0\nleg 4 -2 3 0 1\n");
  flight.runUntil(FlightState::Land);
  flight.run(3.0F);
  const Vector3f before = flight.reference().positionNed;
  flight.state.positionNed += Vector3f(-1.5F, 2.0F, 0.0F);
  const Reference& r = flight.guidance.update(flight.now += GuidedFlight::kStep, flight.state);
  const Vector3f ahead = r.positionNed - flight.state.positionNed;
  // 0.3 m are left of 2.5 m, the same way; and down it goes on as it did.
  assertNear(1e-4F, Vector3f{0.18F, -0.24F, ahead.z()}, ahead);
  TEST_ASSERT_FLOAT_WITHIN(0.002F, before.z(), r.positionNed.z());
  TEST_ASSERT_TRUE(r.velocityNed.z() > 0.2F);
  flight.state.positionNed.x() = kNaN;
  flight.guidance.update(flight.now += GuidedFlight::kStep, flight.state);
  TEST_ASSERT_TRUE(isFinite(flight.reference().positionNed));
}

void test_a_landing_asked_for_on_the_way_stops_first() {
  GuidedFlight flight("takeoff 3 0\nleg 12 0 3 0 1\n");
  flight.runUntil(FlightState::Waypoint);
  flight.run(5.0F);
  TEST_ASSERT_TRUE(flight.reference().velocityNed.x() > 1.0F);
  flight.guidance.enter(FlightState::Land, flight.now, flight.state);
  Vector3f before = flight.reference().velocityNed;
  for (int i = 0; i < 5000; ++i) {
    flight.now += GuidedFlight::kStep;
    const Reference& r = flight.guidance.update(flight.now, flight.state);
    TEST_ASSERT_TRUE((r.velocityNed - before).norm() <= 2.0F * 0.002F * 1.05F);  // 2 m/s^2
    if (r.velocityNed.z() > 0.0F) TEST_ASSERT_TRUE(r.velocityNed.x() == 0.0F);
    before = r.velocityNed;
  }
  TEST_ASSERT_TRUE(before.z() > 0.2F);  // on its way down
}

void test_a_mission_that_ends_at_home_returns_over_the_start_and_lands_there() {
  GuidedFlight flight("takeoff 2 0\nleg 6 -4 2 0 1\nhome\n");
  flight.runUntil(FlightState::Return);
  float lowestOnTheWay = 100.0F;
  while (flight.at(FlightState::Return)) {
    flight.step();
    const Vector3f& p = flight.state.positionNed;
    if ((p - Vector3f{6.0F, -4.0F, p.z()}).norm() > 0.01F) {
      lowestOnTheWay = std::min(lowestOnTheWay, -p.z());
    }
  }
  TEST_ASSERT_FLOAT_WITHIN(0.001F, 3.0F, lowestOnTheWay);  // first up, then over
  TEST_ASSERT_TRUE(flight.at(FlightState::Land));
  assertNear(1e-4F, Vector3f{0.0F, 0.0F, -3.0F}, flight.state.positionNed);
  flight.run(1.0F);
  TEST_ASSERT_TRUE(flight.reference().velocityNed.z() > 0.4F);
}

void test_a_return_from_above_keeps_its_height_and_takes_the_speed_over() {
  GuidedFlight flight("takeoff 5 0\nleg 10 5 6 90 1\n");
  flight.runUntil(FlightState::Waypoint);
  flight.run(4.0F);
  const float speed = flight.state.velocityNed.norm();
  TEST_ASSERT_TRUE(speed > 1.0F);
  const float height = -flight.state.positionNed.z();
  flight.step(condition::kReturn);
  TEST_ASSERT_TRUE(flight.at(FlightState::Return));
  const Smoothness most = watch(flight, [&flight, height] {
    TEST_ASSERT_TRUE(-flight.state.positionNed.z() > height - 0.01F);
    return flight.at(FlightState::Land);
  });
  TEST_ASSERT_TRUE(most.velocity <= 2.0F * 0.002F * 1.05F);
  TEST_ASSERT_TRUE(most.acceleration <= 6.0F * 0.002F * 1.3F);
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 0.0F, flight.state.positionNed.head<2>().norm());
}

void test_an_attitude_leg_holds_its_attitude_and_the_height_for_its_time() {
  for (const float yaw : {0.0F, 2.0F}) {
    GuidedFlight flight("takeoff 4 1\nattitude 30 -10 20 0.5\n", yaw);
    flight.runUntil(FlightState::Waypoint);
    const Micros start = flight.now;
    while (flight.at(FlightState::Waypoint)) {
      const Reference& r = flight.reference();
      TEST_ASSERT_TRUE(r.mode == ReferenceMode::AttitudeHeight);
      assertSameRotation(
          1e-6F,
          eulerToQuaternion({30.0F * kDegToRad, -10.0F * kDegToRad, yaw + 20.0F * kDegToRad}),
          r.attitude);
      TEST_ASSERT_FLOAT_WITHIN(1e-4F, -4.0F, r.positionNed.z());
      TEST_ASSERT_TRUE(r.velocityNed.z() == 0.0F);
      flight.step();
    }
    TEST_ASSERT_EQUAL_UINT32(500'000, elapsed(flight.now, start));
    TEST_ASSERT_TRUE(flight.at(FlightState::Hold));
  }
}

void test_after_an_attitude_the_aircraft_is_stopped_where_it_is_and_then_goes_on() {
  GuidedFlight flight("takeoff 4 1\nattitude 0 -30 0 0.4\nleg 0 0 4 0 1\n");
  flight.runUntil(FlightState::Waypoint);
  while (flight.at(FlightState::Waypoint)) {
    const VehicleState before = flight.state;
    flight.step();
    if (flight.at(FlightState::Waypoint)) continue;
    // Taken over at the aircraft's own place and speed: 0.4 s at g tan 30 deg.
    TEST_ASSERT_TRUE(flight.reference().mode == ReferenceMode::Position);
    TEST_ASSERT_FLOAT_WITHIN(0.02F, 0.4F * 5.66F, before.velocityNed.x());
    assertNear(0.01F, before.positionNed, flight.reference().positionNed);
    assertNear(0.01F, before.velocityNed, flight.reference().velocityNed);
  }
  const Smoothness most = watch(flight, [&flight] { return flight.at(FlightState::Waypoint); });
  TEST_ASSERT_TRUE(most.velocity <= 2.0F * 0.002F * 1.05F);
  // It stopped, and has begun the leg by one tick.
  TEST_ASSERT_TRUE(flight.reference().velocityNed.norm() < 0.001F);
  flight.runUntil(FlightState::Land);
  assertNear(1e-4F, Vector3f{0.0F, 0.0F, -4.0F}, flight.state.positionNed);
}

void test_attitudes_in_a_row_follow_each_other_without_a_hold_between() {
  GuidedFlight flight("takeoff 4 1\nattitude 30 0 10 0.5\nattitude -30 0 -10 0.5\n", 3.1F);
  flight.runUntil(FlightState::Waypoint);
  const Micros start = flight.now;
  while (flight.reference().mode == ReferenceMode::AttitudeHeight) flight.step();
  TEST_ASSERT_UINT32_WITHIN(4000, 1'000'000, elapsed(flight.now, start));
  // Yaw is of the heading at the leg's start: 10 deg there and back.
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 3.1F, flight.reference().yaw);
}

void test_attitudes_each_way_for_as_long_end_without_speed() {
  GuidedFlight flight("takeoff 4 1\nattitude 30 0 0 0.5\nattitude -30 0 0 0.5\n", 2.0F);
  flight.runUntil(FlightState::Waypoint);
  flight.run(0.5F);
  TEST_ASSERT_FLOAT_WITHIN(0.05F, 0.5F * 5.66F, flight.state.velocityNed.norm());
  while (flight.reference().mode == ReferenceMode::AttitudeHeight) flight.step();
  TEST_ASSERT_TRUE(flight.state.velocityNed.norm() < 0.004F * 5.7F);  // two ticks of it
}

std::string missionFile(const std::string& name) {
  const char* const root = std::getenv("STRIX_ROOT");
  std::ifstream in(std::string(root == nullptr ? "." : root) + "/missions/" + name + ".txt");
  std::ostringstream text;
  text << in.rdbuf();
  TEST_ASSERT_FALSE_MESSAGE(text.str().empty(), name.c_str());
  return text.str();
}

void test_the_missions_of_the_repository_run_to_their_end() {
  struct Plan {
    const char* name;
    Vector3f landsAt;
    float longest;  ///< s, from start to the landing's begin
  };
  for (const Plan& plan : {Plan{"square", {0, 0, -3}, 60}, Plan{"step", {0, 0, -2}, 80},
                           Plan{"aggressive", {0, 0, -4}, 90}}) {
    GuidedFlight flight(missionFile(plan.name).c_str(), 1.0F);
    flight.runUntil(FlightState::Land, plan.longest);
    assertNear(1e-4F, plan.landsAt, flight.state.positionNed);
  }
  for (const char* name : {"stand-15", "stand-30"}) {
    GuidedFlight stand(missionFile(name).c_str());
    stand.runUntil(FlightState::Idle, 60.0F);
  }
}

void test_an_estimate_that_is_lost_has_arrived_nowhere() {
  GuidedFlight flight("takeoff 2 1\nleg 1 0 2 0 1\n");
  flight.runUntil(FlightState::Waypoint);
  flight.run(5.0F);
  flight.state.positionNed.z() = kNaN;
  TEST_ASSERT_TRUE((flight.guidance.conditions(flight.now, flight.state) & condition::kArrived) ==
                   0);
}

}  // namespace

void runGuidanceTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_each_leg_is_reached_held_and_turned_from_the_heading_at_take_off);
  RUN_TEST(test_corners_with_no_hold_are_flown_through_near_enough_and_smoothly);
  RUN_TEST(test_a_corner_waits_for_an_aircraft_that_lags_behind_the_reference);
  RUN_TEST(test_an_aircraft_that_does_not_get_there_is_astray_10_s_after_its_path_has_ended);
  RUN_TEST(test_the_landing_goes_straight_down_slower_near_the_ground_and_on_below_it);
  RUN_TEST(test_an_aircraft_pushed_aside_while_it_lands_is_not_sent_back);
  RUN_TEST(test_a_landing_asked_for_on_the_way_stops_first);
  RUN_TEST(test_a_mission_that_ends_at_home_returns_over_the_start_and_lands_there);
  RUN_TEST(test_a_return_from_above_keeps_its_height_and_takes_the_speed_over);
  RUN_TEST(test_an_attitude_leg_holds_its_attitude_and_the_height_for_its_time);
  RUN_TEST(test_after_an_attitude_the_aircraft_is_stopped_where_it_is_and_then_goes_on);
  RUN_TEST(test_attitudes_in_a_row_follow_each_other_without_a_hold_between);
  RUN_TEST(test_attitudes_each_way_for_as_long_end_without_speed);
  RUN_TEST(test_the_missions_of_the_repository_run_to_their_end);
  RUN_TEST(test_an_estimate_that_is_lost_has_arrived_nowhere);
}
