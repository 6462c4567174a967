/// What is chosen about the controller beside its gains: limits, integral action, filters.
#pragma once

#include "Mathpk.h"
#include "ReducedObserver.h"
#include "ReferenceFilter.h"

namespace strix {

/// The values are ours: DESIGN.md publishes none. The horizontal limits are on the length of a
/// vector, so that its direction is kept and no heading is favoured.
struct ControlConfig {
  /// What turns an attitude error into torque: Ugglan's law, or (nullptr) the gain's own columns.
  const ObserverGains* reducedObserver = nullptr;
  ReferenceFilterConfig referenceFilter{};

  // What an error may ask for.
  float positionHorizontal = 2.0F;  ///< m
  float positionVertical = 1.0F;    ///< m
  float velocityHorizontal = 3.0F;  ///< m/s, above the speed at which the position limit balances
  float velocityVertical = 2.0F;    ///< m/s
  float acceleration = 3.0F;        ///< m/s^2, fed forward: 17 deg of tilt
  float yaw = 0.6F;                 ///< rad, above the attitude stand's 30 deg
  float tilt = 35.0F * kDegToRad;   ///< rad, in Position: 7 m/s^2, and 22 % more thrust
  float attitudeTilt = 60.0F * kDegToRad;  ///< rad, of a given attitude
  float rollPitchRate = 5.0F;  ///< rad/s, that a tilt error asks for: a step of 30 deg stays below
  float yawRate = 2.0F;        ///< rad/s, that a yaw error asks for
  float cosTilt = 0.7F;        ///< thrust is raised for tilts up to 45 deg, by 1/0.7 at most

  // What the integrals may ask for.
  float integralTilt = 20.0F * kDegToRad;  ///< rad: wind that pulls with 3.6 m/s^2
  float integralThrust = 0.5F;  ///< of the weight: 20 % more mass on 20 % less thrust, 1.2 / 0.8
  float integralYaw = 0.25F;    ///< of all rotors' drag torque in hover: one that lacks 20 % is 5 %
  // Wanted and achieved wrench differ by less than this through rounding.
  float thrustTolerance = 0.01F;    ///< N
  float torqueTolerance = 0.0005F;  ///< N m
};

}  // namespace strix
