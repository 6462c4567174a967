/// Whether the sensors lie still, and what the gyro shows then.
#pragma once

#include "Mathpk.h"

namespace strix {

struct StandstillConfig {
  float rate = 0.035F;          ///< rad/s from its own low-pass
  float acceleration = 0.5F;    ///< m/s^2 from its own low-pass
  float meanRate = 0.1F;        ///< rad/s: a steady turn is none
  float meanForce = 1.0F;       ///< m/s^2 from g: free fall is none
  float lowPass = 0.5F;         ///< s
  Micros duration = 1'500'000;  ///< of both, without a break
};

/// At rest rate and specific force stay near their own low-pass values, whatever the biases are. A
/// smooth flight does so too: ask only where the aircraft may stand.
class StandstillDetector {
 public:
  explicit StandstillDetector(const StandstillConfig& config) : config_(config) {}

  /// @param accel  m/s^2, body    @param gyro  rad/s, body
  void update(Micros now, const Vector3f& accel, const Vector3f& gyro) {
    if (!started_) {
      started_ = true;
      accel_ = accel;
      gyro_ = gyro;
      now_ = since_ = now;
    }
    const float dt = toSeconds(elapsed(now, now_));
    now_ = now;
    const float part = dt / (config_.lowPass + dt);
    accel_ += part * (accel - accel_);
    gyro_ += part * (gyro - gyro_);
    const bool still =
        (gyro - gyro_).norm() < config_.rate && (accel - accel_).norm() < config_.acceleration &&
        gyro_.norm() < config_.meanRate && accel_.norm() < kGravity + config_.meanForce &&
        accel_.norm() > kGravity - config_.meanForce;
    if (!still) since_ = now;
    held_ = still && (held_ || elapsed(now, since_) >= config_.duration);
  }

  [[nodiscard]] bool held() const { return held_; }
  /// Low-pass of the rate, rad/s, body: while held, the gyro's bias.
  [[nodiscard]] const Vector3f& meanGyro() const { return gyro_; }

 private:
  StandstillConfig config_;
  Vector3f accel_ = Vector3f::Zero();
  Vector3f gyro_ = Vector3f::Zero();
  Micros now_ = 0;
  Micros since_ = 0;
  bool started_ = false;
  bool held_ = false;
};

}  // namespace strix
