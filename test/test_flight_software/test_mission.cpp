// Missions and their fence, guidance through the legs, and signs that must last to be believed.
#include <limits>

#include "AssertNear.h"
#include "FakeFlight.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

void test_the_fence_is_a_cylinder_around_the_start() {
  const Fence fence{30.0F, 15.0F};
  TEST_ASSERT_TRUE(fence.contains({0.0F, 0.0F, 0.0F}));
  TEST_ASSERT_TRUE(fence.contains({21.0F, -21.0F, -14.9F}));  // 29.7 m out
  TEST_ASSERT_FALSE(fence.contains({22.0F, -22.0F, -1.0F}));  // 31.1 m: no box of 30 m
  TEST_ASSERT_FALSE(fence.contains({0.0F, 0.0F, -15.1F}));    // too high: down is positive
  TEST_ASSERT_TRUE(fence.contains({0.0F, 0.0F, 40.0F}));      // below the start is no danger
  TEST_ASSERT_FALSE(fence.contains({kNaN, 0.0F, 0.0F}));
  TEST_ASSERT_FALSE(fence.contains({0.0F, 0.0F, kNaN}));
  TEST_ASSERT_FALSE(fence.contains({1e30F, 0.0F, 0.0F}));
}

void test_a_mission_that_leaves_the_air_or_the_fence_is_not_flyable() {
  const Fence fence;
  TEST_ASSERT_TRUE(isFlyable(kFirstFlight, fence));
  TEST_ASSERT_TRUE(isFlyable(kLowMission, fence));
  const auto refused = [&fence](auto&& spoil) {
    Mission mission = kFirstFlight;
    spoil(mission);
    TEST_ASSERT_FALSE(isFlyable(mission, fence));
  };
  for (const float bad : {0.0F, -2.0F, 15.5F, kNaN, kInfinity}) {
    refused([bad](Mission& m) { m.takeoffHeight = bad; });
    refused([bad](Mission& m) { m.legs[1].height = bad; });
  }
  for (const float bad : {31.0F, -31.0F, kNaN, kInfinity}) {
    refused([bad](Mission& m) { m.legs[0].north = bad; });
    refused([bad](Mission& m) { m.legs[2].east = bad; });
  }
  for (const float bad : {kNaN, kInfinity, 1e5F}) {
    refused([bad](Mission& m) { m.legs[2].turn = bad; });
  }
  refused([](Mission& m) { m.legCount = Mission::kMaxLegs + 1; });

  Mission unused = kFirstFlight;
  unused.legs[3].north = kNaN;  // beyond the legs in use
  TEST_ASSERT_TRUE(isFlyable(unused, fence));
}

