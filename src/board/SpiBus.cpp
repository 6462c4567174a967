#include "SpiBus.h"

#include <Arduino.h>
#include <SPI.h>

namespace strix {

namespace {

constexpr std::uint32_t kClock = 7'000'000;  // Hz; the core's divider makes it 6.86 MHz
constexpr std::uint8_t kReading = 0x80;
constexpr std::uint32_t kHold = 100;  // ns from the last bit to the end; the chip wants 63

/// Chip select low for as long as it lives.
class Selected {
 public:
  Selected() {
    SPI.beginTransaction(SPISettings(kClock, MSBFIRST, SPI_MODE3));
    digitalWriteFast(SpiDevice::kChipSelect, LOW);
  }
  ~Selected() {
    delayNanoseconds(kHold);
    digitalWriteFast(SpiDevice::kChipSelect, HIGH);
    SPI.endTransaction();
  }
  Selected(const Selected&) = delete;
  Selected& operator=(const Selected&) = delete;
};

}  // namespace

void SpiDevice::begin() {
  pinMode(kChipSelect, OUTPUT);
  digitalWrite(kChipSelect, HIGH);
  SPI.begin();
  // 22 kOhm up, as pinMode does for INPUT_PULLUP, which would take the pin away from the master.
  *portControlRegister(kMiso) |=
      IOMUXC_PAD_PKE | IOMUXC_PAD_PUE | IOMUXC_PAD_PUS(3) | IOMUXC_PAD_HYS;
}

bool SpiDevice::read(std::uint8_t reg, std::uint8_t* data, std::size_t count) {
  const Selected selected;
  (void)SPI.transfer(static_cast<std::uint8_t>(reg | kReading));
  SPI.transfer(nullptr, data, count);
  return true;
}

bool SpiDevice::write(std::uint8_t reg, std::uint8_t value) {
  const Selected selected;
  (void)SPI.transfer(reg);
  (void)SPI.transfer(value);
  return true;
}

}  // namespace strix
