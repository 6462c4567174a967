/// The wrench that lagging motors give now: the last state of a design that knows their lag.
#pragma once

#include <array>

#include "ControlRate.h"
#include "Gains.h"
#include "Mathpk.h"

namespace strix {

/// A first order per row of u, w' = (u - w) / tau, exact for a u held over the control period.
class WrenchEstimate {
 public:
  using Rows = std::array<float, kControlCount>;

  /// @param timeConstant  of the motors, s
  explicit WrenchEstimate(float timeConstant)
      : part_(1.0F - exponential(-kControlPeriod / timeConstant)) {}

  void reset() { now_ = {}; }

  /// One control period in which the motors were given u.
  void advance(const Rows& u) {
    for (std::size_t row = 0; row < kControlCount; ++row) {
      now_[row] += part_ * (u[row] - now_[row]);
    }
  }

  [[nodiscard]] const Rows& now() const { return now_; }

 private:
  float part_;  ///< 1 - e^(-T / tau)
  Rows now_{};
};

}  // namespace strix
