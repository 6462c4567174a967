/// What the estimator tells the controller and the log.
#pragma once

#include <cstdint>

#include "Quaternion.h"

namespace strix {

/// Position, velocity, attitude and body rate at one instant.
struct VehicleState {
  Vector3f positionNed = Vector3f::Zero();  ///< m, from the start position
  Vector3f velocityNed = Vector3f::Zero();  ///< m/s
  Quaternion attitude;                      ///< body to NED
  Vector3f rateBody = Vector3f::Zero();     ///< rad/s, FRD
  /// Of the place above, north and east, beside the aircraft's own: while it is being corrected.
  Vector2f correctionAcceleration = Vector2f::Zero();  ///< m/s^2
};

/// What a reference asks for.
enum class ReferenceMode : std::uint8_t {
  Position,        ///< position, velocity, acceleration and yaw; the attitude follows from them
  AttitudeHeight,  ///< attitude; height, sink rate and vertical acceleration; no place
  Attitude,        ///< attitude and thrust as given: the attitude stand, a pilot's sticks
};

/// Where the aircraft should be: what guidance asks of the controller.
struct Reference {
  Vector3f positionNed = Vector3f::Zero();      ///< m
  Vector3f velocityNed = Vector3f::Zero();      ///< m/s
  float yaw = 0.0F;                             ///< rad
  float yawRate = 0.0F;                         ///< rad/s
  Vector3f accelerationNed = Vector3f::Zero();  ///< m/s^2, fed forward as tilt and thrust
  Vector3f jerkNed = Vector3f::Zero();          ///< m/s^3, fed forward as the rate of that tilt
  float yawAcceleration = 0.0F;                 ///< rad/s^2, fed forward as torque
  ReferenceMode mode = ReferenceMode::Position;
  Quaternion attitude{};  ///< body to NED; not in Position
  float thrust = 0.0F;    ///< N, along -z body; in Attitude only
};

}  // namespace strix
