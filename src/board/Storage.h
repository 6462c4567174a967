/// Bytes that survive power-off: the core's EEPROM, which it keeps in the last 252 KB of the
/// program's flash.
#pragma once

#include <cstddef>
#include <cstdint>

#include <avr/eeprom.h>

namespace strix {

/// The core appends two bytes to one of 63 sectors for each byte that changes, and erases that
/// sector when it is full: every 2048 changes, a flash lasts 100000. The flash then answers nobody,
/// and interrupts are off:
///
/// | a byte          | typical   | worst, by W25Q64JV's datasheet                      |
/// | unchanged       | 10 us     | 10 us                                               |
/// | written         | 0.1 ms    | 3 ms                                                |
/// | sector was full | 50 ms     | 0.6 s: 0.4 s to erase, 68 bytes written back        |
///
/// micros() stands still for all of it but a millisecond. So: motors off only, and a few bytes at a
/// time.
class Storage {
 public:
  static constexpr std::size_t kBytes = E2END + 1;

  static void read(std::size_t offset, std::uint8_t* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) data[i] = eeprom_read_byte(at(offset + i));
  }

  /// False beyond the end, or when a byte does not read back.
  [[nodiscard]] static bool write(std::size_t offset, const std::uint8_t* data, std::size_t size) {
    if (offset > kBytes || size > kBytes - offset) return false;
    bool kept = true;
    for (std::size_t i = 0; i < size; ++i) {
      eeprom_write_byte(at(offset + i), data[i]);  // itself leaves alone what is equal
      kept = kept && eeprom_read_byte(at(offset + i)) == data[i];
    }
    return kept;
  }

 private:
  /// The core's interface is that of a processor whose EEPROM has addresses of its own.
  [[nodiscard]] static std::uint8_t* at(std::size_t offset) {
    return reinterpret_cast<std::uint8_t*>(offset);
  }
};

}  // namespace strix
