/// NMEA 0183 as GPS receivers write it: bytes to sentences, sentences to their values.
///
/// A receiver is believed only when a sentence is whole: '$', printable characters, '*', the right
/// checksum in two capital hexadecimal digits, and the end of the line. The checksum is one byte of
/// exclusive or, which lets one damaged line in 256 pass, so the fields are checked as well: their
/// number, every digit, every range. An empty field is a value not known, never zero.
/// Coordinates are integers throughout: 1e-7 deg is 11 mm, a float would be 1 m coarse.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "Time.h"

namespace strix {

/// Puts lines together, byte by byte.
class NmeaLines {
 public:
  /// Between '$' and the line's end. NMEA 0183 allows 79; u-blox's high-precision GGA has 85.
  static constexpr std::size_t kLongest = 120;

  /// Since the start; they wrap. Bytes that do not become lines are noise or the wrong baud rate.
  struct Counts {
    std::uint32_t bytes = 0;
    std::uint32_t sound = 0;  ///< lines with the right checksum
    std::uint32_t badChecksum = 0;
    std::uint32_t broken = 0;  ///< cut by the next '$', unprintable, or no checksum at the end
    std::uint32_t overlong = 0;
  };

  /// True when this byte completes a sound line, which sentence() then shows.
  /// @param now  when the byte arrived
  [[nodiscard]] bool push(std::uint8_t byte, Micros now) {
    ++counts_.bytes;
    if (byte == '$') {  // never inside a line: whatever was begun has been cut
      if (open_) ++counts_.broken;
      open_ = true;
      size_ = 0;
      started_ = now;
      return false;
    }
    if (!open_) return false;
    if (byte == '\r' || byte == '\n') {
      open_ = false;
      return close();
    }
    if (byte < 0x20U || byte > 0x7EU) return drop(counts_.broken);
    if (size_ == kLongest) return drop(counts_.overlong);
    line_[size_++] = static_cast<char>(byte);
    return false;
  }

  /// What stands between '$' and '*'. Valid until the next push().
  [[nodiscard]] std::string_view sentence() const { return {line_.data(), size_ - kTail}; }
  /// When its '$' arrived.
  [[nodiscard]] Micros started() const { return started_; }
  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  static constexpr std::size_t kTail = 3;  // "*hh"

  bool drop(std::uint32_t& counter) {
    ++counter;
    open_ = false;
    return false;
  }

  bool close() {
    if (size_ <= kTail || line_[size_ - kTail] != '*') return drop(counts_.broken);
    const int high = hexDigit(line_[size_ - 2]);
    const int low = hexDigit(line_[size_ - 1]);
    if (high < 0 || low < 0) return drop(counts_.broken);
    unsigned sum = 0;
    for (const char c : sentence()) {
      if (c == '*') return drop(counts_.broken);  // two lines that lost their middle
      sum ^= static_cast<unsigned char>(c);
    }
    if (sum != static_cast<unsigned>(high * 16 + low)) return drop(counts_.badChecksum);
    ++counts_.sound;
    return true;
  }

  /// Capitals only, as all receivers write them: then no single flipped bit of a line passes.
  static constexpr int hexDigit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
  }

  std::array<char, kLongest> line_{};
  std::size_t size_ = 0;
  Micros started_ = 0;
  bool open_ = false;
  Counts counts_;
};

/// As string_view::substr, which throws past the end: on the Teensy, that does not even link.
[[nodiscard]] constexpr std::string_view nmeaPart(std::string_view text, std::size_t from,
                                                  std::size_t count = std::string_view::npos) {
  if (from >= text.size()) return {};
  const std::size_t rest = text.size() - from;
  return {text.data() + from, count < rest ? count : rest};
}

/// The comma-separated fields of a sentence; [0] is talker and kind.
class NmeaFields {
 public:
  explicit NmeaFields(std::string_view sentence) {
    std::size_t start = 0;
    for (std::size_t i = 0; i <= sentence.size(); ++i) {
      if (i < sentence.size() && sentence[i] != ',') continue;
      if (count_ < fields_.size()) fields_[count_] = nmeaPart(sentence, start, i - start);
      ++count_;
      start = i + 1;
    }
  }

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::string_view operator[](std::size_t i) const { return fields_[i]; }

 private:
  std::array<std::string_view, 19> fields_;  // GSA of NMEA 4.1, the longest kind that is read
  std::size_t count_ = 0;                    // may be more than are kept
};

