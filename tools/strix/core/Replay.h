/// A flight over again: the logged inputs through the same flight software.
#pragma once

#include <FlightConfig.h>
#include <FlightSoftware.h>

#include <algorithm>
#include <optional>
#include <string>

#include "LogReader.h"
#include "SimulatedBoard.h"
#include "vehicles/Vehicles.h"

namespace strix {

/// What a replay found.
struct ReplayResult {
  std::uint64_t begin = 0;        ///< us, log time
  std::uint64_t end = 0;          ///< of the last pass
  std::uint64_t logEnd = 0;       ///< of the log
  std::uint32_t ticks = 0;        ///< control ticks compared
  std::uint32_t digest = 0;       ///< of the replayed ticks' hashes: equal when two runs are
  std::uint32_t differences = 0;  ///< ticks that differ, as far as they were compared
  std::uint64_t firstBad = 0;     ///< time of the first of them
  std::string field;              ///< in which it differs first
  bool gap = false;               ///< ended where the log has lost inputs
};

using FlightLogReader =
    LogReader<topic::SensorCombined, topic::SensorMag, topic::SensorBaro, topic::VehicleGpsPosition,
              topic::BatteryStatus, topic::EscStatus, topic::ManualControlSwitches, topic::InputRc,
              topic::VehicleCommand, topic::FlightConfig, topic::MissionLeg, topic::ControlTick,
              topic::LogStatus, topic::VehicleAttitude, topic::VehicleAngularVelocity,
              topic::WrenchSetpoint, topic::WrenchAchieved, topic::ActuatorOutputs>;

/// The next record of a topic that has not been reached yet.
template <class Topic>
class Cursor {
 public:
  explicit Cursor(const FlightLogReader& log) : records_(log.records<Topic>()) {}

  [[nodiscard]] std::uint64_t time() const {
    return next_ < records_.size() ? records_[next_].timestamp : UINT64_MAX;
  }
  /// The record of this very time, if there is one; moves on behind it.
  const Topic* take(std::uint64_t time) {
    while (next_ < records_.size() && records_[next_].timestamp < time) ++next_;
    return next_ < records_.size() && records_[next_].timestamp == time ? &records_[next_++]
                                                                        : nullptr;
  }

