/// Error-state Kalman filter with 9 or 18 states (DESIGN.md, 4; Sola, arXiv 1711.02508).
///
/// Nominal state: position and velocity (NED), attitude q and, with 18 states, the biases of
/// accelerometer, gyro and magnetometer. ErrorDynamics.h has the error state and how it moves.
/// Measurements come in as scalars, one after the other; they change dx and P only. injectError()
/// moves dx into the nominal state, once a loop pass.
#pragma once

#include "Alignment.h"
#include "ErrorDynamics.h"
#include "Innovation.h"
#include "Mathpk.h"
#include "NavigationConfig.h"

namespace strix {

[[nodiscard]] constexpr float square(float x) { return x * x; }

template <int States>
class ESKF {
 public:
  static constexpr int kStates = States;
  static constexpr bool kBiases = ErrorDynamics<States>::kBiases;
  using Vector = std::array<float, States>;
  using Matrix = Eigen::Matrix<float, States, States>;

  explicit ESKF(const NavigationConfig& config);

  /// Starts from rest at the origin with a known attitude and no bias known.
  /// Until then every call below does nothing.
  /// @param gravity  norm of the specific force at rest, m/s^2
  void initialize(const Alignment& alignment, float gravity);

  /// Begins anew in flight, with a state from elsewhere and little trust in it.
  void restart(const Quaternion& attitude, const Vector3f& positionNed,
               const Vector3f& velocityNed);

  /// Power spectral densities from now on.
  /// @param accel  (m/s^2)^2 / Hz    @param gyro  (rad/s)^2 / Hz
  void setNoise(float accel, float gyro) {
    noise_.accel = accel;
    noise_.gyro = gyro;
  }

  /// Moves the nominal state and the covariance on to `now`. The first call only sets the time.
  /// @param accel  measured specific force, m/s^2, body    @param gyro  measured rate, rad/s, body
  void predict(const Vector3f& accel, const Vector3f& gyro, Micros now);

  /// Gravity direction, used while the specific force is nearly g long: | |a| - g | < tiltGate.
  /// @param accel  the sample given to predict, m/s^2, body
  /// @param inflation  factor on the variance; zero: not used
  /// @param extraDensity2  added to the noise's squared density, (m/s^2)^2 / Hz
  void updateTiltMeas(const Vector3f& accel, float inflation = 1.0F, float extraDensity2 = 0.0F);

  /// Magnetic field, as config.magFusion says. Like height, not used before the first prediction:
  /// until then no time is known from which `now` counts.
  /// @param mag  uT, body    @param inflation  factor on the variance; zero: not used
  void updateMagMeas(const Vector3f& mag, Micros now, float inflation = 1.0F);

  /// Height above the start, m, up positive.
  void updateAltMeas(float height, Micros now);

  /// GPS fix in the local frame.
  /// @param positionNed  m; down is not used    @param velocityNed  m/s; down is not used
  void updateGPSMeas(const Vector3f& positionNed, const Vector3f& velocityNed);

  /// The aircraft does not move: v = 0, three scalars (ZUPT). Never from a sensor in flight.
  void updateStandstill();

  /// The mean rate measured while the aircraft does not move is the gyro's bias.
  /// @param meanGyro  rad/s, body    @param sigma  rad/s
  void updateStandstillRate(const Vector3f& meanGyro, float sigma);

  /// Moves dx into the nominal state and clears it. The reset Jacobian I - [alpha/2 x] (Sola,
  /// eq. 287) is taken into account by the next predict.
  void injectError();

  /// One component of a measured direction: h = R ref + b, with H_alpha = row Axis of
  /// [predicted x] and H_bias = 1 at Bias + Axis.
  /// @tparam Bias  the block of the bias; none where the filter has none
  /// @param innovation  z - h(x), without dx
  template <int Axis, int Bias>
  void scalarMagTiltUpdate(Innovation& record, float innovation, const Triple& predicted,
                           float variance);

