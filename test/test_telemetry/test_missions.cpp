// Missions: up, down, broken off, and what cannot be flown.
#include <cmath>

#include "TelemetryBench.h"
#include "suites.h"

using namespace strix;

namespace {

using Item = mavlink_mission_item_int_t;

Item item(std::uint16_t command, std::uint8_t frame = MAV_FRAME_MISSION) {
  Item m{};
  m.command = command;
  m.frame = frame;
  m.param4 = NAN;
  m.target_system = 1;
  m.target_component = kAutopilot;
  m.autocontinue = 1;
  return m;
}
Item local(std::uint16_t command, float north, float east, float height) {
  Item m = item(command, MAV_FRAME_LOCAL_NED);
  m.x = static_cast<std::int32_t>(std::lround(north * 1e4F));
  m.y = static_cast<std::int32_t>(std::lround(east * 1e4F));
  m.z = -height;
  return m;
}
Item waypoint(float north, float east, float height, float hold = 0.0F, float radius = 0.0F) {
  Item m = local(MAV_CMD_NAV_WAYPOINT, north, east, height);
  m.param1 = hold;
  m.param2 = radius;
  return m;
}
Item speed(float metresPerSecond) {
  Item m = item(MAV_CMD_DO_CHANGE_SPEED);
  m.param1 = SPEED_TYPE_GROUNDSPEED;
  m.param2 = metresPerSecond;
  m.param3 = -1.0F;
  return m;
}
Item delay(float seconds) {
  Item m = item(MAV_CMD_NAV_DELAY);
  m.param1 = seconds;
  m.param2 = m.param3 = m.param4 = -1.0F;
  return m;
}

std::vector<Item> wholeMission() {
  return {local(MAV_CMD_NAV_TAKEOFF, 0.0F, 0.0F, 3.0F),
          delay(2.0F),
          waypoint(5.0F, -3.0F, 4.0F, 1.5F, 0.8F),
          speed(1.2F),
          waypoint(-6.0F, 2.0F, 5.0F),
          waypoint(-7.0F, 2.5F, 5.0F),
          speed(-2.0F),
          waypoint(0.0F, 1.0F, 2.0F, 1.0F),
          item(MAV_CMD_NAV_RETURN_TO_LAUNCH)};
}

void sayCount(TelemetryBench& bench, std::size_t count, std::uint8_t type = 0) {
  bench.say(mavlink_msg_mission_count_encode_status,
            mavlink_mission_count_t{static_cast<std::uint16_t>(count), 1, kAutopilot, type});
}

/// The answer, or -1; -2: it asked for an item that was not its turn.
int answerTo(TelemetryBench& bench) {
  const auto acks = bench.all<mavlink_mission_ack_t>(MAVLINK_MSG_ID_MISSION_ACK);
  return acks.empty() ? -1 : acks.back().type;
}

/// As a ground station does: an item each time it is asked for.
int upload(TelemetryBench& bench, const std::vector<Item>& items) {
  bench.heard.clear();
  sayCount(bench, items.size());
  for (std::size_t i = 0; i < 3 * items.size() && answerTo(bench) < 0; ++i) {
    bench.run(0.2F);
    const auto asked = bench.all<mavlink_mission_request_int_t>(MAVLINK_MSG_ID_MISSION_REQUEST_INT);
    bench.heard.erase(std::remove_if(bench.heard.begin(), bench.heard.end(),
                                     [](const mavlink_message_t& m) {
                                       return m.msgid == MAVLINK_MSG_ID_MISSION_REQUEST_INT;
                                     }),
                      bench.heard.end());
    if (asked.empty()) continue;
    Item next = items.at(asked.back().seq);
    next.seq = asked.back().seq;
    bench.say(mavlink_msg_mission_item_int_encode_status, next);
  }
  bench.run(0.3F);
  return answerTo(bench);
}

std::vector<Item> download(TelemetryBench& bench) {
  bench.heard.clear();
  bench.say(mavlink_msg_mission_request_list_encode_status,
            mavlink_mission_request_list_t{1, kAutopilot, 0});
  bench.run(0.3F);
  const auto count = bench.all<mavlink_mission_count_t>(MAVLINK_MSG_ID_MISSION_COUNT);
  TEST_ASSERT_EQUAL_size_t(1, count.size());
  std::vector<Item> items;
  for (std::uint16_t i = 0; i < count[0].count; ++i) {
    bench.say(mavlink_msg_mission_request_int_encode_status,
              mavlink_mission_request_int_t{i, 1, kAutopilot, 0});
    bench.run(0.3F);
    items.push_back(bench.last<Item>(MAVLINK_MSG_ID_MISSION_ITEM_INT));
    TEST_ASSERT_EQUAL_UINT16(i, items.back().seq);
    TEST_ASSERT_EQUAL_UINT8(kStation, items.back().target_system);
  }
  return items;
}

void test_a_mission_is_flown_as_it_was_uploaded() {
  TelemetryBench bench;
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, upload(bench, wholeMission()));
  const Mission& m = bench.flight.flown;
  TEST_ASSERT_EQUAL_FLOAT(3.0F, m.takeoffHeight);
  TEST_ASSERT_EQUAL_UINT32(2'000'000, m.takeoffHoldTime);
  TEST_ASSERT_EQUAL_UINT8(4, m.legCount);
  TEST_ASSERT_EQUAL(MissionEnd::Home, m.end);
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 5.0F, m.legs[0].north);  // 0.1 mm, the unit of the message
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, -3.0F, m.legs[0].east);
  TEST_ASSERT_EQUAL_FLOAT(4.0F, m.legs[0].height);
  TEST_ASSERT_EQUAL_UINT32(1'500'000, m.legs[0].holdTime);
  TEST_ASSERT_EQUAL_FLOAT(0.8F, m.legs[0].radius);
  const float speeds[] = {0.0F, 1.2F, 1.2F, 0.0F};
  for (std::size_t i = 0; i < 4; ++i) TEST_ASSERT_EQUAL_FLOAT(speeds[i], m.legs[i].speed);
}

