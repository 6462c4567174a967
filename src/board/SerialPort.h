/// Serial ports that never wait, as telemetry and console want them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <Arduino.h>

namespace strix {

/// A UART of the Teensy. Each call's bound: 0.1 us a byte.
class SerialPort {
 public:
  explicit SerialPort(HardwareSerialIMXRT& port) : port_(port) {}

  void begin(std::uint32_t baud) {
    port_.addMemoryForRead(received_.data(), received_.size());
    port_.addMemoryForWrite(sent_.data(), sent_.size());
    port_.begin(baud, SERIAL_8N1);
  }

  std::size_t read(std::uint8_t* out, std::size_t most) {
    const auto waiting = static_cast<std::size_t>(std::max(port_.available(), 0));
    const std::size_t count = std::min(most, waiting);
    for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<std::uint8_t>(port_.read());
    return count;
  }

  [[nodiscard]] std::size_t room() {
    return static_cast<std::size_t>(std::max(port_.availableForWrite(), 0));
  }

  /// What there is no room for is dropped, and counted.
  void write(const std::uint8_t* data, std::size_t size) {
    const std::size_t count = std::min(size, room());
    for (std::size_t i = 0; i < count; ++i) port_.write(data[i]);
    dropped_ += static_cast<std::uint32_t>(size - count);
  }

  [[nodiscard]] std::uint32_t dropped() const { return dropped_; }

 private:
  HardwareSerialIMXRT& port_;
  // Two of MAVLink's longest messages (280 bytes) each way, beside the core's 63 and 39.
  std::array<std::uint8_t, 512> received_{};
  std::array<std::uint8_t, 640> sent_{};
  std::uint32_t dropped_ = 0;
};

/// The USB's serial line. Without a terminal everything goes, to nowhere: a person who opens one
/// wants news, and the core keeps 8 KB of old words, then waits up to 120 ms for somebody to take
/// them.
class UsbPort {
 public:
  static constexpr std::size_t kNowhere = 1024;  ///< room without a terminal

  /// Bound: 0.2 us a byte.
  std::size_t read(std::uint8_t* out, std::size_t most) {
    std::size_t count = 0;
    while (count < most) {
      const int byte = Serial.read();
      if (byte < 0) break;
      out[count++] = static_cast<std::uint8_t>(byte);
    }
    return count;
  }

  [[nodiscard]] std::size_t room() {
    if (!Serial) return kNowhere;
    return static_cast<std::size_t>(std::max(Serial.availableForWrite(), 0));
  }

  /// Bound: 5 us and a copy.
  void write(const std::uint8_t* data, std::size_t size) {
    if (!Serial) return;
    const std::size_t count = std::min(size, room());
    if (count != 0) Serial.write(data, count);
    dropped_ += static_cast<std::uint32_t>(size - count);
  }

  [[nodiscard]] std::uint32_t dropped() const { return dropped_; }

 private:
  std::uint32_t dropped_ = 0;
};

}  // namespace strix
