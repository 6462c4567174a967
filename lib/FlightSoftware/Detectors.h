/// Conditions that need time to be believed.
#pragma once

#include "Mathpk.h"

namespace strix {

/// True once a sign has been there without a break for a while.
class Persistence {
 public:
  explicit Persistence(Micros duration) : duration_(duration) {}

  bool update(Micros now, bool present) {
    if (!present) {
      since_ = now;
      return held_ = false;
    }
    held_ = held_ || elapsed(now, since_) >= duration_;
    return held_;
  }
  void reset(Micros now) {
    since_ = now;
    held_ = false;
  }
  [[nodiscard]] bool held() const { return held_; }

 private:
  Micros duration_;
  Micros since_ = 0;
  bool held_ = false;
};

/// On the ground while landing: the aircraft does not sink although little thrust is left; or, when
/// the estimate has lost its height, it does not fall although next to none is left.
struct TouchDownConfig {
  float thrustFraction = 0.75F;  ///< of the weight
  float sinkRate = 0.15F;        ///< m/s
  float fallThrust = 0.5F;       ///< of the weight, ours: no vehicle file errs by a factor of two
  float fallForce = 0.75F;       ///< g of specific force, ours: midway between falling and standing
  Micros duration = 400'000;
};

/// Thrust steadily near the weight: the currents are those of hovering.
struct HoverConfig {
  float thrustBand = 0.2F;  ///< of the weight, either side
  Micros duration = 500'000;
};

}  // namespace strix
