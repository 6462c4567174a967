// The cubes of Cubes.h are all sets of conditions, each once and with its first row; and every row
// of the table, every state and every condition is there for something.
#include <unity.h>

#include <array>
#include <cstring>

#include "Cubes.h"
#include "suites.h"

using namespace strix;

namespace {

/// xorshift64*, Vigna (2016): the same sets in every run and on every processor.
class Random {
 public:
  std::uint64_t next() {
    x_ ^= x_ >> 12U;
    x_ ^= x_ << 25U;
    x_ ^= x_ >> 27U;
    return x_ * 0x2545F4914F6CDD1DULL;
  }

 private:
  std::uint64_t x_ = 88172645463325252ULL;
};

/// The first row that fits, spelt out anew: condition by condition.
const Transition* firstMatch(FlightState state, ConditionSet set) {
  for (std::size_t i = 0; i < kTransitions.size(); ++i) {
    const Transition& row = kTransitions[i];
    bool fits = ((row.from >> static_cast<unsigned>(state)) & 1U) != 0;
    for (unsigned place = 0; place < condition::kCount; ++place) {
      const bool holds = ((set >> place) & 1U) != 0;
      if (((row.when >> place) & 1U) != 0 && !holds) fits = false;
      if (((row.unless >> place) & 1U) != 0 && holds) fits = false;
    }
    if (fits) return &row;
  }
  return nullptr;
}

/// The conditions that rows of this state name.
ConditionSet namedIn(FlightState state) {
  ConditionSet named = condition::kNone;
  for (const Transition& row : kTransitions) {
    if ((row.from & in(state)) != 0) named |= row.when | row.unless;
  }
  return named;
}

unsigned countOf(ConditionSet set) {
  unsigned count = 0;
  for (; set != 0; set &= set - 1) ++count;
  return count;
}

/// That one cube alone contains the set, with the row that is the first match.
void expectInOneCube(FlightState state, ConditionSet set) {
  const Transition* expected = firstMatch(state, set);
  unsigned found = 0;
  forCubes(state, [&](const Cube& cube, const Transition* row) {
    if (!cube.contains(set)) return;
    ++found;
    TEST_ASSERT_TRUE(row == expected);
  });
  TEST_ASSERT_EQUAL_UINT(1, found);
  TEST_ASSERT_TRUE(findTransition(state, set) == expected);
}

void test_the_cubes_of_each_state_are_all_sets_there_are() {
  for (const StateProperties& state : kStates) {
    std::uint64_t members = 0;
    forCubes(state.state, [&](const Cube& cube, const Transition*) { members += cube.size(); });
    TEST_ASSERT_TRUE_MESSAGE(members == kEverything + 1U, state.name);
  }
}

void test_each_set_lies_in_one_cube_with_the_row_that_comes_first() {
  Random random;
  for (const StateProperties& state : kStates) {
    const ConditionSet named = namedIn(state.state);
    // Every combination of what its rows name, where those are few.
    if (countOf(named) <= 8) {
      ConditionSet set = 0;
      do {
        expectInOneCube(state.state, set);
        set = (set - named) & named;  // the next subset
      } while (set != 0);
    }
    for (int i = 0; i < 40; ++i) {
      // Few conditions, as in flight, and many, as never: the first rows would hide the last.
      const ConditionSet sparse = random.next() & random.next() & random.next();
      expectInOneCube(state.state, sparse & random.next() & kEverything);
      expectInOneCube(state.state, random.next() & kEverything);
    }
  }
}

void test_each_row_of_the_table_applies_in_each_state_it_names() {
  std::array<StateSet, kTransitions.size()> reached{};
  for (const StateProperties& state : kStates) {
    forCubes(state.state, [&](const Cube&, const Transition* row) {
      if (row == nullptr) return;
      StateSet& states = reached[static_cast<std::size_t>(row - kTransitions.data())];
      states = static_cast<StateSet>(states | in(state.state));
    });
  }
  for (std::size_t i = 0; i < kTransitions.size(); ++i) {
    const Transition& row = kTransitions[i];
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(row.from, reached[i], row.said);
    TEST_ASSERT_TRUE_MESSAGE(row.said != nullptr && row.said[0] != '\0', "a row says something");
  }
}

void test_every_condition_does_something_somewhere() {
  ConditionSet named = condition::kNone;
  for (const StateProperties& state : kStates) named |= namedIn(state.state);
  for (std::size_t i = 0; i < condition::kCount; ++i) {
    TEST_ASSERT_TRUE_MESSAGE((named >> i & 1U) != 0, kConditionTexts[i].name);
  }
}

/// The states that can come after those of `from`, in any number of updates.
StateSet reachableFrom(StateSet from) {
  for (std::size_t round = 0; round < kStateCount; ++round) {
    forAllCubes([&](FlightState state, const Cube&, FlightState next) {
      if ((from & in(state)) != 0) from = static_cast<StateSet>(from | in(next));
    });
  }
  return from;
}

void test_every_state_can_be_reached_from_power_up() {
  TEST_ASSERT_EQUAL_HEX16((1U << kStateCount) - 1U, reachableFrom(in(FlightState::Boot)));
}

void test_no_state_is_a_trap_and_the_next_flight_is_always_possible() {
  for (const StateProperties& state : kStates) {
    TEST_ASSERT_TRUE_MESSAGE((reachableFrom(in(state.state)) & in(FlightState::Takeoff)) != 0,
                             state.name);
  }
}

void test_every_state_has_its_own_row_and_name() {
  for (std::size_t i = 0; i < kStateCount; ++i) {
    TEST_ASSERT_EQUAL_UINT(i, static_cast<std::size_t>(kStates[i].state));
    for (std::size_t j = 0; j < i; ++j) {
      TEST_ASSERT_TRUE(std::strcmp(kStates[i].name, kStates[j].name) != 0);
    }
  }
}

void test_logs_of_earlier_flights_keep_their_meaning() {
  // The places in the log's set of conditions, and the numbers of the states: new ones follow.
  constexpr std::array<const char*, condition::kCount> kConditions{"Calibrated",
                                                                   "ArmEdge",
                                                                   "Disarm",
                                                                   "PreArmFailure",
                                                                   "Start",
                                                                   "ArmedTooLong",
                                                                   "Arrived",
                                                                   "HoldDone",
                                                                   "LegsRemain",
                                                                   "TouchDown",
                                                                   "Kill",
                                                                   "Upset",
                                                                   "OutsideFence",
                                                                   "ImuLost",
                                                                   "EstimatorUnhealthy",
                                                                   "StandMission",
                                                                   "StandDone",
                                                                   "Return",
                                                                   "LandAsked",
                                                                   "HoldAsked",
                                                                   "Sticks",
                                                                   "SticksEdge",
                                                                   "ThrottleUp",
                                                                   "Guided",
                                                                   "TiltLimit",
                                                                   "FarOutsideFence",
                                                                   "GpsLost",
                                                                   "MagLost",
                                                                   "AltLost",
                                                                   "ImuSaturated",
                                                                   "BatteryLow",
                                                                   "BatteryCritical",
                                                                   "RadioLost",
                                                                   "LinkLost",
                                                                   "Overrun",
                                                                   "LogFailed",
                                                                   "MotorsSaturated",
                                                                   "FreeFall",
                                                                   "Crash",
                                                                   "Failsafe",
                                                                   "BlindOver",
                                                                   "OnGround",
                                                                   "ImuBack",
                                                                   "CalibrateAsked",
                                                                   "MotorTestAsked",
                                                                   "MotorTestDone",
                                                                   "Astray"};
  for (std::size_t i = 0; i < condition::kCount; ++i) {
    TEST_ASSERT_EQUAL_STRING(kConditions[i], kConditionTexts[i].name);
    TEST_ASSERT_TRUE_MESSAGE(std::strlen(kConditionTexts[i].meaning) > 10, kConditions[i]);
  }
  TEST_ASSERT_TRUE(condition::kTouchDown == 1U << 9U);  // the constants are the places
  TEST_ASSERT_TRUE(condition::kOnGround == ConditionSet{1} << 41U);
  constexpr std::array<const char*, kStateCount> kNames{
      "BOOT", "IDLE",           "ARMED",  "TAKEOFF", "HOLD",   "WAYPOINT", "LAND",
      "SAFE", "ATTITUDE_STAND", "RETURN", "MANUAL",  "GUIDED", "BLIND",    "MOTOR_TEST"};
  for (std::size_t i = 0; i < kStateCount; ++i) {
    TEST_ASSERT_EQUAL_STRING(kNames[i], kStates[i].name);
  }
}

}  // namespace

void runTableTests() {
  RUN_TEST(test_the_cubes_of_each_state_are_all_sets_there_are);
  RUN_TEST(test_each_set_lies_in_one_cube_with_the_row_that_comes_first);
  RUN_TEST(test_each_row_of_the_table_applies_in_each_state_it_names);
  RUN_TEST(test_every_condition_does_something_somewhere);
  RUN_TEST(test_every_state_can_be_reached_from_power_up);
  RUN_TEST(test_no_state_is_a_trap_and_the_next_flight_is_always_possible);
  RUN_TEST(test_every_state_has_its_own_row_and_name);
  RUN_TEST(test_logs_of_earlier_flights_keep_their_meaning);
}
