/// Stands in for the Teensy 4 core's SPI library, as far as SpiDevice uses it, with one device at
/// the other end of the wires: bytes take their time at the clock that was asked for, go nowhere
/// while chip select is high, and come back as noise in another mode than the device's.
/// Written from the Arduino reference of SPI; the core is not in CI.
#pragma once

#include <cstddef>
#include <cstdint>

#include "Arduino.h"

// NOLINTBEGIN(cppcoreguidelines-macro-usage)
#define MSBFIRST 1
#define SPI_MODE0 0x00
#define SPI_MODE3 0x0C
// What the pads' control register takes ("i.MX RT1060 Processor Reference Manual", IOMUXC).
#define IOMUXC_PAD_HYS (1U << 16U)
#define IOMUXC_PAD_PUS(pull) (static_cast<std::uint32_t>(pull) << 14U)
#define IOMUXC_PAD_PUE (1U << 13U)
#define IOMUXC_PAD_PKE (1U << 12U)
// NOLINTEND(cppcoreguidelines-macro-usage)

namespace strix {

/// What hears the bytes between two edges of chip select, and answers each.
class SpiPeer {
 public:
  SpiPeer() = default;
  virtual ~SpiPeer() = default;
  SpiPeer(const SpiPeer&) = delete;
  SpiPeer& operator=(const SpiPeer&) = delete;

  virtual void select() = 0;
  [[nodiscard]] virtual std::uint8_t exchange(std::uint8_t sent) = 0;
};

}  // namespace strix

struct SPISettings {
  SPISettings(std::uint32_t clockHz, std::uint8_t bitOrder, std::uint8_t dataMode)
      : clock(clockHz), order(bitOrder), mode(dataMode) {}
  std::uint32_t clock;
  std::uint8_t order;
  std::uint8_t mode;
};

class SPIClass {
 public:
  strix::SpiPeer* peer = nullptr;  ///< set by the test
  std::uint8_t chipSelect = 10;    ///< the pin that it is on

  void begin() { begun_ = true; }
  void beginTransaction(const SPISettings& settings) { settings_ = settings; }
  void endTransaction() {}

  std::uint8_t transfer(std::uint8_t byte) {
    constexpr std::uint64_t kSecond = 1'000'000'000;
    strix::arduinoClock().advance(8 * kSecond / settings_.clock);
    const bool selected = !strix::fakeTeensy().level(chipSelect);
    // MISO has a pull-up: without an answer it reads as ones.
    if (!begun_ || peer == nullptr || !selected) return 0xFF;
    const std::uint8_t answer = peer->exchange(byte);
    const bool understood = settings_.mode == SPI_MODE3 && settings_.order == MSBFIRST;
    return understood ? answer : static_cast<std::uint8_t>(answer << 1U);
  }
  void transfer(const void* /*sent*/, void* received, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      static_cast<std::uint8_t*>(received)[i] = transfer(std::uint8_t{0});
    }
  }

 private:
  bool begun_ = false;
  SPISettings settings_{4'000'000, MSBFIRST, SPI_MODE0};
};

inline SPIClass SPI;

inline void digitalWriteFast(std::uint8_t pin, std::uint8_t value) {
  const bool falls = value == LOW && strix::fakeTeensy().level(pin);
  digitalWrite(pin, value);
  if (falls && pin == SPI.chipSelect && SPI.peer != nullptr) SPI.peer->select();
}
inline void delayNanoseconds(std::uint32_t ns) { strix::arduinoClock().advance(ns); }

/// The pad's electrical properties are not modelled; the register is there to be written.
inline std::uint32_t* portControlRegister(std::uint8_t /*pin*/) {
  static std::uint32_t control = 0;
  return &control;
}
