// Signing: who may command.
#include "TelemetryBench.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr SigningKey kKey{1,  2,  3,  4,  5,  6,  7,  8,  9,  10, 11, 12, 13, 14, 15, 16,
                          17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32};
constexpr SigningKey kOtherKey{1, 2, 3};
constexpr std::uint64_t kToday = 37'000'000'000'000ULL;  // 10 us since 2015: 2026
constexpr std::uint64_t kSecond = 100'000;

struct SignedBench : TelemetryBench {
  explicit SignedBench(PortTrust trust = PortTrust::Radio) : TelemetryBench(trust) {
    flight.values.linkSigned = 1.0F;
    flight.key = kKey;
  }
};

void test_unsigned_commands_are_denied_and_signed_ones_obeyed() {
  for (const std::uint16_t command :
       {MAV_CMD_COMPONENT_ARM_DISARM, MAV_CMD_NAV_TAKEOFF, MAV_CMD_MISSION_START, MAV_CMD_NAV_LAND,
        MAV_CMD_NAV_RETURN_TO_LAUNCH, MAV_CMD_DO_PAUSE_CONTINUE, MAV_CMD_DO_FLIGHTTERMINATION,
        MAV_CMD_PREFLIGHT_CALIBRATION, MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN,
        MAV_CMD_PREFLIGHT_STORAGE}) {
    SignedBench bench;
    TEST_ASSERT_EQUAL(MAV_RESULT_DENIED, bench.command(command, {1.0F}));
    assertTold(bench, "have to be signed");
    TEST_ASSERT_EQUAL_size_t(0, bench.flight.asked.size());
    TEST_ASSERT_FALSE(bench.link.rebootAsked());
    TEST_ASSERT_EQUAL_INT(0, bench.flight.saved);
    bench.sign(kKey, kToday);
    TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED, bench.command(command, {1.0F}));
  }
}

void test_setpoints_parameters_and_missions_count_signed_only() {
  SignedBench bench;
  mavlink_set_position_target_local_ned_t setpoint{};
  setpoint.type_mask = POSITION_TARGET_TYPEMASK_AX_IGNORE | POSITION_TARGET_TYPEMASK_AY_IGNORE |
                       POSITION_TARGET_TYPEMASK_AZ_IGNORE;
  setpoint.coordinate_frame = MAV_FRAME_LOCAL_NED;
  mavlink_param_set_t parameter{};
  parameter.param_value = 25.0F;
  std::memcpy(parameter.param_id, "FENCE_RADIUS", 12);
  parameter.param_type = MAV_PARAM_TYPE_REAL32;
  const auto sayAll = [&] {
    bench.heard.clear();
    bench.say(mavlink_msg_set_position_target_local_ned_encode_status, setpoint);
    bench.say(mavlink_msg_param_set_encode_status, parameter);
    bench.say(mavlink_msg_mission_count_encode_status, mavlink_mission_count_t{3, 1, 1, 0});
    bench.say(mavlink_msg_mission_clear_all_encode_status, mavlink_mission_clear_all_t{1, 1, 0});
    bench.run(1.0F);
  };
  sayAll();
  TEST_ASSERT_EQUAL_size_t(0, bench.flight.asked.size());
  TEST_ASSERT_EQUAL_FLOAT(
      30.0F, bench.last<mavlink_param_value_t>(MAVLINK_MSG_ID_PARAM_VALUE).param_value);
  TEST_ASSERT_EQUAL(MAV_MISSION_DENIED,
                    bench.last<mavlink_mission_ack_t>(MAVLINK_MSG_ID_MISSION_ACK).type);
  bench.sign(kKey, kToday);
  sayAll();
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.count(CommandKind::Setpoint));
  TEST_ASSERT_EQUAL_FLOAT(25.0F, bench.flight.values.fenceRadius);
  TEST_ASSERT_GREATER_THAN_size_t(0, bench.flight.count(CommandKind::MissionClear));
}

void test_who_only_reads_needs_no_key() {
  SignedBench bench;
  bench.say(mavlink_msg_param_request_list_encode_status, mavlink_param_request_list_t{1, 1});
  bench.say(mavlink_msg_mission_request_list_encode_status,
            mavlink_mission_request_list_t{1, 1, 0});
  TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED,
                    bench.command(MAV_CMD_REQUEST_MESSAGE, {MAVLINK_MSG_ID_AUTOPILOT_VERSION}));
  TEST_ASSERT_EQUAL_size_t(1, bench.count(MAVLINK_MSG_ID_MISSION_COUNT));
  TEST_ASSERT_GREATER_THAN_size_t(0, bench.count(MAVLINK_MSG_ID_PARAM_VALUE));
}

void test_the_heartbeat_of_who_commands_has_to_be_signed() {
  SignedBench bench;
  bench.sign(kKey, kToday);
  bench.command(MAV_CMD_NAV_LAND);
  mavlink_heartbeat_t m{};
  m.type = MAV_TYPE_GCS;
  bench.signNoMore();  // somebody else, with the same number
  bench.say(mavlink_msg_heartbeat_encode_status, m);
  bench.run(0.1F);
  TEST_ASSERT_EQUAL_size_t(0, bench.flight.count(CommandKind::LinkAlive));
}

void test_a_message_heard_before_is_not_heard_again() {
  SignedBench bench;
  bench.sign(kKey, kToday);
  const std::vector<std::uint8_t> kill =
      bench.frame(mavlink_msg_command_long_encode_status,
                  TelemetryBench::longCommand(MAV_CMD_DO_FLIGHTTERMINATION, {1.0F}));
  const std::vector<std::uint8_t> land = bench.frame(mavlink_msg_command_long_encode_status,
                                                     TelemetryBench::longCommand(MAV_CMD_NAV_LAND));
  bench.put(land);  // the later of them first
  bench.put(kill);
  bench.put(land);
  bench.put(land);
  bench.run(1.0F);
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.count(CommandKind::Land));
  TEST_ASSERT_EQUAL_size_t(0, bench.flight.count(CommandKind::Kill));
  TEST_ASSERT_EQUAL_UINT32(3, bench.link.refusedSignatures());
  assertTold(bench, "signature is wrong, or was heard before");
}

