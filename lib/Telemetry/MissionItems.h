/// Missions in MAVLink's words. Ours (Mission.h) is
///
///     NAV_TAKEOFF, [NAV_DELAY], { [DO_CHANGE_SPEED], NAV_WAYPOINT }, NAV_LAND or
///     NAV_RETURN_TO_LAUNCH
///
/// and nothing else can be flown, so nothing else is accepted.
/// https://mavlink.io/en/services/mission.html
#pragma once

#include <limits>

#include "Geodesy.h"
#include "Mavlink.h"
#include "Mission.h"
#include "VehicleCommand.h"

namespace strix {

/// What a mission item says, as MAVLink has it.
struct MissionItem {
  std::uint16_t command = 0;
  std::uint8_t frame = MAV_FRAME_MISSION;
  std::array<float, 4> param{};
  std::int32_t x = 0;  ///< 1e-7 deg, or 1e-4 m in the local frame
  std::int32_t y = 0;
  float z = 0.0F;  ///< m: up from home, or down in the local frame
};

/// Where the local frame is on the earth, if that is known.
struct MissionFrame {
  bool known = false;
  LocalFrame local;
};

/// MAV_MISSION_ACCEPTED, or another result and the sentence that explains it.
struct MissionVerdict {
  std::uint8_t result = MAV_MISSION_ACCEPTED;
  const char* why = nullptr;
};

namespace mission_items {

constexpr float kLocalUnit = 1e-4F;  // m
constexpr float kDefaultSpeed = -2.0F;

[[nodiscard]] inline MissionItem place(std::uint16_t command, const Vector3f& ned,
                                       const MissionFrame& frame) {
  MissionItem item;
  item.command = command;
  item.param[3] = std::numeric_limits<float>::quiet_NaN();  // heading: as it is
  if (frame.known) {
    const GeoPoint point = frame.local.toGeo(ned);
    item.frame = MAV_FRAME_GLOBAL_RELATIVE_ALT;
    item.x = point.latitude;
    item.y = point.longitude;
    item.z = -ned.z();
  } else {
    const auto units = [](float metres) {
      return static_cast<std::int32_t>(metres / kLocalUnit + (metres < 0.0F ? -0.5F : 0.5F));
    };
    item.frame = MAV_FRAME_LOCAL_NED;
    item.x = units(ned.x());
    item.y = units(ned.y());
    item.z = ned.z();
  }
  return item;
}

[[nodiscard]] inline Vector3f placeOf(const Leg& leg) { return {leg.north, leg.east, -leg.height}; }

/// Each item in its order, to `visit`.
template <class Visit>
void forEach(const Mission& mission, const MissionFrame& frame, Visit&& visit) {
  Vector3f last{0.0F, 0.0F, -mission.takeoffHeight};
  visit(place(MAV_CMD_NAV_TAKEOFF, last, frame));
  if (mission.takeoffHoldTime != 0) {
    MissionItem delay;
    delay.command = MAV_CMD_NAV_DELAY;
    delay.param = {toSeconds(mission.takeoffHoldTime), -1.0F, -1.0F, -1.0F};
    visit(delay);
  }
  float speed = 0.0F;
  for (std::size_t i = 0; i < mission.legCount; ++i) {
    const Leg& leg = mission.legs[i];
    if (leg.speed != speed) {
      speed = leg.speed;
      MissionItem change;
      change.command = MAV_CMD_DO_CHANGE_SPEED;
      change.param = {SPEED_TYPE_GROUNDSPEED, speed > 0.0F ? speed : kDefaultSpeed, -1.0F, 0.0F};
      visit(change);
    }
    last = placeOf(leg);
    MissionItem waypoint = place(MAV_CMD_NAV_WAYPOINT, last, frame);
    waypoint.param[0] = toSeconds(leg.holdTime);
    waypoint.param[1] = leg.radius;
    visit(waypoint);
  }
  last.z() = 0.0F;
  MissionItem end;
  end.command = MAV_CMD_NAV_RETURN_TO_LAUNCH;
  visit(mission.end == MissionEnd::Home ? end : place(MAV_CMD_NAV_LAND, last, frame));
}

}  // namespace mission_items

/// nullptr, or what of the mission MAVLink has no words for.
[[nodiscard]] inline const char* untellable(const Mission& mission) {
  if (mission.onStand()) return "mission: the attitude stand's cannot be shown";
  for (std::size_t i = 0; i < mission.legCount; ++i) {
    if (mission.legs[i].kind != LegKind::Waypoint || mission.legs[i].turn != 0.0F) {
      return "mission: its attitudes and turns cannot be shown: see mission.txt";
    }
  }
  return nullptr;
}

/// Zero where there is no mission.
[[nodiscard]] inline std::uint16_t missionItemCount(const Mission& mission) {
  std::uint16_t count = 0;
  if (!(mission.takeoffHeight > 0.0F)) return 0;
  mission_items::forEach(mission, {}, [&count](const MissionItem& /*item*/) { ++count; });
  return count;
}

/// @param sequence  below missionItemCount
[[nodiscard]] inline MissionItem missionItem(const Mission& mission, std::uint16_t sequence,
                                             const MissionFrame& frame) {
  MissionItem found;
  std::uint16_t place = 0;
  mission_items::forEach(mission, frame, [&](const MissionItem& item) {
    if (place++ == sequence) found = item;
  });
  return found;
}

/// Items, in their order, made commands for the flight software: MissionLeg and, at the end,
/// MissionDone.
class MissionReader {
 public:
  void begin(std::uint16_t count) {
    *this = {};
    count_ = count;
  }