void test_a_mission_comes_down_as_it_went_up() {
  TelemetryBench bench;
  bench.flight.now.preArm = prearm::kOrigin;  // without a place on earth: the local frame
  std::vector<Item> items = wholeMission();
  for (const std::uint16_t end : {MAV_CMD_NAV_RETURN_TO_LAUNCH, MAV_CMD_NAV_LAND}) {
    items.back() = end == MAV_CMD_NAV_LAND ? local(end, 0.0F, 1.0F, 0.0F) : item(end);
    TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, upload(bench, items));
    const std::vector<Item> found = download(bench);
    TEST_ASSERT_EQUAL_size_t(items.size(), found.size());
    for (std::size_t i = 0; i < items.size(); ++i) {
      TEST_ASSERT_EQUAL_UINT16(items[i].command, found[i].command);
      if (items[i].frame == MAV_FRAME_LOCAL_NED) {
        TEST_ASSERT_EQUAL_UINT8(items[i].frame, found[i].frame);
      }
      TEST_ASSERT_EQUAL_INT32(items[i].x, found[i].x);
      TEST_ASSERT_EQUAL_INT32(items[i].y, found[i].y);
      TEST_ASSERT_EQUAL_FLOAT(items[i].z, found[i].z);
      TEST_ASSERT_EQUAL_FLOAT(items[i].param1, found[i].param1);
      TEST_ASSERT_EQUAL_FLOAT(items[i].param2, found[i].param2);
    }
  }
}

