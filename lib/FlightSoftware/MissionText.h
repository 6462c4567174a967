/// Missions as text, read by the same code on the aircraft and on the laptop, without a heap.
///
/// One word and its numbers a line; '#' starts a comment. Heights and places are relative to the
/// start, angles in degrees to the right, right side down, nose up; times in seconds:
///
///     takeoff HEIGHT_M HOLD_S                                  first
///     leg NORTH_M EAST_M HEIGHT_M TURN_DEG HOLD_S [RADIUS_M]   TURN from the heading at take-off;
///                                                              HOLD 0: through, without a stop
///     attitude ROLL_DEG PITCH_DEG YAW_DEG HOLD_S               YAW from the heading at its start
///     speed M_S                                                of the legs that follow
///     home                                                     last: return to the start, land
///     land                                                     last, and the default: land here
///     stand ANGLE_DEG                                          alone: the attitude stand
#pragma once

#include <string_view>

#include "Mission.h"

namespace strix {

/// Why a text is no mission. MissionErrorText says it in one line.
struct MissionError {
  std::uint16_t line = 0;  ///< from 1; 0: it belongs to no line
  const char* field = "";
  const char* expected = nullptr;  ///< nullptr: there is no error
  const char* unit = nullptr;      ///< given: then `expected`, low to high, unit
  float low = 0.0F;
  float high = 0.0F;
  std::string_view found;          ///< in the text; empty: then `foundText`,
  const char* foundText = "none";  ///< or, from 0 up,
  int foundNumbers = -1;           ///< so many numbers
};

struct ParsedMission {
  Mission mission;
  MissionError error;

  [[nodiscard]] constexpr bool valid() const { return error.expected == nullptr; }
};

namespace mission_text {

constexpr std::size_t kMostBytes = 4096;
constexpr std::size_t kMostNumbers = 6;  ///< in a line
constexpr int kMostDigits = 7;           ///< so that digits and power of ten are exact in float

/// A number and what it may be.
struct Field {
  const char* name;
  float low;
  float high;
  const char* unit;
};

struct Line {
  std::uint16_t number = 0;
  std::string_view word;
  std::array<std::string_view, kMostNumbers> numbers;
  std::size_t count = 0;  ///< of numbers; also those beyond kMostNumbers
};

[[nodiscard]] constexpr bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// Words of one line up to its comment.
[[nodiscard]] constexpr Line split(std::string_view text, std::uint16_t number) {
  Line line;
  line.number = number;
  std::size_t at = 0;
  while (at < text.size() && text[at] != '#') {
    if (isBlank(text[at])) {
      ++at;
      continue;
    }
    const std::size_t begin = at;
    while (at < text.size() && !isBlank(text[at]) && text[at] != '#') ++at;
    const std::string_view word = text.substr(begin, at - begin);
    if (line.word.empty()) {
      line.word = word;
    } else {
      if (line.count < kMostNumbers) line.numbers[line.count] = word;
      ++line.count;
    }
  }
  return line;
}

/// Sign, digits, and a point among them. The result is the float nearest to what is written: both
/// operands of the division are exact.
/// @return nullptr, or what was expected instead
[[nodiscard]] constexpr const char* parseNumber(std::string_view word, float& value) {
  std::size_t at = !word.empty() && (word[0] == '-' || word[0] == '+') ? 1 : 0;
  std::int32_t digits = 0;
  int count = 0;
  float power = 1.0F;
  bool point = false;
  for (; at < word.size(); ++at) {
    const char c = word[at];
    if (c == '.' && !point) {
      point = true;
      continue;
    }
    if (c < '0' || c > '9') return "a number";
    if (++count > kMostDigits) return "a number of at most 7 digits";
    digits = 10 * digits + (c - '0');
    if (point) power *= 10.0F;
  }
  if (count == 0) return "a number";
  value = static_cast<float>(digits) / power;
  if (word[0] == '-') value = -value;
  return nullptr;
}

/// To the nearest; of a value that is not below 0.
[[nodiscard]] constexpr std::uint32_t rounded(float value) {
  // std::lround is not constexpr. NOLINTNEXTLINE(bugprone-incorrect-roundings)
  return static_cast<std::uint32_t>(value + 0.5F);
}

[[nodiscard]] constexpr Micros toMicros(float seconds) { return rounded(seconds * 1e6F); }

}  // namespace mission_text

/// Reads a mission line by line; stops at the first error.
class MissionParser {
 public:
  constexpr MissionParser(const char* name, const Fence& fence)
      : height_{"HEIGHT_M", 0.1F, fence.height, "m"}, fence_(fence) {
    parsed_.mission.name = name;
  }

