// The state machine's table, walked whole: 10 states times 2^18 sets of conditions.
#include <unity.h>

#include <array>
#include <cstring>
#include <string>

#include "FiniteStateMachine.h"

using namespace strix;

void setUp() {}
void tearDown() {}

namespace {

constexpr ConditionSet kAllSets = ConditionSet{1} << condition::kCount;
constexpr std::array<FlightState, kStateCount> kAllStates{
    FlightState::Boot,          FlightState::Idle,     FlightState::Armed, FlightState::Takeoff,
    FlightState::Hold,          FlightState::Waypoint, FlightState::Land,  FlightState::Safe,
    FlightState::AttitudeStand, FlightState::Return};

/// The state after one update.
FlightState next(FlightState state, ConditionSet conditions) {
  const Transition* row = findTransition(state, conditions);
  return row == nullptr ? state : row->to;
}

bool motorsOn(FlightState state) { return propertiesOf(state).motors; }

/// Visits every state with every set of conditions, also those that contradict each other: the
/// table must not depend on whoever sets the bits.
template <class Visit>
void forAll(Visit&& visit) {
  for (const FlightState state : kAllStates) {
    for (ConditionSet set = 0; set < kAllSets; ++set) visit(state, set);
  }
}

/// Brings a machine into `state` by the shortest way from power-up.
FiniteStateMachine machineIn(FlightState state) {
  using namespace condition;
  FiniteStateMachine machine;
  const auto step = [&machine, state](ConditionSet set) {
    if (machine.state() != state) machine.update(set);
  };
  step(kCalibrated);
  step(kArmEdge);
  if (state == FlightState::Safe) step(kKill);
  if (state == FlightState::AttitudeStand) step(kStart | kStandMission);
  step(kStart);
  step(kArrived);
  if (state == FlightState::Waypoint) step(kHoldDone | kLegsRemain);
  if (state == FlightState::Return) step(kReturn);
  step(kHoldDone);
  TEST_ASSERT_TRUE(machine.state() == state);
  return machine;
}

void test_the_aircraft_starts_in_boot_with_everything_off() {
  const FiniteStateMachine machine;
  TEST_ASSERT_TRUE(machine.state() == FlightState::Boot);
  TEST_ASSERT_EQUAL_STRING("BOOT", machine.name());
  TEST_ASSERT_FALSE(machine.getMotorFlag());
  TEST_ASSERT_FALSE(machine.getControlFlag());
  TEST_ASSERT_FALSE(machine.getCriticalErrorFlag());
}

void test_motors_are_off_in_boot_idle_and_safe_and_on_elsewhere() {
  for (const FlightState state : kAllStates) {
    const bool off =
        state == FlightState::Boot || state == FlightState::Idle || state == FlightState::Safe;
    TEST_ASSERT_TRUE(motorsOn(state) == !off);
    TEST_ASSERT_TRUE(((kMotorsOn & in(state)) != 0) == !off);
    const FiniteStateMachine machine = machineIn(state);
    TEST_ASSERT_TRUE(machine.getMotorFlag() == !off);
  }
}

void test_the_controller_reaches_the_motors_in_flight_and_on_the_stand_only() {
  for (const FlightState state : kAllStates) {
    const bool controlled = motorsOn(state) && state != FlightState::Armed;
    TEST_ASSERT_TRUE(propertiesOf(state).controller == controlled);
    const bool flying = controlled && state != FlightState::AttitudeStand;
    TEST_ASSERT_TRUE(((kFlying & in(state)) != 0) == flying);
  }
}

void test_every_state_has_its_own_row_and_name() {
  for (std::size_t i = 0; i < kStateCount; ++i) {
    TEST_ASSERT_TRUE(kStates[i].state == kAllStates[i]);
    TEST_ASSERT_EQUAL_UINT(i, static_cast<std::size_t>(kStates[i].state));
    for (std::size_t j = 0; j < i; ++j) {
      TEST_ASSERT_TRUE(std::strcmp(kStates[i].name, kStates[j].name) != 0);
    }
  }
}

void test_one_update_takes_at_most_one_transition() {
  // Also where the next row would match at once: the machine does what findTransition says, once.
  for (const FlightState state : kAllStates) {
    const FiniteStateMachine before = machineIn(state);
    for (ConditionSet set = 0; set < kAllSets; ++set) {
      FiniteStateMachine machine = before;
      const Transition* row = machine.update(set);
      TEST_ASSERT_TRUE(row == findTransition(state, set));
      TEST_ASSERT_TRUE(machine.state() == next(state, set));
    }
  }
}

/// Critical conditions that count in this state: a stand has no place, so no fence.
ConditionSet criticalIn(FlightState state, ConditionSet set) {
  const bool onStand = state == FlightState::AttitudeStand ||
                       (state == FlightState::Armed && (set & condition::kStandMission) != 0);
  return onStand ? kCritical & ~condition::kOutsideFence : kCritical;
}

void test_each_critical_condition_stops_the_motors_whatever_else_is_there() {
  TEST_ASSERT_EQUAL_HEX32(condition::kKill | condition::kUpset | condition::kOutsideFence |
                              condition::kImuLost | condition::kEstimatorUnhealthy,
                          kCritical);
  forAll([](FlightState state, ConditionSet set) {
    if (!motorsOn(state) || (set & criticalIn(state, set)) == 0) return;
    TEST_ASSERT_TRUE(next(state, set) == FlightState::Safe);
  });
}

void test_the_fence_does_not_count_on_the_stand() {
  forAll([](FlightState state, ConditionSet set) {
    if (!motorsOn(state) || (criticalIn(state, set) & condition::kOutsideFence) != 0) return;
    TEST_ASSERT_TRUE(findTransition(state, set) ==
                     findTransition(state, set & ~condition::kOutsideFence));
  });
}

void test_switching_off_stops_the_motors_in_one_update_whatever_else_is_there() {
  forAll([](FlightState state, ConditionSet set) {
    if ((set & condition::kDisarm) == 0 || !motorsOn(state)) return;
    TEST_ASSERT_FALSE(motorsOn(next(state, set)));
  });
}

void test_arming_takes_an_edge_and_every_check_passed_and_starts_on_the_ground() {
  forAll([](FlightState state, ConditionSet set) {
    const bool arms = next(state, set) == FlightState::Armed && state != FlightState::Armed;
    const bool allowed = (set & condition::kArmEdge) != 0 &&
                         (set & condition::kPreArmFailure) == 0 &&
                         (state == FlightState::Idle || state == FlightState::Safe);
    TEST_ASSERT_TRUE(arms == allowed);
    // No other way to turning motors: every flight goes through ARMED.
    if (!motorsOn(state) && motorsOn(next(state, set))) TEST_ASSERT_TRUE(arms);
  });
}

void test_safe_is_left_only_by_rearming() {
  forAll([](FlightState state, ConditionSet set) {
    if (state != FlightState::Safe || next(state, set) == state) return;
    TEST_ASSERT_TRUE(next(state, set) == FlightState::Armed);
    TEST_ASSERT_TRUE((set & condition::kArmEdge) != 0 && (set & condition::kPreArmFailure) == 0);
  });
}

void test_boot_is_left_only_when_calibrated_and_only_to_idle() {
  forAll([](FlightState state, ConditionSet set) {
    if (state != FlightState::Boot) {
      TEST_ASSERT_TRUE(next(state, set) != FlightState::Boot);
      return;
    }
    const bool calibrated = (set & condition::kCalibrated) != 0;
    TEST_ASSERT_TRUE(next(state, set) == (calibrated ? FlightState::Idle : FlightState::Boot));
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

void test_an_armed_aircraft_that_nobody_starts_disarms() {
  TEST_ASSERT_TRUE(next(FlightState::Armed, condition::kArmedTooLong) == FlightState::Idle);
  TEST_ASSERT_TRUE(next(FlightState::Armed, 0) == FlightState::Armed);
  forAll([](FlightState state, ConditionSet set) {
    if (state == FlightState::Armed) return;
    TEST_ASSERT_TRUE(findTransition(state, set) ==
                     findTransition(state, set & ~condition::kArmedTooLong));
  });
}

void test_touch_down_acts_while_landing_only() {
  forAll([](FlightState state, ConditionSet set) {
    if (state == FlightState::Land) return;
    TEST_ASSERT_TRUE(findTransition(state, set) ==
                     findTransition(state, set & ~condition::kTouchDown));
  });
  TEST_ASSERT_TRUE(next(FlightState::Land, condition::kTouchDown) == FlightState::Idle);
}

void test_each_row_of_the_table_applies_in_each_state_it_names() {
  std::array<StateSet, kTransitions.size()> reached{};
  forAll([&reached](FlightState state, ConditionSet set) {
    const Transition* row = findTransition(state, set);
    if (row == nullptr) return;
    StateSet& states = reached[static_cast<std::size_t>(row - kTransitions.data())];
    states = static_cast<StateSet>(states | in(state));
  });
  for (std::size_t i = 0; i < kTransitions.size(); ++i) {
    const Transition& row = kTransitions[i];
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(row.from, reached[i], row.said);
    TEST_ASSERT_TRUE_MESSAGE(row.said != nullptr && row.said[0] != '\0', "a row says something");
  }
}

void test_the_stand_is_entered_from_armed_by_its_mission_alone_and_never_flies() {
  forAll([](FlightState state, ConditionSet set) {
    const FlightState to = next(state, set);
    if (to == FlightState::AttitudeStand && state != to) {
      TEST_ASSERT_TRUE(state == FlightState::Armed);
      TEST_ASSERT_TRUE((set & condition::kStandMission) != 0 && (set & condition::kStart) != 0);
    }
    // With its mission nothing takes off; from it nothing but motors off.
    if (state == FlightState::Armed && (set & condition::kStandMission) != 0) {
      TEST_ASSERT_TRUE((kFlying & in(to)) == 0);
    }
    if (state == FlightState::AttitudeStand && to != state) TEST_ASSERT_FALSE(motorsOn(to));
  });
  TEST_ASSERT_TRUE(next(FlightState::AttitudeStand, condition::kStandDone) == FlightState::Idle);
}

void test_the_way_home_begins_in_hold_or_on_a_leg_and_ends_in_a_landing() {
  forAll([](FlightState state, ConditionSet set) {
    const FlightState to = next(state, set);
    const bool mayReturn = state == FlightState::Hold || state == FlightState::Waypoint;
    const bool stays = motorsOn(to) && mayReturn;  // no critical condition, no disarming
    if (stays && (set & condition::kReturn) != 0) TEST_ASSERT_TRUE(to == FlightState::Return);
    if (to == FlightState::Return && state != to) {
      TEST_ASSERT_TRUE(mayReturn && (set & condition::kReturn) != 0);
    }
    if (state == FlightState::Return && motorsOn(to)) {
      const bool arrived = (set & condition::kArrived) != 0;
      TEST_ASSERT_TRUE(to == (arrived ? FlightState::Land : FlightState::Return));
    }
  });
}

void test_every_state_can_be_reached_from_power_up() {
  StateSet reached = in(FlightState::Boot);
  for (std::size_t round = 0; round < kStateCount; ++round) {
    forAll([&reached](FlightState state, ConditionSet set) {
      if ((reached & in(state)) == 0) return;
      reached = static_cast<StateSet>(reached | in(next(state, set)));
    });
  }
  TEST_ASSERT_EQUAL_HEX16((1U << kStateCount) - 1U, reached);
}

void test_a_whole_flight_goes_through_its_states_in_order() {
  using namespace condition;
  FiniteStateMachine machine;
  const auto goes = [&machine](ConditionSet set, FlightState to) {
    const Transition* row = machine.update(set);
    TEST_ASSERT_NOT_NULL(row);
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
}

void test_the_critical_error_flag_stays_until_somebody_rearms() {
  for (const FlightState state : kAllStates) {
    if (!motorsOn(state)) continue;
    FiniteStateMachine machine = machineIn(state);
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

void test_every_condition_has_its_bit_and_its_name() {
  using namespace condition;
  struct Named {
    ConditionSet bit;
    const char* name;
  };
  const std::array<Named, kCount> expected{{{kCalibrated, "Calibrated"},
                                            {kArmEdge, "ArmEdge"},
                                            {kDisarm, "Disarm"},
                                            {kPreArmFailure, "PreArmFailure"},
                                            {kStart, "Start"},
                                            {kArmedTooLong, "ArmedTooLong"},
                                            {kArrived, "Arrived"},
                                            {kHoldDone, "HoldDone"},
                                            {kLegsRemain, "LegsRemain"},
                                            {kTouchDown, "TouchDown"},
                                            {kKill, "Kill"},
                                            {kUpset, "Upset"},
                                            {kOutsideFence, "OutsideFence"},
                                            {kImuLost, "ImuLost"},
                                            {kEstimatorUnhealthy, "EstimatorUnhealthy"},
                                            {kStandMission, "StandMission"},
                                            {kStandDone, "StandDone"},
                                            {kReturn, "Return"}}};
  for (std::size_t i = 0; i < kCount; ++i) {
    TEST_ASSERT_EQUAL_HEX32(ConditionSet{1} << i, expected[i].bit);
    TEST_ASSERT_EQUAL_STRING(expected[i].name, kConditionNames[i]);
  }
}

void test_every_reason_to_refuse_arming_has_one_bit_and_one_sentence() {
  ConditionSet seen = 0;
  for (const PreArmCheck& check : kPreArmChecks) {
    TEST_ASSERT_TRUE(check.bit != 0 && (check.bit & (check.bit - 1)) == 0);
    TEST_ASSERT_EQUAL_HEX32(0, seen & check.bit);
    seen |= check.bit;
    TEST_ASSERT_TRUE(std::strlen(check.refusal) > 10);
    TEST_ASSERT_EQUAL_STRING(check.refusal, firstRefusal(check.bit));
    for (const PreArmCheck& other : kPreArmChecks) {
      if (&other != &check) TEST_ASSERT_TRUE(std::strcmp(check.refusal, other.refusal) != 0);
    }
  }
  // Without a gap, so that no bit in use lacks a sentence.
  TEST_ASSERT_EQUAL_HEX32((ConditionSet{1} << kPreArmChecks.size()) - 1U, seen);
  TEST_ASSERT_NULL(firstRefusal(0));
}

void test_the_first_of_several_reasons_is_told() {
  for (ConditionSet set = 1; set < (ConditionSet{1} << kPreArmChecks.size()); ++set) {
    TEST_ASSERT_NOT_NULL(firstRefusal(set));
  }
  // A missing device keeps the calibration from ending: the device is the reason to name.
  TEST_ASSERT_EQUAL_STRING(firstRefusal(prearm::kMag),
                           firstRefusal(prearm::kMag | prearm::kNotCalibrated));
}

}  // namespace

int main() {
  UNITY_BEGIN();
  RUN_TEST(test_the_aircraft_starts_in_boot_with_everything_off);
  RUN_TEST(test_motors_are_off_in_boot_idle_and_safe_and_on_elsewhere);
  RUN_TEST(test_the_controller_reaches_the_motors_in_flight_and_on_the_stand_only);
  RUN_TEST(test_every_state_has_its_own_row_and_name);
  RUN_TEST(test_one_update_takes_at_most_one_transition);
  RUN_TEST(test_each_critical_condition_stops_the_motors_whatever_else_is_there);
  RUN_TEST(test_the_fence_does_not_count_on_the_stand);
  RUN_TEST(test_switching_off_stops_the_motors_in_one_update_whatever_else_is_there);
  RUN_TEST(test_arming_takes_an_edge_and_every_check_passed_and_starts_on_the_ground);
  RUN_TEST(test_safe_is_left_only_by_rearming);
  RUN_TEST(test_boot_is_left_only_when_calibrated_and_only_to_idle);
  RUN_TEST(test_a_refused_arming_is_told_in_every_state_on_the_ground);
  RUN_TEST(test_an_armed_aircraft_that_nobody_starts_disarms);
  RUN_TEST(test_touch_down_acts_while_landing_only);
  RUN_TEST(test_each_row_of_the_table_applies_in_each_state_it_names);
  RUN_TEST(test_the_stand_is_entered_from_armed_by_its_mission_alone_and_never_flies);
  RUN_TEST(test_the_way_home_begins_in_hold_or_on_a_leg_and_ends_in_a_landing);
  RUN_TEST(test_every_state_can_be_reached_from_power_up);
  RUN_TEST(test_a_whole_flight_goes_through_its_states_in_order);
  RUN_TEST(test_the_critical_error_flag_stays_until_somebody_rearms);
  RUN_TEST(test_every_condition_has_its_bit_and_its_name);
  RUN_TEST(test_every_reason_to_refuse_arming_has_one_bit_and_one_sentence);
  RUN_TEST(test_the_first_of_several_reasons_is_told);
  UNITY_END();
  return 0;
}
