/// What a pilot wants, whatever it came by.
#pragma once

#include <cstdint>

namespace strix {

/// Who flies how much, lowest help first. The log holds these numbers.
enum class PilotMode : std::uint8_t {
  Attitude,      ///< sticks are tilt, yaw rate and thrust
  AltitudeHold,  ///< sticks are tilt, yaw rate and climb
  PositionHold,  ///< sticks are velocity and yaw rate
  Stand,         ///< the attitude stand's sequence
  Mission,       ///< the mission, or the way home
};

/// In these the sticks fly.
[[nodiscard]] constexpr bool usesSticks(PilotMode mode) { return mode <= PilotMode::PositionHold; }

/// The pilot's wishes at one instant.
struct PilotInput {
  float roll = 0.0F;      ///< -1 to 1, right positive
  float pitch = 0.0F;     ///< -1 to 1, pulled back positive: nose up
  float yaw = 0.0F;       ///< -1 to 1, right positive
  float throttle = 0.0F;  ///< 0 to 1
  bool arm = false;
  bool kill = false;   ///< motors off now, whatever else
  bool start = false;  ///< begin the mission
  PilotMode mode = PilotMode::Mission;
  bool valid = false;  ///< a transmitter is heard and all of the above is its word
};

}  // namespace strix
