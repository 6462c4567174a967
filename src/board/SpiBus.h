/// Register access over SPI: the IMU's faster wire.
#pragma once

#include <cstddef>
#include <cstdint>

namespace strix {

/// The device on the Teensy's SPI at 7 MHz, mode 3, most significant bit first; bit 7 of the
/// register's address asks for a reading (ICM-20649 datasheet, SPI interface).
///
/// | pin | signal      | ICM20649 breakout |
/// | 10  | chip select | CS                |
/// | 11  | MOSI        | SDA               |
/// | 12  | MISO        | SDO (AD0)         |
/// | 13  | clock       | SCL               |   the Teensy's LED too: it glows
///
/// The master makes the clock and waits for nobody, so no transfer takes longer than its bits. The
/// other side of it: a device that is not there is not noticed here. MISO has a pull-up, so silence
/// reads as all ones, which the driver knows.
class SpiDevice {
 public:
  static constexpr std::uint8_t kChipSelect = 10;
  static constexpr std::uint8_t kMiso = 12;

  /// Pins and clock; to be called before the first transfer.
  void begin();

  /// Always true. Takes 1.25 us a byte, of which there is one more than `count`: 14 are 19 us.
  bool read(std::uint8_t reg, std::uint8_t* data, std::size_t count);
  bool write(std::uint8_t reg, std::uint8_t value);
};

}  // namespace strix
