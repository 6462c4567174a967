/// Stands in for the Teensy 4 core's HardwareSerial.h: one serial port, as far as GpsMtk3333 uses
/// it, with a receiver at its other end (test/fakes/NmeaTalker.h). The core is not in CI.
///
/// Times on the wire are those of 8N1. The receive memory is 64 bytes and what the sketch adds, of
/// which one stays free; what comes when it is full is lost. The transmit memory is 40 bytes;
/// write() waits when it is full (cores/teensy4, HardwareSerial.cpp and HardwareSerial2.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

#include "FakeTeensy.h"
#include "NmeaTalker.h"

class HardwareSerialIMXRT {
 public:
  explicit HardwareSerialIMXRT(strix::NmeaTalker& peer) : peer_(peer) {}

  // Read by the test.
  std::uint32_t taken = 0;  ///< bytes that the sketch has read
  std::uint32_t lost = 0;   ///< bytes that found the memory full

  void begin(std::uint32_t baud) {
    receive();
    baud_ = baud;
    received_.clear();
  }
  void addMemoryForRead(void* /*buffer*/, std::size_t length) { room_ = 63 + length; }

  int available() {
    clock().advance(2 * strix::FakeClock::kRegister);
    receive();
    return static_cast<int>(received_.size());
  }
  int read() {
    clock().advance(strix::FakeClock::kRegister);
    receive();
    if (received_.empty()) return -1;
    const int byte = received_.front();
    received_.pop_front();
    ++taken;
    return byte;
  }
  void print(const char* text) {
    for (; *text != '\0'; ++text) write(*text);
  }
  void println(const char* text) {
    print(text);
    print("\r\n");
  }
  void flush() {
    if (sent_ > clock().now()) clock().advance(sent_ - clock().now());
  }

 private:
  static strix::FakeClock& clock() { return strix::fakeTeensy().clock; }
  static std::uint64_t micros() { return clock().now() / 1000U; }

  void write(char c) {
    const std::uint64_t byte = 10'000'000'000U / baud_;  // ns
    if (sent_ > clock().now() + 40 * byte) clock().advance(sent_ - clock().now() - 40 * byte);
    sent_ = (sent_ > clock().now() ? sent_ : clock().now()) + byte;
    clock().at(sent_, [this, c, baud = baud_] {
      peer_.run(micros());
      peer_.hear(c, baud, micros());
    });
  }

  void receive() {
    peer_.run(micros());
    while (!peer_.line.empty() && peer_.line.front().arrives <= micros()) {
      const strix::NmeaTalker::Byte byte = peer_.line.front();
      peer_.line.pop_front();
      if (received_.size() == room_) {
        ++lost;
        continue;
      }
      // Sampled at the wrong times: anything, but never what was sent.
      const auto noise = static_cast<std::uint8_t>(byte.value * 37U + 0x81U);
      received_.push_back(byte.baud == baud_ ? byte.value : noise);
    }
  }

  strix::NmeaTalker& peer_;
  std::deque<std::uint8_t> received_;
  std::size_t room_ = 63;
  std::uint32_t baud_ = 300;  // not begun: a speed that nobody listens at
  std::uint64_t sent_ = 0;    ///< ns, when the last byte will have left
};
