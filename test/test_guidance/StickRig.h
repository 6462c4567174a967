/// Guidance in the loop: a rigid body with lagging motors flown by the controller after the
/// references that sticks and setpoints ask for.
#pragma once

#include <Controller.h>
#include <FlightConfig.h>
#include <Guidance.h>
#include <Motors.h>
#include <RigidQuad.h>
#include <unity.h>

#include <algorithm>
#include <cmath>

#include "AssertNear.h"

namespace strix {

class StickRig {
 public:
  static constexpr float kPeriod = 0.002F;  // s

  /// Hovers 5 m up with its nose at `yaw`, rad, and has just come to this state.
  explicit StickRig(FlightState entered, float yaw = 0.0F, const Parameters& p = {})
      : parameters(p),
        quad(kQuad5in, yaw),
        guidance(Mission{}, GuidanceConfig(), kQuad5in.mass * kGravity),
        controller_(kQuad5in, kQuad5inGains),
        motors_(kQuad5in) {
    quad.position.z() = -5.0;
    guidance.configure(p);
    motors_.arm();
    controller_.reset(now);
    controller_.setGrounded(false);
    sticks.valid = true;
    sticks.mode = PilotMode::PositionHold;
    sticks.throttle = 0.5F;
    enter(entered);
  }

  void enter(FlightState state) { guidance.enter(state, now, quad.state()); }

  /// One control tick. @param each  called after it
  template <class Each>
  void run(float seconds, Each&& each) {
    const int ticks = static_cast<int>(std::lround(seconds / kPeriod));
    for (int i = 0; i < ticks; ++i) {
      now += 2000;
      const Reference before = guidance.reference();
      guidance.setPilot(sticks, positionKnown, heightKnown, false);
      const Reference& r = guidance.update(now, quad.state());
      step_ = {(r.velocityNed - before.velocityNed).norm(),
               (r.accelerationNed - before.accelerationNed).norm()};
      controller_.updateControl(now, r, quad.state());
      motors_.commandControl(controller_.getControl());
      controller_.setAchieved(motors_.achieved());
      quad.step(motors_.commands(), kPeriod);
      each();
    }
  }
  void run(float seconds) {
    run(seconds, [] {});
  }

  /// Velocity in the frame of somebody who looks along the nose: forward, right, up. m/s
  [[nodiscard]] Eigen::Vector3d seen() const {
    const double c = std::cos(quad.yaw());
    const double s = std::sin(quad.yaw());
    const Eigen::Vector3d& v = quad.velocity;
    return {c * v.x() + s * v.y(), c * v.y() - s * v.x(), -v.z()};
  }
  [[nodiscard]] double levelSpeed() const { return quad.velocity.head<2>().norm(); }
  [[nodiscard]] const Reference& reference() const { return guidance.reference(); }
  /// Of the reference, in the last tick: of velocity, m/s, and of acceleration, m/s^2.
  [[nodiscard]] std::pair<float, float> step() const { return step_; }

  Micros now = 0U - 2'000'000U;  // the clock wraps on the way
  Parameters parameters;
  RigidQuad quad;
  Guidance guidance;
  PilotInput sticks;
  bool positionKnown = true;
  bool heightKnown = true;

 private:
  Controller controller_;
  Motors motors_;
  std::pair<float, float> step_;
};

}  // namespace strix