/// A number of 1 to 18 digits and nothing else.
[[nodiscard]] constexpr std::optional<std::uint64_t> nmeaDigits(std::string_view text) {
  if (text.empty() || text.size() > 18) return std::nullopt;
  std::uint64_t number = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') return std::nullopt;
    number = number * 10U + static_cast<unsigned>(c - '0');
  }
  return number;
}

/// "12.3456" in units of 10^-decimals; digits beyond are checked and cut off. At most six digits
/// before the point.
[[nodiscard]] constexpr std::optional<std::int32_t> nmeaDecimal(std::string_view text,
                                                                std::size_t decimals) {
  const bool negative = !text.empty() && text[0] == '-';
  if (negative) text.remove_prefix(1);
  const std::size_t point = text.find('.');
  const auto whole = nmeaDigits(nmeaPart(text, 0, point));
  if (!whole || *whole > 999'999U) return std::nullopt;
  std::string_view rest;
  if (point != std::string_view::npos) {
    rest = nmeaPart(text, point + 1);
    if (!nmeaDigits(rest)) return std::nullopt;
  }
  std::uint64_t number = *whole;
  for (std::size_t i = 0; i < decimals; ++i) {
    number = number * 10U + (i < rest.size() ? static_cast<unsigned>(rest[i] - '0') : 0U);
  }
  const auto value = static_cast<std::int32_t>(number);
  return negative ? -value : value;
}

/// Time of the day in UTC, "hhmmss" or "hhmmss.sss", as ms. A leap second has the number 60.
[[nodiscard]] constexpr std::optional<std::uint32_t> nmeaTime(std::string_view text) {
  if (text.size() < 6 || (text.size() > 6 && text[6] != '.')) return std::nullopt;
  const auto clock = nmeaDigits(nmeaPart(text, 0, 6));
  const auto millis = nmeaDecimal(nmeaPart(text, 4), 3);  // "ss.sss"
  if (!clock || !millis) return std::nullopt;
  const auto hour = static_cast<std::uint32_t>(*clock / 10'000U);
  const auto minute = static_cast<std::uint32_t>(*clock / 100U % 100U);
  if (hour >= 24 || minute >= 60 || *millis >= 61'000) return std::nullopt;
  return (hour * 60U + minute) * 60'000U + static_cast<std::uint32_t>(*millis);
}

/// "ddmm.mmmm" or "dddmm.mmmm" and its side in 1e-7 deg, rounded to the nearest.
/// @param side  the field after it: `positive` or `negative`    @param limit  deg
[[nodiscard]] constexpr std::optional<std::int32_t> nmeaAngle(std::string_view text,
                                                              std::size_t degreeDigits,
                                                              std::string_view side, char positive,
                                                              char negative, std::uint64_t limit) {
  constexpr std::size_t kDecimals = 9;  // of a minute, kept
  const std::size_t point = degreeDigits + 2;
  if (text.size() <= point || text[point] != '.' || text.size() > point + 1 + kDecimals) {
    return std::nullopt;
  }
  const auto whole = nmeaDigits(nmeaPart(text, 0, point));
  const auto fraction = nmeaDigits(nmeaPart(text, point + 1));
  if (!whole || !fraction || *whole % 100U >= 60U) return std::nullopt;
  std::uint64_t nanoMinutes = *fraction;
  for (std::size_t i = text.size() - point - 1; i < kDecimals; ++i) nanoMinutes *= 10U;
  nanoMinutes += (*whole / 100U * 60U + *whole % 100U) * 1'000'000'000U;
  const std::uint64_t angle = (nanoMinutes + 3000U) / 6000U;  // 1e-7 deg is 6e-6 min
  if (angle > limit * 10'000'000U) return std::nullopt;
  if (side.size() != 1 || (side[0] != positive && side[0] != negative)) return std::nullopt;
  const auto value = static_cast<std::int32_t>(angle);
  return side[0] == positive ? value : -value;
}

/// 1e-7 deg, north and east positive.
struct NmeaPosition {
  std::int32_t latitude = 0;
  std::int32_t longitude = 0;
};

/// Four fields from `first`: latitude, N or S, longitude, E or W.
[[nodiscard]] inline std::optional<NmeaPosition> nmeaPosition(const NmeaFields& f,
                                                              std::size_t first) {
  const auto latitude = nmeaAngle(f[first], 2, f[first + 1], 'N', 'S', 90);
  const auto longitude = nmeaAngle(f[first + 2], 3, f[first + 3], 'E', 'W', 180);
  if (!latitude || !longitude) return std::nullopt;
  return NmeaPosition{*latitude, *longitude};
}

/// True when four fields from `first` are empty.
[[nodiscard]] inline bool noPosition(const NmeaFields& f, std::size_t first) {
  return f[first].empty() && f[first + 1].empty() && f[first + 2].empty() && f[first + 3].empty();
}

/// Fix data. Where the receiver says it has no fix its position is not read: MediaTek's writes
/// 89 deg 60 min north then.
struct NmeaGga {
  std::optional<std::uint32_t> time;     ///< ms of the day
  std::optional<NmeaPosition> position;  ///< of a fix that was measured
  std::optional<std::int32_t> altitude;  ///< mm above mean sea level
  std::optional<std::int32_t> hdop;      ///< thousandths
  std::optional<std::uint8_t> satellites;
};

/// @return nothing when the sentence is malformed
[[nodiscard]] inline std::optional<NmeaGga> parseGga(const NmeaFields& f) {
  if (f.count() != 15) return std::nullopt;
  NmeaGga gga;
  if (!f[1].empty() && !(gga.time = nmeaTime(f[1]))) return std::nullopt;
  // 1 GPS, 2 differential, 3 precise, 4 and 5 RTK; 6 is dead reckoning, 7 typed in, 8 simulated.
  const auto quality = nmeaDigits(f[6]);
  if (!f[6].empty() && (!quality || *quality > 8U)) return std::nullopt;
  const bool measured = quality && *quality >= 1U && *quality <= 5U;
  if (measured && !noPosition(f, 2) && !(gga.position = nmeaPosition(f, 2))) return std::nullopt;
  if (!f[7].empty()) {
    const auto satellites = nmeaDigits(f[7]);
    if (!satellites || *satellites > 99U) return std::nullopt;
    gga.satellites = static_cast<std::uint8_t>(*satellites);
  }
  if (!f[8].empty() && (!(gga.hdop = nmeaDecimal(f[8], 3)) || *gga.hdop < 0)) return std::nullopt;
  if (!f[9].empty() && (!(gga.altitude = nmeaDecimal(f[9], 3)) || f[10] != "M")) {
    return std::nullopt;
  }
  return gga;
}

/// Recommended minimum: position and velocity.
struct NmeaRmc {
  std::optional<std::uint32_t> time;     ///< ms of the day
  std::optional<NmeaPosition> position;  ///< of a fix that was measured
  std::optional<std::int32_t> speed;     ///< thousandths of a knot
  std::optional<std::int32_t> course;    ///< thousandths of a degree, clockwise from true north
};

/// @return nothing when the sentence is malformed
[[nodiscard]] inline std::optional<NmeaRmc> parseRmc(const NmeaFields& f) {
  if (f.count() < 12 || f.count() > 14) return std::nullopt;  // NMEA 2.0, 2.3 and 4.1
  NmeaRmc rmc;
  if (!f[1].empty() && !(rmc.time = nmeaTime(f[1]))) return std::nullopt;
  if (f[2] != "A" && f[2] != "V") return std::nullopt;
  bool measured = f[2] == "A";
  if (f.count() > 12 && !f[12].empty()) {
    // Autonomous, differential, precise, RTK fixed and float; then estimated, manual, simulated,
    // no.
    const std::size_t mode = std::string_view("ADPRFEMSN").find(f[12]);
    if (f[12].size() != 1 || mode == std::string_view::npos) return std::nullopt;
    measured = measured && mode < 5;
  }
  if (measured && !noPosition(f, 3) && !(rmc.position = nmeaPosition(f, 3))) return std::nullopt;
  if (!f[7].empty() && (!(rmc.speed = nmeaDecimal(f[7], 3)) || *rmc.speed < 0)) return std::nullopt;
  if (!f[8].empty() &&
      (!(rmc.course = nmeaDecimal(f[8], 3)) || *rmc.course < 0 || *rmc.course > 360'000)) {
    return std::nullopt;
  }
  return rmc;
}

/// The number of dimensions that a GSA sentence tells: 1 none, 2 or 3.
/// @return nothing when the sentence is malformed
[[nodiscard]] inline std::optional<std::uint8_t> parseGsa(const NmeaFields& f) {
  if (f.count() != 18 && f.count() != 19) return std::nullopt;  // NMEA 4.1 adds the system
  if (f[1] != "A" && f[1] != "M") return std::nullopt;
  if (f[2] != "1" && f[2] != "2" && f[2] != "3") return std::nullopt;
  return static_cast<std::uint8_t>(f[2][0] - '0');
}

}  // namespace strix