  /// The next item.
  /// @tparam Flight  CommandRefusal command(const VehicleCommand&)
  template <class Flight>
  [[nodiscard]] MissionVerdict take(Flight& flight, const MissionItem& item,
                                    const MissionFrame& frame) {
    const bool first = next_ == 0;
    const bool last = next_ + 1 == count_;
    ++next_;
    if (first != (item.command == MAV_CMD_NAV_TAKEOFF)) {
      return {MAV_MISSION_UNSUPPORTED, "mission: take-off is its first item, and no other"};
    }
    const bool ends =
        item.command == MAV_CMD_NAV_LAND || item.command == MAV_CMD_NAV_RETURN_TO_LAUNCH;
    if (last != ends) {
      return {MAV_MISSION_UNSUPPORTED,
              "mission: landing or return to launch is its last item, and no other"};
    }
    switch (item.command) {
      case MAV_CMD_NAV_TAKEOFF:
        return takeOff(item);
      case MAV_CMD_NAV_DELAY:
        return delay(item);
      case MAV_CMD_DO_CHANGE_SPEED:
        return changeSpeed(item);
      case MAV_CMD_NAV_WAYPOINT:
        return waypoint(flight, item, frame);
      case MAV_CMD_NAV_LAND:
        return land(flight, item, frame);
      case MAV_CMD_NAV_RETURN_TO_LAUNCH:
        return finish(flight, MissionEnd::Home);
      default:
        return {MAV_MISSION_UNSUPPORTED,
                "mission: only take-off, delay, speed, waypoints, landing and return are flown"};
    }
  }

 private:
  static constexpr const char* kNoFrame =
      "mission: heights count from home, or all from the start in the local frame";

  [[nodiscard]] static bool isLocal(const MissionItem& item) {
    return item.frame == MAV_FRAME_LOCAL_NED;
  }
  [[nodiscard]] static bool isGlobal(const MissionItem& item) {
    return item.frame == MAV_FRAME_GLOBAL_RELATIVE_ALT ||
           item.frame == MAV_FRAME_GLOBAL_RELATIVE_ALT_INT;
  }

  /// Seconds of a pause; the clock of the loop counts no more than an hour of them.
  [[nodiscard]] static bool isPause(float seconds) { return seconds >= 0.0F && seconds <= 3600.0F; }

  /// Straight up from where the aircraft stands: place and heading are not read.
  MissionVerdict takeOff(const MissionItem& item) {
    if (!isLocal(item) && !isGlobal(item)) return {MAV_MISSION_UNSUPPORTED_FRAME, kNoFrame};
    takeoffHeight_ = isLocal(item) ? -item.z : item.z;
    last_ = {0.0F, 0.0F, -takeoffHeight_};
    return {};
  }

  MissionVerdict delay(const MissionItem& item) {
    if (next_ != 2) {
      return {MAV_MISSION_UNSUPPORTED,
              "mission: a delay follows take-off only: let waypoints hold"};
    }
    if (!isPause(item.param[0])) {
      return {MAV_MISSION_INVALID_PARAM1, "mission: a delay is 0 to 3600 s"};
    }
    takeoffHold_ = toMicros(item.param[0]);
    return {};
  }

  MissionVerdict changeSpeed(const MissionItem& item) {
    if (item.param[0] != SPEED_TYPE_GROUNDSPEED) {
      return {MAV_MISSION_INVALID_PARAM1, "mission: only speed over ground can be changed"};
    }
    if (item.param[1] == mission_items::kDefaultSpeed) {
      speed_ = 0.0F;
    } else if (item.param[1] > 0.0F) {
      speed_ = item.param[1];
    } else if (item.param[1] != -1.0F) {  // -1: no change
      return {MAV_MISSION_INVALID_PARAM2, "mission: a speed is above 0 m/s"};
    }
    return {};
  }

