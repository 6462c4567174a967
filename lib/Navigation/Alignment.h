/// Attitude from a still start: roll and pitch from gravity, heading from the magnetic field.
#pragma once

#include "Mathpk.h"

namespace strix {

struct Alignment {
  Quaternion attitude;                       ///< body to NED
  Vector3f magReference = Vector3f::Zero();  ///< field in NED (true north), uT
};

/// At rest the specific force is R [0 0 -g], so a_x = g sin(pitch), a_y = -g sin(roll) cos(pitch),
/// a_z = -g cos(roll) cos(pitch). The horizontal field points to magnetic north, `declination` east
/// of true north: it turns the reference, never the measurement.
/// @param accel  mean specific force at rest, m/s^2, body
/// @param mag  mean magnetic field, uT, body; zero when there is no magnetometer: heading is then 0
/// @param declination  rad, positive east
[[nodiscard]] inline Alignment alignStill(const Vector3f& accel, const Vector3f& mag,
                                          float declination) {
  EulerAngles euler;
  euler.roll = arcTangent2(-accel.y(), -accel.z());
  euler.pitch = arcTangent2(accel.x(), squareRoot(accel.y() * accel.y() + accel.z() * accel.z()));

  Alignment out;
  const Vector3f level = rotateToNed(eulerToQuaternion(euler), mag);  // yaw still zero
  const float horizontal = squareRoot(level.x() * level.x() + level.y() * level.y());
  if (horizontal > 0.0F) {
    euler.yaw = wrapAngle(arcTangent2(-level.y(), level.x()) + declination);
    const SinCos d = sinCos(declination);
    out.magReference = {horizontal * d.cos, horizontal * d.sin, level.z()};
  }
  out.attitude = eulerToQuaternion(euler);
  return out;
}

}  // namespace strix
