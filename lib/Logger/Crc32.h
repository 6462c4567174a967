/// CRC-32 as in IEEE 802.3, zip and Python's zlib.crc32 (reflected, polynomial 0x04C11DB7).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace strix {

class Crc32 {
 public:
  void update(const std::uint8_t* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
      state_ = (state_ >> 8U) ^ kTable[(state_ ^ data[i]) & 0xFFU];
    }
  }

  [[nodiscard]] std::uint32_t value() const { return ~state_; }

 private:
  static constexpr std::array<std::uint32_t, 256> kTable = [] {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
      std::uint32_t c = byte;
      for (int bit = 0; bit < 8; ++bit) c = (c & 1U) != 0U ? (c >> 1U) ^ 0xEDB88320U : c >> 1U;
      table[byte] = c;
    }
    return table;
  }();

  std::uint32_t state_ = 0xFFFFFFFFU;
};

}  // namespace strix
