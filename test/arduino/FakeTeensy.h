/// What the stand-ins of Arduino.h and Wire.h act upon: one clock, the pins, and two I2C masters
/// with their wires.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "FakeClock.h"
#include "FakeI2cWire.h"
#include "FakeLpi2c.h"
#include "FakeWatchdog.h"

namespace strix {

/// A pin as the core's pinMode, digitalWrite and attachInterrupt leave it.
struct FakePin {
  bool gpio = true;  ///< false while a peripheral has it
  bool output = false;
  bool latch = false;       ///< what digitalWrite was told
  bool level = true;        ///< that the world gives it
  void (*isr)() = nullptr;  ///< on a rising edge
};

/// What the reset controller knows of the last reset: a power-up.
struct FakeReset {
  std::uint32_t causes = 1;  ///< SRSR
  std::uint32_t word = 0;    ///< GPR5
  bool crashed = false;      ///< the core has kept a fault's record
};

/// The registers of SNVS: supplied by a cell or by what is left of the 3.3 V.
struct FakeRetained {
  std::uint32_t control = 0;  ///< LPCR
  std::uint32_t word = 0;     ///< LPGPR2
};

/// One I2C master, its pads, and the wire they are soldered to.
class FakeI2cPort final : public I2cParty {
 public:
  FakeI2cPort(FakeClock& clock, std::size_t sda, std::size_t scl)
      : sdaPin(sda), sclPin(scl), master(clock, wire) {
    wire.attach(*this);
  }
  void edge(Lines /*was*/, Lines /*is*/) override {}

  const std::size_t sdaPin;
  const std::size_t sclPin;
  FakeI2cWire wire;
  FakeLpi2c master;
};

class FakeTeensy {
 public:
  /// @param start_us  what micros() says first
  explicit FakeTeensy(std::uint32_t start_us) {
    clock.advance(nanosFromMicros(start_us));
    for (FakePin& pin : pins_) pin = FakePin{};
  }

  FakeClock clock;
  // Which pins a master's pads go to is a property of the chip and of the Teensy's circuit board
  // (pjrc.com, "Teensy 4.1 pins"; Wire and Wire1 with their first choice of pins).
  FakeI2cPort lpi2c1{clock, 18, 19};
  FakeI2cPort lpi2c3{clock, 17, 16};
  FakeWatchdog watchdog{clock};
  FakeReset reset;
  FakeRetained retained;

  [[nodiscard]] FakePin& pin(std::size_t number) { return pins_.at(number); }

  /// The world raises a pin and lets it fall: an interrupt, if the sketch asked for one.
  void pulse(std::size_t number) {
    if (pin(number).isr != nullptr) pin(number).isr();
  }

  void setMode(std::size_t number, bool output) {
    pin(number).output = output;
    setGpio(number, true);
  }
  void setLatch(std::size_t number, bool high) {
    pin(number).latch = high;
    refresh();
  }
  void setGpio(std::size_t number, bool gpio) {
    pin(number).gpio = gpio;
    refresh();
  }
  [[nodiscard]] bool level(std::size_t number) {
    for (const FakeI2cPort* port : {&lpi2c1, &lpi2c3}) {
      if (number == port->sdaPin) return port->wire.levels().sda;
      if (number == port->sclPin) return port->wire.levels().scl;
    }
    return pin(number).output ? pin(number).latch : pin(number).level;
  }

 private:
  void refresh() {
    for (FakeI2cPort* port : {&lpi2c1, &lpi2c3}) {
      const FakePin& sda = pin(port->sdaPin);
      const FakePin& scl = pin(port->sclPin);
      port->pullsSda = sda.gpio && sda.output && !sda.latch;
      port->pullsScl = scl.gpio && scl.output && !scl.latch;
      port->master.route(!sda.gpio, !scl.gpio);
      port->wire.update();
    }
  }

  std::array<FakePin, 55> pins_;
};

/// The machine that the calls of the Arduino core mean: they have no other way to name it.
inline std::unique_ptr<FakeTeensy>& theTeensy() {
  static std::unique_ptr<FakeTeensy> machine = std::make_unique<FakeTeensy>(0);
  return machine;
}
inline FakeTeensy& fakeTeensy() { return *theTeensy(); }

/// A fresh machine, as after a power-up. The core's own start-up takes 300 ms.
inline FakeTeensy& powerUpTeensy(std::uint32_t start_us = 300'000) {
  theTeensy() = std::make_unique<FakeTeensy>(start_us);
  return fakeTeensy();
}

}  // namespace strix
