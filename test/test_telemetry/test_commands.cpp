// Commands: what each does, and how each is answered.
#include <cmath>

#include "TelemetryBench.h"
#include "suites.h"

using namespace strix;

namespace {

struct Row {
  std::uint16_t command;
  std::array<float, 7> param;
  CommandKind kind;
};
constexpr Row kRows[] = {
    {MAV_CMD_COMPONENT_ARM_DISARM, {1.0F}, CommandKind::Arm},
    {MAV_CMD_COMPONENT_ARM_DISARM, {0.0F}, CommandKind::Disarm},
    {MAV_CMD_COMPONENT_ARM_DISARM, {0.0F, 21196.0F}, CommandKind::Kill},
    // Not even by force past the checks.
    {MAV_CMD_COMPONENT_ARM_DISARM, {1.0F, 21196.0F}, CommandKind::Arm},
    {MAV_CMD_NAV_TAKEOFF, {}, CommandKind::Start},
    {MAV_CMD_MISSION_START, {}, CommandKind::Start},
    {MAV_CMD_NAV_LAND, {}, CommandKind::Land},
    {MAV_CMD_NAV_RETURN_TO_LAUNCH, {}, CommandKind::Return},
    {MAV_CMD_DO_PAUSE_CONTINUE, {0.0F}, CommandKind::Hold},
    {MAV_CMD_DO_PAUSE_CONTINUE, {1.0F}, CommandKind::Resume},
    {MAV_CMD_DO_FLIGHTTERMINATION, {1.0F}, CommandKind::Kill},
    {MAV_CMD_DO_FLIGHTTERMINATION, {0.0F}, CommandKind::KillOff},
    {MAV_CMD_PREFLIGHT_CALIBRATION, {1.0F}, CommandKind::Calibrate},
};

void test_each_command_does_its_one_thing_and_is_answered() {
  for (const Row& row : kRows) {
    TelemetryBench bench;
    TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED, bench.command(row.command, row.param));
    TEST_ASSERT_EQUAL_size_t(1, bench.flight.asked.size());
    TEST_ASSERT_EQUAL(row.kind, bench.flight.asked[0].kind);
    TEST_ASSERT_EQUAL(CommandSource::Link, bench.flight.asked[0].source);
  }
}

void test_a_refusal_is_answered_and_explained() {
  for (const Row& row : kRows) {
    TelemetryBench bench;
    bench.flight.refusal = "not possible in this state";
    TEST_ASSERT_EQUAL(MAV_RESULT_TEMPORARILY_REJECTED, bench.command(row.command, row.param));
    assertTold(bench, "not possible in this state");
  }
}

void test_commands_by_either_message_do_the_same() {
  TelemetryBench bench;
  mavlink_command_int_t m{};
  m.command = MAV_CMD_COMPONENT_ARM_DISARM;
  m.param1 = 1.0F;
  m.target_system = 1;
  m.target_component = kAutopilot;
  bench.say(mavlink_msg_command_int_encode_status, m);
  bench.run(0.3F);
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.count(CommandKind::Arm));
  TEST_ASSERT_EQUAL_size_t(1, bench.count(MAVLINK_MSG_ID_COMMAND_ACK));
}

