/// A Board for tests: clock, devices, switches and card do what the test says.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "Board.h"
#include "FakeCard.h"
#include "Mathpk.h"

namespace strix {

/// One sensor. It measures every `period` and keeps the newest reading until that is taken.
template <class Raw>
class FakeDevice {
 public:
  explicit FakeDevice(Micros measuringPeriod) : period(measuringPeriod) {}

  // Set by the test.
  Micros period;      ///< us
  Micros offset = 0;  ///< us after the start of the board, of the first measurement
  bool dead = false;  ///< nothing comes out
  Raw reading;        ///< what it measures; the time stamp is the device's own

  // Read by the test.
  std::uint32_t asked = 0;
  std::uint32_t taken = 0;

  /// @param time  us since the board's start    @param start  the clock at the board's start
  bool read(std::uint64_t time, Micros start, Raw& out) {
    ++asked;
    if (dead || time < offset) return false;
    const std::uint64_t count = (time - offset) / period + 1;  // measurements so far
    if (count == newestTaken_) return false;
    newestTaken_ = count;
    ++taken;
    out = reading;
    out.sampled = start + static_cast<Micros>(offset + (count - 1) * period);
    return true;
  }

 private:
  std::uint64_t newestTaken_ = 0;
};

template <class CardType>
class BasicFakeBoard {
 public:
  using Card = CardType;
  static constexpr const char* kName = "fake";

  struct EscWrite {
    std::uint64_t time;  ///< us since the board's start
    EscCommands commands;
  };

  // Set by the test.
  FakeDevice<ImuRaw> imu{889};  ///< 1125 Hz, as the ICM20649 has it
  FakeDevice<MagRaw> mag{10'000};
  FakeDevice<AltRaw> alt{20'000};
  FakeDevice<GpsRaw> gps{100'000};
  bool gpsRepeats = false;                        ///< one fix, over and over
  SensorSet found{true, true, true, true, true};  ///< what begin() reports
  PilotSwitches pilot;
  std::vector<RadioChannels> radio;  ///< frames to come, one a reading
  ResetStatus reset;
  std::array<std::uint8_t, 4284> storage = erased();
  FakeDevice<BatteryRaw> battery{100'000};
  FakeDevice<EscRaw> escs{200'000};
  const char* mission = "";  ///< mission.txt on the card
  SensorFaultCounts faults;  ///< of its devices
  Card sd;
  Vector3f gyroBias{0.01F, -0.02F, 0.015F};     ///< rad/s; used by hold()
  Vector3f fieldNed{15.6F, 1.1F, 48.0F};        ///< uT, southern Sweden; used by hold()
  Matrix3f magMounting = Matrix3f::Identity();  ///< body to sensor axes; used by hold()

  // Read by the test.
  std::uint32_t clockReads = 0;
  std::vector<EscWrite> escWrites;
  std::uint32_t watchdogFed = 0;
  bool motorsRemembered = false;
  RadioProtocol radioProtocol = RadioProtocol::None;

  /// @param start  what micros() returns first
  explicit BasicFakeBoard(Micros start = 0) : start_(start) {
    escWrites.reserve(20'000);  // 40 s: no allocation while the flight code runs
    hold(Quaternion{});
    alt.reading.pressure = 100'800.0F;
    alt.reading.temperature = 25.0F;
    gps.reading.latitude = 574'200'000;  // deg 1e-7
    gps.reading.longitude = 119'700'000;
    gps.reading.altitude = 40'000;  // mm
    gps.reading.hdop = 0.9F;
    gps.reading.fix = 3;
    gps.reading.satellites = 11;
    battery.dead = true;  // as on a board that cannot measure it
    escs.dead = true;
  }

  /// Readings of an aircraft that stays where it is, with this attitude and rate.
  /// @param rate  rad/s, body
  void hold(const Quaternion& attitude, const Vector3f& rate = Vector3f::Zero()) {
    imu.reading.accel = rotateToBody(attitude, {0.0F, 0.0F, -kGravity});
    imu.reading.gyro = gyroBias + rate;
    mag.reading.field = magMounting * rotateToBody(attitude, fieldNed);
  }

  void advance(Micros step) {
    time_ += step;
    setCardClock(sd);
  }

  /// us since the board's start
  [[nodiscard]] std::uint64_t time() const { return time_; }
  /// What micros() returns, not counted.
  [[nodiscard]] Micros now() const { return start_ + static_cast<Micros>(time_); }
  [[nodiscard]] const EscCommands& esc() const { return escWrites.back().commands; }

  // What a Board offers (Board.h).
  [[nodiscard]] std::uint32_t bootId() const { return 7; }
  [[nodiscard]] Micros micros() {
    ++clockReads;
    return now();
  }
  [[nodiscard]] SensorSet begin() const { return found; }
  [[nodiscard]] bool readImu(ImuRaw& out) { return imu.read(time_, start_, out); }
  [[nodiscard]] bool readMag(MagRaw& out) { return mag.read(time_, start_, out); }
  [[nodiscard]] bool readAlt(AltRaw& out) { return alt.read(time_, start_, out); }
  /// A receiver's height is never still: 1 mm up, 1 mm down.
  [[nodiscard]] bool readGps(GpsRaw& out) {
    if (!gps.read(time_, start_, out)) return false;
    gpsUp_ = !gpsUp_;
    if (gpsUp_ && !gpsRepeats) ++out.altitude;
    return true;
  }
  [[nodiscard]] bool readBattery(BatteryRaw& out) { return battery.read(time_, start_, out); }
  [[nodiscard]] bool readEscStatus(EscRaw& out) { return escs.read(time_, start_, out); }
  void beginRadio(RadioProtocol protocol) { radioProtocol = protocol; }
  [[nodiscard]] bool readRadio(RadioChannels& out) {
    if (radio.empty()) return false;
    out = radio.front();
    radio.erase(radio.begin());
    return true;
  }
  void feedWatchdog() { ++watchdogFed; }
  [[nodiscard]] ResetStatus resetStatus() const { return reset; }
  void rememberMotors(bool on) { motorsRemembered = on; }
  static constexpr std::size_t kStorageBytes = 4284;
  void readStorage(std::size_t offset, std::uint8_t* data, std::size_t size) const {
    std::copy_n(&storage[offset], size, data);
  }
  bool writeStorage(std::size_t offset, const std::uint8_t* data, std::size_t size) {
    std::copy_n(data, size, &storage[offset]);
    return true;
  }
  [[nodiscard]] std::string_view missionText() const { return mission; }
  void countFaults(SensorFaultCounts& out) const { out = faults; }
  [[nodiscard]] PilotSwitches readPilot() const { return pilot; }
  void writeEsc(const EscCommands& commands) { escWrites.push_back({time_, commands}); }
  [[nodiscard]] Card& card() { return sd; }

 private:
  [[nodiscard]] static std::array<std::uint8_t, 4284> erased() {
    std::array<std::uint8_t, 4284> bytes;
    bytes.fill(0xFF);
    return bytes;
  }

  void setCardClock(FakeCard& card) const { card.now = time_; }
  template <class Other>
  void setCardClock(Other& /*card*/) const {}

  Micros start_;
  std::uint64_t time_ = 0;
  bool gpsUp_ = false;
};

using FakeBoard = BasicFakeBoard<FakeCard>;

}  // namespace strix
