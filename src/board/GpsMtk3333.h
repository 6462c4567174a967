/// The MTK3333 receiver: ten fixes a second over a serial port.
///
/// Adafruit's library talks to the module while it is set up. What the module says goes through
/// lib/Sensors/Nmea.h instead of Adafruit_GPS::parse, which follows the next comma without asking
/// whether there is one, so that a short sentence with the right checksum ends in a null pointer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "NmeaFixes.h"

#include <Arduino.h>

#include <Adafruit_GPS.h>

namespace strix {

class GpsMtk3333 {
 public:
  static constexpr Micros kPeriod = 100'000;  ///< from fix to fix, as begin() sets it

  explicit GpsMtk3333(HardwareSerialIMXRT& port) : port_(port) {}

  /// 57600 baud, GGA, GSA and RMC at 10 Hz: each command acknowledged by the receiver, then three
  /// epochs seen that are 100 ms apart. False when any of that fails; a receiver that talks later
  /// is read all the same. Bound: 1 s when it says nothing, 3.1 s when it fails at the last.
  [[nodiscard]] bool begin();

  /// A whole epoch, once. Takes what the port has received, at most kBytesACall. Bound: 0.1 ms.
  [[nodiscard]] bool read(GpsRaw& out);

  /// Silent: `bytes` stands still. Noise or a wrong speed: `bytes` grows and `sound` does not.
  [[nodiscard]] const NmeaLines::Counts& lines() const { return lines_.counts(); }
  [[nodiscard]] const NmeaFixes::Counts& fixes() const { return fixes_.counts(); }

  /// Lines that are no sound sentence.
  [[nodiscard]] std::uint32_t rejected() const {
    return lines().badChecksum + lines().broken + lines().overlong + fixes().malformed;
  }

  /// Times that the port's memory was found full, so that bytes were lost: nobody called read() for
  /// 100 ms.
  [[nodiscard]] std::uint32_t overflows() const { return overflows_; }

  /// UTC from one epoch to the next, ms: 100 if the receiver still does as it was told.
  [[nodiscard]] std::uint32_t interval() const { return fixes_.interval(); }

 private:
  static constexpr int kBytesACall = 96;  // 16 ms of the line
  static constexpr std::uint32_t kBaudAtPowerUp = 9600;
  static constexpr std::uint32_t kBaud = 57600;
  static constexpr Micros kByte = 10'000'000 / kBaud;    // us: start, eight bits, stop
  static constexpr std::uint32_t kAckTimeout = 300;      // ms: an epoch may be in front of it
  static constexpr std::uint32_t kEpochsTimeout = 1500;  // ms: one more may come at the old rate

  [[nodiscard]] bool command(Adafruit_GPS& module, const char* text, std::string_view answer);
  [[nodiscard]] bool waitForAnswer(std::string_view wanted);
  [[nodiscard]] bool waitForEpochs();

  HardwareSerialIMXRT& port_;
  // Behind the core's own 64 bytes: together 100 ms of the line, two epochs.
  std::array<std::uint8_t, 512> received_{};
  static constexpr int kCoresBytes = 63;  // it keeps one free
  NmeaLines lines_;
  NmeaFixes fixes_;
  std::uint32_t overflows_ = 0;
};

}  // namespace strix
