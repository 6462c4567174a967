/// Error-state Kalman filter with 9 states (DESIGN.md, 4; Sola, arXiv 1711.02508).
///
/// Nominal state: position and velocity (NED), attitude q. Error state dx, in this order:
/// dp (0..2), dv (3..5), alpha (6..8), with alpha local: q_true = q (x) [1, alpha/2].
/// Measurements come in as scalars, one after the other; they change dx and P only. injectError()
/// moves dx into the nominal state, once a loop pass.
#pragma once

#include "Alignment.h"
#include "Innovation.h"
#include "Mathpk.h"
#include "NavigationConfig.h"

namespace strix {

class ESKF {
 public:
  static constexpr int kStates = 9;
  enum Block : int { kPosition = 0, kVelocity = 3, kAlpha = 6 };

  explicit ESKF(const NavigationConfig& config) : config_(config) {}

  /// Starts from rest at the origin with a known attitude.
  /// Until then every call below does nothing.
  /// @param gravity  norm of the specific force at rest, m/s^2
  void initialize(const Alignment& alignment, float gravity);

  /// Moves the nominal state and the covariance on to `now`. The first call only sets the time.
  /// @param accel  specific force, m/s^2, body    @param gyro  rad/s, body
  void predict(const Vector3f& accel, const Vector3f& gyro, Micros now);

  /// Gravity direction, used while the specific force is nearly g long: | |a| - g | < tiltGate.
  /// @param accel  the sample given to predict, m/s^2, body
  void updateTiltMeas(const Vector3f& accel);

  /// Three-axis magnetic field. Like height, not used before the first prediction: until then no
  /// time is known from which `now` counts.
  /// @param mag  uT, body
  void updateMagMeas(const Vector3f& mag, Micros now);

  /// Height above the start, m, up positive.
  void updateAltMeas(float height, Micros now);

  /// GPS fix in the local frame. A fix of age tau measured p - v tau.
  /// @param positionNed  m; down is not used    @param velocityNed  m/s; down is not used
  void updateGPSMeas(const Vector3f& positionNed, const Vector3f& velocityNed);

  /// The aircraft does not move: v = 0, three scalars (ZUPT). Never from a sensor in flight.
  void updateStandstill();

  /// Moves dx into the nominal state and clears it. The reset Jacobian I - [alpha/2 x] (Sola,
  /// eq. 287) is taken as I: alpha is a few mrad a pass.
  void injectError();

  /// Phi = I + F dt.
  [[nodiscard]] static Matrix9f getSTM(const Matrix3f& nedToBody, const Vector3f& accel,
                                       const Vector3f& gyro, float dt);

  /// Q_d = integral over dt of (I + F s) Q_c (I + F s)^T ds, cross terms kept.
  [[nodiscard]] Matrix9f getQd(const Matrix3f& nedToBody, const Vector3f& accel,
                               const Vector3f& gyro, float dt) const;

  [[nodiscard]] const VehicleState& state() const { return state_; }
  [[nodiscard]] const Matrix9f& covariance() const { return covariance_; }
  [[nodiscard]] const Vector9f& error() const { return error_; }
  [[nodiscard]] const Vector3f& magReference() const { return magReference_; }
  [[nodiscard]] const Innovation& tiltInnovation() const { return tilt_; }
  [[nodiscard]] const Innovation& magInnovation() const { return mag_; }
  [[nodiscard]] const Innovation& altInnovation() const { return alt_; }
  [[nodiscard]] const Innovation& gpsInnovation() const { return gps_; }

  /// False once a state or a variance is not finite, or a variance is negative.
  [[nodiscard]] bool healthy() const;

 private:
  /// Moves P to Phi P Phi^T + Q_d by 3x3 blocks.
  void propagateCovariance(const Matrix3f& nedToBody, const Vector3f& accel, const Vector3f& gyro,
                           float dt);

  /// One component of a measured direction: h = R ref, H_alpha = row of [R ref x].
  void scalarMagTiltUpdate(Innovation& record, float innovation, const Vector3f& row,
                           float variance);

  /// One scalar that measures one state directly: H = 1 at `index`.
  void scalarGPSAltUpdate(Innovation& record, float innovation, int index, float variance);

