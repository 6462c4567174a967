// The machine that walks the table: one row an update, what it remembers of a flight, and what it
// tells.
#include <unity.h>

#include "FiniteStateMachine.h"
#include "suites.h"

using namespace strix;

namespace {

/// Brings a machine into `state` by a short way from power-up.
FiniteStateMachine machineIn(FlightState state) {
  using namespace condition;
  FiniteStateMachine machine;
  const auto step = [&machine, state](ConditionSet set) {
    if (machine.state() != state) machine.update(set);
  };
  step(kCalibrated);
  if (state == FlightState::MotorTest) step(kMotorTestAsked);
  step(kArmEdge);
  if (state == FlightState::Safe) step(kKill);
  if (state == FlightState::AttitudeStand) step(kStart | kStandMission);
  if (state == FlightState::Manual) step(kSticks | kThrottleUp);
  step(kStart);
  step(kArrived);
  if (state == FlightState::Waypoint) step(kHoldDone | kLegsRemain);
  if (state == FlightState::Return) step(kReturn);
  if (state == FlightState::Guided) step(kGuided);
  if (state == FlightState::Blind) step(kImuLost);
  step(kHoldDone);
  TEST_ASSERT_TRUE_MESSAGE(machine.state() == state, propertiesOf(state).name);
  return machine;
}

void test_the_aircraft_starts_in_boot_with_everything_off() {
  const FiniteStateMachine machine;
  TEST_ASSERT_TRUE(machine.state() == FlightState::Boot);
  TEST_ASSERT_EQUAL_STRING("BOOT", machine.name());
  TEST_ASSERT_FALSE(machine.getMotorFlag());
  TEST_ASSERT_FALSE(machine.getControlFlag());
  TEST_ASSERT_FALSE(machine.getCriticalErrorFlag());
  TEST_ASSERT_FALSE(machine.getFailsafeFlag());
}

void test_the_machine_says_what_its_state_switches_on() {
  for (const StateProperties& state : kStates) {
    const FiniteStateMachine machine = machineIn(state.state);
    TEST_ASSERT_EQUAL_STRING(state.name, machine.name());
    TEST_ASSERT_TRUE(machine.getMotorFlag() == state.motors);
    TEST_ASSERT_TRUE(machine.getControlFlag() == state.controller);
  }
}

void test_an_update_takes_the_first_row_that_fits_and_that_one_alone() {
  // Also in the second update with the same conditions, and when the row leads where it began.
  std::uint64_t x = 88172645463325252ULL;  // xorshift64*, Vigna (2016)
  const auto random = [&x] {
    x ^= x >> 12U;
    x ^= x << 25U;
    x ^= x >> 27U;
    return x * 0x2545F4914F6CDD1DULL;
  };
  constexpr ConditionSet kGiven =
      ((ConditionSet{1} << condition::kCount) - 1U) & ~condition::kFailsafe;
  for (const StateProperties& state : kStates) {
    FiniteStateMachine machine = machineIn(state.state);
    for (int i = 0; i < 300; ++i) {
      const ConditionSet set = random() & random() & random() & random() & kGiven;
      for (int again = 0; again < 3; ++again) {
        const FlightState before = machine.state();
        const ConditionSet own =
            machine.getFailsafeFlag() ? condition::kFailsafe : condition::kNone;
        const Transition* expected = findTransition(before, set | own);
        TEST_ASSERT_TRUE(machine.update(set) == expected);
        TEST_ASSERT_TRUE(machine.state() == (expected == nullptr ? before : expected->to));
      }
      // Few rows lead back into the air: from here on again.
      if (!machine.getMotorFlag()) machine = machineIn(state.state);
    }
  }
}

void test_a_whole_flight_goes_through_its_states_in_order() {
  using namespace condition;
  FiniteStateMachine machine;
  const auto goes = [&machine](ConditionSet set, FlightState to) {
    TEST_ASSERT_NOT_NULL(machine.update(set));
    TEST_ASSERT_TRUE(machine.state() == to);
  };
  goes(kCalibrated | kDisarm, FlightState::Idle);
  goes(kCalibrated | kArmEdge, FlightState::Armed);
  goes(kCalibrated | kStart, FlightState::Takeoff);
  goes(kCalibrated | kStart | kArrived | kLegsRemain, FlightState::Hold);
  goes(kCalibrated | kStart | kArrived | kLegsRemain | kHoldDone, FlightState::Waypoint);
  goes(kCalibrated | kStart | kArrived, FlightState::Hold);
  goes(kCalibrated | kStart | kArrived | kHoldDone, FlightState::Land);
  goes(kCalibrated | kStart | kTouchDown, FlightState::Idle);
  TEST_ASSERT_FALSE(machine.getCriticalErrorFlag());
  TEST_ASSERT_FALSE(machine.getFailsafeFlag());
}

void test_a_flight_by_the_sticks_begins_and_ends_on_the_ground() {
  using namespace condition;
  FiniteStateMachine machine = machineIn(FlightState::Armed);
  machine.update(kSticks);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Armed);  // the throttle is down
  machine.update(kSticks | kThrottleUp);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Manual);
  machine.update(kNone);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Hold);  // his mode is the mission's
  machine.update(kSticks | kSticksEdge);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Manual);
  machine.update(kSticks | kOnGround);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Manual);
  machine.update(kSticks | kOnGround | kDisarm);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Idle);
  TEST_ASSERT_FALSE(machine.getCriticalErrorFlag());
}

