/// How strongly the specific force shakes.
#pragma once

#include "Mathpk.h"

namespace strix {

/// Mean square of the specific force's difference from its own low-pass.
class Vibration {
 public:
  /// @param accel  m/s^2, body
  void update(Micros now, const Vector3f& accel) {
    if (!started_) {
      started_ = true;
      slow_ = accel;
      now_ = now;
    }
    const float dt = toSeconds(elapsed(now, now_));
    now_ = now;
    const Vector3f fast = accel - slow_;
    slow_ += dt / (kLowPass + dt) * fast;
    meanSquare_ += dt / (kMean + dt) * (fast.squaredNorm() - meanSquare_);
  }

  [[nodiscard]] float meanSquare() const { return meanSquare_; }       ///< (m/s^2)^2
  [[nodiscard]] float rms() const { return squareRoot(meanSquare_); }  ///< m/s^2

 private:
  static constexpr float kLowPass = 0.1F;  ///< s
  static constexpr float kMean = 1.0F;     ///< s

  Vector3f slow_ = Vector3f::Zero();
  float meanSquare_ = 0.0F;
  Micros now_ = 0;
  bool started_ = false;
};

}  // namespace strix
