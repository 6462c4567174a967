/// How the filter's errors move from one IMU sample to the next (DESIGN.md, 4).
///
///     d(dp) = dv    d(dv) = -R^T ([f x] alpha + db_a)    d(alpha) = -[w x] alpha - db_g
///
/// with R the NED-to-body matrix, f the specific force and w the rate in the body frame. The biases
/// are random walks. F is the matrix of these equations.
#pragma once

#include "SymmetricMatrix.h"

namespace strix {

/// First element of each block of the error state. The 9-state filter ends before the biases.
enum ErrorBlock : int {
  kPosition = 0,   ///< dp, m, NED
  kVelocity = 3,   ///< dv, m/s, NED
  kAlpha = 6,      ///< alpha, rad, body: q_true = q (x) [1, alpha/2]
  kAccelBias = 9,  ///< db_a, m/s^2, body
  kGyroBias = 12,  ///< db_g, rad/s, body
  kMagBias = 15,   ///< db_m, uT, body
};

/// Power spectral densities of the white noises that drive the error: the diagonal of Q_c.
struct ProcessNoise {
  float accel = 0.0F;      ///< (m/s^2)^2 / Hz
  float gyro = 0.0F;       ///< (rad/s)^2 / Hz
  float accelBias = 0.0F;  ///< (m/s^2)^2 / s
  float gyroBias = 0.0F;   ///< (rad/s)^2 / s
  float magBias = 0.0F;    ///< uT^2 / s
};

/// The error dynamics over one step.
template <int States>
class ErrorDynamics {
  static_assert(States == 9 || States == 18, "p, v, attitude; with or without the three biases");

 public:
  static constexpr bool kBiases = States == 18;
  using Covariance = SymmetricMatrix<States>;
  using Dense = typename Covariance::Dense;

  /// @param bodyToNed  R^T    @param force  f, m/s^2    @param rate  w, rad/s    @param dt  s
  STRIX_INLINE ErrorDynamics(const TripleRows& bodyToNed, const Triple& force, const Triple& rate,
                             float dt)
      : bodyToNed_(bodyToNed), force_(force), rate_(rate), dt_(dt) {}

  /// Phi = I + F dt.
  [[nodiscard]] Dense transition() const { return Dense::Identity() + dt_ * system(); }

  /// Q_d = integral over dt of (I + F s) Q_c (I + F s)^T ds
  ///     = Q_c dt + (F Q_c + Q_c F^T) dt^2/2 + F Q_c F^T dt^3/3.
  [[nodiscard]] Dense noise(const ProcessNoise& density) const;

  /// P' = Phi P Phi^T + Q_d, without a product of States x States matrices.
  STRIX_INLINE void propagate(Covariance& p, const ProcessNoise& density) const;

 private:
  [[nodiscard]] Dense system() const;
  STRIX_INLINE void move(Covariance& p) const;