  constexpr const ParsedMission& parse(std::string_view text) {
    if (text.size() > mission_text::kMostBytes) {
      refuse("", "at most 4096 bytes");
      parsed_.error.foundText = "more";
      return parsed_;
    }
    std::uint16_t number = 0;
    while (!text.empty() && parsed_.valid()) {
      const std::size_t end = text.find('\n');
      line_ = mission_text::split(text.substr(0, end), ++number);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      if (!line_.word.empty()) take();
    }
    line_ = {};
    if (parsed_.valid() && !begun_) {
      refuse("", "a line 'takeoff HEIGHT_M HOLD_S' or 'stand ANGLE_DEG'");
    }
    return parsed_;
  }

 private:
  using Field = mission_text::Field;

  // Limits of what is asked for, ours where they are not the aircraft's: an hour of hovering is
  // beyond any battery; a tilt for more than a minute, or a walk slower than 0.1 m/s, is a slip of
  // the pen; 5 m/s is a sixth of the fence each second.
  static constexpr float kMostTiltDeg = 45.0F;  // Mission::kMostTilt
  static constexpr Field kHold{"HOLD_S", 0.0F, 3600.0F, "s"};
  static constexpr Field kTurn{"TURN_DEG", -360.0F, 360.0F, "deg"};
  static constexpr Field kRadius{"RADIUS_M", 0.1F, 10.0F, "m"};
  static constexpr Field kRoll{"ROLL_DEG", -kMostTiltDeg, kMostTiltDeg, "deg"};
  static constexpr Field kPitch{"PITCH_DEG", -kMostTiltDeg, kMostTiltDeg, "deg"};
  static constexpr Field kYaw{"YAW_DEG", -180.0F, 180.0F, "deg"};
  static constexpr Field kTilted{"HOLD_S", 0.1F, 60.0F, "s"};
  static constexpr Field kSpeed{"M_S", 0.1F, 5.0F, "m/s"};
  static constexpr Field kAngle{"ANGLE_DEG", 1.0F, kMostTiltDeg, "deg"};

  /// This line's numbers into values_, each within its limits.
  /// Stands before its callers: Clang 14 cannot evaluate a template in a constant otherwise.
  /// @param optional  how many of the last ones may be missing
  template <std::size_t Count>
  constexpr bool takeNumbers(const char* usage, const std::array<Field, Count>& fields,
                             std::size_t optional = 0) {
    if (line_.count > Count || line_.count + optional < Count) {
      refuse("", usage);
      parsed_.error.foundNumbers = static_cast<int>(line_.count);
      return false;
    }
    for (std::size_t i = 0; i < line_.count && i < Count; ++i) {
      const Field& field = fields[i];
      const std::string_view word = line_.numbers[i];
      const char* const expected = mission_text::parseNumber(word, values_[i]);
      const bool within = values_[i] >= field.low && values_[i] <= field.high;
      if (expected == nullptr && within) continue;
      refuse(field.name, expected != nullptr ? expected : "");
      parsed_.error.found = word;
      if (expected == nullptr) {
        parsed_.error.unit = field.unit;
        parsed_.error.low = field.low;
        parsed_.error.high = field.high;
      }
      return false;
    }
    return true;
  }

  /// One line that says something.
  constexpr void take() {
    const std::string_view word = line_.word;
    if (ended_) return refuseWord("no line after the mission's end");
    if (word == "takeoff") return takeTakeoff();
    if (word == "stand") return takeStand();
    if (word == "leg" || word == "attitude" || word == "speed" || word == "home" ||
        word == "land") {
      if (!begun_) return refuseWord("'takeoff HEIGHT_M HOLD_S' first");
      if (word == "leg") return takeLeg();
      if (word == "attitude") return takeAttitude();
      if (word == "speed") return takeSpeed();
      ended_ = true;
      parsed_.mission.end = word == "home" ? MissionEnd::Home : MissionEnd::Land;
      (void)takeNumbers(word == "home" ? "'home'" : "'land'", std::array<Field, 0>{});
      return;
    }
    refuseWord("'takeoff', 'leg', 'attitude', 'speed', 'home', 'land' or 'stand'");
  }

  constexpr void takeTakeoff() {
    if (begun_) return refuseWord("one takeoff, before all legs");
    begun_ = true;
    if (!takeNumbers("'takeoff HEIGHT_M HOLD_S'", std::array<Field, 2>{height_, kHold})) return;
    parsed_.mission.takeoffHeight = values_[0];
    parsed_.mission.takeoffHoldTime = mission_text::toMicros(values_[1]);
  }

  constexpr void takeStand() {
    if (begun_) return refuseWord("'stand ANGLE_DEG' alone");
    begun_ = ended_ = true;
    if (!takeNumbers("'stand ANGLE_DEG'", std::array<Field, 1>{kAngle})) return;
    parsed_.mission.standAngle = values_[0] * kDegToRad;
  }