void test_places_on_the_map_go_up_and_come_down_to_a_centimetre() {
  TelemetryBench bench;
  std::vector<Item> items = wholeMission();
  const auto onMap = [](Item m, std::int32_t north, std::int32_t east) {
    m.frame = MAV_FRAME_GLOBAL_RELATIVE_ALT;
    m.x = 593'500'000 + north;
    m.y = 180'600'000 + east;
    m.z = -m.z;
    return m;
  };
  items[0] = onMap(items[0], 0, 0);
  items[2] = onMap(items[2], 900, -1800);
  items[4] = onMap(items[4], -500, 300);
  items[5] = onMap(items[5], -600, 400);
  items[7] = onMap(items[7], 0, 100);
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, upload(bench, items));
  // 900e-7 deg of latitude are 10.03 m, 1800e-7 deg of longitude at 59.35 deg are 10.24 m.
  TEST_ASSERT_FLOAT_WITHIN(0.02F, 10.03F, bench.flight.flown.legs[0].north);
  TEST_ASSERT_FLOAT_WITHIN(0.02F, -10.24F, bench.flight.flown.legs[0].east);
  TEST_ASSERT_EQUAL_FLOAT(4.0F, bench.flight.flown.legs[0].height);
  const std::vector<Item> found = download(bench);
  for (const std::size_t i : {2U, 4U, 5U, 7U}) {
    TEST_ASSERT_EQUAL_UINT8(MAV_FRAME_GLOBAL_RELATIVE_ALT, found[i].frame);
    TEST_ASSERT_INT_WITHIN(1, items[i].x, found[i].x);  // one unit is 11 mm
    TEST_ASSERT_INT_WITHIN(1, items[i].y, found[i].y);
    TEST_ASSERT_EQUAL_FLOAT(items[i].z, found[i].z);
  }
}

void test_what_cannot_be_flown_is_refused_and_the_mission_before_is_kept() {
  struct Row {
    std::size_t place;
    Item item;
    std::uint8_t result;
    const char* told;
  };
  const auto changed = [](Item m, auto change) {
    change(m);
    return m;
  };
  const Item leg = waypoint(1.0F, 1.0F, 2.0F);
  const std::vector<Row> rows = {
      {0, leg, MAV_MISSION_UNSUPPORTED, "take-off is its first item"},
      {2, local(MAV_CMD_NAV_TAKEOFF, 0, 0, 3), MAV_MISSION_UNSUPPORTED, "take-off"},
      {8, leg, MAV_MISSION_UNSUPPORTED, "last item"},
      {2, item(MAV_CMD_NAV_LAND), MAV_MISSION_UNSUPPORTED, "last item"},
      {2, item(MAV_CMD_NAV_LOITER_UNLIM), MAV_MISSION_UNSUPPORTED, "only take-off"},
      {3, delay(2.0F), MAV_MISSION_UNSUPPORTED, "delay follows take-off"},
      {1, delay(-1.0F), MAV_MISSION_INVALID_PARAM1, "0 to 3600 s"},
      {2, changed(leg, [](Item& m) { m.frame = MAV_FRAME_GLOBAL; }), MAV_MISSION_UNSUPPORTED_FRAME,
       "heights count from home"},
      {2, changed(leg, [](Item& m) { m.param1 = -1.0F; }), MAV_MISSION_INVALID_PARAM1, "holds"},
      {2, changed(leg, [](Item& m) { m.param1 = NAN; }), MAV_MISSION_INVALID_PARAM1, "holds"},
      {2, changed(leg, [](Item& m) { m.param2 = -1.0F; }), MAV_MISSION_INVALID_PARAM2, "radius"},
      {2, changed(leg, [](Item& m) { m.param3 = 5.0F; }), MAV_MISSION_INVALID_PARAM3, "passed by"},
      {2, changed(leg, [](Item& m) { m.param4 = 90.0F; }), MAV_MISSION_INVALID_PARAM4, "heading"},
      {3, changed(speed(1.0F), [](Item& m) { m.param1 = SPEED_TYPE_CLIMB_SPEED; }),
       MAV_MISSION_INVALID_PARAM1, "speed over ground"},
      {3, speed(0.0F), MAV_MISSION_INVALID_PARAM2, "speed is above 0"},
  };
  for (const Row& row : rows) {
    TelemetryBench bench;
    bench.flight.flown.takeoffHeight = 1.0F;
    bench.flight.flown.legCount = 9;
    std::vector<Item> items = wholeMission();
    items[row.place] = row.item;
    TEST_ASSERT_EQUAL_INT_MESSAGE(row.result, upload(bench, items), row.told);
    assertTold(bench, row.told);
    TEST_ASSERT_EQUAL_UINT8(9, bench.flight.flown.legCount);
  }
}