  /// Common end of both: gate, then dx += K r and P -= K (P H^T)^T.
  /// @param column  P H^T    @param residual  z - h(x) - H dx
  void applyScalar(Innovation& record, const Vector9f& column, float residual, float variance);

  void updateDirection(Innovation& record, const Vector3f& measured, const Vector3f& predicted,
                       float variance);

  /// Time since `last`, at most kMaxPredictStep, s; moves `last` on to `now`.
  [[nodiscard]] static float secondsSince(Micros& last, Micros now);

  NavigationConfig config_;
  VehicleState state_;
  Vector9f error_ = Vector9f::Zero();
  Matrix9f covariance_ = Matrix9f::Zero();
  Vector3f magReference_ = Vector3f::Zero();
  Innovation tilt_;
  Innovation mag_;
  Innovation alt_;
  Innovation gps_;
  Innovation standstill_;
  float gravity_ = kGravity;
  float dt_ = 0.0F;  ///< s, of the last prediction
  Micros lastPredict_ = 0;
  Micros lastMag_ = 0;
  Micros lastAlt_ = 0;
  bool aligned_ = false;
  bool started_ = false;  ///< has predicted since
};

/// A longer gap between two samples is taken as this long: the state is then no longer trusted by
/// its own covariance anyway, and one wild dt must not blow it up.
constexpr Micros kMaxPredictStep = 200'000;

inline float ESKF::secondsSince(Micros& last, Micros now) {
  const Micros since = elapsed(now, last);
  last = now;
  return toSeconds(since < kMaxPredictStep ? since : kMaxPredictStep);
}

inline void ESKF::initialize(const Alignment& alignment, float gravity) {
  aligned_ = true;
  state_ = VehicleState{};
  state_.attitude = alignment.attitude;
  magReference_ = alignment.magReference;
  gravity_ = gravity;
  error_.setZero();
  covariance_.setZero();
  // The uncertainty of heading is about the vertical, so alpha's block is rotated into the body.
  const Vector3f down = rotateToBody(state_.attitude, Vector3f{0.0F, 0.0F, 1.0F});
  const auto square = [](float x) { return x * x; };
  const float tilt = square(config_.tiltSigma0);
  const float heading = square(config_.headingSigma0);
  covariance_.block<3, 3>(kPosition, kPosition)
      .diagonal()
      .setConstant(square(config_.positionSigma0));
  covariance_.block<3, 3>(kVelocity, kVelocity)
      .diagonal()
      .setConstant(square(config_.velocitySigma0));
  covariance_.block<3, 3>(kAlpha, kAlpha) =
      tilt * Matrix3f::Identity() + (heading - tilt) * down * down.transpose();
  started_ = false;
}

inline void ESKF::predict(const Vector3f& accel, const Vector3f& gyro, Micros now) {
  if (!aligned_) return;
  state_.rateBody = gyro;
  if (!started_) {
    started_ = true;
    lastPredict_ = lastMag_ = lastAlt_ = now;
    return;
  }
  const float dt = secondsSince(lastPredict_, now);
  dt_ = dt;  // zero for a sample that comes twice: then there is no second tilt update either
  if (dt == 0.0F) return;

  const Matrix3f nedToBody = q2R(state_.attitude);
  propagateCovariance(nedToBody, accel, gyro, dt);

  const Vector3f acceleration = nedToBody.transpose() * accel + Vector3f{0.0F, 0.0F, gravity_};
  state_.positionNed += state_.velocityNed * dt + acceleration * (0.5F * dt * dt);
  state_.velocityNed += acceleration * dt;
  state_.attitude = normalized(state_.attitude * quaternionExp(gyro * dt));
}

inline Matrix9f ESKF::getSTM(const Matrix3f& nedToBody, const Vector3f& accel, const Vector3f& gyro,
                             float dt) {
  Matrix9f phi = Matrix9f::Identity();
  phi.block<3, 3>(kPosition, kVelocity).diagonal().setConstant(dt);
  phi.block<3, 3>(kVelocity, kAlpha) = -dt * (nedToBody.transpose() * skew(accel));
  phi.block<3, 3>(kAlpha, kAlpha) -= dt * skew(gyro);
  return phi;
}

inline Matrix9f ESKF::getQd(const Matrix3f& nedToBody, const Vector3f& accel, const Vector3f& gyro,
                            float dt) const {
  const float qa = config_.accelNoise * config_.accelNoise;
  const float qg = config_.gyroNoise * config_.gyroNoise;
  const float dt2 = dt * dt / 2.0F;
  const float dt3 = dt * dt * dt / 3.0F;
  const Matrix3f identity = Matrix3f::Identity();
  const Matrix3f a = -(nedToBody.transpose() * skew(accel));  // F(dv, alpha)
  const Matrix3f w = skew(gyro);                              // -F(alpha, alpha)

  Matrix9f q = Matrix9f::Zero();
  q.block<3, 3>(kPosition, kPosition) = qa * dt3 * identity;
  q.block<3, 3>(kPosition, kVelocity) = qa * dt2 * identity;
  q.block<3, 3>(kVelocity, kPosition) = qa * dt2 * identity;
  q.block<3, 3>(kVelocity, kVelocity) = qa * dt * identity + qg * dt3 * (a * a.transpose());
  q.block<3, 3>(kVelocity, kAlpha) = qg * (dt2 * a + dt3 * (a * w));
  q.block<3, 3>(kAlpha, kVelocity) = q.block<3, 3>(kVelocity, kAlpha).transpose();
  q.block<3, 3>(kAlpha, kAlpha) = qg * (dt * identity - dt3 * (w * w));
  return q;
}

inline void ESKF::propagateCovariance(const Matrix3f& nedToBody, const Vector3f& accel,
                                      const Vector3f& gyro, float dt) {
  // Phi = [I  dt I  0;  0  I  A;  0  0  B]: the same blocks as getSTM.
  const Matrix3f a = -dt * (nedToBody.transpose() * skew(accel));
  const Matrix3f b = Matrix3f::Identity() - dt * skew(gyro);
  Matrix9f& p = covariance_;
  const auto block = [&p](int row, int column) { return p.block<3, 3>(row, column); };

  // T = Phi P, the blocks that P' needs.
  const Matrix3f tpp = block(kPosition, kPosition) + dt * block(kVelocity, kPosition);
  const Matrix3f tpv = block(kPosition, kVelocity) + dt * block(kVelocity, kVelocity);
  const Matrix3f tpa = block(kPosition, kAlpha) + dt * block(kVelocity, kAlpha);
  const Matrix3f tvv = block(kVelocity, kVelocity) + a * block(kAlpha, kVelocity);
  const Matrix3f tva = block(kVelocity, kAlpha) + a * block(kAlpha, kAlpha);
  const Matrix3f taa = b * block(kAlpha, kAlpha);

  // P' = T Phi^T + Q_d, upper blocks.
  block(kPosition, kPosition) = tpp + dt * tpv;
  block(kPosition, kVelocity) = tpv + tpa * a.transpose();
  block(kPosition, kAlpha) = tpa * b.transpose();
  block(kVelocity, kVelocity) = tvv + tva * a.transpose();
  block(kVelocity, kAlpha) = tva * b.transpose();
  block(kAlpha, kAlpha) = taa * b.transpose();
  p += getQd(nedToBody, accel, gyro, dt);

  // One triangle is the truth and the other its mirror: rounding cannot make P asymmetric, which
  // is what costs a float32 filter its positive definiteness within minutes.
  for (int row = 0; row < kStates; ++row) {
    for (int column = row + 1; column < kStates; ++column) p(column, row) = p(row, column);
  }
}

inline void ESKF::updateTiltMeas(const Vector3f& accel) {
  tilt_.begin();
  const float excess = accel.norm() - gravity_;
  if (dt_ == 0.0F || !(excess < config_.tiltGate && excess > -config_.tiltGate)) return;
  const Vector3f predicted = rotateToBody(state_.attitude, Vector3f{0.0F, 0.0F, -gravity_});
  updateDirection(tilt_, accel, predicted, config_.tilt.variance(dt_));
}

inline void ESKF::updateMagMeas(const Vector3f& mag, Micros now) {
  mag_.begin();
  const float dt = secondsSince(lastMag_, now);
  if (!started_ || magReference_.isZero(0.0F) || dt == 0.0F) return;
  const Vector3f predicted = rotateToBody(state_.attitude, magReference_);
  updateDirection(mag_, mag, predicted, config_.mag.variance(dt));
}

inline void ESKF::updateAltMeas(float height, Micros now) {
  alt_.begin();
  const float dt = secondsSince(lastAlt_, now);
  if (!started_ || dt == 0.0F) return;
  scalarGPSAltUpdate(alt_, -height - state_.positionNed.z(), kPosition + 2,
                     config_.alt.variance(dt));
}

inline void ESKF::updateGPSMeas(const Vector3f& positionNed, const Vector3f& velocityNed) {
  gps_.begin();
  if (!aligned_) return;
  const float age = toSeconds(config_.gpsDelay);
  const float rp = config_.gpsPositionSigma * config_.gpsPositionSigma;
  const float rv = config_.gpsVelocitySigma * config_.gpsVelocitySigma;
  for (int axis = 0; axis < 2; ++axis) {
    const float expected = state_.positionNed(axis) - age * state_.velocityNed(axis);
    scalarGPSAltUpdate(gps_, positionNed(axis) - expected, kPosition + axis, rp);
  }
  for (int axis = 0; axis < 2; ++axis) {
    scalarGPSAltUpdate(gps_, velocityNed(axis) - state_.velocityNed(axis), kVelocity + axis, rv);
  }
}

inline void ESKF::updateStandstill() {
  standstill_.begin();
  if (!aligned_) return;
  const float variance = config_.standstillSigma * config_.standstillSigma;
  for (int axis = 0; axis < 3; ++axis) {
    scalarGPSAltUpdate(standstill_, -state_.velocityNed(axis), kVelocity + axis, variance);
  }
}

inline void ESKF::updateDirection(Innovation& record, const Vector3f& measured,
                                  const Vector3f& predicted, float variance) {
  const Matrix3f h = skew(predicted);
  for (int axis = 0; axis < 3; ++axis) {
    scalarMagTiltUpdate(record, measured(axis) - predicted(axis), h.row(axis).transpose(),
                        variance);
  }
}

inline void ESKF::scalarMagTiltUpdate(Innovation& record, float innovation, const Vector3f& row,
                                      float variance) {
  const Vector9f column = covariance_.block<kStates, 3>(0, kAlpha) * row;
  const float residual = innovation - row.dot(error_.segment<3>(kAlpha));
  const float s = row.dot(column.segment<3>(kAlpha)) + variance;
  applyScalar(record, column, residual, s);
}

inline void ESKF::scalarGPSAltUpdate(Innovation& record, float innovation, int index,
                                     float variance) {
  const Vector9f column = covariance_.col(index);
  applyScalar(record, column, innovation - error_(index), column(index) + variance);
}

inline void ESKF::applyScalar(Innovation& record, const Vector9f& column, float residual,
                              float residualVariance) {
  const float nis = residual * residual / residualVariance;
  const bool accept = nis <= config_.nisGate;  // false for NaN: nothing spreads
  record.add(residual, residualVariance, nis, accept);
  if (!accept) return;
  const Vector9f gain = column / residualVariance;
  error_ += gain * residual;
  for (int row = 0; row < kStates; ++row) {
    for (int col = row; col < kStates; ++col) {
      covariance_(row, col) -= gain(row) * column(col);
      covariance_(col, row) = covariance_(row, col);
    }
  }
}

inline void ESKF::injectError() {
  state_.positionNed += error_.segment<3>(kPosition);
  state_.velocityNed += error_.segment<3>(kVelocity);
  state_.attitude = injectRight(state_.attitude, error_.segment<3>(kAlpha));
  error_.setZero();
}

inline bool ESKF::healthy() const {
  for (int i = 0; i < kStates; ++i) {
    if (!(covariance_(i, i) >= 0.0F)) return false;
  }
  return isFinite(covariance_) && isFinite(state_.positionNed) && isFinite(state_.velocityNed) &&
         isFinite(state_.attitude.w);
}

}  // namespace strix
