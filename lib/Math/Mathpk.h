/// The whole math package.
#pragma once

#include "Deterministic.h"
#include "Matrix18f.h"
#include "Matrix9f.h"
#include "Quaternion.h"
#include "Rotation.h"
#include "StateHash.h"
#include "Time.h"
#include "Vector3f.h"
#include "VehicleState.h"
#include "Wrench.h"

namespace strix {

constexpr float kGravity = 9.80665F;  ///< m/s^2, standard gravity

}  // namespace strix