void test_what_the_flight_refuses_is_refused_with_its_reason() {
  TelemetryBench bench;
  bench.flight.legRefusal = "mission: a leg lies outside the fence";
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_INVALID, upload(bench, wholeMission()));
  assertTold(bench, "outside the fence");
  bench.flight.refusal = "the mission can be changed with the motors off only";
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_DENIED, upload(bench, wholeMission()));
  assertTold(bench, "motors off only");
  std::vector<Item> items = wholeMission();
  items.insert(items.begin() + 2, Mission::kMaxLegs, waypoint(1.0F, 1.0F, 2.0F));
  TelemetryBench other;
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_NO_SPACE, upload(other, items));
}

void test_a_place_on_the_map_needs_a_start_that_is_known() {
  TelemetryBench bench;
  bench.flight.now.preArm = prearm::kOrigin;
  std::vector<Item> items = wholeMission();
  items[2].frame = MAV_FRAME_GLOBAL_RELATIVE_ALT;
  items[2].z = 3.0F;
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_UNSUPPORTED_FRAME, upload(bench, items));
  assertTold(bench, "not known yet");
}

void test_landing_elsewhere_is_flown_there_first() {
  TelemetryBench bench;
  std::vector<Item> items = wholeMission();
  items.back() = local(MAV_CMD_NAV_LAND, 4.0F, 4.0F, 0.0F);
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, upload(bench, items));
  TEST_ASSERT_EQUAL(MissionEnd::Land, bench.flight.flown.end);
  TEST_ASSERT_EQUAL_UINT8(5, bench.flight.flown.legCount);
  TEST_ASSERT_EQUAL_FLOAT(4.0F, bench.flight.flown.legs[4].north);
  TEST_ASSERT_EQUAL_FLOAT(2.0F, bench.flight.flown.legs[4].height);  // of the leg before
  // "Here", as zeros mean in the global frames, is where the last leg ends.
  items.back() = item(MAV_CMD_NAV_LAND, MAV_FRAME_GLOBAL_RELATIVE_ALT);
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, upload(bench, items));
  TEST_ASSERT_EQUAL_UINT8(4, bench.flight.flown.legCount);
}

void test_an_upload_that_stops_is_asked_for_again_then_given_up() {
  for (std::size_t sent = 0; sent < wholeMission().size(); ++sent) {
    TelemetryBench bench;
    bench.flight.flown.legCount = 9;
    sayCount(bench, wholeMission().size());
    for (std::size_t i = 0; i < sent; ++i) {
      bench.run(0.2F);
      Item next = wholeMission()[i];
      next.seq = static_cast<std::uint16_t>(i);
      bench.say(mavlink_msg_mission_item_int_encode_status, next);
    }
    bench.run(0.3F);
    bench.heard.clear();
    bench.run(10.0F);
    const auto asked = bench.all<mavlink_mission_request_int_t>(MAVLINK_MSG_ID_MISSION_REQUEST_INT);
    TEST_ASSERT_EQUAL_size_t(5, asked.size());
    TEST_ASSERT_EQUAL_UINT16(sent, asked.back().seq);
    TEST_ASSERT_EQUAL_INT(MAV_MISSION_OPERATION_CANCELLED, answerTo(bench));
    assertTold(bench, "broke off");
    TEST_ASSERT_EQUAL_UINT8(9, bench.flight.flown.legCount);
    TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, upload(bench, wholeMission()));  // and works again
  }
}

