/// The adapters of src/board on a Teensy that is modelled down to the wires.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "../../src/board/BaroBmp390.h"
#include "../../src/board/I2cBus.h"
#include "../../src/board/MagLis2mdl.h"

#include "FakeBmp390.h"
#include "FakeI2cWire.h"
#include "FakeLis2mdl.h"

namespace strix {

using Nanos = FakeClock::Nanos;

/// Registers that keep what is written: a device to try the bus with.
class PlainChip final : public I2cChip {
 public:
  static constexpr std::uint8_t kAddress = 0x68;

  PlainChip() { powerUp(); }
  void powerUp() override {
    for (std::size_t i = 0; i < registers.size(); ++i) {
      registers[i] = static_cast<std::uint8_t>(i * 37 + 11);
    }
  }
  std::uint8_t readRegister(std::uint8_t reg) override { return registers[reg]; }
  void writeRegister(std::uint8_t reg, std::uint8_t value) override { registers[reg] = value; }

  std::array<std::uint8_t, 256> registers{};
};

/// The IMU's bus with a device of no kind, the other with magnetometer and barometer. The machine
/// starts anew with each.
struct BoardRig {
  explicit BoardRig(std::uint32_t start_us = 300'000) : teensy(powerUpTeensy(start_us)) {
    imuBus.begin();
    slowBus.begin();
  }

  FakeTeensy& teensy;
  PlainChip plainChip;
  FakeLis2mdl magChip{teensy.clock};
  FakeBmp390 baroChip{teensy.clock};
  I2cTarget plainPlug{teensy.lpi2c1.wire, plainChip, PlainChip::kAddress};
  I2cTarget magPlug{teensy.lpi2c3.wire, magChip, FakeLis2mdl::kAddress};
  I2cTarget baroPlug{teensy.lpi2c3.wire, baroChip, FakeBmp390::kAddress};

  I2cBus imuBus{Wire, IMXRT_LPI2C1_ADDRESS, pins::kImuBus};
  I2cBus slowBus{Wire1, IMXRT_LPI2C3_ADDRESS, pins::kSlowBus};
  MagLis2mdl mag{slowBus};
  BaroBmp390 baro{slowBus};

  [[nodiscard]] FakeI2cWire& imuWire() { return teensy.lpi2c1.wire; }
  [[nodiscard]] FakeI2cWire& slowWire() { return teensy.lpi2c3.wire; }

  void shortSda(FakeI2cWire& wire, bool shorted) {
    wire.sdaShorted = shorted;
    wire.update();
  }
  void shortScl(FakeI2cWire& wire, bool shorted) {
    wire.sclShorted = shorted;
    wire.update();
  }

  /// Reads from the plain device; its bytes are what they should be, or the reading fails.
  [[nodiscard]] bool readPlain(std::size_t count = 14) {
    std::array<std::uint8_t, 256> data{};
    if (!imuBus.read(PlainChip::kAddress, 0, data.data(), count)) return false;
    for (std::size_t i = 0; i < count; ++i) {
      if (data[i] != plainChip.registers[i]) return false;
    }
    return true;
  }

  /// us that a call takes, rounded up.
  template <class Call>
  [[nodiscard]] std::uint32_t duration(Call call) {
    const Nanos start = teensy.clock.now();
    call();
    return wholeMicros(teensy.clock.now() - start);
  }
  [[nodiscard]] static std::uint32_t wholeMicros(Nanos time) {
    return static_cast<std::uint32_t>((time + 999) / 1000);
  }

  /// What a while of flight gave, and what it cost.
  struct Flight {
    std::uint32_t mags = 0;
    std::uint32_t alts = 0;
    std::uint32_t longestMag = 0;  ///< us, of one call
    std::uint32_t longestAlt = 0;
    Nanos timeInMag = 0;  ///< of all calls
    Nanos timeInAlt = 0;
    MagRaw mag;
    AltRaw alt;
  };

  /// Asks both sensors as the loop does, which has other work for 0.3 ms between two passes.
  [[nodiscard]] Flight fly(std::uint32_t duration_ms) {
    Flight flight;
    const Nanos end = teensy.clock.now() + nanosFromMicros(1000ULL * duration_ms);
    while (teensy.clock.now() < end) {
      const Nanos start = teensy.clock.now();
      if (mag.read(flight.mag)) ++flight.mags;
      const Nanos middle = teensy.clock.now();
      if (baro.read(flight.alt)) ++flight.alts;
      const Nanos last = teensy.clock.now();
      flight.longestMag = std::max(flight.longestMag, wholeMicros(middle - start));
      flight.longestAlt = std::max(flight.longestAlt, wholeMicros(last - middle));
      flight.timeInMag += middle - start;
      flight.timeInAlt += last - middle;
      teensy.clock.advance(nanosFromMicros(300));
    }
    return flight;
  }
};

}  // namespace strix
