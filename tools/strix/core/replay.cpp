/// Python's view of a replay.
#include "Replay.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>

#include "bind.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using strix::FlightLogReader;

template <int States>
strix::ReplayResult run(const FlightLogReader& log, const strix::FlightSoftwareConfig& config,
                        const std::string& out, bool compare) {
  auto replay = std::make_unique<strix::Replay<States>>(log, config, out);
  strix::ReplayResult result = replay->run(compare);
  if (!out.empty() && !replay->close()) {
    throw std::invalid_argument(out + ": could not be written to its end");
  }
  return result;
}

/// Of each control: the gains on the errors, on the lagging wrench, on the integral.
using GainRows = std::array<std::array<float, strix::kErrorCount + 2>, strix::kControlCount>;

strix::Gains gainsOf(const GainRows& rows) {
  strix::Gains gains{"replayed", {}};
  for (std::size_t row = 0; row < rows.size(); ++row) {
    std::copy_n(rows[row].begin(), strix::kErrorCount, gains.k[row].begin());
    gains.lag[row] = rows[row][strix::kErrorCount];
    gains.integral[row] = rows[row][strix::kErrorCount + 1];
  }
  return gains;
}

strix::ReplayResult replay(const FlightLogReader& log,
                           const std::optional<strix::NavigationConfig>& navigation, int states,
                           const std::optional<GainRows>& gains, const std::string& out,
                           bool compare) {
  std::optional<strix::Gains> other;
  if (gains) other = gainsOf(*gains);
  strix::FlightSoftwareConfig config = strix::replayConfig(log, other ? &*other : nullptr);
  if (navigation) config.navigation = *navigation;
  const nb::gil_scoped_release unlocked;
  return states == 9 ? run<9>(log, config, out, compare) : run<18>(log, config, out, compare);
}

}  // namespace

void bindReplay(nb::module_& m) {
  using strix::ReplayResult;

  nb::class_<ReplayResult>(m, "ReplayResult", "What a replay found; times in us of the log")
      .def_ro("begin", &ReplayResult::begin)
      .def_ro("end", &ReplayResult::end)
      .def_ro("logEnd", &ReplayResult::logEnd)
      .def_ro("ticks", &ReplayResult::ticks)
      .def_ro("digest", &ReplayResult::digest)
      .def_ro("differences", &ReplayResult::differences)
      .def_ro("firstBad", &ReplayResult::firstBad)
      .def_ro("field", &ReplayResult::field)
      .def_ro("gap", &ReplayResult::gap);
  nb::class_<FlightLogReader>(m, "FlightLogReader", "The inputs and control ticks of a flight log")
      .def(nb::init<const std::string&>(), "path"_a)
      .def("info", &FlightLogReader::info, "key"_a);
  m.def(
      "replayNavigation",
      [](const FlightLogReader& log) { return strix::replayConfig(log).navigation; }, "log"_a,
      "The navigation's configuration that flew, to be changed and given to replay()");
  m.def("replay", &replay, "log"_a, "navigation"_a.none(), "states"_a, "gains"_a.none(), "out"_a,
        "compare"_a, "The logged inputs through the flight software");
}
