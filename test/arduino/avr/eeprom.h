/// Stands in for the Teensy core's EEPROM in flash: 63 sectors of 4 KB, to which two bytes are
/// appended for each byte that changes; a full one is erased and what is valid in it written back.
/// Times are the worst of the W25Q64JV's datasheet.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "FakeTeensy.h"

// NOLINTNEXTLINE(cppcoreguidelines-macro-usage)
#define E2END 0x10BB

namespace strix {

class FakeEeprom {
 public:
  static constexpr std::size_t kSectors = 63;
  static constexpr std::uint32_t kRoom = 2048;          ///< changes a sector
  static constexpr std::uint64_t kProgram = 3'000'000;  // ns
  static constexpr std::uint64_t kErase = 400'000'000;

  FakeEeprom() { bytes.fill(0xFF); }

  std::array<std::uint8_t, E2END + 1> bytes{};
  std::array<std::uint32_t, kSectors> used{};
  unsigned erasures = 0;
  bool worn = false;  ///< keeps nothing

  void write(std::size_t address, std::uint8_t value) {
    if (address > E2END || bytes[address] == value || worn) return;
    const std::size_t sector = (address >> 2U) % kSectors;
    FakeClock& clock = fakeTeensy().clock;
    bytes[address] = value;
    if (used[sector] < kRoom) {
      ++used[sector];
      clock.advance(kProgram);
      return;
    }
    ++erasures;
    used[sector] = 0;
    for (std::size_t at = 0; at <= E2END; ++at) {
      if ((at >> 2U) % kSectors == sector && bytes[at] != 0xFF) ++used[sector];
    }
    clock.advance(kErase + used[sector] * kProgram);
  }
};

/// A test sets it anew.
inline FakeEeprom& fakeEeprom() {
  static FakeEeprom memory;
  return memory;
}

}  // namespace strix

inline std::uint8_t eeprom_read_byte(const std::uint8_t* address) {
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  return at > E2END ? 0xFF : strix::fakeEeprom().bytes[at];
}
inline void eeprom_write_byte(std::uint8_t* address, std::uint8_t value) {
  strix::fakeEeprom().write(reinterpret_cast<std::uintptr_t>(address), value);
}
