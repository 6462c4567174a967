/// Walks the intact blocks of a log, as its reader after a crash does. Like ULogReader.h it
/// includes nothing of lib/Logger, so that a mistake there is not repeated here.
#pragma once

#include <cstdint>
#include <cstring>
#include <vector>

class LogBlocks {
 public:
  struct Block {
    std::size_t end = 0;     ///< byte behind it
    std::uint64_t time = 0;  ///< us, when it was closed
    std::uint32_t sequence = 0;
  };

  /// Forgets blocks that end behind `unchanged`, then takes what is intact from there on.
  /// @param unchanged  bytes that are as they were in the last call
  void update(const std::vector<std::uint8_t>& bytes, std::size_t unchanged) {
    while (!blocks_.empty() && blocks_.back().end > unchanged) blocks_.pop_back();
    for (;;) {
      Block block;
      if (!next(bytes, intact(), block)) return;
      blocks_.push_back(block);
    }
  }

  [[nodiscard]] const std::vector<Block>& blocks() const { return blocks_; }

  /// Bytes from the file's start that block after block vouches for.
  [[nodiscard]] std::size_t intact() const { return blocks_.empty() ? 0 : blocks_.back().end; }

 private:
  template <class T>
  static T at(const std::vector<std::uint8_t>& bytes, std::size_t place) {
    T value;
    std::memcpy(&value, &bytes[place], sizeof value);
    return value;
  }

  /// Bit by bit, as IEEE 802.3 has it.
  static std::uint32_t crc32(const std::uint8_t* data, std::size_t size) {
    std::uint32_t crc = 0xFFFFFFFFU;
    for (std::size_t i = 0; i < size; ++i) {
      crc ^= data[i];
      for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) * 0xEDB88320U);
    }
    return ~crc;
  }

  /// The block that begins at `begin`: messages up to one of log_block that fits them.
  bool next(const std::vector<std::uint8_t>& bytes, std::size_t begin, Block& block) {
    constexpr std::size_t kEndMessage = 3 + 2 + 8 + 4 * 4;
    std::size_t place = begin == 0 ? 16 : begin;  // behind magic and start time
    while (place + 3 <= bytes.size() && place - begin <= 8192) {
      const std::size_t size = std::size_t{3} + at<std::uint16_t>(bytes, place);
      const std::uint8_t type = bytes[place + 2];
      if (place + size > bytes.size()) return false;
      if (type == 'A' && size == 6 + 9 && std::memcmp(&bytes[place + 6], "log_block", 9) == 0) {
        blockId_ = at<std::uint16_t>(bytes, place + 4);
      }
      if (type == 'D' && size == kEndMessage && at<std::uint16_t>(bytes, place + 3) == blockId_) {
        block.end = place + size;
        block.time = at<std::uint64_t>(bytes, place + 5);
        block.sequence = at<std::uint32_t>(bytes, place + 17);
        return at<std::uint32_t>(bytes, place + 21) == block.end - begin &&
               at<std::uint32_t>(bytes, place + 25) == crc32(&bytes[begin], place + 25 - begin);
      }
      place += size;
    }
    return false;
  }

  std::vector<Block> blocks_;
  std::uint16_t blockId_ = 0xFFFF;
};
