/// Finds the frames of a serial protocol in a stream of bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace strix {

/// A frame that turns out to be none gives back all but its first byte: one that begins inside it
/// is not lost. Every byte is part of a frame or counted.
/// @tparam Protocol  has kLongest, bytes; length(bytes, count): of the frame that begins there, 0
/// when none does, more than count while that is open; intact(frame, length)
template <class Protocol>
class FrameFinder {
 public:
  /// @return the frame that this byte completes, until the next call; nullptr: none
  const std::uint8_t* add(std::uint8_t byte) {
    drop(taken_);
    taken_ = 0;
    bytes_[count_++] = byte;
    while (count_ > 0) {
      const std::size_t length = Protocol::length(bytes_.data(), count_);
      if (length > count_) return nullptr;
      if (length > 0 && Protocol::intact(bytes_.data(), length)) {
        taken_ = length;
        ++frames_;
        return bytes_.data();
      }
      if (length > 0) ++damaged_;
      ++discarded_;
      drop(1);
    }
    return nullptr;
  }

  [[nodiscard]] std::size_t length() const { return taken_; }  ///< of the frame last returned

  [[nodiscard]] std::uint32_t frames() const { return frames_; }        ///< intact ones
  [[nodiscard]] std::uint32_t damaged() const { return damaged_; }      ///< of a wrong checksum
  [[nodiscard]] std::uint32_t discarded() const { return discarded_; }  ///< bytes in no frame

 private:
  void drop(std::size_t length) {
    count_ -= length;
    for (std::size_t i = 0; i < count_; ++i) bytes_[i] = bytes_[i + length];
  }

  // A frame leaves less than its own length behind, so there is always room for another byte.
  std::array<std::uint8_t, Protocol::kLongest> bytes_{};
  std::size_t count_ = 0;
  std::size_t taken_ = 0;  ///< bytes of the frame last returned
  std::uint32_t frames_ = 0;
  std::uint32_t damaged_ = 0;
  std::uint32_t discarded_ = 0;
};

}  // namespace strix
