/// The last texts said to the pilot, for whoever shows them: each reader keeps its own place.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace strix {

class TextHistory {
 public:
  static constexpr std::uint32_t kKept = 16;
  static constexpr std::size_t kLength = 100;  ///< longer ones are cut

  struct Text {
    std::uint8_t severity = 6;  ///< as in syslog: 3 error, 4 warning, 5 notice, 6 info
    std::uint8_t size = 0;
    std::array<char, kLength> letters{};
    [[nodiscard]] std::string_view text() const { return {letters.data(), size}; }
  };

  void add(std::uint8_t severity, std::string_view text) {
    Text& place = texts_[count_++ % kKept];
    place.severity = severity;
    place.size = static_cast<std::uint8_t>(text.size() < kLength ? text.size() : kLength);
    std::memcpy(place.letters.data(), text.data(), place.size);
  }

  /// The text at the reader's place, and the place moved on; nullptr: nothing new. A reader that
  /// was too slow goes on with the oldest that is left.
  [[nodiscard]] const Text* next(std::uint32_t& place) const {
    if (place == count_) return nullptr;
    if (count_ - place > kKept) place = count_ - kKept;
    return &texts_[place++ % kKept];
  }

 private:
  std::array<Text, kKept> texts_{};
  std::uint32_t count_ = 0;  ///< said since power-up
};

}  // namespace strix
