/// What one measurement told the filter, kept for the log and the health checks.
#pragma once

#include <array>
#include <cstdint>

#include "Time.h"

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
  std::uint32_t readmissions = 0;             ///< scalars taken in again after a long rejection

  /// Begins a new measurement; the totals go on.
  void begin() {
    count = 0;
    rejected = 0;
  }

  /// True if any scalar of this measurement passed its gate.
  [[nodiscard]] bool anyAccepted() const { return rejected != (1U << count) - 1U; }

  /// Records the next scalar of the measurement, one that passed its gate.
  void accept(float residual, float residualVariance, float residualNis) {
    failing_[count] = false;
    ++accepted;
    set(residual, residualVariance, residualNis);
  }

  /// Records one that failed it. Out of the way of those that pass.
  /// @param now  time of the filter    @param patience  us; 0 is endless
  /// @return true if this scalar has gone on failing for longer than `patience`: the filter is then
  /// so sure of itself that it locks the sensor out, and should take it in again
  [[gnu::noinline]] bool reject(float residual, float residualVariance, float residualNis,
                                Micros now, Micros patience) {
    const std::size_t i = count;
    ++rejections;
    rejected = static_cast<std::uint8_t>(rejected | (1U << i));
    // Two lone outliers with a long silence between them are two, not one long failure.
    const bool goesOn = failing_[i] && elapsed(now, failedLast_[i]) <= patience;
    failedLast_[i] = now;
    if (!goesOn) failingSince_[i] = now;
    const bool locked = patience != 0 && elapsed(now, failingSince_[i]) > patience;
    failing_[i] = !locked;
    if (locked) ++readmissions;
    set(residual, residualVariance, residualNis);
    return locked;
  }

 private:
  void set(float residual, float residualVariance, float residualNis) {
    const std::size_t i = count++;
    value[i] = residual;
    variance[i] = residualVariance;
    nis[i] = residualNis;
  }

  std::array<bool, kMaxScalars> failing_{};
  std::array<Micros, kMaxScalars> failingSince_{};
  std::array<Micros, kMaxScalars> failedLast_{};
};

}  // namespace strix