  TripleRows bodyToNed_;
  Triple force_;
  Triple rate_;
  float dt_;
};

template <int States>
auto ErrorDynamics<States>::system() const -> Dense {
  Dense f = Dense::Zero();
  f.template block<3, 3>(kPosition, kVelocity).setIdentity();
  f.template block<3, 3>(kVelocity, kAlpha) = -bodyToNed_.matrix() * skew(force_.vector());
  f.template block<3, 3>(kAlpha, kAlpha) = -skew(rate_.vector());
  if constexpr (kBiases) {
    f.template block<3, 3>(kVelocity, kAccelBias) = -bodyToNed_.matrix();
    f.template block<3, 3>(kAlpha, kGyroBias) = -Matrix3f::Identity();
  }
  return f;
}

template <int States>
auto ErrorDynamics<States>::noise(const ProcessNoise& density) const -> Dense {
  Dense qc = Dense::Zero();
  const auto set = [&qc](int block, float value) {
    qc.diagonal().template segment<3>(block).setConstant(value);
  };
  set(kVelocity, density.accel);
  set(kAlpha, density.gyro);
  if constexpr (kBiases) {
    set(kAccelBias, density.accelBias);
    set(kGyroBias, density.gyroBias);
    set(kMagBias, density.magBias);
  }
  const Dense f = system();
  const Dense fq = f * qc;
  const Dense first = fq + fq.transpose();
  const Dense second = fq * f.transpose();
  return dt_ * qc + (0.5F * dt_ * dt_) * first + (dt_ * dt_ * dt_ / 3.0F) * second;
}

/// Half of the noise comes before the step and half after it (the trapezoidal rule):
/// Phi (Q_c dt/2) Phi^T + Q_c dt/2. These are the first two terms of noise(), and its third with
/// dt^3/2 in place of dt^3/3: a part (|F| dt)^2/6 of the noise, 2e-6 at 1 kHz, for a tenth of the
/// instructions.
template <int States>
inline void ErrorDynamics<States>::propagate(Covariance& p, const ProcessNoise& density) const {
  const float half = 0.5F * dt_;
  const ProcessNoise noise{half * density.accel, half * density.gyro, half * density.accelBias,
                           half * density.gyroBias, dt_ * density.magBias};
  const auto addNoise = [&p, noise]() STRIX_INLINE {
    p.template addDiagonal<kVelocity>(noise.accel);
    p.template addDiagonal<kAlpha>(noise.gyro);
    if constexpr (kBiases) {
      p.template addDiagonal<kAccelBias>(noise.accelBias);
      p.template addDiagonal<kGyroBias>(noise.gyroBias);
    }
  };
  addNoise();
  move(p);
  addNoise();
  if constexpr (kBiases)
    p.template addDiagonal<kMagBias>(noise.magBias);  // whole: it moves nothing
}

/// P to Phi P Phi^T. As dp' needs dv, dv' needs alpha and db_a, and alpha' needs itself and db_g,
/// Phi is the product of three steps, one a row of blocks, each of which finds the others' old
/// values. Each step S moves the rows of P, then its columns: S P S^T. Of the block where both
/// meet only the upper triangle is made.
template <int States>
inline void ErrorDynamics<States>::move(Covariance& p) const {
  const float dt = dt_;
  const TripleRows bodyToNed = -dt * bodyToNed_;
  const Triple force = force_;
  const TripleRows rotation = kBiases ? bodyToNed : timesSkew(bodyToNed, force);
  const Triple turn = dt * rate_;

  // What dt adds to dv and to alpha in one column of P.
  const auto velocityStep = [&](auto column) STRIX_INLINE {
    constexpr int kColumn = column;
    const Triple alpha = p.template triple<kAlpha, kColumn>();
    if constexpr (kBiases) {
      return rotation * (cross(force, alpha) + p.template triple<kAccelBias, kColumn>());
    } else {
      return rotation * alpha;
    }
  };
  const auto attitudeStep = [&](const Triple& alpha, auto column) STRIX_INLINE {
    constexpr int kColumn = column;
    Triple step = cross(alpha, turn);
    if constexpr (kBiases) step = step - dt * p.template triple<kGyroBias, kColumn>();
    return step;
  };
  const auto upperTriangle = [](auto&& f) STRIX_INLINE {
    unrolled<3>([&](auto row) STRIX_INLINE {
      unrolled<3>([&](auto column) STRIX_INLINE {
        if constexpr (row() <= column()) f(row, column);
      });
    });
  };

  {  // dp' = dp + dt dv
    Triple before[3];
    unrolled<3>([&](auto i)
                    STRIX_INLINE { before[i] = p.template triple<kPosition, kVelocity + i()>(); });
    unrolled<States - kVelocity>([&](auto j) STRIX_INLINE {
      constexpr int kColumn = kVelocity + j();
      p.template add<kPosition, kColumn>(dt * p.template triple<kVelocity, kColumn>());
    });
    upperTriangle([&](auto row, auto column) STRIX_INLINE {
      p.template element<kPosition + row(), kPosition + column()>() +=
          dt *
          (before[row].get(column) + p.template element<kPosition + row(), kVelocity + column()>());
    });
  }
  {  // dv' = dv - dt R^T ([f x] alpha + db_a)
    Triple before[3];
    Triple after[3];
    unrolled<3>([&](auto i) STRIX_INLINE {
      before[i] = velocityStep(std::integral_constant<int, kVelocity + i()>{});
    });
    unrolled<States>([&](auto column) STRIX_INLINE {
      if constexpr (column() < kVelocity || column() >= kVelocity + 3) {
        p.template add<kVelocity, column()>(velocityStep(column));
      }
    });
    unrolled<3>([&](auto i) STRIX_INLINE {
      after[i] = velocityStep(std::integral_constant<int, kVelocity + i()>{});
    });
    upperTriangle([&](auto row, auto column) STRIX_INLINE {
      p.template element<kVelocity + row(), kVelocity + column()>() +=
          before[column].get(row) + after[row].get(column);
    });
  }
  {  // alpha' = alpha - dt ([w x] alpha + db_g)
    Triple half[3];
    unrolled<3>([&](auto i) STRIX_INLINE {
      const Triple alpha = p.template triple<kAlpha, kAlpha + i()>();
      half[i] = alpha + attitudeStep(alpha, std::integral_constant<int, kAlpha + i()>{});
    });
    unrolled<States>([&](auto column) STRIX_INLINE {
      if constexpr (column() < kAlpha || column() >= kAlpha + 3) {
        p.template add<kAlpha, column()>(
            attitudeStep(p.template triple<kAlpha, column()>(), column));
      }
    });
    Triple after[3];
    unrolled<3>([&](auto i) STRIX_INLINE {
      const Triple alpha{half[0].get(i), half[1].get(i), half[2].get(i)};
      after[i] = alpha + attitudeStep(alpha, std::integral_constant<int, kAlpha + i()>{});
    });
    upperTriangle([&](auto row, auto column) STRIX_INLINE {
      p.template element<kAlpha + row(), kAlpha + column()>() = after[row].get(column);
    });
  }
}

}  // namespace strix
