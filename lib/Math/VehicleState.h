/// What the estimator tells the controller and the log.
#pragma once

#include "Quaternion.h"

namespace strix {

/// Position, velocity, attitude and body rate at one instant.
struct VehicleState {
  Vector3f positionNed = Vector3f::Zero();  ///< m, from the start position
  Vector3f velocityNed = Vector3f::Zero();  ///< m/s
  Quaternion attitude;                      ///< body to NED
  Vector3f rateBody = Vector3f::Zero();     ///< rad/s, FRD
};

/// Where the aircraft should be: what guidance asks of the controller.
struct Reference {
  Vector3f positionNed = Vector3f::Zero();      ///< m
  Vector3f velocityNed = Vector3f::Zero();      ///< m/s
  float yaw = 0.0F;                             ///< rad
  float yawRate = 0.0F;                         ///< rad/s
  Vector3f accelerationNed = Vector3f::Zero();  ///< m/s^2, fed forward
};

}  // namespace strix
