/// A mission that comes leg by leg, as telemetry sends it.
#pragma once

#include "Mission.h"
#include "VehicleCommand.h"

namespace strix {

class MissionUpload {
 public:
  void clear() {
    mission_ = Mission{};
    mission_.name = "uploaded";
    next_ = 0;
  }

  /// @return nullptr, or why it was refused
  [[nodiscard]] CommandRefusal addLeg(const VehicleCommand& c, const Fence& fence) {
    if (c.index != next_ || next_ >= Mission::kMaxLegs) return "mission: legs out of order";
    const std::array<float, 8>& v = c.values;
    Leg leg{v[0], v[1], v[2], v[3], c.time};
    leg.kind = static_cast<LegKind>(c.detail);
    leg.radius = v[4];
    leg.speed = v[5];
    leg.roll = v[6];
    leg.pitch = v[7];
    if (c.detail > static_cast<std::uint8_t>(LegKind::Attitude) || !isFlyable(leg, fence)) {
      return "mission: a leg lies outside the fence, or is more than the aircraft can do";
    }
    mission_.legs[next_++] = leg;
    return nullptr;
  }

  /// @param out  takes the mission when it is complete and flyable
  [[nodiscard]] CommandRefusal finish(const VehicleCommand& c, const Fence& fence, Mission& out) {
    if (c.index != next_) return "mission: a leg is missing";
    if (c.detail > static_cast<std::uint8_t>(MissionEnd::Home)) return "mission: no such end";
    if (next_ == 0 && c.values[0] == 0.0F) {  // nothing at all: no mission, and so no flight
      out = mission_;
      return nullptr;
    }
    mission_.legCount = next_;
    mission_.takeoffHeight = c.values[0];
    mission_.takeoffHoldTime = c.time;
    mission_.end = static_cast<MissionEnd>(c.detail);
    if (!isFlyable(mission_, fence)) return "mission: take-off height is outside the fence";
    out = mission_;
    return nullptr;
  }

 private:
  Mission mission_;
  std::uint8_t next_ = 0;  ///< legs so far
};

}  // namespace strix
