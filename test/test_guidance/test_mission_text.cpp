// Missions as text: what they say, and each way in which they can be wrong.
#include <MissionText.h>
#include <unity.h>

#include <cstdlib>
#include <string>

#include "AssertNear.h"
#include "Random.h"
#include "missions/FirstFlight.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr const char* kEverything =
    "# all there is\n"
    "takeoff 2.5 1\n"
    "leg 5 -3 2 90 1.5   # a stop\n"
    "speed 2\n"
    "leg 10 0 3 -45 0 1\n"
    "attitude 30 -20 10 0.5\n"
    "home\n";

std::string errorOf(const std::string& text, const Fence& fence = {}) {
  const ParsedMission parsed = parseMission("test", text, fence);
  return parsed.valid() ? "" : MissionErrorText(parsed.error).text();
}

void assertRefused(const std::string& text, const char* said) {
  TEST_ASSERT_EQUAL_STRING_MESSAGE(said, errorOf(text).c_str(), text.c_str());
}

void assertSame(const Mission& a, const Mission& b) {
  TEST_ASSERT_TRUE(a.takeoffHeight == b.takeoffHeight && a.takeoffHoldTime == b.takeoffHoldTime);
  TEST_ASSERT_TRUE(a.legCount == b.legCount && a.end == b.end && a.standAngle == b.standAngle);
  for (std::size_t i = 0; i < a.legCount; ++i) {
    const Leg& x = a.legs[i];
    const Leg& y = b.legs[i];
    TEST_ASSERT_TRUE(x.kind == y.kind && x.north == y.north && x.east == y.east);
    TEST_ASSERT_TRUE(x.height == y.height && x.turn == y.turn && x.holdTime == y.holdTime);
    TEST_ASSERT_TRUE(x.radius == y.radius && x.speed == y.speed);
    TEST_ASSERT_TRUE(x.roll == y.roll && x.pitch == y.pitch);
  }
}

