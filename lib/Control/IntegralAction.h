/// Time integrals of the errors of position and yaw, and what keeps them from winding up.
#pragma once

#include "ControlRate.h"
#include "HeadingTilt.h"

namespace strix {

/// Each integral is bounded. The horizontal one is kept in NED, because wind is a thing of NED: a
/// turn of the aircraft does not disturb it.
class IntegralAction {
 public:
  /// Largest integrals: m s (length), m s, rad s. 0: none.
  struct Bounds {
    float horizontal = 0.0F;
    float down = 0.0F;
    float yaw = 0.0F;
  };

  explicit IntegralAction(const Bounds& bounds) : bounds_(bounds) {}

  void clear() {
    clearHorizontal();
    down_ = 0.0F;
    yaw_ = 0.0F;
  }
  void clearHorizontal() { horizontalNed_.setZero(); }

  /// One control period of an error of position, m north and east.
  void addHorizontal(const Vector2f& errorNed) {
    horizontalNed_ += kControlPeriod * errorNed;
    horizontalNed_ *= shortening(horizontalNed_, bounds_.horizontal);
  }
  /// m
  void addDown(float error) { down_ = clamped(down_ + kControlPeriod * error, bounds_.down); }
  /// rad
  void addYaw(float error) { yaw_ = clamped(yaw_ + kControlPeriod * error, bounds_.yaw); }

  [[nodiscard]] const Vector2f& horizontalNed() const { return horizontalNed_; }  ///< m s
  [[nodiscard]] float down() const { return down_; }                              ///< m s
  [[nodiscard]] float yaw() const { return yaw_; }                                ///< rad s

  /// A control that moves by `step` would go further into what it already lacks, wanted minus
  /// achieved. Steps that lead out of it are free.
  [[nodiscard]] static bool deeper(float step, float lacking, float tolerance) {
    return (lacking > tolerance && step > 0.0F) || (lacking < -tolerance && step < 0.0F);
  }

 private:
  Bounds bounds_;
  Vector2f horizontalNed_ = Vector2f::Zero();
  float down_ = 0.0F;
  float yaw_ = 0.0F;
};

}  // namespace strix
