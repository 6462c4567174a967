/// Stands in for the Teensy 4 core's Wire library on the two masters, with its waiting: 17 ms for
/// a bus that is not idle, ended by nine clocks of its own; 50 ms in each phase of a transfer; four
/// bytes reported from a bus that stayed busy. src/board uses it in set-up alone, and the worst
/// case stated there is measured against these. Written from the Arduino reference of Wire, the
/// i.MX RT1060 manual, and those figures, which were read off the core's source (version 1.0).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "Arduino.h"

class TwoWire {
 public:
  TwoWire(IMXRT_LPI2C_t& registers, strix::FakeRegister::Port port)
      : registers_(registers), port_(port) {}

  void begin() {
    registers_.MCR = LPI2C_MCR_RST;
    setClock(100'000);
    route(true);
  }

  /// The period in cycles of the master's 24 MHz, halved above 100 kHz' prescaler, less what the
  /// manual adds to each: a cycle to each half, and the filter's delay to the upper one.
  void setClock(std::uint32_t frequency) {
    const bool fast = frequency >= 400'000;
    const std::uint32_t prescale = fast ? 0 : 1;
    const std::uint32_t filter = fast ? 2 : 5;
    const std::uint32_t period = (24'000'000U >> prescale) / frequency;
    const std::uint32_t low = period / 2 - 1;
    const std::uint32_t high = period - period / 2 - 1 - ((2 + filter) >> prescale);
    registers_.MCR = 0;
    registers_.MCCR0 = low | high << 8U | (low * 5 / 8) << 16U;
    registers_.MCFGR1 = prescale;
    registers_.MCFGR2 = (fast ? 3600U : 3000U) | filter << 16U;  // idle after 150 or 250 us
    registers_.MCFGR3 = (15'000U * (24U >> prescale) / 256U + 1U) << 8U;  // 15 ms of a low clock
    registers_.MCR = LPI2C_MCR_MEN;
  }

  void beginTransmission(std::uint8_t address) {
    sent_[0] = static_cast<std::uint8_t>(address << 1U);
    toSend_ = 1;
  }
  std::size_t write(std::uint8_t byte) {
    if (toSend_ == sent_.size()) return 0;
    sent_[toSend_++] = byte;
    return 1;
  }

  /// 0 when every byte was acknowledged.
  std::uint8_t endTransmission(bool sendStop = true) {
    constexpr std::uint8_t kOther = 4;
    if (!waitIdle()) return kOther;
    const std::size_t all = toSend_ + (sendStop ? 1 : 0);
    std::size_t next = 0;
    const std::uint32_t start = millis();
    while (true) {
      while (next < all && (registers_.MFSR & 7U) < strix::FakeLpi2c::kFifoDepth) {
        registers_.MTDR = transmitCommand(next++);
      }
      const std::uint32_t status = registers_.MSR;
      if ((status & LPI2C_MSR_ALF) != 0) return giveUp(false), kOther;
      if ((status & LPI2C_MSR_FEF) != 0) return giveUp(false), std::uint8_t{5};
      if ((status & LPI2C_MSR_NDF) != 0) return giveUp(true), std::uint8_t{2};
      if ((status & LPI2C_MSR_PLTF) != 0 || millis() - start > kPhase) return giveUp(true), kOther;
      const bool ended = !sendStop || (status & LPI2C_MSR_SDF) != 0;
      if (next == all && (registers_.MFSR & 7U) == 0 && ended) return 0;
    }
  }

  /// The number of bytes received; 4, too, when the bus stayed busy.
  std::uint8_t requestFrom(std::uint8_t address, std::uint8_t count) {
    if (!waitIdle()) return 4;
    received_ = read_ = 0;
    registers_.MTDR = LPI2C_MTDR_CMD_START | 1U | static_cast<std::uint32_t>(address) << 1U;
    registers_.MTDR = LPI2C_MTDR_CMD_RECEIVE | (count - 1U);
    registers_.MTDR = LPI2C_MTDR_CMD_STOP;
    const std::uint32_t start = millis();
    while (true) {
      while ((registers_.MFSR >> 16U & 7U) != 0 && received_ < bytes_.size()) {
        bytes_[received_++] = static_cast<std::uint8_t>(registers_.MRDR & 0xFFU);
      }
      const std::uint32_t status = registers_.MSR;
      if ((status & LPI2C_MSR_ALF) != 0) return giveUp(false), received_;
      if ((status & (LPI2C_MSR_NDF | LPI2C_MSR_PLTF)) != 0 || millis() - start > kPhase) {
        return giveUp(true), received_;
      }
      if (received_ >= count && (status & LPI2C_MSR_SDF) != 0) return received_;
    }
  }
  int read() { return read_ < received_ ? bytes_[read_++] : -1; }

 private:
  static constexpr std::uint32_t kPhase = 50;  // ms
  static constexpr std::uint32_t kIdle = 16;   // ms

  [[nodiscard]] strix::FakeI2cPort& port() const { return strix::fakeTeensy().*port_; }

  void route(bool toMaster) {
    strix::fakeTeensy().setGpio(port().sdaPin, !toMaster);
    strix::fakeTeensy().setGpio(port().sclPin, !toMaster);
  }

  [[nodiscard]] std::uint32_t transmitCommand(std::size_t index) const {
    if (index == 0) return LPI2C_MTDR_CMD_START | sent_[0];
    if (index < toSend_) return LPI2C_MTDR_CMD_TRANSMIT | sent_[index];
    return LPI2C_MTDR_CMD_STOP;
  }

  void giveUp(bool withStop) {
    registers_.MCR |= LPI2C_MCR_RTF | LPI2C_MCR_RRF;
    if (withStop) registers_.MTDR = LPI2C_MTDR_CMD_STOP;
  }

  bool waitIdle() {
    const std::uint32_t start = millis();
    while (true) {
      const std::uint32_t status = registers_.MSR;
      if ((status & LPI2C_MSR_BBF) == 0 || (status & LPI2C_MSR_MBF) != 0) break;
      if (millis() - start > kIdle) {
        if (forceClock()) break;
        return false;
      }
    }
    registers_.MSR = 0x7F00U;
    return true;
  }

  bool forceClock() {
    const auto sda = static_cast<std::uint8_t>(port().sdaPin);
    const auto scl = static_cast<std::uint8_t>(port().sclPin);
    digitalWrite(scl, HIGH);
    pinMode(sda, INPUT);
    pinMode(scl, OUTPUT_OPENDRAIN);
    delayMicroseconds(10);
    bool free = false;
    for (int i = 0; i < 9 && !free; ++i) {
      free = digitalRead(sda) == HIGH && digitalRead(scl) == HIGH;
      if (free) break;
      digitalWrite(scl, LOW);
      delayMicroseconds(5);
      digitalWrite(scl, HIGH);
      delayMicroseconds(5);
    }
    route(true);
    return free;
  }

  IMXRT_LPI2C_t& registers_;
  strix::FakeRegister::Port port_;
  std::array<std::uint8_t, 137> sent_{};
  std::size_t toSend_ = 0;
  std::array<std::uint8_t, 136> bytes_{};
  std::uint8_t received_ = 0;
  std::uint8_t read_ = 0;
};

inline TwoWire Wire{lpi2c1Registers, &strix::FakeTeensy::lpi2c1};
inline TwoWire Wire1{lpi2c3Registers, &strix::FakeTeensy::lpi2c3};
