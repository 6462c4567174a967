/// A navigation at rest and the sensors it hears, for the tests of what it does with them.
#pragma once

#include <unity.h>

#include "AssertNear.h"
#include "Navigation.h"

// Compiled once for the whole suite, in test_main.cpp.
extern template class strix::ESKF<9>;
extern template class strix::ESKF<18>;

namespace strix {

constexpr Micros kStep = 1'000;  // us, of the IMU
const Vector3f kField(16.0F, 1.5F, 48.0F);
constexpr MotorState kMotorStates[] = {MotorState::Stopped, MotorState::Hover,
                                       MotorState::Disturbed};

/// Nothing aids but what a test adds.
inline NavigationConfig bare() {
  NavigationConfig config;
  config.tiltFusion = TiltFusion::Off;
  config.magFusion = MagFusion::ThreeAxis;
  config.trackField = false;
  config.standstillAid = false;
  config.boundedMotion = false;
  return config;
}

/// A navigation at rest, and what its IMU shows.
template <int States>
struct Rig {
  explicit Rig(const NavigationConfig& config, Micros start = 0,
               const Quaternion& at = eulerToQuaternion({0.1F, -0.2F, 0.7F}))
      : navigation(config), now(start), attitude(at) {
    navigation.initialize({attitude, kField}, kGravity, now);
  }

  Navigation<States> navigation;
  Micros now;
  Quaternion attitude;                          // what the sensors see
  Vector3f accelerationNed = Vector3f::Zero();  // m/s^2

  [[nodiscard]] Vector3f accel() const {
    return rotateToBody(attitude, accelerationNed - Vector3f(0.0F, 0.0F, kGravity));
  }
  [[nodiscard]] Vector3f field() const { return rotateToBody(attitude, kField); }
  [[nodiscard]] const ESKF<States>& filter() const { return navigation.filter(); }

  void predict(Micros step = kStep) {
    now += step;
    navigation.predict(accel(), Vector3f::Zero(), now);
  }
  void pass(Micros step = kStep) {
    predict(step);
    navigation.finishPass(now);
  }
  void run(float seconds, Micros step = kStep) {
    const auto passes = static_cast<int>(seconds * 1e6F / static_cast<float>(step) + 0.5F);
    for (int i = 0; i < passes; ++i) pass(step);
  }
  /// Time until a health bit is `set`, s; it must happen within 100 s.
  float runUntil(NavigationHealth bit, bool set) {
    const Micros begin = now;
    for (int i = 0; i < 100'000; ++i) {
      if (((navigation.health() & bit) != 0) == set) return toSeconds(elapsed(now, begin));
      pass();
    }
    TEST_FAIL_MESSAGE("the health bit did not change");
    return 0.0F;
  }
  [[nodiscard]] bool has(NavigationHealth bit) const { return (navigation.health() & bit) != 0; }
};

}  // namespace strix
