/// The filter's scalar updates: the second half of ESKF.h, which includes it.
///
/// Each has P H^T in a column, the residual z - h(x) - H dx and its variance S = H P H^T + R; then
/// the gate, dx += K r and P -= K (P H^T)^T with K = P H^T/S.
#pragma once

#include "ESKF.h"

namespace strix {

template <int States>
template <int Bias>
void ESKF<States>::updateDirection(Innovation& record, const Triple& measured,
                                   const Triple& predicted, float variance) {
  const Triple innovation = measured - predicted;
  scalarMagTiltUpdate<0, Bias>(record, innovation.x, predicted, variance);
  scalarMagTiltUpdate<1, Bias>(record, innovation.y, predicted, variance);
  scalarMagTiltUpdate<2, Bias>(record, innovation.z, predicted, variance);
}

template <int States>
template <int Axis, int Bias>
void ESKF<States>::scalarMagTiltUpdate(Innovation& record, float innovation,
                                       const Triple& predicted, float variance) {
  // Row Axis of [a x] is -a_k at j and a_j at k, with (Axis, j, k) in cyclic order.
  constexpr int kJ = (Axis + 1) % 3;
  constexpr int kK = (Axis + 2) % 3;
  const float hj = -predicted.get(kK);
  const float hk = predicted.get(kJ);
  Vector column;  // P H^T
  unrolled<States>([&](auto row) STRIX_INLINE {
    float sum = hj * p_.template element<row(), kAlpha + kJ>() +
                hk * p_.template element<row(), kAlpha + kK>();
    if constexpr (kBiases) sum += p_.template element<row(), Bias + Axis>();
    column[row] = sum;
  });
  float residual = innovation - hj * dx_[kAlpha + kJ] - hk * dx_[kAlpha + kK];
  float expected = hj * column[kAlpha + kJ] + hk * column[kAlpha + kK];  // H P H^T
  if constexpr (kBiases) {
    residual -= dx_[Bias + Axis];
    expected += column[Bias + Axis];
  }
  // A direction that is taken in again is believed little: one axis of it, given to a wide-open
  // attitude, would tip that over.
  float spread = 0.0F;
  if (!gate(record, residual, expected + variance, spread)) return;
  if constexpr (Bias == kMagBias) {
    // But a heading may be wrong, as nothing else holds it: where a turn about the vertical, of at
    // most half a turn, explains the residual, the filter gets that unsure of it.
    if (spread > 0.0F) {
      const Triple d(downInBody(state_.attitude));
      const float hd = hj * d.get(kJ) + hk * d.get(kK);
      if (spread < square(kPi * hd)) {
        spreadAlpha(d, spread / square(hd));
        unrolled<3>([&](auto i) STRIX_INLINE { column[kAlpha + i()] += spread / hd * d.get(i); });
      }
    }
  }
  applyScalar(column, residual, expected + variance + spread);
}

template <int States>
template <int Index>
void ESKF<States>::scalarGPSAltUpdate(Innovation& record, float innovation, float variance) {
  const float residual = innovation - dx_[Index];
  const float residualVariance = p_.template element<Index, Index>() + variance;
  float spread = 0.0F;
  if (!gate(record, residual, residualVariance, spread)) return;
  p_.template element<Index, Index>() += spread;
  // A velocity goes wrong by a tilt that does, and that by a gyro that drifts: it may be this that
  // the filter was too sure of.
  if constexpr (kBiases && Index >= kVelocity && Index < kVelocity + 3) {
    if (spread > 0.0F) p_.template addDiagonal<kGyroBias>(square(config_.readmitGyroBias));
  }
  applyScalar(column<Index>(), residual, residualVariance + spread);
}

/// The usual gain K = c/S, c = P H^T, but for its part e = d (d . K_alpha) about the vertical, d
/// down in the body: K - e. Joseph's form P - (K-e) c^T - c (K-e)^T + S (K-e)(K-e)^T is then the
/// usual P - c c^T/S with S e e^T given back.
template <int States>
template <int Index>
void ESKF<States>::scalarAssumedUpdate(float innovation, float variance, bool keepHeading) {
  const float residual = innovation - dx_[Index];
  const float s = p_.template element<Index, Index>() + variance;
  if (!(square(residual) <= config_.nisGate * s)) return;
  const Vector c = column<Index>();
  applyScalar(c, residual, s);
  if (!keepHeading) return;
  const Triple d(downInBody(state_.attitude));
  const Triple e = (dot(d, {c[kAlpha], c[kAlpha + 1], c[kAlpha + 2]}) / s) * d;
  unrolled<3>([&](auto i) STRIX_INLINE {
    dx_[kAlpha + i()] -= e.get(i) * residual;
    unrolled<3>([&](auto j) STRIX_INLINE {
      if constexpr (i() <= j()) {
        p_.template element<kAlpha + i(), kAlpha + j()>() += s * e.get(i) * e.get(j);
      }
    });
  });
}

template <int States>
template <int Index>
auto ESKF<States>::column() const -> Vector {
  Vector column;
  unrolled<States>([&](auto row)
                       STRIX_INLINE { column[row] = p_.template element<row(), Index>(); });
  return column;
}

/// Heading alone: how far the measured field, seen level, points from the reference's heading. The
/// gain is projected on the vertical, K_alpha = d (d . P d)/S with d down in the body, the gyro
/// bias's likewise, and zero else: no field can tilt the attitude, now or later. P stays a
/// covariance with any gain when P' = P - K c^T - c K^T + S K K^T, c = P H^T (Joseph's form).
template <int States>
void ESKF<States>::updateHeading(const Vector3f& mag, float variance) {
  const Matrix3f nedToBody = q2R(state_.attitude);
  const Vector3f down = nedToBody.col(2);
  const Vector3f level = nedToBody.transpose() * mag;
  const Vector3f& ref = magReference_;
  const float horizontal2 = square(ref.x()) + square(ref.y());
  if (!(square(level.x()) + square(level.y()) > kLeastField2 * horizontal2)) return;
  const float innovation = arcTangent2(level.x() * ref.y() - level.y() * ref.x(),
                                       level.x() * ref.x() + level.y() * ref.y());
  const Triple d(down);
  // A tilt error turns part of the vertical field into the horizontal one, as the reference goes.
  const Vector3f row{-ref.x() * ref.z() / horizontal2, -ref.y() * ref.z() / horizontal2, 1.0F};
  const Triple h(Vector3f(nedToBody * row));
  const Vector3f biasRow{ref.y() / horizontal2, -ref.x() / horizontal2, 0.0F};
  const Triple hBias(Vector3f(nedToBody * biasRow));
  const auto times = [&](const Vector& x) STRIX_INLINE {  // H x
    float sum = dot(h, {x[kAlpha], x[kAlpha + 1], x[kAlpha + 2]});
    if constexpr (kBiases) sum += dot(hBias, {x[kMagBias], x[kMagBias + 1], x[kMagBias + 2]});
    return sum;
  };
  Vector c;
  unrolled<States>([&](auto i) STRIX_INLINE {
    c[i] = dot(h, p_.template triple<kAlpha, i()>());
    if constexpr (kBiases) c[i] += dot(hBias, p_.template triple<kMagBias, i()>());
  });
  const float residual = innovation - times(dx_);
  const float expected = times(c);
  float spread = 0.0F;
  if (!gate(mag_, residual, expected + variance, spread)) return;
  if (spread > 0.0F) {  // about the vertical
    unrolled<3>([&](auto i) STRIX_INLINE { c[kAlpha + i()] += spread * d.get(i); });
    spreadAlpha(d, spread);
  }
  const float s = expected + variance + spread;
  // The part of K = c/S about the vertical, of the attitude and of the gyro's bias.
  Vector gain{};
  const auto keepVertical = [&](auto block) STRIX_INLINE {
    constexpr int kBlock = block;
    const float vertical = dot(d, {c[kBlock], c[kBlock + 1], c[kBlock + 2]}) / s;
    unrolled<3>([&](auto i) STRIX_INLINE { gain[kBlock + i()] = vertical * d.get(i); });
  };
  keepVertical(std::integral_constant<int, kAlpha>{});
  if constexpr (kBiases) keepVertical(std::integral_constant<int, kGyroBias>{});
  unrolled<States>([&](auto i) STRIX_INLINE {
    constexpr bool kRow = headingMoves(i());
    if constexpr (kRow) dx_[i()] += gain[i()] * residual;
    unrolled<States>([&](auto j) STRIX_INLINE {
      constexpr bool kColumn = headingMoves(j());
      if constexpr (i() <= j() && (kRow || kColumn)) {
        float& p = p_.template element<i(), j()>();
        if constexpr (kRow) p -= gain[i()] * c[j()];
        if constexpr (kColumn) p -= c[i()] * gain[j()];
        if constexpr (kRow && kColumn) p += s * gain[i()] * gain[j()];
      }
    });
  });
}

template <int States>
inline bool ESKF<States>::gate(Innovation& record, float residual, float residualVariance,
                               float& spread) {
  const float nis = residual * residual / residualVariance;
  if (nis <= config_.nisGate) {  // false for NaN: nothing spreads
    record.accept(residual, residualVariance, nis);
    return true;
  }
  const Micros patience = isFinite(nis) ? config_.readmitAfter : 0;
  const bool again = record.reject(residual, residualVariance, nis, now_, patience);
  if (again) spread = square(residual);
  return again;
}

template <int States>
void ESKF<States>::applyScalar(const Vector& column, float residual, float residualVariance) {
  const float inverse = 1.0F / residualVariance;
  const float scaled = residual * inverse;
  unrolled<States>([&](auto i) STRIX_INLINE { dx_[i] += column[i] * scaled; });
  p_.subtractSquare(inverse, column);
}

}  // namespace strix