  template <class Flight>
  MissionVerdict waypoint(Flight& flight, const MissionItem& item, const MissionFrame& frame) {
    if (!isPause(item.param[0])) {
      return {MAV_MISSION_INVALID_PARAM1, "mission: a waypoint holds 0 to 3600 s"};
    }
    if (!(item.param[1] >= 0.0F)) {
      return {MAV_MISSION_INVALID_PARAM2, "mission: a radius is 0 m, as usual, or more"};
    }
    if (item.param[2] != 0.0F) {
      return {MAV_MISSION_INVALID_PARAM3, "mission: waypoints are not passed by: set 0 m"};
    }
    if (item.param[3] == item.param[3]) {  // not NaN
      return {MAV_MISSION_INVALID_PARAM4,
              "mission: the heading of take-off is kept: leave heading empty (NaN)"};
    }
    Vector3f ned;
    if (const MissionVerdict bad = readPlace(item, frame, ned); bad.why != nullptr) return bad;
    return addLeg(flight, ned, item.param[1], toMicros(item.param[0]));
  }

  /// Where the last leg ends. Another place becomes a leg of its own, at the height of the last.
  template <class Flight>
  MissionVerdict land(Flight& flight, const MissionItem& item, const MissionFrame& frame) {
    const bool here = item.x == 0 && item.y == 0;  // MAVLink: the place where it then is
    if (!here || isLocal(item)) {
      Vector3f ned;
      if (const MissionVerdict bad = readPlace(item, frame, ned); bad.why != nullptr) return bad;
      constexpr float kSame = 0.1F;  // m, ours: far less than an aircraft keeps its place to
      const float north = ned.x() - last_.x();
      const float east = ned.y() - last_.y();
      if (north * north + east * east > kSame * kSame) {
        ned.z() = last_.z();
        if (const MissionVerdict bad = addLeg(flight, ned, 0.0F, 0); bad.why != nullptr) return bad;
      }
    }
    return finish(flight, MissionEnd::Land);
  }

  /// m, down of the origin.
  static MissionVerdict readPlace(const MissionItem& item, const MissionFrame& frame,
                                  Vector3f& ned) {
    if (isLocal(item)) {
      ned = {static_cast<float>(item.x) * mission_items::kLocalUnit,
             static_cast<float>(item.y) * mission_items::kLocalUnit, item.z};
      return {};
    }
    if (!isGlobal(item)) return {MAV_MISSION_UNSUPPORTED_FRAME, kNoFrame};
    if (!frame.known) {
      return {MAV_MISSION_UNSUPPORTED_FRAME,
              "mission: where the start lies is not known yet: wait for GPS, then try again"};
    }
    ned = frame.local.toNed({item.x, item.y, 0});
    ned.z() = -item.z;
    return {};
  }

  template <class Flight>
  MissionVerdict addLeg(Flight& flight, const Vector3f& ned, float radius, Micros hold) {
    VehicleCommand c;
    c.kind = CommandKind::MissionLeg;
    c.detail = static_cast<std::uint8_t>(LegKind::Waypoint);
    c.index = legs_;
    c.time = hold;
    c.values = {ned.x(), ned.y(), -ned.z(), 0.0F, radius, speed_, 0.0F, 0.0F};
    if (legs_ == Mission::kMaxLegs) {
      return {MAV_MISSION_NO_SPACE, "mission: more legs than there is room for"};
    }
    if (const CommandRefusal refusal = flight.command(c)) return {MAV_MISSION_INVALID, refusal};
    ++legs_;
    last_ = ned;
    return {};
  }

  template <class Flight>
  MissionVerdict finish(Flight& flight, MissionEnd end) {
    VehicleCommand c;
    c.kind = CommandKind::MissionDone;
    c.detail = static_cast<std::uint8_t>(end);
    c.index = legs_;
    c.time = takeoffHold_;
    c.values[0] = takeoffHeight_;
    if (const CommandRefusal refusal = flight.command(c)) return {MAV_MISSION_INVALID, refusal};
    return {};
  }

  Vector3f last_ = Vector3f::Zero();  ///< where the mission has come to, m NED
  float takeoffHeight_ = 0.0F;
  float speed_ = 0.0F;  ///< m/s of the legs that follow; zero: the usual one
  Micros takeoffHold_ = 0;
  std::uint16_t count_ = 0;
  std::uint16_t next_ = 0;
  std::uint16_t legs_ = 0;
};

}  // namespace strix
