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
///   and
///                                       the mission that is compiled in flies
///   void countFaults(SensorFaultCounts&);
///                                       fills in the rows of its devices and buses
///   PilotSwitches readPilot();          the pilot's switches as they are now
///   PilotSticks readSticks();           the pilot's sticks as they are now
///   void writeEsc(const EscCommands&);  M1..M4 in the vehicle's command unit; takes effect at the
///                                       next ESC frame
///   Card& card();                       the log's block device (lib/Logger/BlockDevice.h)
///   using Card = ...;
#pragma once

#include "RawSamples.h"
#include "SensorFaults.h"
#include "Vehicle.h"

namespace strix {

/// Switch positions. Arming is an edge the state machine looks for, not a level.
struct PilotSwitches {
  bool arm = false;
  bool kill = false;   ///< motors off now, whatever else
  bool start = false;  ///< begin the mission
};

/// Stick positions. Without a receiver, or when it is lost, they are not valid.
struct PilotSticks {
  float roll = 0.0F;      ///< -1 to 1, right positive
  float pitch = 0.0F;     ///< -1 to 1, pulled back positive: nose up
  float yaw = 0.0F;       ///< -1 to 1, right positive
  float throttle = 0.0F;  ///< 0 to 1
  bool valid = false;
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
