/// Every set of conditions of a state, without counting them one by one: as cubes.
///
/// A row applies to all sets that hold all of its `when` and none of its `unless`: in the space of
/// sets, one dimension a condition, that is a cube. What is left of a cube when another is taken
/// out of it is again some disjoint cubes. So the sets of a state fall, row by row, into cubes for
/// each of which one row, or none, is the first match: 2^47 sets into 57 cubes at most, and
/// what holds for a cube holds for every one of its members.
#pragma once

#include <cstddef>
#include <cstdint>

#include "FiniteStateMachine.h"

constexpr strix::ConditionSet kEverything =
    (strix::ConditionSet{1} << strix::condition::kCount) - 1U;

/// The sets that hold all of `all` and none of `none`; of the other conditions any.
struct Cube {
  strix::ConditionSet all = strix::condition::kNone;
  strix::ConditionSet none = strix::condition::kNone;

  [[nodiscard]] bool contains(strix::ConditionSet set) const {
    return (set & all) == all && (set & none) == 0;
  }
  /// Some member holds all of `with` and none of `without`.
  [[nodiscard]] bool some(strix::ConditionSet with,
                          strix::ConditionSet without = strix::condition::kNone) const {
    return ((with | all) & (without | none)) == 0;
  }
  /// Every member does.
  [[nodiscard]] bool every(strix::ConditionSet with,
                           strix::ConditionSet without = strix::condition::kNone) const {
    return (with & ~all) == 0 && (without & ~none) == 0;
  }
  /// Its members.
  [[nodiscard]] std::uint64_t size() const {
    std::uint64_t members = 1;
    for (strix::ConditionSet free = kEverything & ~(all | none); free != 0; free &= free - 1) {
      members *= 2;
    }
    return members;
  }
};

/// Calls visit(cube, row or nullptr) for the cubes that `cube` falls into from row `first` on.
template <class Visit>
void splitCube(strix::FlightState state, Cube cube, std::size_t first, const Visit& visit) {
  for (std::size_t i = first; i < strix::kTransitions.size(); ++i) {
    const strix::Transition& row = strix::kTransitions[i];
    if ((row.from & strix::in(state)) == 0 || !cube.some(row.when, row.unless)) continue;
    // One condition after the other: the sets that fail here, having passed those before.
    strix::ConditionSet free = (row.when | row.unless) & ~(cube.all | cube.none);
    for (; free != 0; free &= free - 1) {
      const strix::ConditionSet bit = free & (~free + 1U);
      const bool wanted = (row.when & bit) != 0;
      Cube fails = cube;
      (wanted ? fails.none : fails.all) |= bit;
      splitCube(state, fails, i + 1, visit);
      (wanted ? cube.all : cube.none) |= bit;
    }
    visit(cube, &row);
    return;
  }
  visit(cube, static_cast<const strix::Transition*>(nullptr));
}

/// Calls visit(cube, row or nullptr) for disjoint cubes that are all sets of this state.
template <class Visit>
void forCubes(strix::FlightState state, const Visit& visit) {
  splitCube(state, {}, 0, visit);
}

/// Calls visit(state, cube, next state) for all states and all sets.
template <class Visit>
void forAllCubes(const Visit& visit) {
  for (const strix::StateProperties& from : strix::kStates) {
    forCubes(from.state, [&](const Cube& cube, const strix::Transition* row) {
      visit(from.state, cube, row == nullptr ? from.state : row->to);
    });
  }
}