void test_a_text_becomes_the_mission_that_it_says() {
  const ParsedMission parsed = parseMission("everything", kEverything);
  TEST_ASSERT_TRUE(parsed.valid());
  const Mission& m = parsed.mission;
  TEST_ASSERT_EQUAL_STRING("everything", m.name);
  TEST_ASSERT_EQUAL_FLOAT(2.5F, m.takeoffHeight);
  TEST_ASSERT_EQUAL_UINT32(1'000'000, m.takeoffHoldTime);
  TEST_ASSERT_EQUAL_UINT8(3, m.legCount);
  TEST_ASSERT_TRUE(m.end == MissionEnd::Home);
  TEST_ASSERT_FALSE(m.onStand());

  const Leg& stop = m.legs[0];
  TEST_ASSERT_TRUE(stop.kind == LegKind::Waypoint);
  TEST_ASSERT_TRUE(stop.north == 5.0F && stop.east == -3.0F && stop.height == 2.0F);
  TEST_ASSERT_EQUAL_FLOAT(kHalfPi, stop.turn);
  TEST_ASSERT_EQUAL_UINT32(1'500'000, stop.holdTime);
  TEST_ASSERT_TRUE(stop.radius == 0.0F && stop.speed == 0.0F);  // as guidance is configured

  const Leg& through = m.legs[1];
  TEST_ASSERT_EQUAL_UINT32(0, through.holdTime);
  TEST_ASSERT_TRUE(through.radius == 1.0F && through.speed == 2.0F);
  TEST_ASSERT_EQUAL_FLOAT(-45.0F * kDegToRad, through.turn);

  const Leg& attitude = m.legs[2];
  TEST_ASSERT_TRUE(attitude.kind == LegKind::Attitude);
  TEST_ASSERT_EQUAL_FLOAT(30.0F * kDegToRad, attitude.roll);
  TEST_ASSERT_EQUAL_FLOAT(-20.0F * kDegToRad, attitude.pitch);
  TEST_ASSERT_EQUAL_FLOAT(10.0F * kDegToRad, attitude.turn);
  TEST_ASSERT_EQUAL_UINT32(500'000, attitude.holdTime);
  TEST_ASSERT_TRUE(isFlyable(m, {}));
}

void test_a_stand_is_its_angle_alone() {
  const ParsedMission parsed = parseMission("stand", "\n# on the gimbal\nstand 15\n");
  TEST_ASSERT_TRUE(parsed.valid());
  TEST_ASSERT_TRUE(parsed.mission.onStand());
  TEST_ASSERT_EQUAL_FLOAT(15.0F * kDegToRad, parsed.mission.standAngle);
  TEST_ASSERT_TRUE(isFlyable(parsed.mission, {}));
}

void test_land_is_the_end_that_needs_no_saying() {
  const ParsedMission said = parseMission("a", "takeoff 2 1\nland\n");
  const ParsedMission unsaid = parseMission("a", "takeoff 2 1");
  TEST_ASSERT_TRUE(said.valid() && unsaid.valid());
  assertSame(said.mission, unsaid.mission);
  TEST_ASSERT_TRUE(said.mission.end == MissionEnd::Land);
}

void test_blanks_tabs_comments_and_line_ends_of_any_kind_change_nothing() {
  const Mission plain = parseMission("a", kEverything).mission;
  std::string crlf;
  std::string wide;
  for (const char c : std::string(kEverything)) {
    crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
    wide += c == ' '    ? std::string(" \t ")
            : c == '\n' ? std::string("#x\n\n \t\n")
                        : std::string(1, c);
  }
  TEST_ASSERT_TRUE(parseMission("a", crlf).valid());
  assertSame(plain, parseMission("a", crlf).mission);
  TEST_ASSERT_TRUE(parseMission("a", wide).valid());
  assertSame(plain, parseMission("a", wide).mission);
}

void test_each_wrong_line_is_told_with_its_number_its_word_and_what_was_expected() {
  struct Wrong {
    const char* line;  // the second, after a take-off
    const char* said;
  };
  const Wrong kWrong[] = {
      {"fly 1",
       "line 2: expected 'takeoff', 'leg', 'attitude', 'speed', 'home', 'land' or 'stand', "
       "found 'fly'"},
      {"takeoff 2 1", "line 2: expected one takeoff, before all legs, found 'takeoff'"},
      {"stand 15", "line 2: expected 'stand ANGLE_DEG' alone, found 'stand'"},
      {"leg 1 2 3",
       "line 2: expected 'leg NORTH_M EAST_M HEIGHT_M TURN_DEG HOLD_S [RADIUS_M]', "
       "found 3 numbers"},
      {"leg 1 2 3 0 1 1 1",
       "line 2: expected 'leg NORTH_M EAST_M HEIGHT_M TURN_DEG HOLD_S [RADIUS_M]', "
       "found 7 numbers"},
      {"leg 1 2 x 0 1", "line 2, HEIGHT_M: expected a number, found 'x'"},
      {"leg 1 2 nan 0 1", "line 2, HEIGHT_M: expected a number, found 'nan'"},
      {"leg 1 2 1e3 0 1", "line 2, HEIGHT_M: expected a number, found '1e3'"},
      {"leg 1 2 . 0 1", "line 2, HEIGHT_M: expected a number, found '.'"},
      {"leg 1 2 - 0 1", "line 2, HEIGHT_M: expected a number, found '-'"},
      {"leg 1 2 1.2.3 0 1", "line 2, HEIGHT_M: expected a number, found '1.2.3'"},
      {"leg 1 2 2.0000000 0 1",
       "line 2, HEIGHT_M: expected a number of at most 7 digits, found '2.0000000'"},
      {"leg 1 2 0 0 1", "line 2, HEIGHT_M: expected 0.1 to 15 m, found '0'"},
      {"leg 1 2 15.1 0 1", "line 2, HEIGHT_M: expected 0.1 to 15 m, found '15.1'"},
      {"leg 31 2 3 0 1", "line 2, NORTH_M: expected -30 to 30 m, found '31'"},
      {"leg 1 -31 3 0 1", "line 2, EAST_M: expected -30 to 30 m, found '-31'"},
      {"leg 25  25 3 0 1", "line 2: expected a place up to 30 m from the start, found '25  25'"},
      {"leg 1 2 3 361 1", "line 2, TURN_DEG: expected -360 to 360 deg, found '361'"},
      {"leg 1 2 3 0 -1", "line 2, HOLD_S: expected 0 to 3600 s, found '-1'"},
      {"leg 1 2 3 0 3601", "line 2, HOLD_S: expected 0 to 3600 s, found '3601'"},
      {"leg 1 2 3 0 1 0", "line 2, RADIUS_M: expected 0.1 to 10 m, found '0'"},
      {"attitude 46 0 0 1", "line 2, ROLL_DEG: expected -45 to 45 deg, found '46'"},
      {"attitude 0 -46 0 1", "line 2, PITCH_DEG: expected -45 to 45 deg, found '-46'"},
      {"attitude 0 0 181 1", "line 2, YAW_DEG: expected -180 to 180 deg, found '181'"},
      {"attitude 0 0 0 0", "line 2, HOLD_S: expected 0.1 to 60 s, found '0'"},
      {"attitude 0 0 0",
       "line 2: expected 'attitude ROLL_DEG PITCH_DEG YAW_DEG HOLD_S', found 3 numbers"},
      {"speed 0", "line 2, M_S: expected 0.1 to 5 m/s, found '0'"},
      {"speed", "line 2: expected 'speed M_S', found 0 numbers"},
      {"home 1", "line 2: expected 'home', found 1 numbers"},
      {"land now", "line 2: expected 'land', found 1 numbers"},
      {"home\nleg 1 2 3 0 1", "line 3: expected no line after the mission's end, found 'leg'"},
      {"land\nhome", "line 3: expected no line after the mission's end, found 'home'"},
  };
  for (const Wrong& wrong : kWrong) {
    assertRefused(std::string("takeoff 2 1\n") + wrong.line + "\n", wrong.said);
  }
  assertRefused("", "expected a line 'takeoff HEIGHT_M HOLD_S' or 'stand ANGLE_DEG', found none");
  assertRefused("# nothing\n\n",
                "expected a line 'takeoff HEIGHT_M HOLD_S' or 'stand ANGLE_DEG', found none");
  assertRefused("\n\nleg 1 2 3 0 1",
                "line 3: expected 'takeoff HEIGHT_M HOLD_S' first, found 'leg'");
  assertRefused("takeoff 2\n", "line 1: expected 'takeoff HEIGHT_M HOLD_S', found 1 numbers");
  assertRefused("takeoff 16 1\n", "line 1, HEIGHT_M: expected 0.1 to 15 m, found '16'");
  assertRefused("stand 46\n", "line 1, ANGLE_DEG: expected 1 to 45 deg, found '46'");
  assertRefused("stand -15\n", "line 1, ANGLE_DEG: expected 1 to 45 deg, found '-15'");
  assertRefused("stand 15\nhome\n",
                "line 2: expected no line after the mission's end, found 'home'");
}

void test_the_fence_of_the_aircraft_counts() {
  const char* const text = "takeoff 2 1\nleg 12 0 2 0 1\n";
  TEST_ASSERT_EQUAL_STRING("", errorOf(text).c_str());
  TEST_ASSERT_EQUAL_STRING("line 2, NORTH_M: expected -10.5 to 10.5 m, found '12'",
                           errorOf(text, {10.5F, 15.0F}).c_str());
  TEST_ASSERT_EQUAL_STRING("line 1, HEIGHT_M: expected 0.1 to 1.5 m, found '2'",
                           errorOf(text, {30.0F, 1.5F}).c_str());
}

void test_more_than_there_is_room_for_is_told() {
  std::string legs = "takeoff 2 1\n";
  for (std::size_t i = 0; i < Mission::kMaxLegs; ++i) legs += "leg 1 1 1 0 0\n";
  TEST_ASSERT_EQUAL_STRING("", errorOf(legs).c_str());
  assertRefused(legs + "attitude 0 0 0 1\n",
                "line 34: expected at most 32 legs and attitudes, found another");
  std::string comment = "takeoff 2 1 #";
  comment.resize(4096, 'x');
  TEST_ASSERT_EQUAL_STRING("", errorOf(comment).c_str());
  assertRefused(comment + "x", "expected at most 4096 bytes, found more");
}

void test_what_was_found_is_printable_and_short() {
  const std::string said = errorOf("takeoff 2 1\nfl\xC3\xA4\x01" + std::string(300, 'y'));
  const std::string found = said.substr(said.find("found"));
  TEST_ASSERT_EQUAL_STRING("found 'fl???yyyyyyyyyyyyyyyyyyyyyyyyyyy...'", found.c_str());
  for (const char c : said) TEST_ASSERT_TRUE(c >= ' ' && c <= '~');
}

void test_a_number_is_the_float_nearest_to_what_is_written() {
  // The C library's strtof rounds correctly: an independent reference.
  Random random(3);
  for (int i = 0; i < 20'000; ++i) {
    std::string word = std::to_string(random.below(1U << (1 + i % 23)) % 10'000'000);
    const std::size_t point = random.below(static_cast<std::uint32_t>(word.size() + 2));
    if (point <= word.size()) word.insert(point, ".");
    if (random.chance(0.3F)) word.insert(0, random.chance(0.5F) ? "-" : "+");
    float value = 0.0F;
    TEST_ASSERT_NULL_MESSAGE(mission_text::parseNumber(word, value), word.c_str());
    TEST_ASSERT_TRUE_MESSAGE(value == std::strtof(word.c_str(), nullptr), word.c_str());
  }
}

void test_a_text_cut_off_at_any_byte_is_a_flyable_mission_or_refused() {
  const std::string text = kEverything;
  int valid = 0;
  for (std::size_t size = 0; size <= text.size(); ++size) {
    // A copy of its own, so that a tool that watches memory sees a byte read beyond the end.
    const std::string cut(text.data(), size);
    const ParsedMission parsed = parseMission("cut", cut);
    if (parsed.valid()) {
      ++valid;
      TEST_ASSERT_TRUE(isFlyable(parsed.mission, {}));
    } else {
      TEST_ASSERT_TRUE(std::string(MissionErrorText(parsed.error).text()).size() > 20);
    }
  }
  TEST_ASSERT_TRUE(valid > 10);
}

void test_garbage_is_refused_or_flyable_and_never_anything_else() {
  const char* const kWords[] = {"takeoff", "leg",  "attitude", "speed", "home", "land", "stand",
                                "1",       "-2.5", "15",       "nan",   "#",    "\n",   "\r\n",
                                "9999999", "0",    "\t",       "\x80",  "2 1\n"};
  Random random(11);
  int valid = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string text = random.chance(0.7F) ? "takeoff 2 1\n" : "";
    const std::uint32_t words = random.below(30);
    for (std::uint32_t k = 0; k < words; ++k) {
      text += kWords[random.below(sizeof kWords / sizeof kWords[0])];
      text += random.chance(0.9F) ? " " : "";
    }
    const ParsedMission parsed = parseMission("garbage", text);
    if (parsed.valid()) {
      ++valid;
      TEST_ASSERT_TRUE(isFlyable(parsed.mission, {}));
    } else {
      const std::string said = MissionErrorText(parsed.error).text();
      TEST_ASSERT_TRUE(said.find("expected ") != std::string::npos);
      TEST_ASSERT_TRUE(said.find(", found ") != std::string::npos);
    }
  }
  TEST_ASSERT_TRUE(valid > 500);
}