 private:
  const std::deque<Topic>& records_;
  std::size_t next_ = 0;
};

// What the board had read when these were logged: toRecord of FlightLog.h backwards.

[[nodiscard]] inline Vector3f toVector(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

[[nodiscard]] inline ImuRaw asRead(const topic::SensorCombined& r) {
  return {static_cast<Micros>(r.timestamp_sample), toVector(r.accelerometer_m_s2),
          toVector(r.gyro_rad), r.temperature};
}
[[nodiscard]] inline MagRaw asRead(const topic::SensorMag& r) {
  return {static_cast<Micros>(r.timestamp_sample), toVector(r.field_ut)};
}
[[nodiscard]] inline AltRaw asRead(const topic::SensorBaro& r) {
  return {static_cast<Micros>(r.timestamp_sample), r.pressure, r.temperature};
}
[[nodiscard]] inline GpsRaw asRead(const topic::VehicleGpsPosition& r) {
  return {static_cast<Micros>(r.timestamp_sample),
          r.lat,
          r.lon,
          r.alt,
          r.speed_knots,
          r.course_deg,
          r.hdop,
          r.fix_type,
          r.satellites_used};
}
[[nodiscard]] inline BatteryRaw asRead(const topic::BatteryStatus& r) {
  return {static_cast<Micros>(r.timestamp_sample), r.voltage_v, r.current_a};
}
[[nodiscard]] inline EscRaw asRead(const topic::EscStatus& r) {
  return {static_cast<Micros>(r.timestamp_sample), r.revolutions, r.voltage, r.temperature,
          r.current};
}
[[nodiscard]] inline PilotSwitches asRead(const topic::ManualControlSwitches& r) {
  return {r.arm_switch == 1, r.kill_switch == 1, r.start_switch == 1};
}

[[nodiscard]] inline RadioChannels asRead(const topic::InputRc& r) {
  return {r.values, r.channel_count, r.rc_lost_frame != 0, r.rc_failsafe != 0};
}
[[nodiscard]] inline VehicleCommand asRead(const topic::VehicleCommand& r) {
  return {static_cast<CommandKind>(r.kind),
          static_cast<CommandSource>(r.source),
          r.detail,
          r.index,
          r.time_us,
          r.values};
}

/// The configuration that flew, which a flight log begins with.
[[nodiscard]] inline const topic::FlightConfig& loggedConfig(const FlightLogReader& log) {
  const auto& records = log.records<topic::FlightConfig>();
  if (records.empty() || log.records<topic::ControlTick>().empty()) {
    log.refuse("a flight log from its beginning on, with flight_config and control_tick",
               "none of them");
  }
  return records.front();
}

[[nodiscard]] inline Mission loggedMission(const FlightLogReader& log) {
  const topic::FlightConfig& chosen = loggedConfig(log);
  Mission mission{"replayed", chosen.takeoff_height, chosen.takeoff_hold, chosen.leg_count};
  mission.end = static_cast<MissionEnd>(chosen.mission_end);
  mission.standAngle = chosen.stand_angle;
  const auto& legs = log.records<topic::MissionLeg>();
  if (legs.size() < mission.legCount || mission.legCount > Mission::kMaxLegs) {
    log.refuse(std::to_string(mission.legCount) + " legs of the mission",
               std::to_string(legs.size()));
  }
  for (std::size_t i = 0; i < mission.legCount; ++i) {
    const topic::MissionLeg& leg = legs[i];
    mission.legs[i] = {
        leg.north,  leg.east,  leg.height, leg.turn, leg.hold, static_cast<LegKind>(leg.kind),
        leg.radius, leg.speed, leg.roll,   leg.pitch};
  }
  return mission;
}

/// What flew, as this build of the software has it.
/// @param gains  others than those that flew, or null
[[nodiscard]] inline FlightSoftwareConfig replayConfig(const FlightLogReader& log,
                                                       const Gains* gains = nullptr) {
  const Mission mission = loggedMission(log);
  const Airframe* airframe = findAirframe(log.info("vehicle"));
  if (airframe == nullptr) {
    log.refuse("a vehicle of include/vehicles", "'" + log.info("vehicle") + "'");
  }
  const topic::FlightConfig& chosen = loggedConfig(log);
  if (chosen.design >= airframe->designs.size() ||
      (chosen.attitude_law != 0 && airframe->observer == nullptr)) {
    log.refuse("a controller of include/gains", "one of another version");
  }
  FlightSoftwareConfig config =
      flightConfig(airframe->vehicle, gains == nullptr ? *airframe->designs[chosen.design] : *gains,
                   mission, chosen.declination);
  config.design = chosen.design;
  for (const ParameterInfo& row : kParameterTable) {
    if (const float* value = log.parameter(std::string(row.name))) {
      config.parameters.*row.member = *value;
    }
  }
  if (chosen.attitude_law != 0) config.control.reducedObserver = airframe->observer;
  const bool real = log.info("ver_hw") != SimulatedBoard<>::kName;
  if (real) useRealSensors(config.sensors, kCalibration);
  return config;
}

/// @tparam States  of the navigation filter
/// @tparam Card  takes the replay's own log
template <int States, class Card = FileCard>
class Replay {
 public:
  using Software = FlightSoftware<SimulatedBoard<Card>, States>;

  /// @param config  what is flown; the log's own configuration, or another to see what it would do
  /// @param logPath  where the replay writes its own log; empty: nowhere
  Replay(const FlightLogReader& log, const FlightSoftwareConfig& config, const std::string& logPath)
      : log_(log), board_(logPath, bootId()), software_(board_, config) {
    if (!board_.card().open()) {
      throw std::invalid_argument(logPath + ": cannot be written: " + std::strerror(errno));
    }
  }

  /// @param compare  stop at the first control tick whose hash is not the logged one
  ReplayResult run(bool compare) {
    return run(compare, [](Software& software) { software.loop(); });
  }

  /// @param pass  makes one pass of the software: calls its loop(), and may look around it
  template <class Pass>
  ReplayResult run(bool compare, Pass&& pass) {
    ReplayResult result;
    StateHash digest;
    const topic::FlightConfig& chosen = loggedConfig(log_);
    const std::uint64_t limit = firstGap();
    board_.setTime(static_cast<Micros>(chosen.timestamp));
    board_.setDevices(devicesOf(chosen));
    board_.setReset({chosen.reset, chosen.in_flight != 0});
    result.begin = chosen.timestamp;
    result.logEnd = log_.records<topic::ControlTick>().back().timestamp;
    software_.setup();
    for (;;) {
      const std::uint64_t time = std::min(
          {imu_.time(), mag_.time(), alt_.time(), gps_.time(), tick_.time(), command_.time()});
      if (time == UINT64_MAX) break;
      if (time >= limit) {
        result.gap = true;
        break;
      }
      give(time);
      pass(software_);
      while (const auto* asked = command_.take(time)) (void)software_.command(asRead(*asked));
      result.end = time;
      const topic::ControlTick* logged = tick_.take(time);
      const bool ticked = software_.lastTick().timestamp == time;
      if (logged == nullptr && !ticked) continue;
      ++result.ticks;
      digest.add(software_.lastTick().state_hash);
      result.digest = digest.value();
      const bool same =
          logged != nullptr && ticked && logged->state_hash == software_.lastTick().state_hash;
      if (same) continue;
      if (++result.differences > 1) continue;
      result.firstBad = time;
      result.field = logged == nullptr ? "a control tick that the log has not"
                     : !ticked         ? "no control tick where the log has one"
                                       : firstField(time);
      if (compare) break;
    }
    return result;
  }

  /// Writes the rest of the replay's own log.
  bool close() {
    Micros clock = board_.micros();
    return software_.logger().forceWriteAndFlush([&clock] { return clock++; }, 10'000'000);
  }

 private:
  [[nodiscard]] static std::uint32_t bootId() { return 1; }

  [[nodiscard]] static SensorSet devicesOf(const topic::FlightConfig& c) {
    const auto has = [&c](unsigned bit) { return (c.devices & bit) != 0; };
    return {has(1), has(2), has(4), has(8), has(16)};
  }

  /// Time up to which no input is missing: of the last status that has lost none.
  [[nodiscard]] std::uint64_t firstGap() const {
    std::uint64_t sound = 0;
    for (const topic::LogStatus& status : log_.records<topic::LogStatus>()) {
      const auto lost = [&status](std::size_t id) { return status.dropped_by_id[id] != 0; };
      if (lost(logStreamId<topic::SensorCombined, 0>()) ||
          lost(logStreamId<topic::SensorMag, 0>()) || lost(logStreamId<topic::SensorBaro, 0>()) ||
          lost(logStreamId<topic::VehicleGpsPosition, 0>()) ||
          lost(logStreamId<topic::BatteryStatus, 0>()) ||
          lost(logStreamId<topic::EscStatus, 0>()) ||
          lost(logStreamId<topic::ManualControlSwitches, 0>()) ||
          lost(logStreamId<topic::InputRc, 0>()) || lost(logStreamId<topic::VehicleCommand, 0>()) ||
          lost(logStreamId<topic::ControlTick, 0>())) {
        return sound;
      }
      sound = status.timestamp;
    }
    return UINT64_MAX;
  }

  /// Sets the board to this time with what was read then.
  void give(std::uint64_t time) {
    board_.setTime(static_cast<Micros>(time));
    if (const auto* r = imu_.take(time)) board_.put(asRead(*r));
    if (const auto* r = mag_.take(time)) board_.put(asRead(*r));
    if (const auto* r = alt_.take(time)) board_.put(asRead(*r));
    if (const auto* r = gps_.take(time)) board_.put(asRead(*r));
    if (const auto* r = battery_.take(time)) board_.put(asRead(*r));
    if (const auto* r = escs_.take(time)) board_.put(asRead(*r));
    if (const auto* r = radio_.take(time)) board_.put(asRead(*r));
    while (switches_.time() <= time) board_.setPilot(asRead(*switches_.take(switches_.time())));
  }

  /// The first logged field in which the tick at `time` differs.
  [[nodiscard]] std::string firstField(std::uint64_t time) const {
    const GncRecords now =
        toRecords(time, software_.navigation().state(), software_.guidance().reference(),
                  software_.controller(), software_.motors(), software_.lastTick());
    std::string field = differs(time, now.attitude);
    if (field.empty()) field = differs(time, now.rate);
    if (field.empty()) field = differs(time, now.wrenchSetpoint);
    if (field.empty()) field = differs(time, now.wrenchAchieved);
    if (field.empty()) field = differs(time, now.outputs);
    return field.empty() ? "something that is not logged at this tick: position, velocity, "
                           "covariance, bias or state"
                         : field;
  }

  template <class Topic>
  [[nodiscard]] std::string differs(std::uint64_t time, const Topic& replayed) const {
    Cursor<Topic> cursor(log_);
    const Topic* logged = cursor.take(time);
    return logged == nullptr ? std::string() : firstDifference(*logged, replayed);
  }

  const FlightLogReader& log_;
  SimulatedBoard<Card> board_;
  Software software_;
  Cursor<topic::SensorCombined> imu_{log_};
  Cursor<topic::SensorMag> mag_{log_};
  Cursor<topic::SensorBaro> alt_{log_};
  Cursor<topic::VehicleGpsPosition> gps_{log_};
  Cursor<topic::BatteryStatus> battery_{log_};
  Cursor<topic::EscStatus> escs_{log_};
  Cursor<topic::ManualControlSwitches> switches_{log_};
  Cursor<topic::InputRc> radio_{log_};
  Cursor<topic::VehicleCommand> command_{log_};
  Cursor<topic::ControlTick> tick_{log_};
};

}  // namespace strix
