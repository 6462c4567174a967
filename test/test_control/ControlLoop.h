/// Designs and the closed loop of the controller's tests.
#pragma once

#include <Controller.h>
#include <Motors.h>
#include <unity.h>
#include <vehicles/Vehicles.h>

#include <algorithm>

#include "RigidQuad.h"

namespace strix {

constexpr Micros kControlStep = 2000;
constexpr double kControlStepS = 2e-3;
constexpr float kHeadings[] = {0.0F, 90.0F * kDegToRad, 180.0F * kDegToRad, -135.0F * kDegToRad};

// Of Quad5in, made once for these tests, so that they do not move with the tuning. The published
// regulator, without integral action and for motors without lag:
inline constexpr Gains kPlainDesign{
    "Quad5in, 12 states",
    {{{0.0F, 0.0F, -1.99349F, 0.0F, 0.0F, -2.69874F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F},
      {0.0F, 0.00988207F, 0.0F, 0.0F, 0.0164644F, 0.0F, 0.105832F, 0.0F, 0.0F, 0.0352757F, 0.0F,
       0.0F},
      {-0.0099029F, 0.0F, 0.0F, -0.0168216F, 0.0F, 0.0F, 0.0F, 0.111375F, 0.0F, 0.0F, 0.0387635F,
       0.0F},
      {0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0661068F, 0.0F, 0.0F, 0.041876F}}},
    {},
    {}};

// With both (scipy's solve_discrete_are). Bryson's weights: integral 3 m s, position 1 m, velocity
// 1.3 m/s, tilt 0.2 rad, rate 2 rad/s, torque 0.1 N m; down 2 m s, 1 m, 1 m/s, 2 N; yaw 1 rad s,
// 0.3 rad, 1 rad/s, 0.03 N m.
inline constexpr Gains kFullDesign{
    "Quad5in, integral and lag",
    {{{0.0F, 0.0F, -3.20424F, 0.0F, 0.0F, -3.15901F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F},
      {0.0F, 0.141852F, 0.0F, 0.0F, 0.162578F, 0.0F, 0.74222F, 0.0F, 0.0F, 0.103034F, 0.0F, 0.0F},
      {-0.14277F, 0.0F, 0.0F, -0.165118F, 0.0F, 0.0F, 0.0F, 0.767369F, 0.0F, 0.0F, 0.113964F, 0.0F},
      {0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.112851F, 0.0F, 0.0F, 0.0487751F}}},
    {0.142224F, 0.936403F, 0.811179F, 0.334683F},
    {-0.996444F, 0.032553F, -0.0326573F, 0.029749F}};

struct Flown {
  const Vehicle& vehicle;
  const Gains& gains;
};

/// Both, and what flies.
inline constexpr Flown kDesigns[] = {{kQuad5in, kPlainDesign},
                                     {kQuad5in, kFullDesign},
                                     {kQuad5in, kQuad5inGains},
                                     {kUgglanQ450, kUgglanQ450Gains}};

/// Jumps of the reference reach the law as they are.
inline ControlConfig unfiltered() {
  ControlConfig config;
  config.referenceFilter.position = 0.0F;
  config.referenceFilter.yaw = 0.0F;
  config.referenceFilter.tilt = 0.0F;
  return config;
}

inline VehicleState facing(float yaw, const Vector3f& position = Vector3f::Zero()) {
  VehicleState state;
  state.positionNed = position;
  state.attitude = eulerToQuaternion({0.0F, 0.0F, yaw});
  return state;
}

inline Reference at(const Vector3f& position, float yaw) {
  Reference reference;
  reference.positionNed = position;
  reference.yaw = yaw;
  return reference;
}

/// Holds this attitude at the height of the start.
inline Reference leaning(float roll, float pitch, float yaw,
                         ReferenceMode mode = ReferenceMode::AttitudeHeight) {
  Reference reference = at(Vector3f::Zero(), yaw);
  reference.mode = mode;
  reference.attitude = eulerToQuaternion({roll, pitch, yaw});
  return reference;
}

/// Controller, motors and aircraft in a closed loop at 500 Hz, with a perfect estimate.
class Loop {
 public:
  Loop(const Vehicle& vehicle, const Gains& gains, float yaw, const ControlConfig& config = {})
      : quad(vehicle, yaw),
        controller(vehicle, gains, config),
        vehicle_(vehicle),
        motors_(vehicle) {
    controller.reset(0);
    motors_.arm();
    // The motors have been turning at hover for long.
    for (int k = 0; k < 1000; ++k) {
      controller.setAchieved({vehicle.mass * kGravity, Vector3f::Zero()});
      VehicleState state = quad.state();
      controller.updateControl(now, at(state.positionNed, yaw), state);
      now += kControlStep;
    }
    controller.setAchieved(controller.getControl());
  }

  void step(const Reference& reference) { step(reference, quad.state()); }

  void step(const Reference& reference, const VehicleState& estimate) {
    TEST_ASSERT_TRUE(controller.updateControl(now, reference, estimate));
    motors_.commandControl(controller.getControl());
    controller.setAchieved(motors_.achieved());
    for (int part = 0; part < 4; ++part) quad.step(motors_.commands(), kControlStepS / 4);
    now += kControlStep;
    largestTilt = std::max(largestTilt, quad.tilt());
    for (const float command : motors_.commands()) {
      largestCommand = std::max(largestCommand, command);
      capped = capped || command >= vehicle_.commandFlightMax;
    }
  }

  void fly(const Reference& reference, double seconds) {
    const auto steps = static_cast<int>(seconds / kControlStepS + 0.5);
    for (int k = 0; k < steps; ++k) step(reference);
  }

  RigidQuad quad;
  Controller controller;
  Micros now = 0;
  double largestTilt = 0.0;
  float largestCommand = 0.0F;
  bool capped = false;

 private:
  const Vehicle& vehicle_;
  Motors motors_;
};

/// North, east, down to ahead, right, down of where the flight started.
inline Eigen::Vector3d inStartFrame(const Eigen::Vector3d& ned, float yaw) {
  return Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()) * ned;
}

inline Vector3f fromStartFrame(const Vector3f& ahead, float yaw) {
  return rotateToNed(eulerToQuaternion({0.0F, 0.0F, yaw}), ahead);
}

}  // namespace strix
