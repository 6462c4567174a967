/// Register access over I2C that never takes longer than it says.
#pragma once

#include <cstddef>
#include <cstdint>

#include "Pins.h"
#include "Time.h"

#include <Arduino.h>
#include <Wire.h>

namespace strix {

/// One I2C master of the i.MX RT1062 at 400 kHz, polled on its registers with a deadline in
/// processor cycles.
///
/// Wire sets up pins and clock, and serves the Adafruit drivers during set-up; in the loop it is
/// not called, because it waits up to 134 ms on a bus that is held, and takes a four-byte read from
/// a busy bus for a good one. A transfer that fails resets the master, which lets go of both lines;
/// unless the device just did not acknowledge, the lines are then clocked free, at most every 50
/// ms.
class I2cBus {
 public:
  static constexpr std::size_t kMaxWrite = 12;  ///< bytes after the register's address

  /// Counted since the start.
  struct Faults {
    std::uint32_t unacknowledged = 0;  ///< no device there, or it refused
    std::uint32_t held = 0;            ///< a line was low before we began
    std::uint32_t late = 0;            ///< deadline passed on the way: the clock was held
    std::uint32_t lost = 0;            ///< another drove the lines against us
    std::uint32_t recoveries = 0;      ///< times the lines were clocked
    std::uint32_t freed = 0;           ///< of these: times both were high afterwards
  };

  /// @param port  address of the LPI2C registers that belong to `wire`
  constexpr I2cBus(TwoWire& wire, std::uintptr_t port, pins::I2cPins pins)
      : wire_(wire), port_(port), pins_(pins) {}

  /// Sets the pins and 400 kHz. To be called again after any Adafruit driver's begin, which calls
  /// Wire.begin and so falls back to 100 kHz.
  void begin();

  /// Reads `count` registers from `reg` on. False: nothing is known about `data`.
  /// Bound: transferBound(3 + count), and kFailureBound more when it fails.
  [[nodiscard]] bool read(std::uint8_t address, std::uint8_t reg, std::uint8_t* data,
                          std::size_t count);

  /// Bound: transferBound(2 + count), and kFailureBound more when it fails.
  [[nodiscard]] bool write(std::uint8_t address, std::uint8_t reg, const std::uint8_t* data,
                           std::size_t count);

  [[nodiscard]] TwoWire& wire() { return wire_; }
  [[nodiscard]] const Faults& faults() const { return faults_; }

  /// Longest time of a transfer of so many bytes, addresses included, us: 9 bits of 2.5 us each, a
  /// quarter more for slow edges and interrupts, and the start and stop conditions.
  [[nodiscard]] static constexpr Micros transferBound(std::size_t bytes) {
    return static_cast<Micros>(bytes) * 29U + 40U;
  }
  static constexpr Micros kFailureBound = 200;  ///< us, master reset and clocking the lines free

 private:
  static constexpr Micros kRecoveryPause = 50'000;

  [[nodiscard]] bool transfer(const std::uint32_t* commands, std::size_t commandCount,
                              std::uint8_t* data, std::size_t count, Micros bound);
  bool fail(std::uint32_t& counter);
  void freeLines();
  [[nodiscard]] IMXRT_LPI2C_t& port() const { return *reinterpret_cast<IMXRT_LPI2C_t*>(port_); }

  TwoWire& wire_;
  std::uintptr_t port_;
  pins::I2cPins pins_;
  Faults faults_;
  Micros lastRecovery_ = 0;
};

/// One device on a bus. After a miss it is left alone for 1 ms, then 2, 4 ... 128 ms, so that a
/// device that died costs five tries in the first 31 ms and then less than 1 % of the time.
class I2cDevice {
 public:
  I2cDevice(I2cBus& bus, std::uint8_t address) : bus_(bus), address_(address) {}

  [[nodiscard]] bool read(std::uint8_t reg, std::uint8_t* data, std::size_t count) {
    return !resting() && noted(bus_.read(address_, reg, data, count));
  }
  [[nodiscard]] bool write(std::uint8_t reg, const std::uint8_t* data, std::size_t count) {
    return !resting() && noted(bus_.write(address_, reg, data, count));
  }
  [[nodiscard]] bool write(std::uint8_t reg, std::uint8_t value) { return write(reg, &value, 1); }

  /// True when the register can be read and has this value in the bits of `mask`.
  [[nodiscard]] bool holds(std::uint8_t reg, std::uint8_t value, std::uint8_t mask = 0xFF) {
    std::uint8_t found = 0;
    return read(reg, &found, 1) && (found & mask) == value;
  }

  [[nodiscard]] I2cBus& bus() { return bus_; }
  [[nodiscard]] std::uint8_t address() const { return address_; }
  [[nodiscard]] std::uint32_t misses() const { return misses_; }

 private:
  static constexpr Micros kFirstRest = 1000;
  static constexpr std::uint32_t kMaxDoublings = 7;

  [[nodiscard]] bool resting() const {
    return missesInARow_ != 0 && elapsed(::micros(), lastMiss_) < rest_;
  }
  bool noted(bool success);

  I2cBus& bus_;
  std::uint8_t address_;
  std::uint32_t misses_ = 0;
  std::uint32_t missesInARow_ = 0;
  Micros lastMiss_ = 0;
  Micros rest_ = 0;
};

}  // namespace strix
