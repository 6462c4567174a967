/// Python's view of the table of parameters, from which docs/parameters.md is made.
#include "bind.h"

#include <Parameters.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include <stdexcept>
#include <string>

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Rows = nb::typed<nb::list, nb::typed<nb::dict, nb::str, nb::any>>;

const char* nameOf(strix::ParameterLock lock) {
  if (lock == strix::ParameterLock::Air) return "air";
  return lock == strix::ParameterLock::Ground ? "ground" : "start";
}

Rows parameters() {
  Rows rows;
  for (const strix::ParameterInfo& info : strix::kParameterTable) {
    nb::dict row;
    row["name"] = info.name;
    row["default"] = info.standard;
    row["lowest"] = info.lowest;
    row["highest"] = info.highest;
    row["unit"] = info.unit;
    row["whole"] = info.whole();
    row["lock"] = nameOf(info.lock);
    row["help"] = info.help;
    rows.append(row);
  }
  return rows;
}

const char* checkParameter(const std::string& name, float value, bool motorsOn) {
  return strix::checkParameter(strix::findParameter(name), value, motorsOn);
}

}  // namespace

void bindParameters(nb::module_& m) {
  m.def("parameters", &parameters, "The rows of the table of parameters");
  m.def("check_parameter", &checkParameter, "name"_a, "value"_a, "motors_on"_a = false,
        "None, or the sentence that says why it must not be set to that");
}