void test_a_landing_after_a_failsafe_ends_in_safe_and_any_other_in_idle() {
  using namespace condition;
  FiniteStateMachine machine = machineIn(FlightState::Waypoint);
  machine.update(kBatteryLow);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Return && machine.getFailsafeFlag());
  machine.update(kArrived);  // the voltage has recovered
  TEST_ASSERT_TRUE(machine.state() == FlightState::Land && machine.getFailsafeFlag());
  machine.update(kTouchDown);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Safe);
  TEST_ASSERT_TRUE(machine.getFailsafeFlag());  // what was wrong can be asked
  machine.update(kArmEdge);
  TEST_ASSERT_FALSE(machine.getFailsafeFlag());

  FiniteStateMachine asked = machineIn(FlightState::Waypoint);
  asked.update(kReturn);
  asked.update(kArrived);
  TEST_ASSERT_FALSE(asked.getFailsafeFlag());
  asked.update(kTouchDown);
  TEST_ASSERT_TRUE(asked.state() == FlightState::Idle);
}

void test_nobody_outside_can_say_that_there_was_a_failsafe() {
  FiniteStateMachine machine = machineIn(FlightState::Land);
  machine.update(condition::kTouchDown | condition::kFailsafe);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Idle);
}

void test_a_pilot_who_takes_over_after_a_failsafe_lands_as_after_any_flight() {
  using namespace condition;
  FiniteStateMachine machine = machineIn(FlightState::Manual);
  machine.update(kRadioLost);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Return && machine.getFailsafeFlag());
  machine.update(kSticks | kSticksEdge);  // heard again, and his mode switch moved
  TEST_ASSERT_TRUE(machine.state() == FlightState::Manual);
  TEST_ASSERT_FALSE(machine.getFailsafeFlag());
  machine.update(kSticks | kLandAsked);
  machine.update(kSticks | kTouchDown);
  TEST_ASSERT_TRUE(machine.state() == FlightState::Idle);
}

void test_the_critical_error_flag_stays_until_somebody_rearms() {
  for (const StateProperties& state : kStates) {
    if (!state.motors) continue;
    FiniteStateMachine machine = machineIn(state.state);
    TEST_ASSERT_FALSE(machine.getCriticalErrorFlag());
    machine.update(condition::kUpset);
    TEST_ASSERT_TRUE(machine.getCriticalErrorFlag());
    machine.update(condition::kArmEdge | condition::kPreArmFailure);
    TEST_ASSERT_TRUE(machine.getCriticalErrorFlag());
    machine.update(condition::kArmEdge);
    TEST_ASSERT_TRUE(machine.state() == FlightState::Armed);
    TEST_ASSERT_FALSE(machine.getCriticalErrorFlag());
  }
}

}  // namespace

void runMachineTests() {
  RUN_TEST(test_the_aircraft_starts_in_boot_with_everything_off);
  RUN_TEST(test_the_machine_says_what_its_state_switches_on);
  RUN_TEST(test_an_update_takes_the_first_row_that_fits_and_that_one_alone);
  RUN_TEST(test_a_whole_flight_goes_through_its_states_in_order);
  RUN_TEST(test_a_flight_by_the_sticks_begins_and_ends_on_the_ground);
  RUN_TEST(test_a_landing_after_a_failsafe_ends_in_safe_and_any_other_in_idle);
  RUN_TEST(test_nobody_outside_can_say_that_there_was_a_failsafe);
  RUN_TEST(test_a_pilot_who_takes_over_after_a_failsafe_lands_as_after_any_flight);
  RUN_TEST(test_the_critical_error_flag_stays_until_somebody_rearms);
}
