// DESIGN.md, section 8, for every state and every set of conditions - also those that contradict
// each other: the table must not depend on whoever sets the bits.
#include <unity.h>

#include "Cubes.h"
#include "suites.h"

using namespace strix;

namespace {

bool motorsOn(FlightState state) { return propertiesOf(state).motors; }
bool isFlying(FlightState state) { return (kFlying & in(state)) != 0; }

/// With a kill, motors would turn for one tick.
constexpr ConditionSet kNotArming = condition::kPreArmFailure | condition::kKill;
constexpr StateSet kMotorsOff = in(FlightState::Boot, FlightState::Idle, FlightState::Safe);

void test_motors_are_off_in_boot_idle_and_safe_and_on_elsewhere() {
  for (const StateProperties& state : kStates) {
    const bool off = (kMotorsOff & in(state.state)) != 0;
    TEST_ASSERT_TRUE(state.motors == !off);
    TEST_ASSERT_TRUE(((kMotorsOn & in(state.state)) != 0) == !off);
  }
}

void test_the_controller_reaches_the_motors_in_flight_and_on_the_stand_only() {
  for (const StateProperties& state : kStates) {
    const bool expected = isFlying(state.state) || state.state == FlightState::AttitudeStand;
    TEST_ASSERT_TRUE_MESSAGE(state.controller == expected, state.name);
  }
}

void test_a_kill_ends_in_safe_in_one_update_whatever_else_is_there() {
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (motorsOn(state) && cube.some(condition::kKill)) TEST_ASSERT_TRUE(next == FlightState::Safe);
  });
}

void test_each_critical_condition_does_too() {
  TEST_ASSERT_TRUE(kCritical == (condition::kKill | condition::kUpset |
                                 condition::kEstimatorUnhealthy | condition::kTiltLimit));
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    for (ConditionSet left = kCritical; left != 0; left &= left - 1) {
      const ConditionSet bit = left & (~left + 1U);
      if (motorsOn(state) && cube.some(bit)) TEST_ASSERT_TRUE(next == FlightState::Safe);
    }
  });
}

void test_disarming_stops_the_motors_in_one_update_whatever_else_is_there() {
  for (const StateProperties& state : kStates) {
    if (!state.motors) continue;
    forCubes(state.state, [](const Cube& cube, const Transition* row) {
      if (!cube.some(condition::kDisarm)) return;
      TEST_ASSERT_NOT_NULL(row);
      TEST_ASSERT_FALSE_MESSAGE(motorsOn(row->to), row->said);
    });
  }
}

void test_arming_takes_an_edge_and_every_check_passed_and_starts_on_the_ground() {
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (state == FlightState::Armed) return;
    if (next == FlightState::Armed) {
      TEST_ASSERT_TRUE(state == FlightState::Idle || state == FlightState::Safe);
      TEST_ASSERT_TRUE(cube.every(condition::kArmEdge, kNotArming));
    }
    // And is not refused when they are there.
    if ((state == FlightState::Idle || state == FlightState::Safe) &&
        cube.every(condition::kArmEdge, kNotArming)) {
      TEST_ASSERT_TRUE(next == FlightState::Armed);
    }
  });
}

void test_motors_begin_to_turn_by_arming_or_for_a_motor_test_alone() {
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (motorsOn(state) || !motorsOn(next)) return;
    if (next == FlightState::Armed) return;  // the test above
    TEST_ASSERT_TRUE(state == FlightState::Idle && next == FlightState::MotorTest);
    TEST_ASSERT_TRUE(cube.every(condition::kMotorTestAsked, condition::kKill));
  });
}

void test_every_flight_begins_in_armed() {
  forAllCubes([](FlightState state, const Cube&, FlightState next) {
    if (isFlying(state) || !isFlying(next)) return;
    TEST_ASSERT_TRUE(state == FlightState::Armed);
    TEST_ASSERT_TRUE(next == FlightState::Takeoff || next == FlightState::Manual);
  });
}

void test_a_motor_test_is_followed_by_motors_off_alone() {
  forAllCubes([](FlightState state, const Cube&, FlightState next) {
    if (state == FlightState::MotorTest && next != state) TEST_ASSERT_FALSE(motorsOn(next));
  });
}

void test_safe_is_left_only_by_rearming() {
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (state != FlightState::Safe || next == state) return;
    TEST_ASSERT_TRUE(next == FlightState::Armed);
    TEST_ASSERT_TRUE(cube.every(condition::kArmEdge, kNotArming));
  });
}

void test_boot_is_left_only_when_calibrated_and_only_to_idle() {
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (state == FlightState::Boot) {
      TEST_ASSERT_TRUE(cube.every(condition::kCalibrated) ? next == FlightState::Idle
                                                          : next == FlightState::Boot);
    } else if (next == FlightState::Boot) {  // to calibrate again, with the motors off
      TEST_ASSERT_TRUE(state == FlightState::Idle && cube.every(condition::kCalibrateAsked));
    }
  });
}

void test_no_flight_comes_back_to_the_states_before_it_but_by_motors_off() {
  forAllCubes([](FlightState state, const Cube&, FlightState next) {
    if (!isFlying(state)) return;
    TEST_ASSERT_TRUE(isFlying(next) || next == FlightState::Idle || next == FlightState::Safe);
  });
}

