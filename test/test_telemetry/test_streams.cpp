// What the aircraft tells by itself: rates, budget, fairness, and what the numbers mean.
#include <cmath>

#include "Random.h"
#include "TelemetryBench.h"
#include "suites.h"

using namespace strix;

namespace {

struct Rate {
  std::uint32_t id;
  float hz;
};
// As the issue asks for, and as QGroundControl wants them.
constexpr Rate kRates[] = {
    {MAVLINK_MSG_ID_HEARTBEAT, 1.0F},
    {MAVLINK_MSG_ID_SYS_STATUS, 1.0F},
    {MAVLINK_MSG_ID_ATTITUDE_QUATERNION, 10.0F},
    {MAVLINK_MSG_ID_LOCAL_POSITION_NED, 5.0F},
    {MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 2.0F},
    {MAVLINK_MSG_ID_GPS_RAW_INT, 2.0F},
    {MAVLINK_MSG_ID_VFR_HUD, 2.0F},
    {MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 2.0F},
    {MAVLINK_MSG_ID_BATTERY_STATUS, 0.5F},
    {MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 1.0F},
    {MAVLINK_MSG_ID_HOME_POSITION, 0.5F},
};

void fly(TelemetryBench& bench) {
  bench.flight.now.voltage = 23.1F;
  bench.flight.now.state = static_cast<std::uint8_t>(FlightState::Hold);
  bench.flight.now.motorsOn = bench.flight.now.flying = true;
}

void test_every_message_keeps_its_rate_where_there_is_room() {
  TelemetryBench bench;
  fly(bench);
  for (const bool isSigned : {false, true}) {
    if (isSigned) bench.flight.key[0] = 1;
    bench.run(1.0F);
    bench.heard.clear();
    constexpr float kSeconds = 60.0F;
    bench.run(kSeconds);
    for (const Rate& rate : kRates) {
      // One at either end of the time.
      TEST_ASSERT_FLOAT_WITHIN_MESSAGE(1.01F, rate.hz * kSeconds,
                                       static_cast<float>(bench.count(rate.id)),
                                       std::to_string(rate.id).c_str());
    }
  }
}

/// The most bytes in any one second, by the time each frame was sent at.
std::size_t mostInASecond(const std::vector<FakePort::Sent>& sent) {
  std::size_t most = 0;
  std::size_t sum = 0;
  std::size_t first = 0;
  for (const FakePort::Sent& frame : sent) {
    sum += frame.size;
    while (elapsed(frame.at, sent[first].at) >= 1'000'000) sum -= sent[first++].size;
    most = std::max(most, sum);
  }
  return most;
}

void test_no_second_has_more_bytes_than_the_parameter_allows() {
  for (const float limit : {200.0F, 500.0F, 2000.0F, 50'000.0F}) {
    TelemetryBench bench;
    fly(bench);
    bench.flight.values.linkRate = limit;
    for (int i = 0; i < 20; ++i) {
      // All that makes it talk: the whole list, commands and texts.
      bench.say(mavlink_msg_param_request_list_encode_status,
                mavlink_param_request_list_t{1, kAutopilot});
      for (int j = 0; j < 5; ++j) {
        bench.say(mavlink_msg_command_long_encode_status,
                  TelemetryBench::longCommand(MAV_CMD_NAV_LAND));
        bench.flight.history.add(4, std::string(99, 'x'));
      }
      bench.run(0.5F);
    }
    TEST_ASSERT_LESS_OR_EQUAL_size_t(static_cast<std::size_t>(limit),
                                     mostInASecond(bench.port.sent));
    // And it uses what it has: all but one burst, and a frame that did not fit.
    if (limit >= 500.0F && limit <= 2000.0F) {
      TEST_ASSERT_GREATER_THAN_size_t(static_cast<std::size_t>(limit) - ByteBudget::kBurst - 110,
                                      mostInASecond(bench.port.sent));
    }
  }
}

void test_nothing_starves_where_there_is_room_for_a_tenth_only() {
  TelemetryBench bench;
  fly(bench);
  bench.flight.values.linkRate = 250.0F;
  bench.run(5.0F);
  bench.heard.clear();
  // A ground station that commands and asks without a pause on top of it: more answers than fit.
  for (int i = 0; i < 60; ++i) {
    bench.say(mavlink_msg_param_request_list_encode_status,
              mavlink_param_request_list_t{1, kAutopilot});
    for (int j = 0; j < 20; ++j) {
      bench.say(mavlink_msg_command_long_encode_status,
                TelemetryBench::longCommand(MAV_CMD_NAV_LAND));
    }
    bench.run(1.0F);
  }
  for (const Rate& rate : kRates) {
    TEST_ASSERT_GREATER_THAN_size_t_MESSAGE(0, bench.count(rate.id),
                                            std::to_string(rate.id).c_str());
  }
  TEST_ASSERT_GREATER_THAN_size_t(10, bench.count(MAVLINK_MSG_ID_COMMAND_ACK));
  TEST_ASSERT_GREATER_THAN_size_t(10, bench.count(MAVLINK_MSG_ID_PARAM_VALUE));
}

void test_a_port_without_room_loses_old_streams_only() {
  TelemetryBench bench;
  fly(bench);
  bench.run(1.0F);
  bench.heard.clear();
  bench.port.free = 100;  // less than the largest frame
  bench.flight.history.add(3, "battery critical: landing");
  bench.say(mavlink_msg_command_long_encode_status, TelemetryBench::longCommand(MAV_CMD_NAV_LAND));
  bench.say(mavlink_msg_param_request_read_encode_status,
            mavlink_param_request_read_t{0, 1, kAutopilot, {}});
  bench.run(10.0F);
  TEST_ASSERT_EQUAL_size_t(0, bench.heard.size());
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.count(CommandKind::Land));  // it is obeyed all the same
  bench.port.free = 10'000;
  bench.run(1.0F);
  TEST_ASSERT_EQUAL_size_t(1, bench.count(MAVLINK_MSG_ID_COMMAND_ACK));
  TEST_ASSERT_EQUAL_size_t(1, bench.count(MAVLINK_MSG_ID_PARAM_VALUE));
  TEST_ASSERT_TRUE(bench.told("battery critical"));
  // The streams go on at their rate: what was missed is not made good.
  TEST_ASSERT_LESS_OR_EQUAL_size_t(11, bench.count(MAVLINK_MSG_ID_ATTITUDE_QUATERNION));
  TEST_ASSERT_EQUAL_UINT32(0, bench.link.lost());
}

void test_the_heartbeat_says_what_qgroundcontrol_reads() {
  TelemetryBench bench;
  const auto heartbeat = [&bench](FlightState state, bool motors) {
    bench.flight.now.state = static_cast<std::uint8_t>(state);
    bench.flight.now.motorsOn = motors;
    bench.heard.clear();
    bench.run(1.1F);
    return bench.last<mavlink_heartbeat_t>(MAVLINK_MSG_ID_HEARTBEAT);
  };
  const mavlink_heartbeat_t idle = heartbeat(FlightState::Idle, false);
  TEST_ASSERT_EQUAL(MAV_TYPE_QUADROTOR, idle.type);
  TEST_ASSERT_EQUAL(MAV_AUTOPILOT_GENERIC, idle.autopilot);
  TEST_ASSERT_EQUAL(0, idle.base_mode);
  TEST_ASSERT_EQUAL(MAV_STATE_STANDBY, idle.system_status);
  TEST_ASSERT_EQUAL(FlightState::Idle, static_cast<FlightState>(idle.custom_mode));
  const mavlink_heartbeat_t leg = heartbeat(FlightState::Waypoint, true);
  TEST_ASSERT_EQUAL(MAV_MODE_FLAG_SAFETY_ARMED | MAV_MODE_FLAG_AUTO_ENABLED, leg.base_mode);
  TEST_ASSERT_EQUAL(MAV_STATE_ACTIVE, leg.system_status);
  bench.flight.now.failsafe = true;
  TEST_ASSERT_EQUAL(MAV_STATE_CRITICAL, heartbeat(FlightState::Land, true).system_status);
  bench.flight.now.critical = true;
  TEST_ASSERT_EQUAL(MAV_STATE_FLIGHT_TERMINATION,
                    heartbeat(FlightState::Safe, false).system_status);
  TEST_ASSERT_EQUAL(MAV_STATE_CALIBRATING, heartbeat(FlightState::Boot, false).system_status);
}

void test_position_on_the_map_is_the_local_one_about_the_origin() {
  TelemetryBench bench;
  bench.flight.now.estimate.positionNed = {100.0F, -50.0F, -12.0F};
  bench.flight.now.estimate.velocityNed = {1.0F, -2.0F, -0.5F};
  bench.flight.now.estimate.attitude = eulerToQuaternion({0.0F, 0.0F, -kPi / 2.0F});
  bench.run(1.0F);
  const auto m = bench.last<mavlink_global_position_int_t>(MAVLINK_MSG_ID_GLOBAL_POSITION_INT);
  // A degree of latitude at 59.35 deg is 111.41 km, of longitude 56.87 km (WGS-84).
  TEST_ASSERT_INT_WITHIN(3, 593'500'000 + 100.0 / 111'410.0 * 1e7, m.lat);
  TEST_ASSERT_INT_WITHIN(5, 180'600'000 - 50.0 / 56'870.0 * 1e7, m.lon);
  TEST_ASSERT_EQUAL_INT32(42'000, m.alt);
  TEST_ASSERT_EQUAL_INT32(12'000, m.relative_alt);
  TEST_ASSERT_EQUAL_INT16(100, m.vx);
  TEST_ASSERT_EQUAL_INT16(-200, m.vy);
  TEST_ASSERT_EQUAL_INT16(-50, m.vz);  // positive down
  TEST_ASSERT_INT_WITHIN(1, 27'000, m.hdg);
  const auto hud = bench.last<mavlink_vfr_hud_t>(MAVLINK_MSG_ID_VFR_HUD);
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 0.5F, hud.climb);
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 42.0F, hud.alt);
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, std::sqrt(5.0F), hud.groundspeed);
}

void test_places_go_to_the_map_and_back_all_over_the_earth() {
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    const auto any = [&random](std::int32_t most) {
      return static_cast<std::int32_t>(random.uniform(-1.0F, 1.0F) * static_cast<float>(most));
    };
    GeoPoint origin{any(850'000'000), any(1'799'999'000), std::abs(any(5'000'000))};
    if (i % 4 == 0) origin.longitude = i % 8 == 0 ? 1'799'999'990 : -1'799'999'990;  // date line
    const LocalFrame frame(origin);
    const Vector3f ned{random.uniform(-500.0F, 500.0F), random.uniform(-500.0F, 500.0F),
                       random.uniform(-120.0F, 0.0F)};
    const GeoPoint place = frame.toGeo(ned);
    TEST_ASSERT_TRUE(isOnEarth(place));
    const Vector3f back = frame.toNed(place);
    // Half a unit of 11 mm, of 1 mm in height; and what a float keeps of 500 m.
    TEST_ASSERT_FLOAT_WITHIN(0.006F, ned.x(), back.x());
    TEST_ASSERT_FLOAT_WITHIN(0.006F, ned.y(), back.y());
    TEST_ASSERT_FLOAT_WITHIN(0.0006F, ned.z(), back.z());
  }
}

void test_no_place_on_the_map_before_it_is_known() {
  TelemetryBench bench;
  bench.flight.now.preArm = prearm::kOrigin;
  bench.run(5.0F);
  TEST_ASSERT_EQUAL_size_t(0, bench.count(MAVLINK_MSG_ID_GLOBAL_POSITION_INT));
  TEST_ASSERT_EQUAL_size_t(0, bench.count(MAVLINK_MSG_ID_HOME_POSITION));
  TEST_ASSERT_GREATER_THAN_size_t(20, bench.count(MAVLINK_MSG_ID_LOCAL_POSITION_NED));
  bench.flight.now.preArm = 0;
  bench.flight.now.positionValid = false;  // GPS lost: the estimate drifts
  bench.run(5.0F);
  TEST_ASSERT_EQUAL_size_t(0, bench.count(MAVLINK_MSG_ID_GLOBAL_POSITION_INT));
  TEST_ASSERT_GREATER_THAN_size_t(0, bench.count(MAVLINK_MSG_ID_HOME_POSITION));
}

void test_sensors_battery_and_motors_are_told_in_mavlinks_units() {
  TelemetryBench bench;
  FlightStatus& s = bench.flight.now;
  s.voltage = 22.25F;
  s.conditions = condition::kBatteryLow;
  s.imuFresh = s.altFresh = true;
  s.longestPass = 500;
  s.overruns = 7;
  s.commands = {1150.0F, 1400.4F, 1400.6F, 1700.0F};
  s.gpsFresh = true;
  s.fix = 3;
  s.hdop = 0.9F;
  s.speed = 3.21F;
  s.course = 1.5F;
  s.satellites = 11;
  bench.run(2.5F);
  const auto sys = bench.last<mavlink_sys_status_t>(MAVLINK_MSG_ID_SYS_STATUS);
  TEST_ASSERT_EQUAL_UINT16(22'250, sys.voltage_battery);
  TEST_ASSERT_EQUAL_INT16(-1, sys.current_battery);  // not measured
  TEST_ASSERT_EQUAL_UINT16(250, sys.load);           // of the 2 ms of a control tick
  TEST_ASSERT_EQUAL_UINT16(7, sys.errors_count1);
  const std::uint32_t health = sys.onboard_control_sensors_health;
  TEST_ASSERT_TRUE((health & MAV_SYS_STATUS_SENSOR_3D_GYRO) != 0);
  TEST_ASSERT_TRUE((health & MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE) != 0);
  TEST_ASSERT_FALSE((health & MAV_SYS_STATUS_SENSOR_3D_MAG) != 0);
  const auto battery = bench.last<mavlink_battery_status_t>(MAVLINK_MSG_ID_BATTERY_STATUS);
  TEST_ASSERT_EQUAL_UINT16(22'250, battery.voltages[0]);
  TEST_ASSERT_EQUAL_UINT16(UINT16_MAX, battery.voltages[1]);
  TEST_ASSERT_EQUAL(MAV_BATTERY_CHARGE_STATE_LOW, battery.charge_state);
  const auto servo = bench.last<mavlink_servo_output_raw_t>(MAVLINK_MSG_ID_SERVO_OUTPUT_RAW);
  TEST_ASSERT_EQUAL_UINT16(1150, servo.servo1_raw);
  TEST_ASSERT_EQUAL_UINT16(1400, servo.servo2_raw);
  TEST_ASSERT_EQUAL_UINT16(1401, servo.servo3_raw);
  TEST_ASSERT_EQUAL_UINT16(1700, servo.servo4_raw);
  const auto gps = bench.last<mavlink_gps_raw_int_t>(MAVLINK_MSG_ID_GPS_RAW_INT);
  TEST_ASSERT_EQUAL(GPS_FIX_TYPE_3D_FIX, gps.fix_type);
  TEST_ASSERT_EQUAL_UINT16(90, gps.eph);
  TEST_ASSERT_EQUAL_UINT16(321, gps.vel);
  TEST_ASSERT_EQUAL_UINT16(8594, gps.cog);  // 1.5 rad
  TEST_ASSERT_EQUAL_UINT8(11, gps.satellites_visible);
}

void test_texts_of_any_length_arrive_whole_and_in_order() {
  TelemetryBench bench;
  std::vector<std::string> said;
  for (const std::size_t size : {1U, 49U, 50U, 51U, 99U, 100U}) {
    std::string text;
    for (std::size_t i = 0; i < size; ++i) text += static_cast<char>('a' + (i + size) % 26);
    said.push_back(text);
    bench.flight.history.add(5, text);
  }
  bench.run(2.0F);
  const std::vector<std::string> found = bench.texts();
  TEST_ASSERT_EQUAL_size_t(said.size(), found.size());
  for (std::size_t i = 0; i < said.size(); ++i) {
    TEST_ASSERT_EQUAL_STRING(said[i].c_str(), found[i].c_str());
  }
  // MAVLink: a text of more than one part ends with a part that is not full.
  std::vector<mavlink_statustext_t> parts =
      bench.all<mavlink_statustext_t>(MAVLINK_MSG_ID_STATUSTEXT);
  TEST_ASSERT_EQUAL(0, parts.back().text[0]);
  TEST_ASSERT_EQUAL(2, parts.back().chunk_seq);
  for (const auto& part : parts) TEST_ASSERT_EQUAL(5, part.severity);
}

void test_the_time_is_told_to_who_asks() {
  TelemetryBench bench;
  bench.run(1.0F);
  bench.heard.clear();
  bench.say(mavlink_msg_timesync_encode_status, mavlink_timesync_t{0, 123'456'789'012});
  bench.say(mavlink_msg_timesync_encode_status, mavlink_timesync_t{5, 77});  // somebody's answer
  bench.run(0.2F);
  const auto answers = bench.all<mavlink_timesync_t>(MAVLINK_MSG_ID_TIMESYNC);
  TEST_ASSERT_EQUAL_size_t(1, answers.size());
  TEST_ASSERT_EQUAL_INT64(123'456'789'012, answers[0].ts1);
  TEST_ASSERT_INT64_WITHIN(200'000'000, 1'000'000'000, answers[0].tc1);  // ns since power-up
}

}  // namespace

void runStreamTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_every_message_keeps_its_rate_where_there_is_room);
  RUN_TEST(test_no_second_has_more_bytes_than_the_parameter_allows);
  RUN_TEST(test_nothing_starves_where_there_is_room_for_a_tenth_only);
  RUN_TEST(test_a_port_without_room_loses_old_streams_only);
  RUN_TEST(test_the_heartbeat_says_what_qgroundcontrol_reads);
  RUN_TEST(test_position_on_the_map_is_the_local_one_about_the_origin);
  RUN_TEST(test_places_go_to_the_map_and_back_all_over_the_earth);
  RUN_TEST(test_no_place_on_the_map_before_it_is_known);
  RUN_TEST(test_sensors_battery_and_motors_are_told_in_mavlinks_units);
  RUN_TEST(test_texts_of_any_length_arrive_whole_and_in_order);
  RUN_TEST(test_the_time_is_told_to_who_asks);
}
