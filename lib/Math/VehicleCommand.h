/// What a ground station or a console may ask of the flight software, and what it answers.
#pragma once

#include <array>
#include <cstdint>

namespace strix {

/// The log holds these numbers: new ones go to the end.
enum class CommandKind : std::uint8_t {
  Arm,           ///< as the arm switch's edge: every pre-arm check counts
  Disarm,        ///< on the ground; in flight it is refused
  Kill,          ///< motors off now, whatever else, until it is taken back
  KillOff,       ///< takes it back; refused with the motors on
  Start,         ///< take off and fly the mission, or begin the stand's sequence
  Land,          ///< here
  Return,        ///< home, and land
  Hold,          ///< stop and stay here
  Resume,        ///< go on with the mission
  Setpoint,      ///< values: north, east, height m; yaw rad; v north, east, up m/s; yaw rate rad/s.
                 ///< index: bit n set: value n counts
  SetParameter,  ///< index: its row; values[0]
  MissionClear,  ///< begins the upload of another mission
  MissionLeg,    ///< index: its place; kind in `detail`; values: north, east, height m; turn rad;
                 ///< radius m; speed m/s; roll, pitch rad; time: hold
  MissionDone,   ///< index: legs; values[0]: take-off height m; detail: MissionEnd; time: the hold
  Calibrate,     ///< stand still and begin as after power-up
  MotorTest,  ///< index: motor from 0; values[0]: 0 to 1 of the ESC's range; time: so long, 0: end
  LinkAlive,  ///< a ground station that commands is heard: its heartbeat
};

enum class CommandSource : std::uint8_t { Link, Console };

struct VehicleCommand {
  CommandKind kind = CommandKind::LinkAlive;
  CommandSource source = CommandSource::Link;
  std::uint8_t detail = 0;
  std::uint16_t index = 0;
  std::uint32_t time = 0;  ///< us
  std::array<float, 8> values{};
};

/// nullptr: accepted. Else the sentence that says why not, and what to do.
using CommandRefusal = const char*;

}  // namespace strix
