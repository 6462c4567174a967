/// A radio receiver at a serial port.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "Board.h"
#include "Crsf.h"
#include "Ibus.h"
#include "Sbus.h"

#include <Arduino.h>

namespace strix {

/// One of lib/Radio's protocols, chosen at the start.
class RadioReceiver {
 public:
  explicit RadioReceiver(HardwareSerialIMXRT& port) : port_(port) {}

  void begin(RadioProtocol protocol) {
    protocol_ = protocol;
    if (protocol == RadioProtocol::None) return;
    port_.addMemoryForRead(received_.data(), received_.size());
    switch (protocol) {
      case RadioProtocol::Sbus:  // inverted by the port: no transistor
        port_.begin(100'000, SERIAL_8E2_RXINV);
        break;
      case RadioProtocol::Crsf:
        port_.begin(420'000, SERIAL_8N1);
        break;
      default:
        port_.begin(115'200, SERIAL_8N1);
        break;
    }
    asked_ = ::micros();
  }

  /// True with the newest frame, once; a receiver's failsafe is never passed over. Takes at most
  /// kBytesACall of what has come. Bound: 30 us.
  [[nodiscard]] bool read(RadioChannels& out) {
    if (protocol_ == RadioProtocol::None) return false;
    const int waiting = port_.available();
    watchLine(waiting);
    if (waiting >= kMemory) ++overflows_;
    const int count = waiting < kBytesACall ? waiting : kBytesACall;
    bool heard = false;
    for (int i = 0; i < count && !(heard && out.failsafe); ++i) {
      heard = add(static_cast<std::uint8_t>(port_.read()), out) || heard;
    }
    return heard;
  }

  /// Times that the port's memory was found full, so that bytes were lost.
  [[nodiscard]] std::uint32_t overflows() const { return overflows_; }

 private:
  /// Asked each 2 ms, more than any receiver sends: the channels of CRSF are 26 bytes, 500 times a
  /// second. So a loop that was late catches up.
  static constexpr int kBytesACall = 48;
  static constexpr int kCoresBytes = 63;  // of 64 it keeps one free
  static constexpr Micros kQuiet = 500;   // us: four bytes of SBUS, whose frames have no gaps

  /// Asked each 2 ms, nobody can tell from the times of two calls whether SBUS paused between two
  /// bytes (4 ms) or not. But a call that finds nothing can: nothing has come since the one before.
  void watchLine(int waiting) {
    const Micros now = ::micros();
    if (waiting == 0 && elapsed(now, asked_) >= kQuiet) lineTime_ += Sbus::kPause;
    asked_ = now;
  }

  [[nodiscard]] bool add(std::uint8_t byte, RadioChannels& out) {
    switch (protocol_) {
      case RadioProtocol::Ibus:
        return ibus_.add(byte, out);
      case RadioProtocol::Sbus:
        return sbus_.add(byte, lineTime_, out);
      case RadioProtocol::Crsf:
        return crsf_.add(byte, out);
      default:
        return false;
    }
  }

  HardwareSerialIMXRT& port_;
  RadioProtocol protocol_ = RadioProtocol::None;
  std::array<std::uint8_t, 448> received_{};  // with the core's 12 ms of CRSF
  static constexpr int kMemory = 448 + kCoresBytes;
  Ibus ibus_;
  Sbus sbus_;
  Crsf crsf_;
  Micros asked_ = 0;
  Micros lineTime_ = 0;  ///< stands still while bytes come
  std::uint32_t overflows_ = 0;
};

}  // namespace strix