void test_an_armed_aircraft_waits_for_a_start_and_not_for_ever() {
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (state != FlightState::Armed) return;
    if (cube.some(condition::kArmedTooLong)) TEST_ASSERT_TRUE(next != state);
    if (cube.every(condition::kNone, condition::kStart | condition::kSticks)) {
      TEST_ASSERT_TRUE(next == state || !motorsOn(next));
    }
  });
}

void test_nobody_takes_off_with_a_hazard() {
  constexpr ConditionSet kHazards = kGrounding | kCritical | condition::kImuLost;
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (state == FlightState::Armed && isFlying(next)) {
      TEST_ASSERT_TRUE(cube.every(condition::kNone, kHazards | condition::kStandMission));
    }
  });
  // Whoever asked for it is told: the start switch on, and the aircraft disarms.
  const Transition* row =
      findTransition(FlightState::Armed, condition::kStart | condition::kMagLost);
  TEST_ASSERT_NOT_NULL(row);
  TEST_ASSERT_TRUE(row->to == FlightState::Idle);
}

void test_the_stand_is_entered_from_armed_by_its_mission_alone_and_never_flies() {
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (next == FlightState::AttitudeStand && state != next) {
      TEST_ASSERT_TRUE(state == FlightState::Armed);
      TEST_ASSERT_TRUE(cube.every(condition::kStandMission | condition::kStart));
    }
    // With its mission nothing takes off; from it nothing but motors off.
    if (state == FlightState::Armed && cube.some(condition::kStandMission)) {
      TEST_ASSERT_FALSE(isFlying(next));
    }
    if (state == FlightState::AttitudeStand && next != state) TEST_ASSERT_FALSE(motorsOn(next));
  });
}

void test_the_sticks_fly_only_when_their_pilot_asked_for_it() {
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (next != FlightState::Manual || state == next) return;
    const ConditionSet asked = state == FlightState::Armed
                                   ? condition::kSticks | condition::kThrottleUp
                                   : condition::kSticksEdge;
    TEST_ASSERT_TRUE(cube.every(asked));
  });
}

void test_nobody_but_motors_off_or_a_landing_ends_blind_flight() {
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (state != FlightState::Blind || next == state) return;
    TEST_ASSERT_TRUE(next == FlightState::Safe || cube.every(condition::kImuBack));
  });
}

void test_on_the_ground_with_the_sticks_down_nothing_makes_it_fly_off() {
  // Who lands by hand and switches the transmitter off must not see it start to fly home.
  forAllCubes([](FlightState state, const Cube& cube, FlightState next) {
    if (state != FlightState::Manual || !cube.some(condition::kOnGround)) return;
    TEST_ASSERT_TRUE(next == state || !motorsOn(next) || next == FlightState::Land);
  });
}

void test_a_refused_arming_is_told_in_every_state_on_the_ground() {
  for (const FlightState state : {FlightState::Boot, FlightState::Idle, FlightState::Safe}) {
    const Transition* row = findTransition(state, condition::kArmEdge | condition::kPreArmFailure);
    TEST_ASSERT_NOT_NULL(row);
    TEST_ASSERT_TRUE(row->to == state);
    TEST_ASSERT_EQUAL_STRING("arming refused", row->said);
  }
}

}  // namespace

void runInvariantTests() {
  RUN_TEST(test_motors_are_off_in_boot_idle_and_safe_and_on_elsewhere);
  RUN_TEST(test_the_controller_reaches_the_motors_in_flight_and_on_the_stand_only);
  RUN_TEST(test_a_kill_ends_in_safe_in_one_update_whatever_else_is_there);
  RUN_TEST(test_each_critical_condition_does_too);
  RUN_TEST(test_disarming_stops_the_motors_in_one_update_whatever_else_is_there);
  RUN_TEST(test_arming_takes_an_edge_and_every_check_passed_and_starts_on_the_ground);
  RUN_TEST(test_motors_begin_to_turn_by_arming_or_for_a_motor_test_alone);
  RUN_TEST(test_every_flight_begins_in_armed);
  RUN_TEST(test_a_motor_test_is_followed_by_motors_off_alone);
  RUN_TEST(test_safe_is_left_only_by_rearming);
  RUN_TEST(test_boot_is_left_only_when_calibrated_and_only_to_idle);
  RUN_TEST(test_no_flight_comes_back_to_the_states_before_it_but_by_motors_off);
  RUN_TEST(test_an_armed_aircraft_waits_for_a_start_and_not_for_ever);
  RUN_TEST(test_nobody_takes_off_with_a_hazard);
  RUN_TEST(test_the_stand_is_entered_from_armed_by_its_mission_alone_and_never_flies);
  RUN_TEST(test_the_sticks_fly_only_when_their_pilot_asked_for_it);
  RUN_TEST(test_nobody_but_motors_off_or_a_landing_ends_blind_flight);
  RUN_TEST(test_on_the_ground_with_the_sticks_down_nothing_makes_it_fly_off);
  RUN_TEST(test_a_refused_arming_is_told_in_every_state_on_the_ground);
}