void test_what_makes_no_sense_is_denied() {
  const std::pair<std::uint16_t, std::array<float, 7>> rows[] = {
      {MAV_CMD_COMPONENT_ARM_DISARM, {0.5F}},
      {MAV_CMD_COMPONENT_ARM_DISARM, {NAN}},
      {MAV_CMD_DO_PAUSE_CONTINUE, {2.0F}},
      {MAV_CMD_PREFLIGHT_CALIBRATION, {0.0F, 1.0F}},   // magnetometer
      {MAV_CMD_PREFLIGHT_CALIBRATION, {}},             // nothing
      {MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, {2.0F}},     // shut down
      {MAV_CMD_PREFLIGHT_STORAGE, {2.0F}},             // reset
      {MAV_CMD_SET_MESSAGE_INTERVAL, {30.0F, 10.0F}},  // 100 kHz of nothing
      {MAV_CMD_SET_MESSAGE_INTERVAL, {31.0F, 10.0F}},  // 100 kHz
      {MAV_CMD_SET_MESSAGE_INTERVAL, {31.0F, NAN}},
      {MAV_CMD_SET_MESSAGE_INTERVAL, {MAVLINK_MSG_ID_HEARTBEAT, -1.0F}},
      {MAV_CMD_REQUEST_MESSAGE, {NAN}},
      {MAV_CMD_DO_SET_MODE, {1.0F}},
      {MAV_CMD_NAV_WAYPOINT, {}},
  };
  for (const auto& [command, param] : rows) {
    TelemetryBench bench;
    const int result = bench.command(command, param);
    TEST_ASSERT_TRUE_MESSAGE(result == MAV_RESULT_DENIED || result == MAV_RESULT_UNSUPPORTED,
                             std::to_string(command).c_str());
    TEST_ASSERT_EQUAL_size_t(0, bench.flight.asked.size());
    TEST_ASSERT_FALSE(bench.link.rebootAsked());
    TEST_ASSERT_EQUAL_INT(0, bench.flight.saved);
  }
}

void test_a_refused_arming_tells_every_check_that_fails() {
  TelemetryBench bench;
  bench.flight.now.preArm = prearm::kGps | prearm::kTilt | prearm::kLog;
  bench.flight.refusal = firstRefusal(bench.flight.now.preArm);
  TEST_ASSERT_EQUAL(MAV_RESULT_TEMPORARILY_REJECTED,
                    bench.command(MAV_CMD_COMPONENT_ARM_DISARM, {1.0F}));
  // The first of them is what the flight software itself says, to everybody.
  TEST_ASSERT_FALSE(bench.told("GPS fix"));
  assertTold(bench, "tilted");
  assertTold(bench, "log card");
  TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED, bench.command(MAV_CMD_RUN_PREARM_CHECKS));
  bench.run(1.0F);
  assertTold(bench, "GPS fix");
  assertTold(bench, "tilted");
}

void test_others_commands_are_left_to_them() {
  TelemetryBench bench;
  const auto arm = [&bench](std::uint8_t system, std::uint8_t component) {
    bench.say(mavlink_msg_command_long_encode_status,
              TelemetryBench::longCommand(MAV_CMD_COMPONENT_ARM_DISARM, {1.0F}, system, component));
    bench.run(0.3F);
    return bench.flight.count(CommandKind::Arm);
  };
  TEST_ASSERT_EQUAL_size_t(0, arm(2, kAutopilot));
  TEST_ASSERT_EQUAL_size_t(0, arm(1, MAV_COMP_ID_CAMERA));
  TEST_ASSERT_EQUAL_size_t(0, bench.count(MAVLINK_MSG_ID_COMMAND_ACK));
  TEST_ASSERT_EQUAL_size_t(1, arm(1, kAutopilot));
  TEST_ASSERT_EQUAL_size_t(2, arm(1, 0));  // every component of it
  TEST_ASSERT_EQUAL_size_t(3, arm(0, 0));  // everybody: MAVLink's broadcast
  TEST_ASSERT_EQUAL_size_t(3, bench.count(MAVLINK_MSG_ID_COMMAND_ACK));
  bench.station = 1;  // its own echo, as a radio may return it
  TEST_ASSERT_EQUAL_size_t(3, arm(1, kAutopilot));
}

void test_the_parameter_gives_the_system_id_from_the_start_on() {
  TelemetryBench bench;
  bench.flight.values.linkId = 7.0F;
  bench.run(1.1F);
  TEST_ASSERT_EQUAL_UINT8(7, bench.heard.front().sysid);
  bench.flight.values.linkId = 8.0F;  // acts after the next start
  bench.heard.clear();
  bench.run(1.1F);
  TEST_ASSERT_EQUAL_UINT8(7, bench.heard.front().sysid);
}

