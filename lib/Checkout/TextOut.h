/// Text on its way to a terminal that may be slow, or not there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "Vector3f.h"

namespace strix {

/// A number with so many digits behind the point (0 to 6).
struct Fixed {
  float value;
  int decimals;
};

/// Three numbers with blanks between them.
struct Fixed3 {
  Vector3f value;
  int decimals;
};

/// An angle in 1e-7 deg, of which a float would lose the last digits.
struct Degrees {
  std::int32_t value;
};

/// Blanks up to this column; at least one.
struct Column {
  std::size_t at;
};

/// A queue of characters. What finds no room is lost and counted; a line says so as soon as there
/// is room for it. The C library's printf is not used: for floats it asks for heap.
class TextOut {
 public:
  static constexpr std::size_t kCapacity = 8192;  ///< the longest table, every line with advice

  TextOut& operator<<(const char* text) {
    for (; *text != '\0'; ++text) add(*text);
    return *this;
  }

  TextOut& operator<<(std::uint32_t value) { return integer(value, 1); }

  TextOut& operator<<(const Fixed& number) {
    std::uint64_t scale = 1;
    for (int i = 0; i < number.decimals; ++i) scale *= 10;
    if (!isFinite(number.value)) return *this << "no number";
    const double size = number.value < 0.0F ? -double{number.value} : double{number.value};
    if (size > 1e9) return *this << (number.value < 0.0F ? "< -1e9" : "> 1e9");
    // Half up: twice as much, cut off, plus one, halved.
    const auto twice = static_cast<std::uint64_t>(2.0 * size * static_cast<double>(scale));
    const std::uint64_t rounded = (twice + 1) / 2;
    if (number.value < 0.0F && rounded != 0) add('-');
    integer(rounded / scale, 1);
    if (number.decimals == 0) return *this;
    add('.');
    return integer(rounded % scale, number.decimals);
  }

  TextOut& operator<<(const Fixed3& numbers) {
    const Vector3f& v = numbers.value;
    return *this << Fixed{v.x(), numbers.decimals} << " " << Fixed{v.y(), numbers.decimals} << " "
                 << Fixed{v.z(), numbers.decimals};
  }

  TextOut& operator<<(Degrees angle) {
    constexpr std::uint32_t kUnit = 10'000'000;
    const std::int64_t wide = angle.value;
    const auto size = static_cast<std::uint32_t>(wide < 0 ? -wide : wide);
    if (wide < 0) add('-');
    integer(size / kUnit, 1);
    add('.');
    return integer(size % kUnit, 7);
  }

  TextOut& operator<<(Column column) {
    do add(' ');
    while (column_ < column.at);
    return *this;
  }

  /// Hands text to `put(const char*, std::size_t)`, which returns how many characters it took.
  template <class Put>
  void drain(Put&& put) {
    if (lost_ != 0 && kCapacity - size_ > kLossLine) {
      const std::uint32_t lost = lost_;
      lost_ = 0;
      *this << "\n(" << lost << " characters lost: the terminal is too slow)\n";
    }
    while (size_ != 0) {
      const std::size_t toEnd = kCapacity - first_;
      const std::size_t run = size_ < toEnd ? size_ : toEnd;
      const std::size_t taken = put(&characters_[first_], run);
      if (taken == 0 || taken > run) return;
      first_ = (first_ + taken) % kCapacity;
      size_ -= taken;
      if (taken < run) return;
    }
  }

  [[nodiscard]] bool atLineStart() const { return column_ == 0; }
  [[nodiscard]] bool empty() const { return size_ == 0; }

 private:
  static constexpr std::size_t kLossLine = 80;

  TextOut& integer(std::uint64_t value, int digits) {
    std::array<char, 20> reversed{};
    std::size_t count = 0;
    do {
      reversed[count++] = static_cast<char>('0' + value % 10);
      value /= 10;
    } while (value != 0 || count < static_cast<std::size_t>(digits));
    while (count != 0) add(reversed[--count]);
    return *this;
  }

  /// A terminal wants a carriage return before each line feed.
  void add(char c) {
    if (c == '\n') store('\r');
    store(c);
    column_ = c == '\n' ? 0 : column_ + 1;
  }

  void store(char c) {
    if (size_ == kCapacity) {
      ++lost_;
      return;
    }
    characters_[(first_ + size_) % kCapacity] = c;
    ++size_;
  }

  std::array<char, kCapacity> characters_{};
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  std::size_t column_ = 0;
  std::uint32_t lost_ = 0;
};

}  // namespace strix
