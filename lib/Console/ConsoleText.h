/// Words and numbers as the console reads and writes them.
#pragma once

#include <string_view>

#include "MissionText.h"
#include "TextOut.h"

namespace strix {

/// A number as a person writes it: seven digits, no zeros at its end.
struct Plain {
  float value;
};

inline TextOut& operator<<(TextOut& out, Plain number) {
  const double size = number.value < 0.0F ? -double{number.value} : double{number.value};
  int decimals = 6;
  for (double limit = 10.0; decimals > 0 && size >= limit; limit *= 10.0) --decimals;
  if (isFinite(number.value) && size < 1e9) {
    double scale = 1.0;
    for (int i = 0; i < decimals; ++i) scale *= 10.0;
    // std::lround is libm's. NOLINTNEXTLINE(bugprone-incorrect-roundings)
    auto digits = static_cast<std::uint64_t>(size * scale + 0.5);
    for (; decimals > 0 && digits % 10 == 0; digits /= 10) --decimals;
  }
  return out << Fixed{number.value, decimals};
}

/// A text that knows its size.
inline TextOut& operator<<(TextOut& out, std::string_view text) {
  for (const char c : text) out << std::array<char, 2>{c, '\0'}.data();
  return out;
}

[[nodiscard]] constexpr char upper(char c) {
  return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}

/// `part` stands in `text`, whatever the case of either.
[[nodiscard]] constexpr bool contains(std::string_view text, std::string_view part) {
  for (std::size_t at = 0; at + part.size() <= text.size(); ++at) {
    std::size_t i = 0;
    while (i < part.size() && upper(text[at + i]) == upper(part[i])) ++i;
    if (i == part.size()) return true;
  }
  return false;
}
[[nodiscard]] constexpr bool sameWord(std::string_view a, std::string_view b) {
  return a.size() == b.size() && contains(a, b);
}

/// A line's command and its arguments.
using Words = mission_text::Line;

[[nodiscard]] inline bool toNumber(std::string_view word, float& value) {
  return mission_text::parseNumber(word, value) == nullptr;
}

/// A whole number from 0 to `most`, which is below 1e7.
[[nodiscard]] inline bool toWhole(std::string_view word, std::uint32_t most, std::uint32_t& value) {
  float number = 0.0F;
  if (!toNumber(word, number) || !(number >= 0.0F && number <= static_cast<float>(most))) {
    return false;
  }
  value = static_cast<std::uint32_t>(number);
  return static_cast<float>(value) == number;
}

}  // namespace strix
