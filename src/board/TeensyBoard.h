/// The aircraft's Board (lib/FlightSoftware/Board.h): a Teensy 4.1 with its sensors, ESCs and card.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "Board.h"
#include "RawSamples.h"
#include "Vehicle.h"

#include "BaroBmp390.h"
#include "Battery.h"
#include "EscPwm.h"
#include "GpsMtk3333.h"
#include "I2cBus.h"
#include "ImuIcm20649.h"
#include "MagLis2mdl.h"
#include "Pins.h"
#include "RadioReceiver.h"
#include "Reset.h"
#include "SdCard.h"
#include "Storage.h"
#include "Switch.h"
#include "Watchdog.h"

namespace strix {

/// What each call may take at worst, and why, stands at the device's own class; docs/board.md has
/// the table.
class TeensyBoard {
 public:
  using Card = SdCard;
  static constexpr const char* kName = "Teensy 4.1";

  /// The ESCs first, so that they see `off` while the rest starts. Takes 1 s.
  SensorSet begin();

  /// Log number and start-up jitter: differs between two starts with or without a card.
  [[nodiscard]] std::uint32_t bootId() const { return bootId_; }

  [[nodiscard]] Micros micros() const { return ::micros(); }

  [[nodiscard]] bool readImu(ImuRaw& out) { return imu_.read(out); }
  [[nodiscard]] bool readMag(MagRaw& out) { return mag_.read(out); }
  [[nodiscard]] bool readAlt(AltRaw& out) { return baro_.read(out); }
  [[nodiscard]] bool readGps(GpsRaw& out) { return gps_.read(out); }

  [[nodiscard]] bool readBattery(BatteryRaw& out) { return battery_.read(out); }
  /// ESCs by pulse width do not answer; EscI2c's do.
  [[nodiscard]] static bool readEscStatus(EscRaw& /*out*/) { return false; }

  void beginRadio(RadioProtocol protocol) { radio_.begin(protocol); }
  [[nodiscard]] bool readRadio(RadioChannels& out) { return radio_.read(out); }
  [[nodiscard]] std::uint32_t radioOverflows() const { return radio_.overflows(); }

  [[nodiscard]] std::string_view missionText() const { return card_.missionText(); }

  void countFaults(SensorFaultCounts& out) const;

  [[nodiscard]] PilotSwitches readPilot();

  void writeEsc(const EscCommands& commands) { esc_.write(commands); }

  /// The watchdog runs while motors are armed or turn; on the ground it is off: Watchdog.h.
  void feedWatchdog() {
    watchdog_.run(motorsOn());
    watchdog_.feed();
  }
  [[nodiscard]] const Watchdog& watchdog() const { return watchdog_; }

  /// As begin() found it.
  [[nodiscard]] ResetStatus resetStatus() const { return reset_; }
  void rememberMotors(bool on);

  static constexpr std::size_t kStorageBytes = Storage::kBytes;
  static void readStorage(std::size_t offset, std::uint8_t* data, std::size_t size) {
    Storage::read(offset, data, size);
  }
  /// Refused with the motors on: it may take 0.6 s.
  [[nodiscard]] bool writeStorage(std::size_t offset, const std::uint8_t* data, std::size_t size) {
    return !motorsOn() && Storage::write(offset, data, size);
  }

  [[nodiscard]] SdCard& card() { return card_; }

  // The card's logs, for the console: SdCard.h.
  [[nodiscard]] std::size_t logCount() const { return card_.logCount(); }
  [[nodiscard]] bool logInfo(std::size_t index, std::uint32_t& number, std::uint32_t& bytes) const {
    return card_.logInfo(index, number, bytes);
  }
  /// Nothing with the motors on.
  [[nodiscard]] std::size_t readLog(std::uint32_t number, std::uint32_t offset, std::uint8_t* out,
                                    std::size_t most) {
    return motorsOn() ? 0 : card_.readLog(number, offset, out, most);
  }

 private:
  [[nodiscard]] bool motorsOn() const { return armed_ || esc_.turning(); }

  EscPwm esc_;
  Battery battery_{pins::kBattery, pins::kBatteryRatio};
  Switch arm_{pins::kArmSwitch, false};
  Switch kill_{pins::kKillSwitch, true};
  Switch start_{pins::kStartSwitch, false};
  I2cBus imuBus_{Wire, IMXRT_LPI2C1_ADDRESS, pins::kImuBus};
  I2cBus slowBus_{Wire1, IMXRT_LPI2C3_ADDRESS, pins::kSlowBus};
  ImuIcm20649 imu_{imuBus_};
  MagLis2mdl mag_{slowBus_};
  BaroBmp390 baro_{slowBus_};
  GpsMtk3333 gps_{Serial2};
  RadioReceiver radio_{Serial1};
  SdCard card_;
  Watchdog watchdog_;
  ResetStatus reset_;
  bool armed_ = false;
  std::uint32_t bootId_ = 0;
};

}  // namespace strix