  /// One scalar that measures one error state directly: H = 1 at Index.
  template <int Index>
  void scalarGPSAltUpdate(Innovation& record, float innovation, float variance);

  /// One scalar that is assumed and not measured. It may be wrong for long, so unlike a sensor it
  /// is never taken in again once the gate rejects it.
  /// @param keepHeading  its gain gets no part that turns the attitude about the vertical
  template <int Index>
  void scalarAssumedUpdate(float innovation, float variance, bool keepHeading);

  /// Phi = I + F dt.
  [[nodiscard]] static Matrix getSTM(const Matrix3f& nedToBody, const Vector3f& force,
                                     const Vector3f& rate, float dt) {
    return dynamics(nedToBody, force, rate, dt).transition();
  }
  /// Q_d = integral over dt of (I + F s) Q_c (I + F s)^T ds.
  [[nodiscard]] Matrix getQd(const Matrix3f& nedToBody, const Vector3f& force, const Vector3f& rate,
                             float dt) const {
    return dynamics(nedToBody, force, rate, dt).noise(noise_);
  }

  [[nodiscard]] const VehicleState& state() const { return state_; }
  [[nodiscard]] const Vector3f& accelBias() const { return accelBias_; }  ///< m/s^2, body
  [[nodiscard]] const Vector3f& gyroBias() const { return gyroBias_; }    ///< rad/s, body
  [[nodiscard]] const Vector3f& magBias() const { return magBias_; }      ///< uT, body
  [[nodiscard]] const SymmetricMatrix<States>& packedCovariance() const { return p_; }
  [[nodiscard]] Matrix covariance() const { return p_.dense(); }
  [[nodiscard]] const Vector& error() const { return dx_; }
  [[nodiscard]] const Vector3f& magReference() const { return magReference_; }
  [[nodiscard]] float gravity() const { return gravity_; }
  [[nodiscard]] bool aligned() const { return aligned_; }
  [[nodiscard]] const Innovation& tiltInnovation() const { return tilt_; }
  [[nodiscard]] const Innovation& magInnovation() const { return mag_; }
  [[nodiscard]] const Innovation& altInnovation() const { return alt_; }
  [[nodiscard]] const Innovation& gpsInnovation() const { return gps_; }

  /// The field that R maps to the measured one, uT, NED: what an alignment found, or a new place.
  void setMagReference(const Vector3f& reference) { magReference_ = reference; }

  /// False for NaN or infinity in position, velocity or attitude: seen right after predict.
  [[nodiscard]] bool finite() const {
    const Quaternion& q = state_.attitude;
    return isFinite(state_.positionNed.sum() + state_.velocityNed.sum() + q.w + q.x + q.y + q.z);
  }

  /// False once a state or a variance is not finite, or a variance is negative.
  [[nodiscard]] bool healthy() const;

 private:
  [[nodiscard]] static ErrorDynamics<States> dynamics(const Matrix3f& nedToBody,
                                                      const Vector3f& force, const Vector3f& rate,
                                                      float dt) {
    return {transposedRowsOf(nedToBody), Triple(force), Triple(rate), dt};
  }
  STRIX_INLINE void propagateCovariance(const TripleRows& bodyToNed, const Triple& force,
                                        const Triple& rate, float dt) {
    ErrorDynamics<States>(bodyToNed, force, rate, dt).propagate(p_, noise_);
  }

  /// No bias known, no correction pending, and these uncertainties.
  void setCovariance(float positionSigma, float velocitySigma, float tiltSigma, float headingSigma);

  template <int Bias>
  void updateDirection(Innovation& record, const Triple& measured, const Triple& predicted,
                       float variance);
  /// Part of the reference's horizontal field, squared, below which a field has no heading.
  static constexpr float kLeastField2 = 0.01F;
  void updateHeading(const Vector3f& mag, float variance);
  /// Whether updateHeading may move error state i.
  [[nodiscard]] static constexpr bool headingMoves(int i) {
    return (i >= kAlpha && i < kAlpha + 3) || (i >= kGyroBias && i < kGyroBias + 3);
  }

