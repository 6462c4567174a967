/// Characters to lines, as a person types them.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace strix {

/// One line of input. Backspace works; other control characters are left out; a line too long is
/// none, rather than a shorter one with another meaning.
class CommandLine {
 public:
  static constexpr std::size_t kLongest = 40;

  enum class Event { Nothing, Typed, Erased, Line, TooLong };

  /// After Line the text is there until the next call.
  Event take(char c) {
    if (complete_) {
      size_ = 0;
      complete_ = tooLong_ = false;
    }
    if (c == '\r' || c == '\n') {
      // A terminal may send both for one Enter.
      const bool secondHalf = c == '\n' && lastWasReturn_;
      lastWasReturn_ = c == '\r';
      if (secondHalf) return Event::Nothing;
      complete_ = true;
      return tooLong_ ? Event::TooLong : Event::Line;
    }
    lastWasReturn_ = false;
    if (c == '\b' || c == 127) {
      if (size_ == 0) return Event::Nothing;
      --size_;
      return Event::Erased;
    }
    if (c < ' ' || c > '~') return Event::Nothing;
    if (size_ == kLongest) {
      tooLong_ = true;
      return Event::Nothing;
    }
    characters_[size_++] = c;
    return Event::Typed;
  }

  /// The last character was a return: a line feed would be the same Enter.
  [[nodiscard]] bool returned() const { return lastWasReturn_; }

  /// The line without blanks at its ends.
  [[nodiscard]] std::string_view text() const {
    std::string_view text(characters_.data(), size_);
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    return text;
  }

 private:
  std::array<char, kLongest> characters_{};
  std::size_t size_ = 0;
  bool tooLong_ = false;
  bool complete_ = false;
  bool lastWasReturn_ = false;
};

}  // namespace strix
