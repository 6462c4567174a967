/// Mean and scatter of readings, and the signs of a sensor that is stuck or at its end.
#pragma once

#include <cstdint>

#include "Mathpk.h"

namespace strix {

/// Mean and standard deviation of each axis (B. P. Welford, 1962), counted from the first reading:
/// a pressure of 100 kPa would leave no digits for its noise.
class Statistics {
 public:
  /// @param range  an axis at 99.9 % of it counts as clipped, one beyond it or NaN as unsound
  explicit Statistics(float range) : range_(range) {}

  void add(const Vector3f& value) {
    if (!isFinite(value) || value.cwiseAbs().maxCoeff() > range_) {
      ++unsound_;
      return;
    }
    if (value.cwiseAbs().maxCoeff() > 0.999F * range_) ++clipped_;
    if (count_ == 0) first_ = value;
    run_ = count_ != 0 && value == last_ ? run_ + 1 : 1;
    if (run_ > longestRun_) longestRun_ = run_;
    last_ = value;
    ++count_;
    const Vector3f offset = value - first_;
    const Vector3f before = offset - mean_;
    mean_ += before / static_cast<float>(count_);
    squares_ += before.cwiseProduct(offset - mean_);
  }

  void clear() { *this = Statistics(range_); }

  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] std::uint32_t unsound() const { return unsound_; }
  [[nodiscard]] std::uint32_t clipped() const { return clipped_; }
  /// Most equal readings in a row.
  [[nodiscard]] std::uint32_t longestRun() const { return longestRun_; }
  [[nodiscard]] Vector3f mean() const { return first_ + mean_; }
  [[nodiscard]] Vector3f deviation() const {
    if (count_ < 2) return Vector3f::Zero();
    const Vector3f variance = squares_ / static_cast<float>(count_ - 1);
    return {squareRoot(variance.x()), squareRoot(variance.y()), squareRoot(variance.z())};
  }

 private:
  float range_;
  std::uint32_t count_ = 0;
  std::uint32_t unsound_ = 0;
  std::uint32_t clipped_ = 0;
  std::uint32_t run_ = 0;
  std::uint32_t longestRun_ = 0;
  Vector3f first_ = Vector3f::Zero();
  Vector3f last_ = Vector3f::Zero();
  Vector3f mean_ = Vector3f::Zero();
  Vector3f squares_ = Vector3f::Zero();
};

}  // namespace strix