void test_items_lost_or_sent_twice_do_no_harm() {
  TelemetryBench bench;
  const std::vector<Item> items = wholeMission();
  sayCount(bench, items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    bench.run(0.2F);
    Item next = items[i];
    next.seq = static_cast<std::uint16_t>(i);
    Item early = items.back();
    early.seq = static_cast<std::uint16_t>(items.size() - 1);
    if (i + 1 < items.size()) bench.say(mavlink_msg_mission_item_int_encode_status, early);
    bench.say(mavlink_msg_mission_item_int_encode_status, next);
    bench.say(mavlink_msg_mission_item_int_encode_status, next);
  }
  bench.run(1.0F);
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, answerTo(bench));
  TEST_ASSERT_EQUAL_UINT8(4, bench.flight.flown.legCount);
  // The last item again, its answer being lost: the same answer.
  bench.heard.clear();
  Item last = items.back();
  last.seq = static_cast<std::uint16_t>(items.size() - 1);
  bench.say(mavlink_msg_mission_item_int_encode_status, last);
  bench.run(0.3F);
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, answerTo(bench));
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.count(CommandKind::MissionDone));
}

void test_clearing_leaves_no_mission() {
  TelemetryBench bench;
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, upload(bench, wholeMission()));
  bench.heard.clear();
  bench.say(mavlink_msg_mission_clear_all_encode_status,
            mavlink_mission_clear_all_t{1, kAutopilot, 0});
  bench.run(0.3F);
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_ACCEPTED, answerTo(bench));
  TEST_ASSERT_EQUAL_size_t(0, download(bench).size());
  TEST_ASSERT_EQUAL_FLOAT(0.0F, bench.flight.flown.takeoffHeight);
}

void test_fences_and_rally_points_are_refused() {
  TelemetryBench bench;
  sayCount(bench, 3, MAV_MISSION_TYPE_FENCE);
  bench.run(0.3F);
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_UNSUPPORTED, answerTo(bench));
  TEST_ASSERT_EQUAL_size_t(0, bench.flight.asked.size());
}

void test_what_mavlink_has_no_words_for_is_not_shown_as_something_else() {
  TelemetryBench bench;
  bench.flight.flown.takeoffHeight = 2.0F;
  bench.flight.flown.legCount = 1;
  bench.flight.flown.legs[0] = {1.0F, 1.0F, 2.0F, 0.5F, 0};  // with a turn
  bench.say(mavlink_msg_mission_request_list_encode_status,
            mavlink_mission_request_list_t{1, kAutopilot, 0});
  bench.run(0.3F);
  TEST_ASSERT_EQUAL_INT(MAV_MISSION_ERROR, answerTo(bench));
  assertTold(bench, "cannot be shown");
}

}  // namespace

void runMissionTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_mission_is_flown_as_it_was_uploaded);
  RUN_TEST(test_a_mission_comes_down_as_it_went_up);
  RUN_TEST(test_places_on_the_map_go_up_and_come_down_to_a_centimetre);
  RUN_TEST(test_what_cannot_be_flown_is_refused_and_the_mission_before_is_kept);
  RUN_TEST(test_what_the_flight_refuses_is_refused_with_its_reason);
  RUN_TEST(test_a_place_on_the_map_needs_a_start_that_is_known);
  RUN_TEST(test_landing_elsewhere_is_flown_there_first);
  RUN_TEST(test_an_upload_that_stops_is_asked_for_again_then_given_up);
  RUN_TEST(test_items_lost_or_sent_twice_do_no_harm);
  RUN_TEST(test_clearing_leaves_no_mission);
  RUN_TEST(test_fences_and_rally_points_are_refused);
  RUN_TEST(test_what_mavlink_has_no_words_for_is_not_shown_as_something_else);
}
