/// What one measurement told the filter, kept for the log and the health checks.
#pragma once

#include <array>
#include <cstdint>

namespace strix {

/// Largest number of scalars in one measurement (GPS: p_n, p_e, v_n, v_e).
constexpr std::size_t kMaxScalars = 4;

/// Innovations of the scalars of one measurement, in the measurement's unit.
struct Innovation {
  std::array<float, kMaxScalars> value{};     ///< z - h(x) - H dx
  std::array<float, kMaxScalars> variance{};  ///< H P H^T + R
  std::array<float, kMaxScalars> nis{};       ///< value^2 / variance, chi-square with 1 dof
  std::uint8_t count = 0;                     ///< scalars in this measurement
  std::uint8_t rejected = 0;                  ///< bit i: scalar i failed the gate
  std::uint32_t rejections = 0;               ///< rejected scalars since the start
  std::uint32_t accepted = 0;                 ///< accepted scalars since the start

  /// Begins a new measurement; the two totals go on.
  void begin() {
    count = 0;
    rejected = 0;
  }

  /// Records the next scalar of the measurement.
  void add(float residual, float residualVariance, float residualNis, bool accept) {
    value[count] = residual;
    variance[count] = residualVariance;
    nis[count] = residualNis;
    if (!accept) rejected = static_cast<std::uint8_t>(rejected | (1U << count));
    ++(accept ? accepted : rejections);
    ++count;
  }
};

}  // namespace strix
