/// CRC-32 as in IEEE 802.3, zip and Python's zlib.crc32 (reflected, polynomial 0x04C11DB7).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace strix {

class Crc32 {
 public:
  void update(const std::uint8_t* data, std::size_t size) {
    std::uint32_t c = state_;
    for (; size >= 8; size -= 8, data += 8) c = fourBytes(fourBytes(c, data), data + 4);
    for (; size > 0; --size, ++data) c = (c >> 8U) ^ kTables[0][(c ^ *data) & 0xFFU];
    state_ = c;
  }

  [[nodiscard]] std::uint32_t value() const { return ~state_; }

 private:
  using Table = std::array<std::uint32_t, 256>;

  /// Four table look-ups that do not wait for each other ("slicing", Kounavis and Berry 2005): half
  /// the instructions of one byte at a time.
  [[nodiscard]] static std::uint32_t fourBytes(std::uint32_t c, const std::uint8_t* data) {
    std::uint32_t word = 0;
    std::memcpy(&word, data, sizeof word);  // little-endian, as the reflected polynomial wants
    c ^= word;
    return kTables[3][c & 0xFFU] ^ kTables[2][(c >> 8U) & 0xFFU] ^ kTables[1][(c >> 16U) & 0xFFU] ^
           kTables[0][c >> 24U];
  }

  /// Table n: what a byte does to the register when n bytes of zero follow it.
  static constexpr std::array<Table, 4> kTables = [] {
    std::array<Table, 4> tables{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
      std::uint32_t c = byte;
      for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0U ? (c >> 1U) ^ 0xEDB88320U : c >> 1U;
      tables[0][byte] = c;
    }
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
      for (std::size_t n = 1; n < tables.size(); ++n) {
        const std::uint32_t c = tables[n - 1][byte];
        tables[n][byte] = (c >> 8U) ^ tables[0][c & 0xFFU];
      }
    }
    return tables;
  }();

  std::uint32_t state_ = 0xFFFFFFFFU;
};

}  // namespace strix
