/// Python's view of the state machine's table, from which docs/state-machine.md
/// and the model for Spin are made.
#include "bind.h"

#include <FiniteStateMachine.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <vector>

namespace nb = nanobind;

namespace {

using Names = std::vector<std::string>;
using Rows = nb::typed<nb::list, nb::typed<nb::dict, nb::str, nb::any>>;

Names namesOf(strix::ConditionSet set) {
  Names names;
  for (std::size_t i = 0; i < strix::condition::kCount; ++i) {
    if ((set >> i & 1U) != 0) names.emplace_back(strix::kConditionTexts[i].name);
  }
  return names;
}

Names namesOfStates(strix::StateSet set) {
  Names names;
  for (const strix::StateProperties& state : strix::kStates) {
    if ((set & strix::in(state.state)) != 0) names.emplace_back(state.name);
  }
  return names;
}

Rows transitions() {
  Rows rows;
  for (const strix::Transition& row : strix::kTransitions) {
    nb::dict found;
    found["from_states"] = namesOfStates(row.from);
    found["when"] = namesOf(row.when);
    found["unless"] = namesOf(row.unless);
    found["to"] = strix::propertiesOf(row.to).name;
    found["failsafe"] = row.failsafe;
    found["said"] = row.said;
    rows.append(found);
  }
  return rows;
}

Rows states() {
  Rows rows;
  for (const strix::StateProperties& state : strix::kStates) {
    nb::dict found;
    found["name"] = state.name;
    found["motors"] = state.motors;
    found["controller"] = state.controller;
    found["flying"] = (strix::kFlying & strix::in(state.state)) != 0;
    found["under_way"] = (strix::kUnderWay & strix::in(state.state)) != 0;
    found["keeps_failsafe"] = (strix::kFailsafeStates & strix::in(state.state)) != 0;
    rows.append(found);
  }
  return rows;
}

Rows conditions() {
  Rows rows;
  for (const strix::ConditionText& condition : strix::kConditionTexts) {
    nb::dict found;
    found["name"] = condition.name;
    found["meaning"] = condition.meaning;
    rows.append(found);
  }
  return rows;
}

}  // namespace

void bindStates(nb::module_& m) {
  m.def("transitions", &transitions, "The rows of the state machine's table, the first match wins");
  m.def("states", &states, "The states in the order of their numbers in the log");
  m.def("conditions", &conditions, "The conditions in the order of their places in the log");
}
