/// A flight plan: take off, go through the legs, then land there or at home. Or no flight but the
/// attitude stand. As text: MissionText.h.
#pragma once

#include <array>
#include <cstdint>

#include "Mathpk.h"

namespace strix {

enum class LegKind : std::uint8_t {
  Waypoint,  ///< go to a place and stay there
  Attitude,  ///< fly an attitude at the present height, then hold where that ends
};

struct Leg {
  float north;      ///< m from the start; these three of a waypoint only
  float east;       ///< m
  float height;     ///< m, up
  float turn;       ///< rad to the right: waypoint: of the heading at take-off; attitude: of the
                    ///< heading at the leg's start
  Micros holdTime;  ///< stay there this long; zero at a waypoint: fly through without a stop
  LegKind kind = LegKind::Waypoint;
  float radius = 0.0F;  ///< m, this near is there; zero: as guidance is configured
  float speed =
      0.0F;           ///< m/s, most on the way there, horizontally; zero: as guidance is configured
  float roll = 0.0F;  ///< rad, right side down; of an attitude only
  float pitch = 0.0F;  ///< rad, nose up
};

enum class MissionEnd : std::uint8_t {
  Land,  ///< where the last leg ends
  Home,  ///< return to the start and land there
};

struct Mission {
  static constexpr std::size_t kMaxLegs = 32;
  /// ours: rad; thrust is raised for the tilt up to 45 deg (ControlConfig.h), beyond it the
  /// aircraft sinks.
  static constexpr float kMostTilt = 45.0F * kDegToRad;

  const char* name = "";
  float takeoffHeight = 0.0F;  ///< m
  Micros takeoffHoldTime = 0;
  std::uint8_t legCount = 0;  ///< legs in use, from the first
  std::array<Leg, kMaxLegs> legs{};
  MissionEnd end = MissionEnd::Land;
  float standAngle = 0.0F;  ///< rad; above zero: the attitude stand with steps of this size

  [[nodiscard]] constexpr bool onStand() const { return standAngle > 0.0F; }
};

/// The box the aircraft must not leave; outside it the motors stop.
struct Fence {
  float radius = 30.0F;  ///< m, horizontally from the start
  float height = 15.0F;  ///< m above the start

  [[nodiscard]] constexpr bool contains(float north, float east, float up) const {
    return north * north + east * east <= radius * radius && up <= height;
  }
  [[nodiscard]] bool contains(const Vector3f& positionNed) const {
    return contains(positionNed.x(), positionNed.y(), -positionNed.z());
  }
};

/// True when a leg lies in the air, inside the fence and within what the aircraft can do.
[[nodiscard]] constexpr bool isFlyable(const Leg& leg, const Fence& fence) {
  const auto within = [](float value, float limit) { return value >= -limit && value <= limit; };
  if (!within(leg.turn, 8192.0F)) return false;  // sinCos's domain
  if (leg.kind == LegKind::Attitude) {
    return within(leg.roll, Mission::kMostTilt) && within(leg.pitch, Mission::kMostTilt);
  }
  return leg.height > 0.0F && fence.contains(leg.north, leg.east, leg.height) &&
         leg.radius >= 0.0F && leg.radius <= fence.radius &&  //
         leg.speed >= 0.0F && leg.speed < 100.0F;
}

/// True when the mission takes off and every leg is flyable, or when it is a stand's.
[[nodiscard]] constexpr bool isFlyable(const Mission& mission, const Fence& fence) {
  if (!(mission.standAngle >= 0.0F && mission.standAngle <= Mission::kMostTilt)) return false;
  if (mission.onStand()) return mission.legCount == 0;
  if (!(mission.takeoffHeight > 0.0F && mission.takeoffHeight <= fence.height)) return false;
  if (mission.legCount > Mission::kMaxLegs) return false;
  for (std::size_t i = 0; i < mission.legCount; ++i) {
    if (!isFlyable(mission.legs[i], fence)) return false;
  }
  return true;
}

}  // namespace strix
