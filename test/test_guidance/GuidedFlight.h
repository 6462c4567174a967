/// Guidance and the state machine together, with an aircraft that follows its reference exactly.
#pragma once

#include <FiniteStateMachine.h>
#include <Guidance.h>
#include <MissionText.h>
#include <unity.h>

#include <vector>

#include "AssertNear.h"

namespace strix {

constexpr float kWeight = 8.0F;  // N

class GuidedFlight {
 public:
  static constexpr Micros kStep = 2000;

  explicit GuidedFlight(const char* mission, float yaw = 0.0F,
                        Micros start = 0U - 20'000'000U,  // the clock wraps on the way
                        const GuidanceConfig& config = {})
      : now(start), guidance(parsed(mission), config, kWeight) {
    state.attitude = eulerToQuaternion({0.0F, 0.0F, yaw});
    step(condition::kCalibrated);
    step(condition::kArmEdge);
    TEST_ASSERT_TRUE(at(FlightState::Armed));
    step(condition::kStart);
    states.clear();
  }

  static Mission parsed(const char* text) {
    const ParsedMission mission = parseMission("test", text);
    TEST_ASSERT_TRUE_MESSAGE(mission.valid(), text);
    return mission.mission;
  }

  /// One control tick. @param also  conditions beside those that guidance raises
  void step(ConditionSet also = 0) {
    now += kStep;
    const Transition* row = machine.update(guidance.conditions(now, state) | also);
    if (row != nullptr) {
      guidance.enter(machine.state(), now, state);
      states.push_back(machine.state());
    }
    const Reference& reference = guidance.update(now, state);
    if (machine.getControlFlag()) follow(reference);
  }

  /// At most so long. @return s it took
  float runUntil(FlightState wanted, float seconds = 60.0F) {
    const Micros start = now;
    while (!at(wanted) && toSeconds(elapsed(now, start)) < seconds) step();
    TEST_ASSERT_TRUE(at(wanted));
    return toSeconds(elapsed(now, start));
  }
  void run(float seconds) {
    const Micros start = now;
    while (toSeconds(elapsed(now, start)) < seconds) step();
  }

  [[nodiscard]] bool at(FlightState wanted) const { return machine.state() == wanted; }
  [[nodiscard]] const Reference& reference() const { return guidance.reference(); }

  Micros now;
  Guidance guidance;
  FiniteStateMachine machine;
  VehicleState state;
  std::vector<FlightState> states;  ///< entered since take-off was commanded

 private:
  /// A tilt accelerates by g tan(tilt): forward with the nose down, right with the right side down.
  void follow(const Reference& r) {
    if (r.mode == ReferenceMode::Position) {
      state.positionNed = r.positionNed;
      state.velocityNed = r.velocityNed;
      state.attitude = eulerToQuaternion({0.0F, 0.0F, r.yaw});
      return;
    }
    state.attitude = r.attitude;
    if (r.mode == ReferenceMode::Attitude) return;  // on the stand
    const Vector3f up = rotateToNed(r.attitude, {0.0F, 0.0F, -1.0F});
    const float dt = toSeconds(kStep);
    state.velocityNed.head<2>() += dt * kGravity / -up.z() * up.head<2>();
    state.positionNed.head<2>() += dt * state.velocityNed.head<2>();
    state.positionNed.z() = r.positionNed.z();
    state.velocityNed.z() = r.velocityNed.z();
  }
};

}  // namespace strix
