// Whatever comes in: it commands nothing that it does not say, and never takes long.
#include "Random.h"
#include "TelemetryBench.h"
#include "suites.h"

using namespace strix;

namespace {

void test_noise_commands_nothing_and_what_follows_is_heard() {
  Random random(1);
  TelemetryBench bench;
  for (int i = 0; i < 200; ++i) {
    std::vector<std::uint8_t> noise(1 + random.below(2000));
    for (std::uint8_t& byte : noise) {
      byte = static_cast<std::uint8_t>(random.below(256));
      if (random.chance(0.02F)) byte = MAVLINK_STX;  // many beginnings
    }
    bench.put(noise);
    bench.run(0.1F);
  }
  TEST_ASSERT_EQUAL_size_t(0, bench.flight.asked.size());
  TEST_ASSERT_GREATER_THAN_UINT32(100, bench.link.damaged());
  // A frame that was begun by noise swallows no more than its own length.
  bench.put(std::vector<std::uint8_t>(MAVLINK_MAX_PACKET_LEN, 0));
  TEST_ASSERT_EQUAL(MAV_RESULT_ACCEPTED, bench.command(MAV_CMD_NAV_LAND));
}

void test_a_frame_with_any_one_byte_changed_commands_nothing() {
  TelemetryBench bench;
  const std::vector<std::uint8_t> good = bench.frame(mavlink_msg_command_long_encode_status,
                                                     TelemetryBench::longCommand(MAV_CMD_NAV_LAND));
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const unsigned change : {0x01U, 0x80U, 0xFFU}) {
      std::vector<std::uint8_t> bad = good;
      bad[i] = static_cast<std::uint8_t>(bad[i] ^ change);
      bench.put(bad);
      bench.put(std::vector<std::uint8_t>(300, 0));
      bench.run(0.02F);
    }
  }
  TEST_ASSERT_EQUAL_size_t(0, bench.flight.asked.size());
}

/// Well-formed frames of every kind that is understood, filled with anything.
void test_any_payload_of_any_length_is_survived() {
  const std::uint32_t ids[] = {
      MAVLINK_MSG_ID_HEARTBEAT,
      MAVLINK_MSG_ID_COMMAND_LONG,
      MAVLINK_MSG_ID_COMMAND_INT,
      MAVLINK_MSG_ID_PARAM_SET,
      MAVLINK_MSG_ID_PARAM_REQUEST_READ,
      MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
      MAVLINK_MSG_ID_MISSION_COUNT,
      MAVLINK_MSG_ID_MISSION_ITEM_INT,
      MAVLINK_MSG_ID_MISSION_REQUEST_INT,
      MAVLINK_MSG_ID_MISSION_REQUEST_LIST,
      MAVLINK_MSG_ID_MISSION_CLEAR_ALL,
      MAVLINK_MSG_ID_MISSION_ACK,
      MAVLINK_MSG_ID_TIMESYNC,
      MAVLINK_MSG_ID_SETUP_SIGNING,
      MAVLINK_MSG_ID_STATUSTEXT,
      MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED,
  };
  Random random(2);
  for (const PortTrust trust : {PortTrust::Radio, PortTrust::Cable}) {
    TelemetryBench bench(trust);
    mavlink_status_t status{};
    for (int i = 0; i < 3000; ++i) {
      mavlink_message_t message{};
      message.msgid = ids[random.below(16)] & 0xFFFFFFU;
      const auto length = static_cast<std::uint8_t>(random.below(256));
      for (std::size_t j = 0; j < length; ++j) {
        const auto byte = static_cast<char>(random.chance(0.5F) ? 0U : random.below(256));
        _MAV_PAYLOAD_NON_CONST(&message)[j] = byte;
      }
      const mavlink_msg_entry_t* entry = mavlink_get_msg_entry(message.msgid);
      mavlink_finalize_message_buffer(&message, 255, 190, &status, entry->min_msg_len, length,
                                      entry->crc_extra);
      std::vector<std::uint8_t> bytes(MAVLINK_MAX_PACKET_LEN);
      bytes.resize(mavlink_msg_to_send_buffer(bytes.data(), &message));
      bench.put(bytes);
      bench.run(0.02F);
    }
    // Of parameters, whatever came, each holds what the table allows.
    for (std::size_t i = 0; i < kParameterCount; ++i) {
      TEST_ASSERT_NULL(checkParameter(i, getParameter(bench.flight.values, i), false));
    }
  }
}

/// Everything said at once, by a station that does not pause.
void test_a_flood_neither_silences_the_aircraft_nor_delays_a_kill() {
  TelemetryBench bench;
  bench.run(2.0F);
  bench.heard.clear();
  constexpr int kMessages = 20'000;  // more than the 10 s hear: a message every other step
  for (int i = 0; i < kMessages; ++i) {
    if (i == 4900) {
      bench.say(mavlink_msg_command_long_encode_status,
                TelemetryBench::longCommand(MAV_CMD_DO_FLIGHTTERMINATION, {1.0F}));
    }
    bench.say(mavlink_msg_timesync_encode_status, mavlink_timesync_t{0, 1});
  }
  bench.run(10.0F);
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.count(CommandKind::Kill));
  TEST_ASSERT_GREATER_OR_EQUAL_size_t(9, bench.count(MAVLINK_MSG_ID_HEARTBEAT));
}

}  // namespace

void runBadBytesTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_noise_commands_nothing_and_what_follows_is_heard);
  RUN_TEST(test_a_frame_with_any_one_byte_changed_commands_nothing);
  RUN_TEST(test_any_payload_of_any_length_is_survived);
  RUN_TEST(test_a_flood_neither_silences_the_aircraft_nor_delays_a_kill);
}
