/// A Board fed from outside: the simulator puts readings and switches in and takes commands out.
#pragma once

#include <Board.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "FileCard.h"

namespace strix {

/// @tparam LogCard  the log's block device, made from the path of its file
template <class LogCard = FileCard>
class SimulatedBoard {
 public:
  using Card = LogCard;
  static constexpr const char* kName = "simulator";

  SimulatedBoard(const std::string& logPath, std::uint32_t bootId)
      : card_(logPath), bootId_(bootId) {}

  // What a Board offers (Board.h).
  [[nodiscard]] std::uint32_t bootId() const { return bootId_; }
  [[nodiscard]] Micros micros() const { return now_; }
  [[nodiscard]] SensorSet begin() {
    SensorSet found = devices_;
    found.card = found.card && card_.open();
    return found;
  }
  [[nodiscard]] bool readImu(ImuRaw& out) { return take(imu_, out); }
  [[nodiscard]] bool readMag(MagRaw& out) { return take(mag_, out); }
  [[nodiscard]] bool readAlt(AltRaw& out) { return take(alt_, out); }
  [[nodiscard]] bool readGps(GpsRaw& out) { return take(gps_, out); }
  [[nodiscard]] bool readBattery(BatteryRaw& out) { return take(battery_, out); }
  [[nodiscard]] bool readEscStatus(EscRaw& out) { return take(escs_, out); }
  /// The simulator's mission comes with the configuration, a replay's from the log.
  [[nodiscard]] static std::string_view missionText() { return {}; }
  void countFaults(SensorFaultCounts& /*out*/) const {}  // nothing is in the way here
  [[nodiscard]] PilotSwitches readPilot() const { return pilot_; }
  void beginRadio(RadioProtocol /*protocol*/) {}  // frames come ready-made
  [[nodiscard]] bool readRadio(RadioChannels& out) { return take(radio_, out); }
  void feedWatchdog() { fed_ = now_; }
  [[nodiscard]] ResetStatus resetStatus() const { return reset_; }
  void rememberMotors(bool on) { motorsOn_ = on; }
  static constexpr std::size_t kStorageBytes = 4284;  // as a Teensy 4.1 has
  void readStorage(std::size_t offset, std::uint8_t* data, std::size_t size) const {
    std::copy_n(&storage_[offset], size, data);
  }
  bool writeStorage(std::size_t offset, const std::uint8_t* data, std::size_t size) {
    std::copy_n(data, size, &storage_[offset]);
    return true;
  }
  void writeEsc(const EscCommands& commands) { esc_ = commands; }
  [[nodiscard]] Card& card() { return card_; }

  // The outside. A reading stays until it is read or a newer one takes its place.
  void setTime(Micros now) { now_ = now; }
  void setDevices(const SensorSet& devices) { devices_ = devices; }  ///< that answer begin()
  void setPilot(const PilotSwitches& pilot) { pilot_ = pilot; }
  void put(const ImuRaw& reading) { imu_ = reading; }
  void put(const MagRaw& reading) { mag_ = reading; }
  void put(const AltRaw& reading) { alt_ = reading; }
  void put(const GpsRaw& reading) { gps_ = reading; }
  void put(const BatteryRaw& reading) { battery_ = reading; }
  void put(const EscRaw& reading) { escs_ = reading; }
  void put(const RadioChannels& frame) { radio_ = frame; }
  void setReset(const ResetStatus& reset) { reset_ = reset; }
  [[nodiscard]] bool motorsOn() const { return motorsOn_; }  ///< as remembered for a restart
  [[nodiscard]] Micros fedAt() const { return fed_; }        ///< the watchdog
  using Storage = std::array<std::uint8_t, kStorageBytes>;
  [[nodiscard]] Storage& storage() { return storage_; }  ///< 0xFF: never written
  [[nodiscard]] const EscCommands& esc() const { return esc_; }

 private:
  [[nodiscard]] static Storage erased() {
    Storage bytes;
    bytes.fill(0xFF);
    return bytes;
  }

  template <class Reading>
  [[nodiscard]] static bool take(std::optional<Reading>& slot, Reading& out) {
    if (!slot) return false;
    out = *slot;
    slot.reset();
    return true;
  }

  Card card_;
  std::uint32_t bootId_;
  Micros now_ = 0;
  SensorSet devices_{true, true, true, true, true};
  PilotSwitches pilot_;
  std::optional<ImuRaw> imu_;
  std::optional<MagRaw> mag_;
  std::optional<AltRaw> alt_;
  std::optional<GpsRaw> gps_;
  std::optional<BatteryRaw> battery_;
  std::optional<EscRaw> escs_;
  std::optional<RadioChannels> radio_;
  ResetStatus reset_;
  Storage storage_ = erased();
  Micros fed_ = 0;
  bool motorsOn_ = false;
  EscCommands esc_{};
};

}  // namespace strix