void test_reboot_waits_for_its_answer_and_for_the_motors() {
  TelemetryBench bench;
  bench.flight.now.motorsOn = true;
  TEST_ASSERT_EQUAL(MAV_RESULT_TEMPORARILY_REJECTED,
                    bench.command(MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, {1.0F}));
  TEST_ASSERT_FALSE(bench.link.rebootAsked());
  bench.flight.now.motorsOn = false;
  bench.port.free = 0;
  bench.command(MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, {1.0F});
  TEST_ASSERT_FALSE(bench.link.rebootAsked());  // nobody has been told
  bench.port.free = 1000;
  bench.run(0.1F);
  TEST_ASSERT_TRUE(bench.link.rebootAsked());
}

void test_a_message_is_sent_on_request_and_at_the_rate_asked_for() {
  TelemetryBench bench;
  bench.run(0.5F);
  TEST_ASSERT_EQUAL_size_t(0, bench.count(MAVLINK_MSG_ID_AUTOPILOT_VERSION));
  TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED,
                    bench.command(MAV_CMD_REQUEST_MESSAGE, {MAVLINK_MSG_ID_AUTOPILOT_VERSION}));
  const auto version = bench.all<mavlink_autopilot_version_t>(MAVLINK_MSG_ID_AUTOPILOT_VERSION);
  TEST_ASSERT_EQUAL_size_t(1, version.size());
  TEST_ASSERT_TRUE((version[0].capabilities & MAV_PROTOCOL_CAPABILITY_MISSION_INT) != 0);
  TEST_ASSERT_EQUAL_HEX32(0x00010000, version[0].flight_sw_version);  // 0.1.0, in development
  TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED,
                    bench.command(MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, {1}));
  TEST_ASSERT_EQUAL_size_t(1, bench.count(MAVLINK_MSG_ID_AUTOPILOT_VERSION));

  const auto attitudes = [&bench](float interval) {
    TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED,
                      bench.command(MAV_CMD_SET_MESSAGE_INTERVAL,
                                    {MAVLINK_MSG_ID_ATTITUDE_QUATERNION, interval}));
    bench.heard.clear();
    bench.run(10.0F);
    return static_cast<int>(bench.count(MAVLINK_MSG_ID_ATTITUDE_QUATERNION));
  };
  TEST_ASSERT_INT_WITHIN(1, 200, attitudes(50'000.0F));
  TEST_ASSERT_INT_WITHIN(1, 5, attitudes(2'000'000.0F));
  TEST_ASSERT_EQUAL_INT(0, attitudes(-1.0F));
  TEST_ASSERT_INT_WITHIN(1, 100, attitudes(0.0F));
}

void test_only_who_commands_keeps_the_link_alive() {
  TelemetryBench bench;
  mavlink_heartbeat_t m{};
  m.type = MAV_TYPE_GCS;
  const auto beat = [&] {
    bench.say(mavlink_msg_heartbeat_encode_status, m);
    bench.run(0.1F);
    return bench.flight.count(CommandKind::LinkAlive);
  };
  TEST_ASSERT_EQUAL_size_t(0, beat());  // it has only watched
  bench.command(MAV_CMD_COMPONENT_ARM_DISARM, {1.0F});
  TEST_ASSERT_EQUAL_size_t(1, beat());
  bench.station = 254;  // another, that watches
  TEST_ASSERT_EQUAL_size_t(1, beat());
  bench.station = kStation;
  m.type = MAV_TYPE_GIMBAL;  // of the same number, but no ground station
  TEST_ASSERT_EQUAL_size_t(1, beat());
}

mavlink_set_position_target_local_ned_t setpoint() {
  mavlink_set_position_target_local_ned_t m{};
  m.x = 1.0F;
  m.y = 2.0F;
  m.z = -3.0F;
  m.vx = 4.0F;
  m.vy = 5.0F;
  m.vz = -6.0F;
  m.yaw = 0.7F;
  m.yaw_rate = 0.8F;
  m.type_mask = POSITION_TARGET_TYPEMASK_AX_IGNORE | POSITION_TARGET_TYPEMASK_AY_IGNORE |
                POSITION_TARGET_TYPEMASK_AZ_IGNORE;
  m.target_system = 1;
  m.target_component = kAutopilot;
  m.coordinate_frame = MAV_FRAME_LOCAL_NED;
  return m;
}

void test_setpoints_reach_the_flight_with_up_positive_and_what_is_ignored_left_out() {
  TelemetryBench bench;
  bench.say(mavlink_msg_set_position_target_local_ned_encode_status, setpoint());
  bench.run(0.1F);
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.count(CommandKind::Setpoint));
  const VehicleCommand all = bench.flight.asked.back();
  TEST_ASSERT_EQUAL_HEX16(0xFF, all.index);
  const float expected[] = {1.0F, 2.0F, 3.0F, 0.7F, 4.0F, 5.0F, 6.0F, 0.8F};
  TEST_ASSERT_EQUAL_FLOAT_ARRAY(expected, all.values.data(), 8);

  mavlink_set_position_target_local_ned_t m = setpoint();
  m.type_mask |= POSITION_TARGET_TYPEMASK_VX_IGNORE | POSITION_TARGET_TYPEMASK_VY_IGNORE |
                 POSITION_TARGET_TYPEMASK_VZ_IGNORE | POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE;
  m.vx = NAN;
  bench.say(mavlink_msg_set_position_target_local_ned_encode_status, m);
  bench.run(0.1F);
  TEST_ASSERT_EQUAL_HEX16(0x0F, bench.flight.asked.back().index);
  TEST_ASSERT_EQUAL_FLOAT(0.0F, bench.flight.asked.back().values[4]);
}

