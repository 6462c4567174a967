/// Random numbers for property tests: the same on every machine and in every run.
#pragma once

#include <cstdint>

#include "Quaternion.h"

namespace strix {

/// The linear congruential generator of Numerical Recipes; its upper 24 bits are good enough here.
class Random {
 public:
  explicit Random(std::uint32_t seed) : state_(seed) {}

  /// 24 random bits.
  std::uint32_t bits() {
    state_ = state_ * 1664525U + 1013904223U;
    return state_ >> 8U;
  }

  /// An integer in [0, count), count up to 2^24.
  std::uint32_t below(std::uint32_t count) { return bits() % count; }

  bool chance(float probability) { return uniform(0.0F, 1.0F) < probability; }

  float uniform(float low, float high) {
    return low + (high - low) * static_cast<float>(bits()) / 16777216.0F;
  }

  /// Each element in [-size, size).
  Vector3f vector(float size) {
    const float x = uniform(-size, size);
    const float y = uniform(-size, size);
    return {x, y, uniform(-size, size)};
  }

  /// Any direction, length one.
  Vector3f direction() {
    for (;;) {
      const Vector3f v = vector(1.0F);
      const float length = v.norm();
      if (length > 0.1F && length <= 1.0F) return v / length;
    }
  }

  /// Any attitude.
  Quaternion rotation() {
    for (;;) {
      const Vector3f v = vector(1.0F);
      const Quaternion q{uniform(-1.0F, 1.0F), v.x(), v.y(), v.z()};
      const float length = norm(q);
      if (length > 0.1F && length <= 1.0F) return normalized(q);
    }
  }

 private:
  std::uint32_t state_;
};

}  // namespace strix
