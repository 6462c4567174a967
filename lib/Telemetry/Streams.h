/// What the aircraft tells by itself: one function a message, and the table of their rates.
#pragma once

#include <array>
#include <limits>

#include "Conditions.h"
#include "FlightStatus.h"
#include "Geodesy.h"
#include "Mavlink.h"
#include "Rotation.h"
#include "States.h"
#include "Version.h"

namespace strix {

namespace stream {

constexpr float kNotKnown = std::numeric_limits<float>::quiet_NaN();

/// To the nearest whole number, and to the ends of Whole's range.
template <class Whole>
[[nodiscard]] Whole whole(float value) {
  const auto lowest = static_cast<float>(std::numeric_limits<Whole>::lowest());
  const auto highest = static_cast<float>(std::numeric_limits<Whole>::max());
  if (!(value > lowest)) return std::numeric_limits<Whole>::lowest();  // and what is no number
  if (!(value < highest)) return std::numeric_limits<Whole>::max();
  return static_cast<Whole>(value + (value < 0.0F ? -0.5F : 0.5F));
}

/// ms since power-up: wraps after 49 days.
[[nodiscard]] inline std::uint32_t bootMillis(const FlightStatus& s) {
  return static_cast<std::uint32_t>(s.time / 1000);
}

/// deg, 0 to 360, of the nose from north.
[[nodiscard]] inline float heading(const FlightStatus& s) {
  const float degrees = yawOf(s.estimate.attitude) / kDegToRad;
  return degrees < 0.0F ? degrees + 360.0F : degrees;
}

/// The place where the local frame begins; it is known once GPS has been averaged.
[[nodiscard]] inline bool originKnown(const FlightStatus& s) {
  return (s.preArm & prearm::kOrigin) == 0 && (s.originLatitude != 0 || s.originLongitude != 0);
}
[[nodiscard]] inline LocalFrame localFrame(const FlightStatus& s) {
  return LocalFrame({s.originLatitude, s.originLongitude, s.originAltitude});
}

[[nodiscard]] inline FlightState stateOf(const FlightStatus& s) {
  return static_cast<FlightState>(s.state);
}

/// MAV_MODE_FLAG_CUSTOM_MODE_ENABLED stays off: QGroundControl would show a bare number, whereas it
/// names these (FirmwarePlugin::flightMode). FlightState itself is in custom_mode.
[[nodiscard]] inline std::uint8_t baseMode(const FlightStatus& s) {
  if (!s.motorsOn) return 0;  // "PreFlight"
  unsigned mode = MAV_MODE_FLAG_AUTO_ENABLED;
  if (stateOf(s) == FlightState::Guided) mode = MAV_MODE_FLAG_GUIDED_ENABLED;
  if (stateOf(s) == FlightState::Manual) {
    mode = MAV_MODE_FLAG_MANUAL_INPUT_ENABLED | MAV_MODE_FLAG_STABILIZE_ENABLED;
  }
  return static_cast<std::uint8_t>(mode | MAV_MODE_FLAG_SAFETY_ARMED);
}

[[nodiscard]] inline std::uint8_t systemStatus(const FlightStatus& s) {
  switch (stateOf(s)) {
    case FlightState::Boot:
      return MAV_STATE_CALIBRATING;
    case FlightState::Idle:
      return MAV_STATE_STANDBY;
    case FlightState::Safe:
      return s.critical ? MAV_STATE_FLIGHT_TERMINATION : MAV_STATE_STANDBY;
    case FlightState::Blind:
      return MAV_STATE_EMERGENCY;
    default:
      return s.failsafe ? MAV_STATE_CRITICAL : MAV_STATE_ACTIVE;
  }
}

[[nodiscard]] inline std::uint8_t landedState(const FlightStatus& s) {
  if (!s.flying) return MAV_LANDED_STATE_ON_GROUND;
  if (stateOf(s) == FlightState::Takeoff) return MAV_LANDED_STATE_TAKEOFF;
  return stateOf(s) == FlightState::Land ? MAV_LANDED_STATE_LANDING : MAV_LANDED_STATE_IN_AIR;
}

/// MAV_AUTOPILOT_GENERIC: docs/telemetry.md says what follows from it.
template <class Out>
bool heartbeat(Out& out, const FlightStatus& s) {
  mavlink_heartbeat_t m{};
  m.custom_mode = s.state;
  m.type = MAV_TYPE_QUADROTOR;
  m.autopilot = MAV_AUTOPILOT_GENERIC;
  m.base_mode = baseMode(s);
  m.system_status = systemStatus(s);
  m.mavlink_version = 3;  // of the dialect's first file, as every heartbeat says
  out.send(mavlink_msg_heartbeat_encode_status, m);
  return true;
}

template <class Out>
bool sysStatus(Out& out, const FlightStatus& s) {
  const std::array<std::pair<std::uint32_t, bool>, 10> parts{{
      {MAV_SYS_STATUS_SENSOR_3D_GYRO, s.imuFresh},
      {MAV_SYS_STATUS_SENSOR_3D_ACCEL, s.imuFresh},
      {MAV_SYS_STATUS_SENSOR_3D_MAG, s.magFresh},
      {MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE, s.altFresh},
      {MAV_SYS_STATUS_SENSOR_GPS, s.gpsFresh},
      {MAV_SYS_STATUS_SENSOR_RC_RECEIVER, s.radioHeard},
      {MAV_SYS_STATUS_AHRS, s.estimatorHealthy},
      {MAV_SYS_STATUS_LOGGING, s.logGood},
      {MAV_SYS_STATUS_SENSOR_BATTERY, s.voltage > 0.0F},
      {MAV_SYS_STATUS_PREARM_CHECK, s.motorsOn || s.preArm == 0},
  }};
  mavlink_sys_status_t m{};
  for (const auto& [bit, healthy] : parts) {
    m.onboard_control_sensors_present |= bit;
    m.onboard_control_sensors_health |= healthy ? bit : 0U;
  }
  m.onboard_control_sensors_enabled = m.onboard_control_sensors_present;
  constexpr float kControlTick = 2000.0F;  // us: the pass that is longer misses one
  const float load = static_cast<float>(s.longestPass) / kControlTick * 1000.0F;
  m.load = load < 1000.0F ? whole<std::uint16_t>(load) : std::uint16_t{1000};
  m.voltage_battery =
      s.voltage > 0.0F ? whole<std::uint16_t>(s.voltage * 1e3F) : std::uint16_t{UINT16_MAX};
  m.current_battery = s.current > 0.0F ? whole<std::int16_t>(s.current * 100.0F) : std::int16_t{-1};
  m.battery_remaining = -1;
  m.errors_count1 = static_cast<std::uint16_t>(s.overruns);
  m.errors_count2 = static_cast<std::uint16_t>(s.logDropped);
  out.send(mavlink_msg_sys_status_encode_status, m);
  return true;
}

template <class Out>
bool attitude(Out& out, const FlightStatus& s) {
  const Quaternion& q = s.estimate.attitude;
  const Vector3f& rate = s.estimate.rateBody;
  const mavlink_attitude_quaternion_t m{bootMillis(s), q.w,      q.x,      q.y, q.z,
                                        rate.x(),      rate.y(), rate.z(), {}};
  out.send(mavlink_msg_attitude_quaternion_encode_status, m);
  return true;
}

template <class Out>
bool localPosition(Out& out, const FlightStatus& s) {
  const Vector3f& p = s.estimate.positionNed;
  const Vector3f& v = s.estimate.velocityNed;
  const mavlink_local_position_ned_t m{bootMillis(s), p.x(), p.y(), p.z(), v.x(), v.y(), v.z()};
  out.send(mavlink_msg_local_position_ned_encode_status, m);
  return true;
}

/// The estimate on the map: none without GPS, rather than one in the sea off Africa.
template <class Out>
bool globalPosition(Out& out, const FlightStatus& s) {
  if (!s.positionValid || !originKnown(s)) return false;
  const GeoPoint place = localFrame(s).toGeo(s.estimate.positionNed);
  const Vector3f& v = s.estimate.velocityNed;
  mavlink_global_position_int_t m{};
  m.time_boot_ms = bootMillis(s);
  m.lat = place.latitude;
  m.lon = place.longitude;
  m.alt = place.altitude;
  m.relative_alt = place.altitude - s.originAltitude;
  m.vx = whole<std::int16_t>(v.x() * 100.0F);
  m.vy = whole<std::int16_t>(v.y() * 100.0F);
  m.vz = whole<std::int16_t>(v.z() * 100.0F);
  m.hdg = whole<std::uint16_t>(heading(s) * 100.0F);
  out.send(mavlink_msg_global_position_int_encode_status, m);
  return true;
}

template <class Out>
bool gpsRaw(Out& out, const FlightStatus& s) {
  mavlink_gps_raw_int_t m{};
  m.time_usec = s.time;
  m.fix_type = static_cast<std::uint8_t>(!s.gpsFresh   ? GPS_FIX_TYPE_NO_GPS
                                         : s.fix < 2   ? GPS_FIX_TYPE_NO_FIX
                                         : s.fix == 2U ? GPS_FIX_TYPE_2D_FIX
                                                       : GPS_FIX_TYPE_3D_FIX);
  m.lat = s.latitude;
  m.lon = s.longitude;
  m.alt = s.altitude;
  m.eph = whole<std::uint16_t>(s.hdop * 100.0F);
  m.epv = UINT16_MAX;
  m.vel = whole<std::uint16_t>(s.speed * 100.0F);
  m.cog = whole<std::uint16_t>(s.course / kDegToRad * 100.0F);
  m.satellites_visible = s.satellites;
  out.send(mavlink_msg_gps_raw_int_encode_status, m);
  return true;
}

template <class Out>
bool hud(Out& out, const FlightStatus& s) {
  const Vector3f& v = s.estimate.velocityNed;
  float throttle = 0.0F;
  for (const float motor : s.motors) throttle += 0.25F * motor;
  mavlink_vfr_hud_t m{};
  m.airspeed = kNotKnown;
  m.groundspeed = squareRoot(v.x() * v.x() + v.y() * v.y());
  m.alt = static_cast<float>(s.originAltitude) * 1e-3F - s.estimate.positionNed.z();
  m.climb = -v.z();
  m.heading = whole<std::int16_t>(heading(s));
  m.throttle = whole<std::uint16_t>(throttle * 100.0F);
  out.send(mavlink_msg_vfr_hud_encode_status, m);
  return true;
}

/// M1..M4 in the vehicle's command unit: us of pulse width, where the ESCs have one.
template <class Out>
bool servos(Out& out, const FlightStatus& s) {
  mavlink_servo_output_raw_t m{};
  m.time_usec = static_cast<std::uint32_t>(s.time);
  m.servo1_raw = whole<std::uint16_t>(s.commands[0]);
  m.servo2_raw = whole<std::uint16_t>(s.commands[1]);
  m.servo3_raw = whole<std::uint16_t>(s.commands[2]);
  m.servo4_raw = whole<std::uint16_t>(s.commands[3]);
  out.send(mavlink_msg_servo_output_raw_encode_status, m);
  return true;
}

template <class Out>
bool battery(Out& out, const FlightStatus& s) {
  if (!(s.voltage > 0.0F)) return false;
  const bool low = (s.conditions & condition::kBatteryLow) != 0;
  const bool critical = (s.conditions & condition::kBatteryCritical) != 0;
  mavlink_battery_status_t m{};
  m.battery_function = MAV_BATTERY_FUNCTION_ALL;
  m.type = MAV_BATTERY_TYPE_LIPO;
  m.temperature = INT16_MAX;
  std::memset(m.voltages, 0xFF, sizeof m.voltages);        // UINT16_MAX: no such cell
  m.voltages[0] = whole<std::uint16_t>(s.voltage * 1e3F);  // of all, where no cell is measured
  m.current_battery = s.current > 0.0F ? whole<std::int16_t>(s.current * 100.0F) : std::int16_t{-1};
  m.current_consumed = -1;
  m.energy_consumed = -1;
  m.battery_remaining = -1;
  m.charge_state = static_cast<std::uint8_t>(critical ? MAV_BATTERY_CHARGE_STATE_CRITICAL
                                             : low    ? MAV_BATTERY_CHARGE_STATE_LOW
                                                      : MAV_BATTERY_CHARGE_STATE_OK);
  out.send(mavlink_msg_battery_status_encode_status, m);
  return true;
}

template <class Out>
bool extendedState(Out& out, const FlightStatus& s) {
  out.send(mavlink_msg_extended_sys_state_encode_status,
           mavlink_extended_sys_state_t{MAV_VTOL_STATE_UNDEFINED, landedState(s)});
  return true;
}

template <class Out>
bool home(Out& out, const FlightStatus& s) {
  if (!originKnown(s)) return false;
  mavlink_home_position_t m{};
  m.latitude = s.originLatitude;
  m.longitude = s.originLongitude;
  m.altitude = s.originAltitude;
  m.q[0] = 1.0F;
  m.approach_x = m.approach_y = m.approach_z = kNotKnown;
  m.time_usec = s.time;
  out.send(mavlink_msg_home_position_encode_status, m);
  return true;
}

/// "0.1.0" in the upper bytes.
[[nodiscard]] constexpr std::uint32_t versionNumber() {
  std::uint32_t number = 0;
  std::uint32_t part = 0;
  for (const char* c = kVersion;; ++c) {
    if (*c >= '0' && *c <= '9') {
      part = part * 10 + static_cast<std::uint32_t>(*c - '0');
    } else {
      number = (number << 8U) | part;
      part = 0;
      if (*c == '\0') return (number << 8U) | FIRMWARE_VERSION_TYPE_DEV;
    }
  }
}

template <class Out>
bool version(Out& out, const FlightStatus& /*s*/) {
  mavlink_autopilot_version_t m{};
  m.capabilities = MAV_PROTOCOL_CAPABILITY_MAVLINK2 | MAV_PROTOCOL_CAPABILITY_MISSION_INT |
                   MAV_PROTOCOL_CAPABILITY_COMMAND_INT |
                   MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST |
                   MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED |
                   MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION;
  m.flight_sw_version = versionNumber();
  for (std::size_t i = 0; i < sizeof m.flight_custom_version && kGitCommit[i] != '\0'; ++i) {
    m.flight_custom_version[i] = static_cast<std::uint8_t>(kGitCommit[i]);
  }
  out.send(mavlink_msg_autopilot_version_encode_status, m);
  return true;
}

}  // namespace stream

/// One message that is sent again and again.
template <class Out>
struct Stream {
  std::uint32_t id;
  Micros period;                            ///< zero: on request only
  bool (*send)(Out&, const FlightStatus&);  ///< false: there is nothing to tell now
};

constexpr std::size_t kStreamCount = 12;

/// They add up to 1.1 kB/s, signed 1.4: below MAV_RATE's default, 2 kB/s.
template <class Out>
constexpr std::array<Stream<Out>, kStreamCount> kStreams{{
    {MAVLINK_MSG_ID_HEARTBEAT, periodFromHz(1), &stream::heartbeat<Out>},
    {MAVLINK_MSG_ID_SYS_STATUS, periodFromHz(1), &stream::sysStatus<Out>},
    {MAVLINK_MSG_ID_ATTITUDE_QUATERNION, periodFromHz(10), &stream::attitude<Out>},
    {MAVLINK_MSG_ID_LOCAL_POSITION_NED, periodFromHz(5), &stream::localPosition<Out>},
    {MAVLINK_MSG_ID_GLOBAL_POSITION_INT, periodFromHz(2), &stream::globalPosition<Out>},
    {MAVLINK_MSG_ID_GPS_RAW_INT, periodFromHz(2), &stream::gpsRaw<Out>},
    {MAVLINK_MSG_ID_VFR_HUD, periodFromHz(2), &stream::hud<Out>},
    {MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, periodFromHz(2), &stream::servos<Out>},
    {MAVLINK_MSG_ID_BATTERY_STATUS, 2'000'000, &stream::battery<Out>},
    {MAVLINK_MSG_ID_EXTENDED_SYS_STATE, periodFromHz(1), &stream::extendedState<Out>},
    {MAVLINK_MSG_ID_HOME_POSITION, 2'000'000, &stream::home<Out>},
    {MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0, &stream::version<Out>},
}};

}  // namespace strix
