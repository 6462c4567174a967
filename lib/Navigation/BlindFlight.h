/// The aircraft's state when no IMU says it: a rigid body under the wrench that its motors give,
/// with what magnetometer and altimeter still see. docs/blind-flight.md: what it is worth.
#pragma once

#include <array>
#include <cstddef>

#include "Mathpk.h"
#include "Vehicle.h"
#include "VehicleState.h"

namespace strix {

/// While the IMU lives, what the model lacks is learnt from the estimate: an acceleration d in NED
/// (level: wind; down: a wrong mass) and a turning m in the body (a weak rotor, a shifted centre of
/// mass), each as the integral of an observer with both poles at 1/t. What goes with the thrust T
/// does so here, s = T / weight:
///     v' = g - T z_body / mass + [d_n d_e s d_d] + (2/t) e,  d' = e / t^2,  e = estimated v - v
///     w' = J^-1 (tau - w x J w) + s m + (2/t) e,             m' = e / t^2,  e = estimated w - w
/// Without an IMU the same model runs alone, d stands still, and
///     the field, of all turns but those about itself, corrects attitude, rate and m:
///         three poles at one frequency; without it a gust's torque, never measured, tips the
///         aircraft over within a second or two
///     the height corrects height and climb: two poles at another.
/// All gains are continuous ones times the sensors' period: every one is well below 1.
class BlindFlight {
 public:
  /// What the motors give: the vertical part of the thrust, N, and the torque, N m, body.
  using WrenchRows = std::array<float, 4>;

  explicit BlindFlight(const Vehicle& vehicle)
      : mass_(vehicle.mass), inertia_(vehicle.inertia[0], vehicle.inertia[1], vehicle.inertia[2]) {}

  /// On the ground: nothing is known of the next flight but where the field points.
  void reset() {
    lacking_.setZero();
    lackingTurn_.setZero();
    recent_ = {};
    blind_ = false;
  }

  /// In each control tick of a flight with an IMU.
  /// @param wrench  that the motors give now    @param dt  s
  void observe(const WrenchRows& wrench, const VehicleState& estimate, float dt) {
    blind_ = false;
    period_ = dt;
    attitude_ = estimate.attitude;
    sinceSample_ = estimate.rateBody == lastRate_ ? sinceSample_ + 1 : 0;
    lastRate_ = estimate.rateBody;
    recent_[next_] = wrench;
    next_ = next_ + 1 < kRecent ? next_ + 1 : 0;
    // 50 times a second is enough of a wrench that the motors' lag has smoothed; half of it in one
    // tick, half in another.
    ++tick_;
    if (tick_ == kEvery / 2) observeTurning(wrench, estimate, static_cast<float>(kEvery) * dt);
    if (tick_ < kEvery) return;
    tick_ = 0;
    observeMoving(wrench, estimate, static_cast<float>(kEvery) * dt);
  }

  /// No IMU any more. The estimate is that of its last sample, and the motors have gone on since:
  /// so does the model.
  void start(const VehicleState& estimate) {
    state_ = estimate;
    state_.correctionAcceleration.setZero();
    blind_ = true;
    above_ = 0.0F;
    std::size_t gone = sinceSample_ < kRecent ? sinceSample_ : kRecent;
    for (; gone > 0; --gone) update(recent_[(next_ + kRecent - gone) % kRecent], period_);
  }

  /// One control period further. @param wrench  that the motors give now    @param dt  s
  const VehicleState& update(const WrenchRows& wrench, float dt) {
    const Vector3f acceleration = accelerationNed(wrench, state_.attitude);
    state_.positionNed += dt * (state_.velocityNed + (0.5F * dt) * acceleration);
    state_.velocityNed += dt * acceleration;
    const Vector3f before = state_.rateBody;
    state_.rateBody += dt * turning(wrench, before);
    turn((0.5F * dt) * (before + state_.rateBody));
    return state_;
  }

  /// @param field  uT, body, also while the IMU lives
  void updateMagMeas(const Vector3f& field) {
    if (!blind_) {
      const Vector3f ned = rotateToNed(attitude_, field);
      fieldNed_ = fieldKnown_ ? Vector3f(fieldNed_ + kFieldShare * (ned - fieldNed_)) : ned;
      fieldKnown_ = true;
      return;
    }
    if (!fieldKnown_) return;
    // f = R(q exp(a)) f_ned = f_hat - a x f_hat, so f x f_hat = a f_hat^2 - f_hat (f_hat . a): the
    // turn that the state lacks, less its part about the field.
    const Vector3f expected = rotateToBody(state_.attitude, fieldNed_);
    const float square = expected.squaredNorm();
    if (!(square > 0.0F)) return;
    const Vector3f lacking = field.cross(expected) / square;
    if (!(lacking.squaredNorm() < 1.0F)) return;  // also when it is no number
    const float w = kFieldFrequency;
    turn((3.0F * w * kFieldPeriod) * lacking);
    state_.rateBody += (3.0F * w * w * kFieldPeriod) * lacking;
    lackingTurn_ += (w * w * w * kFieldPeriod) * lacking;
  }

  /// @param height  m above the start
  void updateAltMeas(float height) {
    if (!blind_) return;
    const float above = height + state_.positionNed.z();
    if (!(above * above < kMostAbove * kMostAbove)) return;  // also when it is no number
    const float w = kHeightFrequency;
    state_.positionNed.z() -= (2.0F * w * kHeightPeriod) * above;
    state_.velocityNed.z() -= (w * w * kHeightPeriod) * above;
    above_ += (kHeightPeriod / kAboveTime) * (above - above_);
  }