void test_setpoints_that_cannot_be_flown_are_told_once_and_not_at_their_rate() {
  TelemetryBench bench;
  for (int i = 0; i < 40; ++i) {  // 10 Hz for 4 s
    mavlink_set_position_target_local_ned_t m = setpoint();
    m.coordinate_frame = MAV_FRAME_BODY_OFFSET_NED;
    bench.say(mavlink_msg_set_position_target_local_ned_encode_status, m);
    bench.run(0.1F);
  }
  TEST_ASSERT_EQUAL_size_t(0, bench.flight.asked.size());
  TEST_ASSERT_EQUAL_size_t(1, bench.texts().size());
  mavlink_set_position_target_local_ned_t m = setpoint();
  m.type_mask = 0;  // with acceleration
  bench.say(mavlink_msg_set_position_target_local_ned_encode_status, m);
  bench.run(0.2F);
  assertTold(bench, "acceleration");
  TEST_ASSERT_EQUAL_size_t(0, bench.flight.asked.size());
}

void test_more_commands_than_answers_are_all_obeyed_and_the_loss_is_counted() {
  TelemetryBench bench;
  bench.port.free = 0;
  for (int i = 0; i < 20; ++i) {
    bench.say(mavlink_msg_command_long_encode_status,
              TelemetryBench::longCommand(MAV_CMD_DO_FLIGHTTERMINATION, {1.0F}));
  }
  bench.run(1.0F);
  TEST_ASSERT_EQUAL_size_t(20, bench.flight.count(CommandKind::Kill));
  TEST_ASSERT_EQUAL_UINT32(12, bench.link.lost());  // eight answers wait
}

}  // namespace

void runCommandTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_each_command_does_its_one_thing_and_is_answered);
  RUN_TEST(test_a_refusal_is_answered_and_explained);
  RUN_TEST(test_commands_by_either_message_do_the_same);
  RUN_TEST(test_what_makes_no_sense_is_denied);
  RUN_TEST(test_a_refused_arming_tells_every_check_that_fails);
  RUN_TEST(test_others_commands_are_left_to_them);
  RUN_TEST(test_the_parameter_gives_the_system_id_from_the_start_on);
  RUN_TEST(test_reboot_waits_for_its_answer_and_for_the_motors);
  RUN_TEST(test_a_message_is_sent_on_request_and_at_the_rate_asked_for);
  RUN_TEST(test_only_who_commands_keeps_the_link_alive);
  RUN_TEST(test_setpoints_reach_the_flight_with_up_positive_and_what_is_ignored_left_out);
  RUN_TEST(test_setpoints_that_cannot_be_flown_are_told_once_and_not_at_their_rate);
  RUN_TEST(test_more_commands_than_answers_are_all_obeyed_and_the_loss_is_counted);
}
