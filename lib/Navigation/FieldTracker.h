/// Whether a magnetic field is the earth's, or bent by iron and currents.
///
/// After VQF (Laidig and Seel, Information Fusion 2023, section 3.4): a field is trusted while its
/// length and dip stay near those tracked, and another one is adopted when it has stayed the same
/// through motion for long enough.
#pragma once

#include "Mathpk.h"

namespace strix {

struct FieldTrackerConfig {
  float norm = 0.07F;    ///< of the tracked length
  float dip = 0.1F;      ///< rad from the tracked dip
  float track = 20.0F;   ///< s, in which the tracked values follow
  float motion = 0.35F;  ///< rad/s: a field is tried while turning, not while lying beside iron
  float adopt = 20.0F;   ///< s of motion in a new field
};

class FieldTracker {
 public:
  explicit FieldTracker(const FieldTrackerConfig& config) : config_(config) {}

  /// Takes a field as the earth's.
  /// @param fieldNed  uT
  void start(const Vector3f& fieldNed) {
    trusted_ = candidate_ = shapeOf(fieldNed);
    tried_ = 0.0F;
  }

  /// @param fieldNed  the measured field, turned by the estimated attitude, uT
  /// @param rate  rad/s, how fast the sensor turns    @param dt  s since the last field
  /// @return true if it is the earth's
  bool update(const Vector3f& fieldNed, float rate, float dt) {
    const Shape now = shapeOf(fieldNed);
    if (near(now, candidate_)) {
      follow(candidate_, now, dt / (0.25F * config_.track + dt));
      if (rate > config_.motion) tried_ += dt;
    } else {
      candidate_ = now;
      tried_ = 0.0F;
    }
    if (near(now, trusted_)) {
      follow(trusted_, now, dt / (config_.track + dt));
      return true;
    }
    if (tried_ < config_.adopt) return false;
    trusted_ = candidate_;
    return true;
  }

 private:
  struct Shape {
    float norm = 0.0F;  ///< uT
    float dip = 0.0F;   ///< rad below the horizon
  };

  [[nodiscard]] static Shape shapeOf(const Vector3f& f) {
    return {f.norm(), arcTangent2(f.z(), squareRoot(f.x() * f.x() + f.y() * f.y()))};
  }
  [[nodiscard]] bool near(const Shape& a, const Shape& b) const {
    const float norm = a.norm - b.norm;
    const float dip = a.dip - b.dip;
    return norm < config_.norm * b.norm && norm > -config_.norm * b.norm && dip < config_.dip &&
           dip > -config_.dip;
  }
  static void follow(Shape& shape, const Shape& now, float part) {
    shape.norm += part * (now.norm - shape.norm);
    shape.dip += part * (now.dip - shape.dip);
  }

  FieldTrackerConfig config_;
  Shape trusted_;
  Shape candidate_;
  float tried_ = 0.0F;  ///< s of motion in the candidate
};

}  // namespace strix
