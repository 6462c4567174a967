/// Numbers that change from call to call, the same in every run.
#pragma once

#include <Vector3f.h>

#include <cstdint>

namespace m7 {

/// Even noise in [-1, 1) (constants: Numerical Recipes, "ranqd1").
class Noise {
 public:
  float operator()() {
    seed_ = seed_ * 1664525U + 1013904223U;
    return static_cast<float>(static_cast<std::int32_t>(seed_)) * 0x1p-31F;
  }
  strix::Vector3f vector(float scale) {
    const float x = (*this)();
    const float y = (*this)();
    const float z = (*this)();
    return {scale * x, scale * y, scale * z};
  }

 private:
  std::uint32_t seed_ = 1;
};

}  // namespace m7