  /// True if the scalar counts. One that failed its gate for too long counts again: `spread` then
  /// is the variance that something was less sure of than it knew, else zero.
  [[nodiscard]] STRIX_INLINE bool gate(Innovation& record, float residual, float residualVariance,
                                       float& spread);

  /// Makes the attitude less sure of a turn about `axis`, length one, by `variance`, rad^2.
  void spreadAlpha(const Triple& axis, float variance) {
    unrolled<3>([&](auto i) STRIX_INLINE {
      unrolled<3>([&](auto j) STRIX_INLINE {
        if constexpr (i() <= j()) {
          p_.template element<kAlpha + i(), kAlpha + j()>() += variance * axis.get(i) * axis.get(j);
        }
      });
    });
  }

  /// dx += K r and P -= K (P H^T)^T.
  /// @param column  P H^T    @param residual  z - h(x) - H dx    @param residualVariance  H P H^T +
  /// R
  void applyScalar(const Vector& column, float residual, float residualVariance);

  /// Column Index of P.
  template <int Index>
  [[nodiscard]] Vector column() const;

  /// Time since `last`, at most kMaxPredictStep, s; moves `last` on to `now`.
  [[nodiscard]] static float secondsSince(Micros& last, Micros now);

  // What every call touches comes first: one address reaches it.
  SymmetricMatrix<States> p_;
  Vector dx_{};
  VehicleState state_;
  Triple reset_;  ///< rad, body: half of what was injected since the last prediction
  Vector3f accelBias_ = Vector3f::Zero();
  Vector3f gyroBias_ = Vector3f::Zero();
  Vector3f magBias_ = Vector3f::Zero();
  Vector3f magReference_ = Vector3f::Zero();
  ProcessNoise noise_;
  Innovation tilt_;
  Innovation mag_;
  Innovation alt_;
  Innovation gps_;
  Innovation standstill_;
  float gravity_ = kGravity;
  float dt_ = 0.0F;  ///< s, of the last prediction
  Micros now_ = 0;   ///< of the last prediction
  Micros lastMag_ = 0;
  Micros lastAlt_ = 0;
  bool aligned_ = false;
  bool started_ = false;  ///< has predicted since
  NavigationConfig config_;
};

/// A longer gap between two samples is taken as this long: the state is then no longer trusted by
/// its own covariance anyway, and one wild dt must not blow it up.
constexpr Micros kMaxPredictStep = 200'000;

template <int States>
ESKF<States>::ESKF(const NavigationConfig& config)
    : noise_{square(config.accelNoise), square(config.gyroNoise), square(config.accelBiasWalk),
             square(config.gyroBiasWalk), square(config.magBiasWalk)},
      config_(config) {}

template <int States>
float ESKF<States>::secondsSince(Micros& last, Micros now) {
  const Micros since = elapsed(now, last);
  last = now;
  return toSeconds(since < kMaxPredictStep ? since : kMaxPredictStep);
}

template <int States>
void ESKF<States>::initialize(const Alignment& alignment, float gravity) {
  aligned_ = true;
  started_ = false;
  state_ = VehicleState{};
  state_.attitude = alignment.attitude;
  magReference_ = alignment.magReference;
  gravity_ = gravity;
  setCovariance(config_.positionSigma0, config_.velocitySigma0, config_.tiltSigma0,
                config_.headingSigma0);
}

template <int States>
void ESKF<States>::restart(const Quaternion& attitude, const Vector3f& positionNed,
                           const Vector3f& velocityNed) {
  state_.attitude = attitude;
  state_.positionNed = positionNed;
  state_.velocityNed = velocityNed;
  constexpr float kPositionSigma = 10.0F;  // m
  constexpr float kVelocitySigma = 3.0F;   // m/s
  constexpr float kTiltSigma = 0.05F;      // rad: wider, and the first fixes would tilt it
  constexpr float kHeadingSigma = 0.2F;    // rad
  setCovariance(kPositionSigma, kVelocitySigma, kTiltSigma, kHeadingSigma);
}

template <int States>
void ESKF<States>::setCovariance(float positionSigma, float velocitySigma, float tiltSigma,
                                 float headingSigma) {
  accelBias_.setZero();
  gyroBias_.setZero();
  magBias_.setZero();
  dx_.fill(0.0F);
  reset_ = Triple{};
  // The uncertainty of heading is about the vertical, so alpha's block is rotated into the body.
  const Vector3f down = downInBody(state_.attitude);
  const float tilt = square(tiltSigma);
  Matrix p = Matrix::Zero();
  const auto set = [&p](int block, float sigma) {
    p.diagonal().template segment<3>(block).setConstant(square(sigma));
  };
  set(kPosition, positionSigma);
  set(kVelocity, velocitySigma);
  p.template block<3, 3>(kAlpha, kAlpha) =
      tilt * Matrix3f::Identity() + (square(headingSigma) - tilt) * down * down.transpose();
  if constexpr (kBiases) {
    set(kAccelBias, config_.accelBiasSigma0);
    set(kGyroBias, config_.gyroBiasSigma0);
    set(kMagBias, config_.magBiasSigma0);
  }
  p_.set(p);
}

template <int States>
void ESKF<States>::predict(const Vector3f& accel, const Vector3f& gyro, Micros now) {
  if (!aligned_) return;
  const Triple force = Triple(accel) - Triple(accelBias_);
  const Triple rate = Triple(gyro) - Triple(gyroBias_);
  state_.rateBody = rate.vector();
  if (!started_) {
    started_ = true;
    now_ = lastMag_ = lastAlt_ = now;
    return;
  }
  const float dt = secondsSince(now_, now);
  dt_ = dt;  // zero for a sample that comes twice: then there is no second tilt update either
  if (dt == 0.0F) return;

  const TripleRows bodyToNed = transposedRowsOf(q2R(state_.attitude));
  const Triple acceleration = bodyToNed * force + Triple{0.0F, 0.0F, gravity_};
  const Triple velocity(state_.velocityNed);
  state_.positionNed += (dt * velocity + (0.5F * dt * dt) * acceleration).vector();
  state_.velocityNed += (dt * acceleration).vector();
  state_.attitude = renormalized(state_.attitude * quaternionExp((dt * rate).vector()));
  // Injecting alpha turned the frame that alpha lives in, by alpha/2 (Sola, eq. 287): a turn that
  // P takes now, with that of the gyro.
  propagateCovariance(bodyToNed, force, rate + (1.0F / dt) * reset_, dt);
  reset_ = Triple{};
}

template <int States>
void ESKF<States>::updateTiltMeas(const Vector3f& accel, float inflation, float extraDensity2) {
  tilt_.begin();
  const float excess = accel.norm() - gravity_;
  if (dt_ == 0.0F || inflation == 0.0F ||
      !(excess < config_.tiltGate && excess > -config_.tiltGate))
    return;
  updateDirection<kAccelBias>(tilt_, Triple(accel) - Triple(accelBias_),
                              -gravity_ * Triple(downInBody(state_.attitude)),
                              inflation * (config_.tilt.variance(dt_) + extraDensity2 / dt_));
}

template <int States>
void ESKF<States>::updateMagMeas(const Vector3f& mag, Micros now, float inflation) {
  mag_.begin();
  const float dt = secondsSince(lastMag_, now);
  if (!started_ || inflation == 0.0F || magReference_.isZero(0.0F) || dt == 0.0F) return;
  if (config_.magFusion == MagFusion::HeadingOnly) {
    updateHeading(mag - magBias_, inflation * config_.heading.variance(dt));
  } else {
    updateDirection<kMagBias>(mag_, Triple(mag) - Triple(magBias_),
                              Triple(rotateToBody(state_.attitude, magReference_)),
                              inflation * config_.mag.variance(dt));
  }
}

template <int States>
void ESKF<States>::updateAltMeas(float height, Micros now) {
  alt_.begin();
  const float dt = secondsSince(lastAlt_, now);
  if (!started_ || dt == 0.0F) return;
  scalarGPSAltUpdate<kPosition + 2>(alt_, -height - state_.positionNed.z(),
                                    config_.alt.variance(dt));
}

template <int States>
void ESKF<States>::updateGPSMeas(const Vector3f& positionNed, const Vector3f& velocityNed) {
  gps_.begin();
  if (!aligned_) return;
  const float rp = square(config_.gpsPositionSigma);
  const float rv = square(config_.gpsVelocitySigma);
  const Vector3f position = positionNed - state_.positionNed;
  const Vector3f velocity = velocityNed - state_.velocityNed;
  scalarGPSAltUpdate<kPosition + 0>(gps_, position.x(), rp);
  scalarGPSAltUpdate<kPosition + 1>(gps_, position.y(), rp);
  scalarGPSAltUpdate<kVelocity + 0>(gps_, velocity.x(), rv);
  scalarGPSAltUpdate<kVelocity + 1>(gps_, velocity.y(), rv);
}

template <int States>
void ESKF<States>::updateStandstill() {
  standstill_.begin();
  if (!aligned_) return;
  const float variance = square(config_.standstillSigma);
  scalarGPSAltUpdate<kVelocity + 0>(standstill_, -state_.velocityNed.x(), variance);
  scalarGPSAltUpdate<kVelocity + 1>(standstill_, -state_.velocityNed.y(), variance);
  scalarGPSAltUpdate<kVelocity + 2>(standstill_, -state_.velocityNed.z(), variance);
}

template <int States>
void ESKF<States>::updateStandstillRate(const Vector3f& meanGyro, float sigma) {
  if constexpr (kBiases) {
    standstill_.begin();
    if (!aligned_) return;
    const Vector3f innovation = meanGyro - gyroBias_;
    scalarGPSAltUpdate<kGyroBias + 0>(standstill_, innovation.x(), square(sigma));
    scalarGPSAltUpdate<kGyroBias + 1>(standstill_, innovation.y(), square(sigma));
    scalarGPSAltUpdate<kGyroBias + 2>(standstill_, innovation.z(), square(sigma));
  }
}

template <int States>
void ESKF<States>::injectError() {
  const auto triple = [this](int block) {
    const auto i = static_cast<std::size_t>(block);
    return Vector3f{dx_[i], dx_[i + 1], dx_[i + 2]};
  };
  state_.positionNed += triple(kPosition);
  state_.velocityNed += triple(kVelocity);
  state_.attitude = injectRight(state_.attitude, triple(kAlpha));
  reset_ = reset_ + 0.5F * Triple(triple(kAlpha));
  if constexpr (kBiases) {
    accelBias_ += triple(kAccelBias);
    gyroBias_ += triple(kGyroBias);
    magBias_ += triple(kMagBias);
  }
  dx_.fill(0.0F);
}

template <int States>
bool ESKF<States>::healthy() const {
  for (int i = 0; i < States; ++i) {
    if (!(p_(i, i) >= 0.0F)) return false;
  }
  for (const float element : p_.elements()) {
    if (!isFinite(element)) return false;
  }
  return isFinite(state_.positionNed) && isFinite(state_.velocityNed) &&
         isFinite(state_.attitude.w) && isFinite(accelBias_) && isFinite(gyroBias_) &&
         isFinite(magBias_);
}

}  // namespace strix

#include "ScalarUpdates.h"