void test_a_sign_is_believed_once_it_has_lasted() {
  constexpr Micros kStarts[] = {0, 5'000'000, 0U - 200'000U, 0U - 1U};
  for (const Micros start : kStarts) {
    Persistence sign(400'000);
    sign.reset(start);
    for (Micros t = 0; t < 400'000; t += 2000) TEST_ASSERT_FALSE(sign.update(start + t, true));
    TEST_ASSERT_TRUE(sign.update(start + 400'000, true));
    TEST_ASSERT_TRUE(sign.held());
  }
}

void test_a_break_in_a_sign_starts_its_time_anew() {
  Persistence sign(400'000);
  sign.reset(0);
  sign.update(399'000, true);
  TEST_ASSERT_FALSE(sign.update(399'500, false));
  TEST_ASSERT_FALSE(sign.update(799'000, true));
  TEST_ASSERT_TRUE(sign.update(799'500, true));
  TEST_ASSERT_FALSE(sign.update(800'000, false));  // and it ends at once
  TEST_ASSERT_FALSE(sign.held());
}

void test_a_sign_that_has_held_for_hours_does_not_lapse_with_the_clock() {
  Persistence sign(400'000);
  sign.reset(0);
  std::uint64_t t = 0;
  while (t < (std::uint64_t{3} << 32U)) {
    const bool held = sign.update(static_cast<Micros>(t), true);
    TEST_ASSERT_TRUE(held == (t >= 400'000));
    t += 100'000;
  }
}

/// Guidance with the aircraft carried along: it is always where the reference is.
struct Carried {
  explicit Carried(const Mission& mission, float yaw = 0.0F) : guidance(mission, {}) {
    state.attitude = eulerToQuaternion({0.0F, 0.0F, yaw});
  }
  Guidance guidance;
  VehicleState state;
  Micros now = 0U - 5'000'000U;  // the clock wraps on the way

  void enter(FlightState flightState) { guidance.enter(flightState, now, state); }

  /// us until arrival, at most a minute
  Micros follow() {
    const Micros start = now;
    while (!has(condition::kArrived) && elapsed(now, start) < 60'000'000) {
      now += 2000;
      const Reference& r = guidance.update(now, state);
      state.positionNed = r.positionNed;
      state.velocityNed = r.velocityNed;
      state.attitude = eulerToQuaternion({0.0F, 0.0F, r.yaw});
    }
    return elapsed(now, start);
  }
  [[nodiscard]] bool has(ConditionSet condition) const {
    return (guidance.conditions(now, state) & condition) != 0;
  }
};

void test_the_legs_are_flown_in_order_and_turn_from_the_heading_at_take_off() {
  for (const float yaw : {0.0F, 2.0F, -2.5F}) {
    Carried flight(kFirstFlight, yaw);
    flight.enter(FlightState::Takeoff);
    TEST_ASSERT_TRUE(flight.follow() < 20'000'000);
    assertNear(0.01F, Vector3f{0.0F, 0.0F, -2.0F}, flight.state.positionNed);
    for (std::size_t i = 0; i < kFirstFlight.legCount; ++i) {
      TEST_ASSERT_TRUE(flight.has(condition::kLegsRemain));
      flight.enter(FlightState::Hold);
      flight.enter(FlightState::Waypoint);
      TEST_ASSERT_TRUE(flight.follow() < 30'000'000);
      const Leg& leg = kFirstFlight.legs[i];
      assertNear(0.01F, Vector3f{leg.north, leg.east, -leg.height}, flight.state.positionNed);
      TEST_ASSERT_FLOAT_WITHIN(0.01F, 0.0F,
                               wrapAngle(yawOf(flight.state.attitude) - yaw - leg.turn));
    }
    TEST_ASSERT_FALSE(flight.has(condition::kLegsRemain));
  }
}

void test_each_leg_is_held_for_its_own_time() {
  Carried flight(kFirstFlight);
  flight.enter(FlightState::Takeoff);
  flight.follow();
  flight.enter(FlightState::Hold);
  TEST_ASSERT_FALSE(flight.has(condition::kHoldDone));
  flight.now += kFirstFlight.takeoffHoldTime - 1;
  TEST_ASSERT_FALSE(flight.has(condition::kHoldDone));
  flight.now += 1;
  TEST_ASSERT_TRUE(flight.has(condition::kHoldDone));
}

void test_the_aircraft_has_arrived_when_it_is_there_and_slow_and_looks_the_right_way() {
  Carried flight(kFirstFlight);
  flight.enter(FlightState::Takeoff);
  flight.follow();
  const VehicleState there = flight.state;
  TEST_ASSERT_TRUE(flight.has(condition::kArrived));
  flight.state.positionNed += Vector3f{0.4F, 0.4F, 0.0F};  // 0.57 m beside it
  TEST_ASSERT_FALSE(flight.has(condition::kArrived));
  flight.state = there;
  flight.state.velocityNed.x() = 0.5F;
  TEST_ASSERT_FALSE(flight.has(condition::kArrived));
  for (const float turned : {0.2F, -0.2F, kPi, kNaN}) {
    flight.state = there;
    flight.state.attitude = eulerToQuaternion({0.0F, 0.0F, turned});
    TEST_ASSERT_FALSE(flight.has(condition::kArrived));
  }
  flight.state = there;
  flight.state.positionNed.z() = kNaN;
  TEST_ASSERT_FALSE(flight.has(condition::kArrived));
}

void test_the_landing_goes_straight_down_from_the_last_leg_and_on_below_the_start() {
  Carried flight(kFirstFlight);
  flight.enter(FlightState::Takeoff);
  flight.follow();
  flight.enter(FlightState::Waypoint);
  flight.follow();
  flight.enter(FlightState::Land);
  bool belowStart = false;
  for (int i = 0; i < 10'000; ++i) {
    flight.now += 2000;
    const Reference& r = flight.guidance.update(flight.now, flight.state);
    TEST_ASSERT_FLOAT_WITHIN(0.01F, kFirstFlight.legs[0].north, r.positionNed.x());
    TEST_ASSERT_FLOAT_WITHIN(0.01F, kFirstFlight.legs[0].east, r.positionNed.y());
    TEST_ASSERT_TRUE(r.velocityNed.z() >= 0.0F && r.velocityNed.z() <= 0.5F + 1e-4F);
    belowStart = belowStart || r.positionNed.z() > 1.0F;
  }
  TEST_ASSERT_TRUE(belowStart);
}

void test_the_mission_on_the_card_is_flown_in_place_of_the_one_compiled_in() {
  FakeFlight flight;
  flight.board.mission = "takeoff 0.4 0.5\r\nland\r\n";
  flight.getReady();
  flight.reach(FlightState::Takeoff);
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Land, 5.0F));  // no leg comes before
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, -0.4F, flight.software.guidance().reference().positionNed.z());
}

void test_a_wrong_mission_on_the_card_is_refused_with_its_line() {
  FakeFlight flight;
  flight.board.mission = "takeoff 2 1\nleg 5 five 2 0 1\n";
  flight.getReady();
  TEST_ASSERT_FALSE(flight.arm());
  TEST_ASSERT_TRUE(flight.logSays("line 2, EAST_M: expected a number, found 'five'"));
}

}  // namespace

void runMissionTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_fence_is_a_cylinder_around_the_start);
  RUN_TEST(test_the_mission_on_the_card_is_flown_in_place_of_the_one_compiled_in);
  RUN_TEST(test_a_wrong_mission_on_the_card_is_refused_with_its_line);
  RUN_TEST(test_a_mission_that_leaves_the_air_or_the_fence_is_not_flyable);
  RUN_TEST(test_a_sign_is_believed_once_it_has_lasted);
  RUN_TEST(test_a_break_in_a_sign_starts_its_time_anew);
  RUN_TEST(test_a_sign_that_has_held_for_hours_does_not_lapse_with_the_clock);
  RUN_TEST(test_the_legs_are_flown_in_order_and_turn_from_the_heading_at_take_off);
  RUN_TEST(test_each_leg_is_held_for_its_own_time);
  RUN_TEST(test_the_aircraft_has_arrived_when_it_is_there_and_slow_and_looks_the_right_way);
  RUN_TEST(test_the_landing_goes_straight_down_from_the_last_leg_and_on_below_the_start);
}