  [[nodiscard]] const VehicleState& state() const { return state_; }
  /// The model flies.
  [[nodiscard]] bool active() const { return blind_; }

  /// Down: the altimeter does not sink although the model does, or the model is below the ground.
  /// Or the state is none.
  [[nodiscard]] bool over() const {
    const float height = -state_.positionNed.z();
    return (above_ > kStands && height < kNearGround) || !(height > -kDeepest) ||
           !isFinite(state_.attitude.w);
  }

 private:
  static constexpr unsigned kEvery = 10;         ///< control ticks
  static constexpr std::size_t kRecent = 16;     ///< ticks: an IMU is lost after 20 ms
  static constexpr float kFieldPeriod = 0.01F;   ///< s, of the sensors' rates (DESIGN.md, 3)
  static constexpr float kHeightPeriod = 0.02F;  ///< s
  // ours, chosen with `docs/blind-flight.md`'s flights:
  static constexpr float kTurningTime = 0.5F;     ///< s: a rotor that has just lost its strength
  static constexpr float kMovingTime = 1.0F;      ///< s: gusts are in the mean, too
  static constexpr float kFieldShare = 0.005F;    ///< of each field: a mean over 2 s
  static constexpr float kFieldFrequency = 6.0F;  ///< rad/s
  /// rad/s: 0.17 m of noise make 4 cm; the air that a descent meets, 1 m/s^2, 0.25 m.
  static constexpr float kHeightFrequency = 2.0F;
  static constexpr float kFlies = 0.5F;       ///< of the weight: less, and it may stand
  static constexpr float kMostAbove = 10.0F;  ///< m: beyond it, it is the altimeter that errs
  static constexpr float kAboveTime = 0.2F;   ///< s
  static constexpr float kStands = 0.5F;      ///< m: twice that
  static constexpr float kNearGround = 1.5F;  ///< m above the start
  static constexpr float kDeepest = 1.5F;     ///< m below it
  static constexpr float kCosMost = 0.7F;     ///< thrust is raised for the tilt up to there

  [[nodiscard]] Vector3f accelerationNed(const WrenchRows& wrench, const Quaternion& q) const {
    const Vector3f up = rotateToNed(q, {0.0F, 0.0F, -1.0F});  // the thrust's way
    const float cosine = -up.z() > kCosMost ? -up.z() : kCosMost;
    Vector3f acceleration = (wrench[0] / (mass_ * cosine)) * up;
    acceleration.z() += kGravity;
    return acceleration +
           Vector3f{lacking_.x(), lacking_.y(), shareOfWeight(wrench) * lacking_.z()};
  }

  [[nodiscard]] Vector3f turning(const WrenchRows& wrench, const Vector3f& rate) const {
    const Vector3f torque{wrench[1], wrench[2], wrench[3]};
    return (torque - rate.cross(inertia_.cwiseProduct(rate))).cwiseQuotient(inertia_) +
           shareOfWeight(wrench) * lackingTurn_;
  }

  /// On the ground it carries what the model does not know: nothing is learnt there.
  [[nodiscard]] bool flies(const WrenchRows& wrench) const {
    return shareOfWeight(wrench) > kFlies;
  }

  /// Of the thrust.
  [[nodiscard]] float shareOfWeight(const WrenchRows& wrench) const {
    return wrench[0] / (kGravity * mass_);
  }

  void observeTurning(const WrenchRows& wrench, const VehicleState& estimate, float dt) {
    if (!flies(wrench)) {
      rate_ = estimate.rateBody;
      return;
    }
    rate_ += dt * turning(wrench, estimate.rateBody);
    const Vector3f error = estimate.rateBody - rate_;
    rate_ += (2.0F * dt / kTurningTime) * error;
    lackingTurn_ += (dt / (kTurningTime * kTurningTime)) * error;
  }

  void observeMoving(const WrenchRows& wrench, const VehicleState& estimate, float dt) {
    if (!flies(wrench)) {
      velocity_ = estimate.velocityNed;
      return;
    }
    velocity_ += dt * accelerationNed(wrench, estimate.attitude);
    const Vector3f error = estimate.velocityNed - velocity_;
    velocity_ += (2.0F * dt / kMovingTime) * error;
    lacking_ += (dt / (kMovingTime * kMovingTime)) * error;
  }

  void turn(const Vector3f& angle) {
    state_.attitude = renormalized(state_.attitude * quaternionExp(angle));
  }

  float mass_;        ///< kg
  Vector3f inertia_;  ///< kg m^2, diagonal
  VehicleState state_;
  // What the model lacks.
  Vector3f lacking_ = Vector3f::Zero();      ///< d, m/s^2, NED
  Vector3f lackingTurn_ = Vector3f::Zero();  ///< m, rad/s^2, body
  Vector3f velocity_ = Vector3f::Zero();     ///< m/s, NED, of the observer
  Vector3f rate_ = Vector3f::Zero();         ///< rad/s, body, of the observer
  Vector3f fieldNed_ = Vector3f::Zero();     ///< uT, as it was measured and the attitude said
  Quaternion attitude_;                      ///< of the last estimate
  Vector3f lastRate_ = Vector3f::Zero();     ///< rad/s, of the last estimate
  std::array<WrenchRows, kRecent> recent_{};
  std::size_t next_ = 0;         ///< in recent_
  std::size_t sinceSample_ = 0;  ///< control ticks
  float period_ = 0.0F;          ///< s
  float above_ = 0.0F;           ///< m, the altimeter's height over the model's, a short mean
  unsigned tick_ = 0;
  bool blind_ = false;
  bool fieldKnown_ = false;
};

}  // namespace strix
