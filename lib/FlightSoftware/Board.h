/// What the flight software asks of a board, and all it ever sees of one.
///
/// A Board is a class with the members below (a compile-time interface: no virtual call, nothing to
/// inherit). There are four kinds: the Teensy (src/board), the simulator (tools/strix/core), the
/// log replay and the emulated Cortex-M7. The flight code is a pure function of what they return.
///
///   static constexpr const char* kName; for the log, e.g. "Teensy 4.1"
///   std::uint32_t bootId();             differs between two starts, as far as the board can tell
///   Micros micros();                    the clock; read once a pass
///   SensorSet begin();                  starts buses and devices; returns those that answered.
///                                       Called once by setup(), on the ground; may take seconds.
///   bool readImu(ImuRaw&);              true and filled when a reading newer than the last one is
///   bool readMag(MagRaw&);              there. Never waits for one; how long each may take at
///   bool readAlt(AltRaw&);              worst is the board's stated bound.
///   bool readGps(GpsRaw&);
///   bool readBattery(BatteryRaw&);      the same; a board that cannot measure it returns false for
///   bool readEscStatus(EscRaw&);        ever
///   std::string_view missionText();     mission.txt as begin() found it on the card; empty: none,
///                                       and the mission that is compiled in flies
///   void countFaults(SensorFaultCounts&);
///                                       fills in the rows of its devices and buses
///   PilotSwitches readPilot();          the switches on the aircraft as they are now
///   void beginRadio(RadioProtocol);     once, after begin(): which receiver is connected
///   bool readRadio(RadioChannels&);     true and filled when a frame has come
///   void writeEsc(const EscCommands&);  M1..M4 in the vehicle's command unit; takes effect at the
///                                       next ESC frame
///   void feedWatchdog();                each control tick; a board whose loop stops restarts, and
///                                       its motors have stopped by then
///   ResetStatus resetStatus();          why it started
///   void rememberMotors(bool on);       kept across a restart, for resetStatus()
///   static constexpr std::size_t kStorageBytes;  that survive power-off
///   void readStorage(std::size_t offset, std::uint8_t* data, std::size_t size);
///   bool writeStorage(std::size_t offset, const std::uint8_t* data, std::size_t size);
///                                       with the motors off, a few bytes at a time: may take long
///   Card& card();                       the log's block device (lib/Logger/BlockDevice.h)
///   using Card = ...;
#pragma once

#include "RadioChannels.h"
#include "RawSamples.h"
#include "SensorFaults.h"
#include "Vehicle.h"

namespace strix {

/// Switches wired to the aircraft. Arming is an edge, not a level.
struct PilotSwitches {
  bool arm = false;
  bool kill = false;   ///< motors off now, whatever else
  bool start = false;  ///< begin the mission
};

/// What a radio receiver speaks; the numbers of parameter RC_PROTOCOL.
enum class RadioProtocol : std::uint8_t { None, Ibus, Sbus, Crsf };

/// Why the processor started.
namespace reset {
constexpr std::uint32_t kPowerUp = 1U << 0U;
constexpr std::uint32_t kPin = 1U << 1U;
constexpr std::uint32_t kLockup = 1U << 2U;
constexpr std::uint32_t kSoftware = 1U << 3U;
constexpr std::uint32_t kWatchdog = 1U << 4U;
constexpr std::uint32_t kDebugger = 1U << 5U;
constexpr std::uint32_t kTemperature = 1U << 6U;
constexpr std::uint32_t kOther = 1U << 7U;
}  // namespace reset

struct ResetStatus {
  std::uint32_t causes = reset::kPowerUp;
  bool motorsWereOn = false;  ///< when it stopped: it was a restart in flight
};

/// Devices that answered with the right identity at start.
struct SensorSet {
  bool imu = false;
  bool mag = false;
  bool alt = false;
  bool gps = false;
  bool card = false;
};

}  // namespace strix
