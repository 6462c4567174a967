/// The MTK3333 receiver: ten fixes a second over a serial port, parsed by Adafruit's library.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "RawSamples.h"

#include <Arduino.h>

#include <Adafruit_GPS.h>

namespace strix {

class GpsMtk3333 {
 public:
  explicit GpsMtk3333(HardwareSerialIMXRT& port) : port_(port), parser_(&port) {}

  /// 57600 baud, GGA, GSA and RMC at 10 Hz, each command acknowledged by the receiver. False when
  /// it does not answer; a receiver that talks later is read all the same. Bound: 0.45 s, 1.3 s
  /// when every acknowledgement is missing but the first.
  [[nodiscard]] bool begin();

  /// A whole epoch, once: published when its RMC sentence ends. Takes what the port has received,
  /// at most kCharactersACall characters and one sentence. Bound: 0.1 ms.
  [[nodiscard]] bool read(GpsRaw& out);

  /// Lines that are not a sound sentence of those three kinds.
  [[nodiscard]] std::uint32_t rejected() const { return rejected_; }

  /// True for a line that Adafruit's parser can be trusted with: RMC, GGA or GSA with all its
  /// fields and a two-digit checksum at the end. Adafruit_GPS::parse follows strchr(...) + 1
  /// without asking whether there was a comma, and the checksum lets one damaged line in 256 pass.
  [[nodiscard]] static bool isParseable(const char* line);

 private:
  static constexpr int kCharactersACall = 96;  // 16 ms of the line at 57600 baud
  static constexpr std::uint32_t kBaudAtPowerUp = 9600;
  static constexpr std::uint32_t kBaud = 57600;
  static constexpr std::uint32_t kAckTimeout = 300;  // ms

  [[nodiscard]] bool command(const char* sentence, const char* acknowledgement);
  [[nodiscard]] bool waitForLine(const char* wanted);
  [[nodiscard]] bool take(const char* line, GpsRaw& out);
  [[nodiscard]] std::uint32_t timeOfDay() const;

  HardwareSerialIMXRT& port_;
  Adafruit_GPS parser_;
  std::array<std::uint8_t, 512> received_{};  // the core's 64 bytes hold 11 ms of the line
  Micros lineStart_ = 0;
  Micros epochStart_ = 0;
  std::uint32_t ggaTime_ = 0;  // ms of the day
  bool ggaSeen_ = false;
  std::uint32_t rejected_ = 0;
};

}  // namespace strix
