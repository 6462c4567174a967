/// What a pilot's sticks ask for.
#pragma once

#include "Mathpk.h"
#include "VehicleState.h"

namespace strix {

/// At full deflection; Ugglan's (pilot_control.h).
struct StickLimits {
  float tilt = kPi / 8.0F;  ///< rad, roll and pitch
  float yawRate = kPi;      ///< rad/s
  float thrust = 20.0F;     ///< N, of the throttle
  /// ours: rad. The wanted heading runs ahead of the nose by no more: with the stick let go the
  /// aircraft does not go on turning. It is also the limit of the law's own integral of yaw rate.
  float headingLead = 1.0F;
};

struct PilotDemand {
  float roll = 0.0F;     ///< rad, right side down positive
  float pitch = 0.0F;    ///< rad, nose up positive
  float yawRate = 0.0F;  ///< rad/s, nose right positive
  float thrust = 0.0F;   ///< N, along -z body
};

class StickMapping {
 public:
  explicit StickMapping(const StickLimits& limits = {}) : limits_(limits) {}

  /// Sticks beyond their range count as at its end. NaN is the middle, and no throttle.
  /// @tparam Sticks  has roll, pitch and yaw, -1 to 1, right and back positive; throttle, 0 to 1
  template <class Sticks>
  [[nodiscard]] PilotDemand demand(const Sticks& sticks) const {
    return {limits_.tilt * within(sticks.roll, -1.0F), limits_.tilt * within(sticks.pitch, -1.0F),
            limits_.yawRate * within(sticks.yaw, -1.0F),
            limits_.thrust * within(sticks.throttle, 0.0F)};
  }

  /// Starts at this heading, rad.
  void reset(float heading) { yaw_ = heading; }

  /// The demand as a reference: roll and pitch as they stand, the heading from the rate.
  /// @param heading  of the aircraft now, rad    @param dt  s since the last call
  [[nodiscard]] Reference reference(const PilotDemand& demand, float heading, float dt) {
    float lead = wrapAngle(yaw_ + demand.yawRate * dt - heading);
    if (lead > limits_.headingLead) lead = limits_.headingLead;
    if (lead < -limits_.headingLead) lead = -limits_.headingLead;
    yaw_ = wrapAngle(heading + lead);
    Reference reference;
    reference.mode = ReferenceMode::Attitude;
    reference.yaw = yaw_;
    reference.yawRate = demand.yawRate;
    reference.attitude = eulerToQuaternion({demand.roll, demand.pitch, yaw_});
    reference.thrust = demand.thrust;
    return reference;
  }

 private:
  [[nodiscard]] static float within(float stick, float low) {
    if (stick > 1.0F) return 1.0F;
    if (stick < low) return low;
    return isFinite(stick) ? stick : 0.0F;
  }

  StickLimits limits_;
  float yaw_ = 0.0F;  ///< rad
};

}  // namespace strix
