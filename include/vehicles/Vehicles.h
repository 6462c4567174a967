/// All airframes by name, with their gains.
#pragma once

#include <array>
#include <string_view>

#include "Gains.h"
#include "Vehicle.h"
#include "gains/Quad5in.h"
#include "gains/UgglanQ450.h"
#include "gains/UgglanQ450Observer.h"
#include "vehicles/Quad5in.h"
#include "vehicles/UgglanQ450.h"

namespace strix {

struct Airframe {
  const Vehicle& vehicle;
  const Gains& gains;                          ///< that fly: integral action, motor lag known
  const std::array<const Gains*, 4>& designs;  ///< those, no integral, no lag, neither
  const ObserverGains* observer = nullptr;     ///< of Ugglan's attitude law at 500 Hz
};

constexpr std::array<Airframe, 2> kAirframes{{
    {kQuad5in, kQuad5inGains, kQuad5inDesigns},
    {kUgglanQ450, kUgglanQ450Gains, kUgglanQ450Designs, &kUgglanQ450ObserverGains500Hz},
}};

/// @return nullptr when there is none of that name
[[nodiscard]] constexpr const Airframe* findAirframe(std::string_view name) {
  for (const Airframe& airframe : kAirframes) {
    if (name == airframe.vehicle.name) return &airframe;
  }
  return nullptr;
}

}  // namespace strix
