/// The first flight: up to 2 m, 5 m north and 3 m east, a quarter turn, back, down.
#pragma once

#include "MissionText.h"

namespace strix {

constexpr const char* kFirstFlightText =
    "takeoff 2 2\n"
    "leg 5 3 2  0 2  # north m, east m, height m, turn deg, hold s\n"
    "leg 5 3 2 90 2\n"
    "leg 0 0 2 90 2\n";

constexpr Mission kFirstFlight = parseMission("first-flight", kFirstFlightText).mission;
static_assert(parseMission("first-flight", kFirstFlightText).valid());

}  // namespace strix
