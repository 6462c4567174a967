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

/// True if P is positive definite, by the square-root-free Cholesky factorisation P = L D L^T with
/// every D above zero. A state that is known exactly (a zero row, as of a bias that is switched
/// off) is left out.
template <int States>
[[nodiscard]] bool isPositiveDefinite(const SymmetricMatrix<States>& p) {
  std::array<std::array<float, States>, States> l{};
  std::array<float, States> d{};
  for (std::size_t i = 0; i < States; ++i) {
    const auto row = static_cast<int>(i);
    for (std::size_t j = 0; j <= i; ++j) {
      float sum = p(row, static_cast<int>(j));
      for (std::size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k] * d[k];
      if (j == i) {
        d[i] = sum;
      } else {
        if (d[j] == 0.0F && sum != 0.0F) return false;  // correlated with what is known exactly
        l[i][j] = d[j] > 0.0F ? sum / d[j] : 0.0F;
      }
    }
    const bool known = p(row, row) == 0.0F && d[i] == 0.0F;
    if (!known && !(d[i] > 0.0F)) return false;
  }
  return true;
}

}  // namespace strix
