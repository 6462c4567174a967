/// What the controller asks of the motors, and what they give.
#pragma once

#include "Vector3f.h"

namespace strix {

/// Total thrust along -z body and torque about the body axes (FRD).
struct Wrench {
  float thrust = 0.0F;                 ///< N, upwards
  Vector3f torque = Vector3f::Zero();  ///< N m: + rolls right, + pitches up, + yaws right

  /// Motors off.
  [[nodiscard]] static Wrench none() { return {}; }
};

}  // namespace strix