  constexpr void takeLeg() {
    const Field north{"NORTH_M", -fence_.radius, fence_.radius, "m"};
    const Field east{"EAST_M", -fence_.radius, fence_.radius, "m"};
    if (!takeNumbers("'leg NORTH_M EAST_M HEIGHT_M TURN_DEG HOLD_S [RADIUS_M]'",
                     std::array<Field, 6>{north, east, height_, kTurn, kHold, kRadius}, 1)) {
      return;
    }
    if (!fence_.contains(values_[0], values_[1], values_[2])) {
      const char* const begin = line_.numbers[0].data();
      const std::string_view last = line_.numbers[1];
      refuse("", "a place up to");
      parsed_.error.unit = "m from the start";
      parsed_.error.low = parsed_.error.high = fence_.radius;
      parsed_.error.found = {begin, static_cast<std::size_t>(last.data() - begin) + last.size()};
      return;
    }
    add({values_[0], values_[1], values_[2], values_[3] * kDegToRad,
         mission_text::toMicros(values_[4]), LegKind::Waypoint,
         line_.count == 6 ? values_[5] : 0.0F, speed_});
  }

  constexpr void takeAttitude() {
    if (!takeNumbers("'attitude ROLL_DEG PITCH_DEG YAW_DEG HOLD_S'",
                     std::array<Field, 4>{kRoll, kPitch, kYaw, kTilted})) {
      return;
    }
    add({0.0F, 0.0F, 0.0F, values_[2] * kDegToRad, mission_text::toMicros(values_[3]),
         LegKind::Attitude, 0.0F, 0.0F, values_[0] * kDegToRad, values_[1] * kDegToRad});
  }

  constexpr void takeSpeed() {
    if (takeNumbers("'speed M_S'", std::array<Field, 1>{kSpeed})) speed_ = values_[0];
  }

  constexpr void add(const Leg& leg) {
    Mission& mission = parsed_.mission;
    if (mission.legCount == Mission::kMaxLegs) {
      refuse("", "at most 32 legs and attitudes");
      parsed_.error.foundText = "another";
      return;
    }
    mission.legs[mission.legCount++] = leg;
  }

  constexpr void refuse(const char* field, const char* expected) {
    parsed_.error.line = line_.number;
    parsed_.error.field = field;
    parsed_.error.expected = expected;
  }

  constexpr void refuseWord(const char* expected) {
    refuse("", expected);
    parsed_.error.found = line_.word;
  }

  Field height_;
  Fence fence_;
  ParsedMission parsed_;
  mission_text::Line line_;
  std::array<float, mission_text::kMostNumbers> values_{};
  float speed_ = 0.0F;
  bool begun_ = false;
  bool ended_ = false;
};

/// @param name  lives as long as the mission
/// @param text  lives as long as the result, whose error may point into it
[[nodiscard]] constexpr ParsedMission parseMission(const char* name, std::string_view text,
                                                   const Fence& fence = {}) {
  return MissionParser(name, fence).parse(text);
}

/// An error in one line: "line 3, HEIGHT_M: expected 0.1 to 15 m, found '16'".
class MissionErrorText {
 public:
  explicit MissionErrorText(const MissionError& error) {
    if (error.line != 0) {
      add("line ").add(static_cast<float>(error.line));
      if (error.field[0] != '\0') add(", ").add(error.field);
      add(": ");
    }
    add("expected ").add(error.expected);
    if (error.unit != nullptr) {
      if (error.expected[0] != '\0') add(" ");
      if (error.low != error.high) add(error.low).add(" to ");
      add(error.high).add(" ").add(error.unit);
    }
    add(", found ");
    if (error.foundNumbers >= 0) {
      add(static_cast<float>(error.foundNumbers)).add(" numbers");
    } else if (error.found.empty()) {
      add(error.foundText);
    } else {
      constexpr std::size_t kMostFound = 32;
      add("'").add(error.found.substr(0, kMostFound));
      add(error.found.size() > kMostFound ? "...'" : "'");
    }
  }

  [[nodiscard]] const char* text() const { return text_.data(); }

 private:
  MissionErrorText& add(std::string_view words) {
    for (const char c : words) {
      if (size_ + 1 >= text_.size()) break;
      text_[size_++] = c >= ' ' && c <= '~' ? c : '?';  // a file may hold anything
    }
    return *this;
  }

  /// With one decimal where there is one: all limits are such numbers.
  MissionErrorText& add(float number) {
    std::uint32_t tenths = mission_text::rounded((number < 0.0F ? -number : number) * 10.0F);
    const std::uint32_t tenth = tenths % 10U;
    tenths /= 10U;
    std::array<char, 10> digits{};
    std::size_t at = digits.size();
    do {
      digits[--at] = static_cast<char>('0' + tenths % 10U);
      tenths /= 10U;
    } while (tenths != 0);
    if (number < 0.0F) add("-");
    add(std::string_view(digits.data() + at, digits.size() - at));
    if (tenth == 0) return *this;
    const char decimal = static_cast<char>('0' + tenth);
    return add(".").add(std::string_view(&decimal, 1));
  }

  std::array<char, 192> text_{};
  std::size_t size_ = 0;
};

}  // namespace strix
