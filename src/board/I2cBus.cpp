#include "I2cBus.h"

#include <array>

namespace strix {

namespace {

constexpr std::uint32_t kClock = 400'000;  // Hz
constexpr std::uint32_t kAllFlags = LPI2C_MSR_DMF | LPI2C_MSR_PLTF | LPI2C_MSR_FEF | LPI2C_MSR_ALF |
                                    LPI2C_MSR_NDF | LPI2C_MSR_SDF | LPI2C_MSR_EPF;
constexpr std::uint32_t kFifoDepth = 4;  // words, each way

constexpr std::uint32_t startWrite(std::uint8_t address) {
  return LPI2C_MTDR_CMD_START | (static_cast<std::uint32_t>(address) << 1U);
}
constexpr std::uint32_t startRead(std::uint8_t address) { return startWrite(address) | 1U; }

}  // namespace

void I2cBus::begin() {
  wire_.begin();
  wire_.setClock(kClock);
}

bool I2cBus::read(std::uint8_t address, std::uint8_t reg, std::uint8_t* data, std::size_t count) {
  if (count == 0 || count > 256) return false;
  const std::array<std::uint32_t, 5> commands{
      startWrite(address), LPI2C_MTDR_CMD_TRANSMIT | reg, startRead(address),
      LPI2C_MTDR_CMD_RECEIVE | static_cast<std::uint32_t>(count - 1), LPI2C_MTDR_CMD_STOP};
  return transfer(commands.data(), commands.size(), data, count, transferBound(3 + count));
}

bool I2cBus::write(std::uint8_t address, std::uint8_t reg, const std::uint8_t* data,
                   std::size_t count) {
  if (count > kMaxWrite) return false;
  std::array<std::uint32_t, kMaxWrite + 3> commands{startWrite(address),
                                                    LPI2C_MTDR_CMD_TRANSMIT | reg};
  std::size_t used = 2;
  for (std::size_t i = 0; i < count; ++i) commands[used++] = LPI2C_MTDR_CMD_TRANSMIT | data[i];
  commands[used++] = LPI2C_MTDR_CMD_STOP;
  return transfer(commands.data(), used, nullptr, 0, transferBound(2 + count));
}

/// Feeds the command FIFO and empties the data FIFO until the stop condition is on the lines.
/// The master stretches the clock when we are late for either, so an interrupt does no harm.
bool I2cBus::transfer(const std::uint32_t* commands, std::size_t commandCount, std::uint8_t* data,
                      std::size_t count, Micros bound) {
  IMXRT_LPI2C_t& master = port();
  const std::uint32_t start = ARM_DWT_CYCCNT;
  const std::uint32_t limit = bound * (F_CPU_ACTUAL / 1'000'000U);
  const auto late = [start, limit] { return ARM_DWT_CYCCNT - start > limit; };

  while ((master.MSR & LPI2C_MSR_BBF) != 0) {  // 1 us after the last stop; for ever on a held bus
    if (late()) return fail(faults_.held);
  }
  master.MSR = kAllFlags;  // written with ones to clear
  std::size_t sent = 0;
  std::size_t received = 0;
  while (true) {
    const std::uint32_t status = master.MSR;
    if ((status & LPI2C_MSR_NDF) != 0) return fail(faults_.unacknowledged);
    if ((status & (LPI2C_MSR_ALF | LPI2C_MSR_FEF | LPI2C_MSR_PLTF)) != 0) return fail(faults_.lost);
    while (sent < commandCount && (master.MFSR & 7U) < kFifoDepth) {
      master.MTDR = commands[sent++];
    }
    while (received < count && ((master.MFSR >> 16U) & 7U) != 0) {
      data[received++] = static_cast<std::uint8_t>(master.MRDR & 0xFFU);
    }
    if (sent == commandCount && received == count && (status & LPI2C_MSR_SDF) != 0) return true;
    if (late()) return fail(faults_.late);
  }
}

bool I2cBus::fail(std::uint32_t& counter) {
  ++counter;
  port().MCR = LPI2C_MCR_RST;  // empties the FIFOs, lets go of the lines
  wire_.setClock(kClock);      // ends the reset and sets the timing again
  const Micros now = ::micros();
  if (&counter != &faults_.unacknowledged && elapsed(now, lastRecovery_) >= kRecoveryPause) {
    lastRecovery_ = now;
    freeLines();
  }
  return false;
}

/// A device that was interrupted while it sends a zero waits for clocks with SDA low. Nine are
/// enough for it to see our missing acknowledge; a stop condition ends it. At most 130 us.
void I2cBus::freeLines() {
  const auto release = [](std::uint8_t pin) {
    pinMode(pin, INPUT_PULLUP);
    delayMicroseconds(5);
  };
  const auto pullLow = [](std::uint8_t pin) {
    pinMode(pin, OUTPUT_OPENDRAIN);
    digitalWrite(pin, LOW);
    delayMicroseconds(5);
  };
  ++faults_.recoveries;
  release(pins_.sda);
  release(pins_.scl);
  for (int i = 0; i < 9 && digitalRead(pins_.sda) == LOW; ++i) {
    pullLow(pins_.scl);
    release(pins_.scl);
  }
  pullLow(pins_.sda);
  release(pins_.sda);
  if (digitalRead(pins_.sda) != LOW && digitalRead(pins_.scl) != LOW) ++faults_.freed;
  begin();
}

bool I2cDevice::noted(bool success) {
  if (success) {
    missesInARow_ = 0;
    return true;
  }
  ++misses_;
  rest_ = kFirstRest << (missesInARow_ < kMaxDoublings ? missesInARow_ : kMaxDoublings);
  ++missesInARow_;
  lastMiss_ = ::micros();
  return false;
}

}  // namespace strix
