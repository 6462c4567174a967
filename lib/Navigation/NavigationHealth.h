/// What can be wrong with the estimate: one named bit each, for the state machine, the log and the
/// pilot.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "SymmetricMatrix.h"

namespace strix {

/// A set of the bits below.
using NavigationHealth = std::uint32_t;

namespace health {
constexpr NavigationHealth kNone = 0;
constexpr NavigationHealth kNotFinite = 1U << 0U;  ///< NaN or infinity in state or covariance
constexpr NavigationHealth kNotPositiveDefinite = 1U << 1U;  ///< covariance is none any more
constexpr NavigationHealth kRestarted = 1U << 2U;            ///< has begun anew from the fallback
constexpr NavigationHealth kAttitudesDisagree = 1U << 3U;  ///< filter against complementary filter
constexpr NavigationHealth kNoGps = 1U << 4U;              ///< no fix used for too long
constexpr NavigationHealth kNoAltimeter = 1U << 5U;        ///< no height used for too long
constexpr NavigationHealth kNoMagnetometer = 1U << 6U;     ///< no field used for too long

/// With these the state is not to be flown with.
constexpr NavigationHealth kLost = kNotFinite | kNotPositiveDefinite;
/// With these no flight begins.
constexpr NavigationHealth kNoArming = kLost | kRestarted | kAttitudesDisagree;
}  // namespace health

/// What the log says when a bit is set.
struct HealthText {
  NavigationHealth bit;
  const char* said;
};

constexpr std::array<HealthText, 7> kHealthTexts{{
    {health::kNotFinite, "estimator: NaN or infinity in its state"},
    {health::kNotPositiveDefinite, "estimator: covariance is not positive definite"},
    {health::kRestarted, "estimator: was lost and began anew from the fallback"},
    {health::kAttitudesDisagree, "estimator: tilt differs from the complementary filter's"},
    {health::kNoGps, "estimator: no GPS fix used for too long"},
    {health::kNoAltimeter, "estimator: no height used for too long"},
    {health::kNoMagnetometer, "estimator: no magnetic field used for too long"},
}};

/// Whether P is positive definite, by the square-root-free Cholesky factorisation P = L D L^T with
/// every D above zero. A state that is known exactly (a zero row, as of a bias that is switched
/// off) is left out. One row a step: the whole takes as long as all updates of a pass together.
template <int States>
class PositiveDefiniteCheck {
 public:
  /// Takes a copy of P. What an earlier one was found to be stays until step() is through.
  void start(const SymmetricMatrix<States>& p) {
    std::size_t element = 0;
    for (std::size_t column = 0; column < States; ++column) {
      for (std::size_t row = column; row < States; ++row) l_[row][column] = p.elements()[element++];
    }
    row_ = 0;
  }

  /// Factorises the next row, if there is one.
  void step() {
    if (row_ == States) return;
    if (!factorise(row_)) {
      row_ = States;
      definite_ = false;
    } else if (++row_ == States) {
      definite_ = true;
    }
  }

  [[nodiscard]] bool done() const { return row_ == States; }
  [[nodiscard]] bool definite() const { return definite_; }

 private:
  bool factorise(std::size_t i) {
    std::array<float, States>& row = l_[i];
    for (std::size_t j = 0; j < i; ++j) {  // row = L D
      const std::array<float, States>& upper = l_[j];
      float sum = row[j];
      for (std::size_t k = 0; k < j; ++k) sum -= row[k] * upper[k];
      if (inverse_[j] == 0.0F && sum != 0.0F) return false;  // correlated with a known one
      row[j] = sum;
    }
    const float variance = row[i];
    float d = variance;
    for (std::size_t k = 0; k < i; ++k) {  // row = L
      const float scaled = row[k];
      row[k] = scaled * inverse_[k];
      d -= scaled * row[k];
    }
    const bool known = variance == 0.0F && d == 0.0F;
    inverse_[i] = known ? 0.0F : 1.0F / d;
    return known || d > 0.0F;
  }

  std::array<std::array<float, States>, States> l_{};  ///< P, then row by row L; below D only
  std::array<float, States> inverse_{};                ///< 1 / D; 0 for a state known exactly
  std::size_t row_ = States;                           ///< next
  bool definite_ = true;
};

/// The same at once.
template <int States>
[[nodiscard]] bool isPositiveDefinite(const SymmetricMatrix<States>& p) {
  PositiveDefiniteCheck<States> check;
  check.start(p);
  while (!check.done()) check.step();
  return check.definite();
}

}  // namespace strix
