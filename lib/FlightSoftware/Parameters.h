/// What can be changed without compiling: the values, and the table that says what they are.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace strix {

/// When a parameter may be changed.
enum class ParameterLock : std::uint8_t {
  Air,     ///< at any time
  Ground,  ///< with the motors off
  Start,   ///< with the motors off; acts after the next start
};

/// The values by name, such as parameters.fenceRadius, in the unit of their row.
struct Parameters {
  // clang-format off
#define PARAMETER(member, name, standard, lowest, highest, unit, lock, help) float member = standard;
#include "Parameters.def"
  // clang-format on
};

/// One row of the table.
struct ParameterInfo {
  std::string_view name;
  float standard;
  float lowest;
  float highest;
  std::string_view unit;  ///< "1": none, and whole numbers only
  ParameterLock lock;
  std::string_view help;
  float Parameters::* member;
  const char* locked;  ///< the sentence that refuses a change with the motors on

  [[nodiscard]] constexpr bool whole() const { return unit == "1"; }
};

// clang-format off
inline constexpr ParameterInfo kParameterTable[] = {
#define PARAMETER(member, name, standard, lowest, highest, unit, lock, help) \
  {#name, standard, lowest, highest, #unit, ParameterLock::lock, help, &Parameters::member, \
   #name " can be changed with the motors off only"},
#include "Parameters.def"
};
// clang-format on

constexpr std::size_t kParameterCount = std::size(kParameterTable);
constexpr std::size_t kParameterNameLength = 16;  ///< as MAVLink has it

namespace parameter_text {

/// The sentence "NAME is from LOWEST to HIGHEST UNIT", put together by the compiler, so that a
/// refusal names what it refuses and is still only a pointer.
class Range {
 public:
  /// @param lowest, highest  as they stand in the table: "0.5F"
  constexpr Range(std::string_view name, std::string_view lowest, std::string_view highest,
                  std::string_view unit) {
    add(name);
    add(unit == "1" ? " is a whole number from " : " is from ");
    add(number(lowest));
    add(" to ");
    add(number(highest));
    if (unit == "1") return;
    add(" ");
    add(unit);
  }

  [[nodiscard]] constexpr const char* text() const { return letters_.data(); }

 private:
  [[nodiscard]] static constexpr std::string_view number(std::string_view literal) {
    literal.remove_suffix(1);  // F
    while (literal.back() == '0') literal.remove_suffix(1);
    if (literal.back() == '.') literal.remove_suffix(1);
    return literal;
  }
  constexpr void add(std::string_view part) {
    for (const char c : part) letters_[size_++] = c;  // too long: does not compile
  }

  std::array<char, 72> letters_{};
  std::size_t size_ = 0;
};

// clang-format off
inline constexpr std::array<Range, kParameterCount> kRanges{{
#define PARAMETER(member, name, standard, lowest, highest, unit, lock, help) \
  {#name, #lowest, #highest, #unit},
#include "Parameters.def"
}};
// clang-format on

}  // namespace parameter_text

/// Its place in the table; kParameterCount when there is none of that name.
[[nodiscard]] constexpr std::size_t findParameter(std::string_view name) {
  std::size_t i = 0;
  while (i < kParameterCount && kParameterTable[i].name != name) ++i;
  return i;
}

/// @param index  below kParameterCount, here and below
[[nodiscard]] constexpr float getParameter(const Parameters& parameters, std::size_t index) {
  return parameters.*kParameterTable[index].member;
}

/// checkParameter comes first.
constexpr void setParameter(Parameters& parameters, std::size_t index, float value) {
  parameters.*kParameterTable[index].member = value;
}

/// @param value  NaN is refused
/// @return nullptr, or the sentence that says why it must not be set to that now
[[nodiscard]] constexpr const char* checkParameter(std::size_t index, float value, bool motorsOn) {
  if (index >= kParameterCount) return "there is no such parameter";
  const ParameterInfo& info = kParameterTable[index];
  const bool within = value >= info.lowest && value <= info.highest;
  // Whole numbers of the table are far below 2^31: the conversion is defined where it is reached.
  if (!within || (info.whole() && value != static_cast<float>(static_cast<std::int32_t>(value)))) {
    return parameter_text::kRanges[index].text();
  }
  if (motorsOn && info.lock != ParameterLock::Air) return info.locked;
  return nullptr;
}

namespace parameter_text {

/// What every row has to be.
[[nodiscard]] constexpr bool isSound(const ParameterInfo& info) {
  if (info.name.empty() || info.name.size() > kParameterNameLength) return false;
  for (const char c : info.name) {
    if (!((c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_')) return false;
  }
  constexpr std::size_t kLineOfConsole = 76;
  return !info.unit.empty() && !info.help.empty() && info.help.size() <= kLineOfConsole &&
         info.lowest < info.highest;
}

[[nodiscard]] constexpr bool tableIsSound() {
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const ParameterInfo& info = kParameterTable[i];
    if (!isSound(info) || findParameter(info.name) != i) return false;
    for (const float value : {info.standard, info.lowest, info.highest}) {
      if (checkParameter(i, value, false) != nullptr) return false;
    }
  }
  return true;
}
static_assert(tableIsSound(), "a name twice or not of A-Z 0-9 _, a default out of its range, ...");

}  // namespace parameter_text

}  // namespace strix
