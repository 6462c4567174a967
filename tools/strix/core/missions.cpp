/// Python's view of missions: their text, read by the flight code.
#include "bind.h"

#include <MissionText.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>

#include <map>
#include <string>

#include "missions/FirstFlight.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Dict = nb::typed<nb::dict, nb::str, nb::any>;

double toSeconds(strix::Micros duration) { return static_cast<double>(duration) * 1e-6; }

Dict toDict(const strix::Leg& leg) {
  nb::dict d;
  d["kind"] = leg.kind == strix::LegKind::Attitude ? "attitude" : "leg";
  d["north_m"] = leg.north;
  d["east_m"] = leg.east;
  d["height_m"] = leg.height;
  d["turn_rad"] = leg.turn;
  d["hold_s"] = toSeconds(leg.holdTime);
  d["radius_m"] = leg.radius;
  d["speed_m_s"] = leg.speed;
  d["roll_rad"] = leg.roll;
  d["pitch_rad"] = leg.pitch;
  return Dict(d);
}

Dict parseMission(const std::string& text) {
  const strix::ParsedMission parsed = strix::parseMission("", text);
  if (!parsed.valid()) throw nb::value_error(strix::MissionErrorText(parsed.error).text());
  const strix::Mission& m = parsed.mission;
  nb::dict d;
  d["takeoff_height_m"] = m.takeoffHeight;
  d["takeoff_hold_s"] = toSeconds(m.takeoffHoldTime);
  nb::list legs;
  for (std::size_t i = 0; i < m.legCount; ++i) legs.append(toDict(m.legs[i]));
  d["legs"] = legs;
  d["end"] = m.end == strix::MissionEnd::Home ? "home" : "land";
  d["stand_angle_rad"] = m.standAngle;
  return Dict(d);
}

std::map<std::string, std::string> missionTexts() {
  return {{strix::kFirstFlight.name, strix::kFirstFlightText}};
}

}  // namespace

void bindMissions(nb::module_& m) {
  m.def("parse_mission", &parseMission, "text"_a,
        "What a mission's text says; ValueError with line, word and what was expected");
  m.def("mission_texts", &missionTexts, "Missions that are part of the flight code, by name");
}
