/// Stands in for the Teensy 4 core's Arduino.h, so that src/board compiles on the host unchanged:
/// the calls, registers and names that the adapters use, and no more. The core itself is not in CI
/// (PlatformIO's registry brings it) and never in this repository.
///
/// Written from the Arduino language reference, pjrc.com's pages on the Teensy 4.1, and the
/// "i.MX RT1060 Processor Reference Manual".
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "FakeFlexPwm.h"
#include "FakeTeensy.h"

// Names that the core takes from everybody: a header that calls a matrix F, or that includes Eigen
// (whose templates have a B0 and a B1) behind Arduino.h, compiles on no Teensy; nor does it here.
// NOLINTBEGIN(cppcoreguidelines-macro-usage)
#define F(text) (text)
#define B0 0
#define B1 1
#define PI 3.1415926535897932384626433832795
#define bit(number) (1UL << (number))

#define HIGH 1
#define LOW 0
#define INPUT 0
#define OUTPUT 1
#define INPUT_PULLUP 2
#define INPUT_PULLDOWN 3
#define OUTPUT_OPENDRAIN 4
#define RISING 3
#define DEC 10
#define HEX 16

#define F_CPU_ACTUAL 600000000U
#define ARM_DWT_CYCCNT (strix::cycleCount())
// NOLINTEND(cppcoreguidelines-macro-usage)

namespace strix {

inline FakeClock& arduinoClock() { return fakeTeensy().clock; }

/// 600 MHz, 32 bits: wraps after 7.2 s.
inline std::uint32_t cycleCount() {
  arduinoClock().advance(FakeClock::kInstruction);
  return static_cast<std::uint32_t>(arduinoClock().now() * 6U / 10U);
}

}  // namespace strix

inline std::uint32_t micros() {
  strix::arduinoClock().advance(8 * strix::FakeClock::kInstruction);
  return static_cast<std::uint32_t>(strix::arduinoClock().now() / 1000U);
}
inline std::uint32_t millis() {
  strix::arduinoClock().advance(strix::FakeClock::kInstruction);
  return static_cast<std::uint32_t>(strix::arduinoClock().now() / 1'000'000U);
}
inline void delayMicroseconds(std::uint32_t us) {
  strix::arduinoClock().advance(strix::nanosFromMicros(us));
}
inline void delay(std::uint32_t ms) { delayMicroseconds(ms * 1000U); }

inline void pinMode(std::uint8_t pin, std::uint8_t mode) {
  strix::arduinoClock().advance(2 * strix::FakeClock::kRegister);
  strix::fakeTeensy().setMode(pin, mode == OUTPUT || mode == OUTPUT_OPENDRAIN);
}
inline void digitalWrite(std::uint8_t pin, std::uint8_t value) {
  strix::arduinoClock().advance(strix::FakeClock::kRegister);
  strix::fakeTeensy().setLatch(pin, value != LOW);
}
inline std::uint8_t digitalRead(std::uint8_t pin) {
  strix::arduinoClock().advance(strix::FakeClock::kRegister);
  return strix::fakeTeensy().level(pin) ? HIGH : LOW;
}
/// Rising edges only: nothing else is used.
inline void attachInterrupt(std::uint8_t pin, void (*function)(), int /*mode*/) {
  strix::fakeTeensy().pin(pin).isr = function;
}

/// The USB's serial line with a terminal that takes what is sent when the test lets it.
class FakeUsbSerial {
 public:
  bool terminal = false;  ///< somebody has opened the line
  std::size_t space = 8192;
  std::deque<std::uint8_t> typed;
  std::vector<std::uint8_t> shown;
  unsigned waits = 0;  ///< writes that had to wait, up to 120 ms each

  explicit operator bool() const { return terminal; }
  int availableForWrite() const { return static_cast<int>(space); }
  int read() {
    if (typed.empty()) return -1;
    const int byte = typed.front();
    typed.pop_front();
    return byte;
  }
  std::size_t write(const std::uint8_t* data, std::size_t size) {
    if (size > space) {
      ++waits;
      delay(120);
      size = space;
    }
    space -= size;
    shown.insert(shown.end(), data, data + size);
    return size;
  }
};

inline FakeUsbSerial Serial;

#include "HardwareSerial.h"
#include "Lpi2cRegisters.h"
#include "SystemRegisters.h"
