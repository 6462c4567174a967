/// The first flight: up to 2 m, 5 m north and 3 m east, a quarter turn, back, down.
#pragma once

#include "Mission.h"

namespace strix {

constexpr Mission kFirstFlight{
    "first-flight",
    2.0F,       // m
    2'000'000,  // us at take-off height
    3,
    {{
        // north m, east m, height m, turn rad, hold us
        {5.0F, 3.0F, 2.0F, 0.0F, 2'000'000},
        {5.0F, 3.0F, 2.0F, kHalfPi, 2'000'000},
        {0.0F, 0.0F, 2.0F, kHalfPi, 2'000'000},
    }},
};

}  // namespace strix