void test_old_messages_of_another_link_are_refused_as_well() {
  SignedBench bench;
  bench.sign(kKey, kToday, 1);
  TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED, bench.command(MAV_CMD_NAV_LAND));
  bench.sign(kKey, kToday - 61 * kSecond, 2);  // MAVLink: a minute is let pass
  TEST_ASSERT_EQUAL(-1, bench.command(MAV_CMD_NAV_LAND));
  bench.sign(kKey, kToday - 50 * kSecond, 3);
  TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED, bench.command(MAV_CMD_NAV_LAND));
}

void test_another_key_or_one_changed_bit_is_refused() {
  SignedBench bench;
  bench.sign(kOtherKey, kToday);
  TEST_ASSERT_EQUAL(-1, bench.command(MAV_CMD_NAV_LAND));
  bench.sign(kKey, kToday);
  const std::vector<std::uint8_t> good = bench.frame(mavlink_msg_command_long_encode_status,
                                                     TelemetryBench::longCommand(MAV_CMD_NAV_LAND));
  for (std::size_t bit = 0; bit < good.size() * 8; ++bit) {
    std::vector<std::uint8_t> bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    bench.put(bad);
    bench.put(std::vector<std::uint8_t>(300, 0));  // so that none waits for its end
    bench.run(0.05F);
  }
  TEST_ASSERT_EQUAL_size_t(0, bench.flight.asked.size());
  bench.put(good);
  bench.run(0.1F);
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.count(CommandKind::Land));
}

void test_without_a_key_nobody_commands_by_radio_but_all_by_cable() {
  SignedBench radio;
  radio.flight.key = {};
  TEST_ASSERT_EQUAL(MAV_RESULT_DENIED, radio.command(MAV_CMD_NAV_LAND));
  radio.sign({}, kToday);  // the key of all zeros is none
  TEST_ASSERT_EQUAL(MAV_RESULT_DENIED, radio.command(MAV_CMD_NAV_LAND));
  SignedBench cable(PortTrust::Cable);
  cable.flight.key = {};
  TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED, cable.command(MAV_CMD_NAV_LAND));
}

void test_the_key_is_set_by_cable_only_and_kept() {
  mavlink_setup_signing_t m{};
  m.target_system = 1;
  m.target_component = kAutopilot;
  std::memcpy(m.secret_key, kKey.data(), kKey.size());
  TelemetryBench radio;
  radio.say(mavlink_msg_setup_signing_encode_status, m);
  radio.run(5.0F);
  TEST_ASSERT_TRUE(radio.flight.key == SigningKey{});
  TEST_ASSERT_EQUAL_INT(0, radio.flight.saved);
  assertTold(radio, "by cable only");
  TelemetryBench cable(PortTrust::Cable);
  cable.say(mavlink_msg_setup_signing_encode_status, m);
  cable.run(5.0F);
  TEST_ASSERT_TRUE(cable.flight.key == kKey);
  TEST_ASSERT_EQUAL_INT(1, cable.flight.saved);
}

void test_with_a_key_all_that_is_sent_is_signed_and_never_twice_the_same() {
  SignedBench bench;
  bench.flight.values.linkSigned = 0.0F;
  // Heard once, the station's time is the aircraft's: it would refuse what is older than a minute.
  bench.sign(kKey, kToday);
  bench.command(MAV_CMD_NAV_LAND);
  bench.heard.clear();
  bench.run(20.0F);
  TEST_ASSERT_GREATER_THAN_size_t(300, bench.heard.size());
  mavlink_signing_t station{};
  mavlink_signing_streams_t streams{};
  std::memcpy(station.secret_key, kKey.data(), kKey.size());
  station.timestamp = kToday + 20 * kSecond;
  for (const mavlink_message_t& message : bench.heard) {
    TEST_ASSERT_TRUE((message.incompat_flags & MAVLINK_IFLAG_SIGNED) != 0);
    TEST_ASSERT_TRUE(mavlink_signature_check(&station, &streams, &message));
  }
}

void test_without_the_parameter_unsigned_commands_count_but_wrong_signatures_do_not() {
  SignedBench bench;
  bench.flight.values.linkSigned = 0.0F;
  TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED, bench.command(MAV_CMD_NAV_LAND));
  bench.sign(kOtherKey, kToday);
  TEST_ASSERT_EQUAL(-1, bench.command(MAV_CMD_NAV_LAND));
}

}  // namespace

void runSigningTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_unsigned_commands_are_denied_and_signed_ones_obeyed);
  RUN_TEST(test_setpoints_parameters_and_missions_count_signed_only);
  RUN_TEST(test_who_only_reads_needs_no_key);
  RUN_TEST(test_the_heartbeat_of_who_commands_has_to_be_signed);
  RUN_TEST(test_a_message_heard_before_is_not_heard_again);
  RUN_TEST(test_old_messages_of_another_link_are_refused_as_well);
  RUN_TEST(test_another_key_or_one_changed_bit_is_refused);
  RUN_TEST(test_without_a_key_nobody_commands_by_radio_but_all_by_cable);
  RUN_TEST(test_the_key_is_set_by_cable_only_and_kept);
  RUN_TEST(test_with_a_key_all_that_is_sent_is_signed_and_never_twice_the_same);
  RUN_TEST(test_without_the_parameter_unsigned_commands_count_but_wrong_signatures_do_not);
}
