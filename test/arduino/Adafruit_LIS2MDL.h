/// Stands in for Adafruit's LIS2MDL library (2.1.x), which CI does not have: begin() alone, the one
/// call that MagLis2mdl makes, with the same transfers through Wire in the same order and the same
/// two waits of 100 ms, because set-up's worst case is made of them. Written from ST's datasheet
/// (LIS2MDL, registers) and from watching what the library puts on the bus; none of its code.
#pragma once

#include <cstdint>

#include "Wire.h"

enum lis2mdl_register_t : std::uint8_t {
  LIS2MDL_WHO_AM_I = 0x4F,
  LIS2MDL_CFG_REG_A = 0x60,
  LIS2MDL_CFG_REG_C = 0x62,
  LIS2MDL_STATUS_REG = 0x67,
};

class Adafruit_LIS2MDL {
 public:
  bool begin(std::uint8_t address, TwoWire* wire) {
    address_ = address;
    wire_ = wire;
    wire_->begin();
    wire_->beginTransmission(address_);
    if (wire_->endTransmission() != 0 || read(LIS2MDL_WHO_AM_I) != 0x40) return false;
    change(LIS2MDL_CFG_REG_A, 0x20, 0x20);  // soft reset
    delay(100);
    change(LIS2MDL_CFG_REG_A, 0x40, 0x40);  // reboot
    delay(100);
    change(LIS2MDL_CFG_REG_C, 0x10, 0x10);  // block data update
    change(LIS2MDL_CFG_REG_A, 0x80, 0x80);  // temperature compensation
    change(LIS2MDL_CFG_REG_A, 0x03, 0x00);  // continuous
    change(LIS2MDL_CFG_REG_A, 0x0C, 0x0C);  // 100 Hz
    return true;
  }

 private:
  /// A register that cannot be read is taken for all ones, and the changed value written.
  [[nodiscard]] std::uint8_t read(std::uint8_t reg) {
    wire_->beginTransmission(address_);
    wire_->write(reg);
    if (wire_->endTransmission(false) != 0) return 0xFF;
    if (wire_->requestFrom(address_, 1) != 1) return 0xFF;
    return static_cast<std::uint8_t>(wire_->read());
  }

  void change(std::uint8_t reg, std::uint8_t mask, std::uint8_t bits) {
    const auto value = static_cast<std::uint8_t>((read(reg) & ~mask) | bits);
    wire_->beginTransmission(address_);
    wire_->write(reg);
    wire_->write(value);
    (void)wire_->endTransmission();
  }

  std::uint8_t address_ = 0;
  TwoWire* wire_ = nullptr;
};
