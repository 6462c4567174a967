// What each hazard does in each state, as docs/safety.md tells it: a table of its own, held against
// the one that flies.
#include <unity.h>

#include <array>

#include "Cubes.h"
#include "suites.h"

using namespace strix;

namespace {

/// What is left of a flight, most first.
enum Answer { GoesOn, FliesHome, Lands, GoesBlind, StopsMotors };

Answer answerOf(FlightState state) {
  switch (state) {
    case FlightState::Return:
      return FliesHome;
    case FlightState::Land:
      return Lands;
    case FlightState::Blind:
      return GoesBlind;
    default:
      return propertiesOf(state).motors ? GoesOn : StopsMotors;
  }
}

struct Policy {
  ConditionSet hazard;
  Answer underWay;  ///< in HOLD, WAYPOINT and GUIDED
  Answer takeoff;
  Answer goingHome;
  Answer landing;
  Answer manual;
  Answer blind;
  Answer armed;
  Answer stand;
};

// clang-format off
constexpr std::array<Policy, 21> kPolicies{{
    // hazard                         under way    take-off     going home   landing      manual       blind        armed        stand
    {condition::kKill,                StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors},
    {condition::kUpset,               StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors},
    {condition::kTiltLimit,           StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors},
    {condition::kEstimatorUnhealthy,  StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors},
    {condition::kCrash,               StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, GoesOn,      GoesOn},
    {condition::kFreeFall,            StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, StopsMotors, GoesOn,      GoesOn},
    {condition::kImuLost,             GoesBlind,   GoesBlind,   GoesBlind,   GoesBlind,   GoesBlind,   GoesBlind,   StopsMotors, StopsMotors},
    {condition::kFarOutsideFence,     Lands,       Lands,       Lands,       Lands,       Lands,       GoesBlind,   GoesOn,      GoesOn},
    {condition::kBatteryCritical,     Lands,       Lands,       Lands,       Lands,       Lands,       GoesBlind,   GoesOn,      GoesOn},
    {condition::kGpsLost,             Lands,       Lands,       Lands,       Lands,       GoesOn,      GoesBlind,   GoesOn,      GoesOn},
    {condition::kAltLost,             Lands,       Lands,       Lands,       Lands,       GoesOn,      GoesBlind,   GoesOn,      GoesOn},
    {condition::kImuSaturated,        Lands,       Lands,       Lands,       Lands,       GoesOn,      GoesBlind,   GoesOn,      GoesOn},
    {condition::kMotorsSaturated,     Lands,       Lands,       Lands,       Lands,       GoesOn,      GoesBlind,   GoesOn,      GoesOn},
    {condition::kOverrun,             Lands,       Lands,       Lands,       Lands,       GoesOn,      GoesBlind,   GoesOn,      GoesOn},
    {condition::kAstray,              Lands,       Lands,       Lands,       Lands,       GoesOn,      GoesBlind,   GoesOn,      GoesOn},
    {condition::kOutsideFence,        FliesHome,   Lands,       FliesHome,   Lands,       FliesHome,   GoesBlind,   StopsMotors, GoesOn},
    {condition::kRadioLost,           FliesHome,   Lands,       FliesHome,   Lands,       FliesHome,   GoesBlind,   StopsMotors, StopsMotors},
    {condition::kLinkLost,            FliesHome,   Lands,       FliesHome,   Lands,       GoesOn,      GoesBlind,   StopsMotors, StopsMotors},
    {condition::kBatteryLow,          FliesHome,   Lands,       FliesHome,   Lands,       GoesOn,      GoesBlind,   GoesOn,      GoesOn},
    {condition::kMagLost,             FliesHome,   Lands,       FliesHome,   Lands,       GoesOn,      GoesBlind,   GoesOn,      GoesOn},
    {condition::kLogFailed,           FliesHome,   Lands,       FliesHome,   Lands,       GoesOn,      GoesBlind,   GoesOn,      GoesOn},
}};
// clang-format on

/// Where the motors turn, but for the motor test, which no hazard of flight concerns.
constexpr std::array<FlightState, 10> kStatesAtStake{
    FlightState::Armed, FlightState::Takeoff,      FlightState::Hold,   FlightState::Waypoint,
    FlightState::Land,  FlightState::Return,       FlightState::Manual, FlightState::Guided,
    FlightState::Blind, FlightState::AttitudeStand};

Answer expected(const Policy& policy, FlightState state) {
  switch (state) {
    case FlightState::Armed:
      return policy.armed;
    case FlightState::Takeoff:
      return policy.takeoff;
    case FlightState::Land:
      return policy.landing;
    case FlightState::Return:
      return policy.goingHome;
    case FlightState::Manual:
      return policy.manual;
    case FlightState::Blind:
      return policy.blind;
    case FlightState::AttitudeStand:
      return policy.stand;
    default:
      return policy.underWay;
  }
}

/// Without which a state ends by itself: the sticks' pilot, the positions that are sent.
ConditionSet keptBy(FlightState state) {
  if (state == FlightState::Manual) return condition::kSticks;
  if (state == FlightState::Guided) return condition::kGuided;
  return condition::kNone;
}

FlightState next(FlightState state, ConditionSet set) {
  const Transition* row = findTransition(state, set);
  return row == nullptr ? state : row->to;
}

void test_every_row_that_a_hazard_takes_has_its_policy() {
  // The ends of what a hazard has begun, and the pilot who disarms.
  ConditionSet known =
      condition::kBlindOver | condition::kTouchDown | condition::kImuBack | condition::kDisarm;
  for (const Policy& policy : kPolicies) known |= policy.hazard;
  for (const Transition& row : kTransitions) {
    if (row.failsafe) TEST_ASSERT_TRUE_MESSAGE((row.when & known) != 0, row.said);
  }
}

void test_each_hazard_alone_does_in_each_state_what_the_manual_says() {
  for (const Policy& policy : kPolicies) {
    for (const FlightState state : kStatesAtStake) {
      const FlightState after = next(state, policy.hazard | keptBy(state));
      TEST_ASSERT_EQUAL_MESSAGE(expected(policy, state), answerOf(after), propertiesOf(state).name);
      // A hazard that has nothing to do in a state changes nothing there.
      if (expected(policy, state) == GoesOn) TEST_ASSERT_TRUE(after == state);
    }
  }
}

void test_no_other_condition_makes_the_answer_milder() {
  // But two people: the pilot who takes the sticks himself, and for the fence of ARMED the one who
  // put the stand's mission on the card. And the IMU that comes back ends blind flight.
  for (const Policy& policy : kPolicies) {
    for (const FlightState state : kStatesAtStake) {
      const Answer least = expected(policy, state);
      forCubes(state, [&](const Cube& cube, const Transition* row) {
        if (!cube.some(policy.hazard)) return;
        const FlightState after = row == nullptr ? state : row->to;
        if (answerOf(after) >= least) return;
        const bool pilot = state == FlightState::Land || state == FlightState::Return;
        const bool allowed =
            (pilot && cube.every(condition::kSticksEdge)) ||
            (state == FlightState::Return && cube.every(condition::kHoldAsked)) ||
            (state == FlightState::Armed && cube.every(condition::kStandMission)) ||
            (state == FlightState::Blind && cube.every(condition::kImuBack));
        TEST_ASSERT_TRUE_MESSAGE(allowed, row == nullptr ? "stays" : row->said);
      });
    }
  }
}

void test_who_takes_over_with_a_hazard_that_is_still_there_gets_its_answer_in_the_next_update() {
  for (const Policy& policy : kPolicies) {
    for (const FlightState state : {FlightState::Return, FlightState::Land}) {
      const ConditionSet takesOver = policy.hazard | condition::kSticks | condition::kSticksEdge;
      const FlightState once = next(state, takesOver);
      const FlightState twice = next(once, takesOver & ~condition::kSticksEdge);
      if (once == FlightState::Manual) TEST_ASSERT_EQUAL(policy.manual, answerOf(twice));
    }
    const FlightState held = next(FlightState::Return, policy.hazard | condition::kHoldAsked);
    if (held == FlightState::Hold) {
      TEST_ASSERT_EQUAL(policy.underWay, answerOf(next(held, policy.hazard)));
    }
  }
}

void test_a_hazard_that_stays_ends_every_flight_in_safe() {
  // Home is reached, the ground too, and blind flight has its time: nothing else happens.
  constexpr ConditionSet kInTime =
      condition::kArrived | condition::kTouchDown | condition::kBlindOver;
  for (const Policy& policy : kPolicies) {
    for (const FlightState state : kStatesAtStake) {
      if (expected(policy, state) == GoesOn) continue;
      if ((kFlying & in(state)) == 0) continue;
      // Landing or going home as planned, a lesser hazard changes nothing of it.
      const bool planned = state == FlightState::Land || state == FlightState::Return;
      FlightState at = state;
      ConditionSet failsafe = condition::kNone;
      unsigned steps = 0;
      for (const Transition* row = nullptr; propertiesOf(at).motors; ++steps) {
        TEST_ASSERT_TRUE_MESSAGE(steps < 4, propertiesOf(at).name);
        row = findTransition(at, policy.hazard | keptBy(at) | kInTime | failsafe);
        TEST_ASSERT_NOT_NULL(row);
        if (row->failsafe) failsafe = condition::kFailsafe;
        at = row->to;
      }
      if (planned && failsafe == condition::kNone) {
        TEST_ASSERT_TRUE(at == FlightState::Idle);
      } else {
        TEST_ASSERT_TRUE_MESSAGE(at == FlightState::Safe, propertiesOf(state).name);
      }
    }
  }
}

void test_a_failsafe_never_leads_to_more_of_a_flight_than_was_left() {
  for (const Transition& row : kTransitions) {
    if (!row.failsafe || (row.when & condition::kImuBack) != 0) continue;
    for (const FlightState state : kStatesAtStake) {
      if ((row.from & in(state)) == 0) continue;
      TEST_ASSERT_TRUE_MESSAGE(answerOf(row.to) > answerOf(state), row.said);
    }
  }
}

void test_every_row_that_a_hazard_takes_from_a_flight_is_a_failsafe() {
  // So that no landing after one ends in IDLE as if nothing had been.
  constexpr ConditionSet kOwn = condition::kDisarm | condition::kOnGround;
  for (const Transition& row : kTransitions) {
    ConditionSet hazards = condition::kNone;
    for (const Policy& policy : kPolicies) hazards |= row.when & policy.hazard;
    if (hazards == 0 || (row.from & kFlying) == 0) continue;
    if ((row.when & kOwn) != 0 && row.to == FlightState::Idle) continue;  // stands there already
    TEST_ASSERT_TRUE_MESSAGE(row.failsafe, row.said);
  }
}

void test_the_way_home_without_a_place_is_a_landing() {
  for (const ConditionSet lost : {condition::kGpsLost, condition::kAltLost}) {
    TEST_ASSERT_TRUE(next(FlightState::Return, lost) == FlightState::Land);
  }
  for (const ConditionSet hazard : {condition::kRadioLost, condition::kOutsideFence}) {
    TEST_ASSERT_TRUE(next(FlightState::Manual, hazard | condition::kGpsLost) == FlightState::Land);
  }
}

void test_on_the_stand_there_is_no_fence() {
  for (const FlightState state : {FlightState::Armed, FlightState::AttitudeStand}) {
    constexpr ConditionSet kFence = condition::kOutsideFence | condition::kFarOutsideFence;
    TEST_ASSERT_TRUE(next(state, kFence | condition::kStandMission) == state);
  }
}

void test_what_is_asked_for_is_done_where_it_can_be() {
  struct Wish {
    ConditionSet wish;
    StateSet answered;
    FlightState to;
  };
  const std::array<Wish, 3> wishes{{
      {condition::kLandAsked, kFlying & ~in(FlightState::Land, FlightState::Blind),
       FlightState::Land},
      {condition::kReturn,
       in(FlightState::Takeoff, FlightState::Hold, FlightState::Waypoint, FlightState::Guided),
       FlightState::Return},
      {condition::kHoldAsked,
       in(FlightState::Takeoff, FlightState::Waypoint, FlightState::Return, FlightState::Guided),
       FlightState::Hold},
  }};
  for (const Wish& wish : wishes) {
    for (const StateProperties& state : kStates) {
      const bool answered = (wish.answered & in(state.state)) != 0;
      TEST_ASSERT_TRUE_MESSAGE(answers(state.state, wish.wish) == answered, state.name);
      const FlightState after = next(state.state, wish.wish | keptBy(state.state));
      TEST_ASSERT_TRUE_MESSAGE(after == (answered ? wish.to : state.state), state.name);
    }
  }
}

}  // namespace

void runPolicyTests() {
  RUN_TEST(test_every_row_that_a_hazard_takes_has_its_policy);
  RUN_TEST(test_each_hazard_alone_does_in_each_state_what_the_manual_says);
  RUN_TEST(test_no_other_condition_makes_the_answer_milder);
  RUN_TEST(
      test_who_takes_over_with_a_hazard_that_is_still_there_gets_its_answer_in_the_next_update);
  RUN_TEST(test_a_hazard_that_stays_ends_every_flight_in_safe);
  RUN_TEST(test_a_failsafe_never_leads_to_more_of_a_flight_than_was_left);
  RUN_TEST(test_every_row_that_a_hazard_takes_from_a_flight_is_a_failsafe);
  RUN_TEST(test_the_way_home_without_a_place_is_a_landing);
  RUN_TEST(test_on_the_stand_there_is_no_fence);
  RUN_TEST(test_what_is_asked_for_is_done_where_it_can_be);
}
