/// Stands in for the Teensy 4 core's HardwareSerial.h: one serial port. At its other end is a GPS
/// receiver (test/fakes/NmeaTalker.h), or what the test puts on the line. The core is not in CI.
///
/// Times on the wire are those of 8N1. The receive memory is 64 bytes and what the sketch adds, of
/// which one stays free; what comes when it is full is lost. The transmit memory is 40 bytes and
/// what the sketch adds; write() waits when it is full (cores/teensy4, HardwareSerial.cpp and
/// HardwareSerial2.cpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "FakeTeensy.h"
#include "NmeaTalker.h"

// NOLINTBEGIN(cppcoreguidelines-macro-usage): numbers of the core
#define SERIAL_8N1 0x00
#define SERIAL_8E2_RXINV 0x116
// NOLINTEND(cppcoreguidelines-macro-usage)

class HardwareSerialIMXRT {
 public:
  HardwareSerialIMXRT() = default;
  explicit HardwareSerialIMXRT(strix::NmeaTalker& peer) : peer_(&peer) {}

  // Set by the test that has no peer.
  std::deque<strix::NmeaTalker::Byte> line;  ///< on its way to the port
  int lineFormat = SERIAL_8N1;
  std::vector<std::uint8_t> sent;  ///< what has left the port

  // Read by the test.
  std::uint32_t taken = 0;  ///< bytes that the sketch has read
  std::uint32_t lost = 0;   ///< bytes that found the memory full

  void begin(std::uint32_t baud, int format = SERIAL_8N1) {
    receive();
    baud_ = baud;
    format_ = format;
    received_.clear();
  }
  void addMemoryForRead(void* /*buffer*/, std::size_t length) { room_ = 63 + length; }
  void addMemoryForWrite(void* /*buffer*/, std::size_t length) { outRoom_ = 39 + length; }
  int availableForWrite() {
    return static_cast<int>(outRoom_ > waiting() ? outRoom_ - waiting() : 0);
  }
  std::size_t write(std::uint8_t byte) {
    send(byte);
    return 1;
  }

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
    for (; *text != '\0'; ++text) send(static_cast<std::uint8_t>(*text));
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

  [[nodiscard]] std::uint64_t byteTime() const { return 10'000'000'000U / baud_; }  // ns
  /// Bytes in the transmit memory.
  [[nodiscard]] std::size_t waiting() const {
    const std::uint64_t now = clock().now();
    return sent_ > now ? static_cast<std::size_t>((sent_ - now + byteTime() - 1) / byteTime()) : 0;
  }

  void send(std::uint8_t byte) {
    const std::uint64_t full = (outRoom_ + 1) * byteTime();
    if (sent_ > clock().now() + full) clock().advance(sent_ - clock().now() - full);
    sent_ = (sent_ > clock().now() ? sent_ : clock().now()) + byteTime();
    clock().at(sent_, [this, byte, baud = baud_] {
      if (peer_ == nullptr) {
        sent.push_back(byte);
        return;
      }
      peer_->run(micros());
      peer_->hear(static_cast<char>(byte), baud, micros());
    });
  }

  void receive() {
    if (peer_ != nullptr) peer_->run(micros());
    std::deque<strix::NmeaTalker::Byte>& coming = peer_ != nullptr ? peer_->line : line;
    while (!coming.empty() && coming.front().arrives <= micros()) {
      const strix::NmeaTalker::Byte byte = coming.front();
      coming.pop_front();
      if (received_.size() == room_) {
        ++lost;
        continue;
      }
      // Sampled at the wrong times: anything, but never what was sent.
      const auto noise = static_cast<std::uint8_t>(byte.value * 37U + 0x81U);
      received_.push_back(byte.baud == baud_ && format_ == lineFormat ? byte.value : noise);
    }
  }

  strix::NmeaTalker* peer_ = nullptr;
  int format_ = SERIAL_8N1;
  std::size_t outRoom_ = 39;
  std::deque<std::uint8_t> received_;
  std::size_t room_ = 63;
  std::uint32_t baud_ = 300;  // not begun: a speed that nobody listens at
  std::uint64_t sent_ = 0;    ///< ns, when the last byte will have left
};