void test_a_leg_that_leaves_the_air_the_fence_or_reason_is_not_flyable() {
  const Fence fence;
  const Mission good = parseMission("good", kEverything).mission;
  TEST_ASSERT_TRUE(isFlyable(good, fence));
  const auto refused = [&](auto&& spoil) {
    Mission mission = good;
    spoil(mission);
    TEST_ASSERT_FALSE(isFlyable(mission, fence));
  };
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float bad : {kNaN, kInfinity, -1.0F, 100.0F}) {
    refused([bad](Mission& m) { m.legs[1].radius = bad; });
    refused([bad](Mission& m) { m.legs[1].speed = bad; });
    refused([bad](Mission& m) { m.legs[2].roll = bad; });
    refused([bad](Mission& m) { m.legs[2].pitch = bad; });
    refused([bad](Mission& m) { m.standAngle = bad; });
  }
  refused([](Mission& m) { m.legs[2].turn = kNaN; });
  refused([](Mission& m) { m.standAngle = 0.3F; });  // and legs
}

void test_the_first_flight_is_what_it_was() {
  TEST_ASSERT_EQUAL_STRING("first-flight", kFirstFlight.name);
  TEST_ASSERT_EQUAL_UINT8(3, kFirstFlight.legCount);
  TEST_ASSERT_TRUE(kFirstFlight.legs[2].turn == kHalfPi);
  TEST_ASSERT_TRUE(isFlyable(kFirstFlight, {}));
}

}  // namespace

void runMissionTextTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_text_becomes_the_mission_that_it_says);
  RUN_TEST(test_a_stand_is_its_angle_alone);
  RUN_TEST(test_land_is_the_end_that_needs_no_saying);
  RUN_TEST(test_blanks_tabs_comments_and_line_ends_of_any_kind_change_nothing);
  RUN_TEST(test_each_wrong_line_is_told_with_its_number_its_word_and_what_was_expected);
  RUN_TEST(test_the_fence_of_the_aircraft_counts);
  RUN_TEST(test_more_than_there_is_room_for_is_told);
  RUN_TEST(test_what_was_found_is_printable_and_short);
  RUN_TEST(test_a_number_is_the_float_nearest_to_what_is_written);
  RUN_TEST(test_a_text_cut_off_at_any_byte_is_a_flyable_mission_or_refused);
  RUN_TEST(test_garbage_is_refused_or_flyable_and_never_anything_else);
  RUN_TEST(test_a_leg_that_leaves_the_air_the_fence_or_reason_is_not_flyable);
  RUN_TEST(test_the_first_flight_is_what_it_was);
}
