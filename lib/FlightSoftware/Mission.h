/// A flight plan: take off, go through the legs, land where the last one ends.
#pragma once

#include <array>
#include <cstdint>

#include "Mathpk.h"

namespace strix {

/// A place to go to and stay at, relative to the start.
struct Leg {
  float north;      ///< m
  float east;       ///< m
  float height;     ///< m, up
  float turn;       ///< rad, right of the heading at take-off
  Micros holdTime;  ///< stay there this long
};

struct Mission {
  static constexpr std::size_t kMaxLegs = 16;

  const char* name;
  float takeoffHeight;  ///< m
  Micros takeoffHoldTime;
  std::uint8_t legCount;  ///< legs in use, from the first
  std::array<Leg, kMaxLegs> legs;
};

/// The box the aircraft must not leave; outside it the motors stop.
struct Fence {
  float radius = 30.0F;  ///< m, horizontally from the start
  float height = 15.0F;  ///< m above the start

  [[nodiscard]] bool contains(const Vector3f& positionNed) const {
    const float horizontal2 = positionNed.x() * positionNed.x() + positionNed.y() * positionNed.y();
    return horizontal2 <= radius * radius && -positionNed.z() <= height;
  }
};

/// True when the mission takes off and every leg lies in the air and inside the fence.
[[nodiscard]] inline bool isFlyable(const Mission& mission, const Fence& fence) {
  if (!(mission.takeoffHeight > 0.0F && mission.takeoffHeight <= fence.height)) return false;
  if (mission.legCount > Mission::kMaxLegs) return false;
  for (std::size_t i = 0; i < mission.legCount; ++i) {
    const Leg& leg = mission.legs[i];
    if (!(leg.height > 0.0F) || !fence.contains({leg.north, leg.east, -leg.height})) return false;
    if (!(leg.turn > -8192.0F && leg.turn < 8192.0F)) return false;  // sinCos's domain
  }
  return true;
}

}  // namespace strix
