/// Futaba's SBUS: 100000 baud, 8E2, inverted; 16 channels each 7 or 14 ms.
#pragma once

#include "PackedChannels.h"
#include "Time.h"

namespace strix {

/// 0x0F, 22 bytes of channels, flags, an end byte. There is no checksum, and 0x0F stands in the
/// channels too: only the pause before it tells where a frame begins. So a frame is what follows a
/// pause, or another frame, whole and with an end byte and flags that exist.
class Sbus {
 public:
  static constexpr std::size_t kLength = 25;
  /// A byte takes 0.12 ms, the pause 4 ms at least; a pass of the loop is shorter than 2 ms.
  static constexpr Micros kPause = 2'000;

  /// @param now  when the byte was fetched    @return true when `channels` are new
  bool add(std::uint8_t byte, Micros now, RadioChannels& channels) {
    if (started_ && now - last_ >= kPause) {
      discarded_ += static_cast<std::uint32_t>(count_);
      count_ = 0;
      lost_ = false;
    }
    started_ = true;
    last_ = now;
    if (lost_ || (count_ == 0 && byte != kBegin)) {
      lost_ = true;
      ++discarded_;
      return false;
    }
    bytes_[count_++] = byte;
    if (count_ < kLength) return false;
    count_ = 0;
    if (!intact()) {
      lost_ = true;
      ++damaged_;
      discarded_ += kLength;
      return false;
    }
    ++frames_;
    channels = unpackChannels(&bytes_[1]);
    channels.frameLost = (flags() & kFrameLost) != 0;
    channels.failsafe = (flags() & kFailsafe) != 0;
    return true;
  }

  [[nodiscard]] std::uint32_t frames() const { return frames_; }        ///< whole ones
  [[nodiscard]] std::uint32_t damaged() const { return damaged_; }      ///< with another end
  [[nodiscard]] std::uint32_t discarded() const { return discarded_; }  ///< bytes in no frame

 private:
  static constexpr std::uint8_t kBegin = 0x0F;
  static constexpr std::uint8_t kFrameLost = 0x04;
  static constexpr std::uint8_t kFailsafe = 0x08;

  [[nodiscard]] std::uint8_t flags() const { return bytes_[kLength - 2]; }

  /// Four bits of flags: two more switches, and the two above. SBUS2 ends with 0x04 to 0x34.
  [[nodiscard]] bool intact() const {
    const std::uint8_t end = bytes_[kLength - 1];
    return flags() < 0x10 && (end == 0x00 || (end & 0xCFU) == 0x04);
  }

  std::array<std::uint8_t, kLength> bytes_{};
  std::size_t count_ = 0;
  Micros last_ = 0;
  bool started_ = false;
  bool lost_ = true;  ///< until the next pause
  std::uint32_t frames_ = 0;
  std::uint32_t damaged_ = 0;
  std::uint32_t discarded_ = 0;
};

}  // namespace strix
