/// Linear-quadratic regulator of position, velocity, attitude and rate (DESIGN.md, 5), with
/// integral action, the motors' lag as a state, and limits. docs/control.md has the derivation.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "ControlConfig.h"
#include "ControlRate.h"
#include "Gains.h"
#include "HeadingTilt.h"
#include "IntegralAction.h"
#include "Mathpk.h"
#include "ReducedObserver.h"
#include "ReferenceFilter.h"
#include "Vehicle.h"
#include "WrenchEstimate.h"

namespace strix {

/// Estimate minus reference, as the gain's columns are ordered. Positive: too far forward, right,
/// down; rolled right, nose up, nose right. Errors that the reference's mode does not control are
/// 0.
using ControlError = Eigen::Matrix<float, static_cast<int>(kErrorCount), 1>;

/// u = u_nom - k e - lag (w_hat - u_nom) - integral I. At hover the four channels do not touch, so
/// of k's 48 entries 12 are not zero, and what the lateral channels ask for can be read as a
/// cascade in which each stage has a limit: the position, velocity and integral columns over the
/// alpha column are a tilt, the alpha column over the rate column is a rate. Within the limits it
/// is the linear law.
class Controller {
 public:
  static constexpr std::uint32_t kRateHz = kControlRateHz;

  Controller(const Vehicle& vehicle, const Gains& gains, const ControlConfig& config = {})
      : gains_(gains),
        config_(config),
        mass_(vehicle.mass),
        inertia_(vehicle.inertia[0], vehicle.inertia[1], vehicle.inertia[2]),
        toTilt_{perAlpha(gains, 1, 6), perAlpha(gains, 2, 7)},
        toRate_(gains.k[1][6] / gains.k[1][9], gains.k[2][7] / gains.k[2][10]),
        yawErrorMost_(config.yawRate * gains.k[3][11] / gains.k[3][8]),
        halfYaw_(sinCos(0.5F * config.yaw)),
        tiltMost_(2.0F * sine(0.5F * config.tilt)),
        attitudeTiltMost_(2.0F * sine(0.5F * config.attitudeTilt)),
        filter_(config.referenceFilter),
        motors_(vehicle.motorTimeConstant),
        integral_(bounds(vehicle, gains, config)) {
    if (config.reducedObserver == nullptr) return;
    const ObserverGains& law = *config.reducedObserver;
    toRate_ = {law.roll.angle / law.roll.rate, law.pitch.angle / law.pitch.rate};
    yawErrorMost_ = config.yawRate / law.heading;
    reducedObserver_.emplace(vehicle, law, kControlPeriod);
  }

  /// Forgets everything and starts the 500 Hz phase at `now`.
  void reset(Micros now) {
    task_.start(now);
    reference_ = {};
    filter_.restart();
    motors_.reset();
    integral_.clear();
    if (reducedObserver_) reducedObserver_->reset();
    attitudeReference_ = {};
    error_.setZero();
    control_ = Wrench::none();
    achieved_ = Wrench::none();
    lift_ = 1.0F;
    tiltLacking_.setZero();
  }

  [[nodiscard]] bool due(Micros now) const { return task_.due(now); }

  /// On the ground nothing is integrated: the aircraft cannot do what the errors ask for.
  void setGrounded(bool grounded) {
    grounded_ = grounded;
    if (!grounded) return;
    integral_.clear();
    if (reducedObserver_) reducedObserver_->reset();
    filter_.restart();
  }

  /// One control step when it is due. Between two steps setAchieved() has to be called.
  /// @return true when getControl() is new
  bool updateControl(Micros now, const Reference& reference, const VehicleState& state) {
    if (!task_.run(now)) return false;
    motors_.advance({achieved_.thrust * lift_, achieved_.torque.x(), achieved_.torque.y(),
                     achieved_.torque.z()});
    if (!plausible(reference, state)) {  // an estimate that is lost commands nothing
      ++invalid_;
      filter_.restart();
      control_ = Wrench::none();
      return true;
    }
    const Wrench lacking{control_.thrust - achieved_.thrust, control_.torque - achieved_.torque};
    updateRef(reference, state);
    updateError(state);
    if (!grounded_) integrate(lacking);

    // Thrust points along the tilted body axis; the gain's row is its vertical part.
    const float cosine = cosTilt(state.attitude);
    lift_ = cosine > config_.cosTilt ? cosine : config_.cosTilt;
    control_.thrust = thrust();
    control_.torque = torque(virtualTilt(), state.rateBody);
    return true;
  }

  /// Takes the reference: filtered, and its attitude limited in tilt and, when its heading is
  /// further away than the limit, approached from there. In Position the tilt is the one that gives
  /// the reference acceleration.
  void updateRef(const Reference& reference, const VehicleState& state) {
    const bool position = reference.mode == ReferenceMode::Position;
    if (reference.mode != reference_.mode) integral_.clearHorizontal();
    reference_ = reference;
    const SinCos half = halfHeadingOf(state.attitude);
    heading_ = doubled(half);

    SinCos halfReference{0.0F, 1.0F};
    Vector2f tilt = Vector2f::Zero();
    if (!position) {
      const Quaternion attitude = normalized(reference.attitude);
      halfReference = halfHeadingOf(attitude);
      tilt = tiltOf(attitude, halfReference);
    }
    const AttitudeMotion motion = filter_.follow(reference_, halfReference, tilt, state, half);
    tiltRate_ = motion.tiltRate;
    nominal_.torque = inertia_.cwiseProduct(motion.acceleration);

    SinCos turn = halfTurn(half, halfReference);
    yawLimited_ = turn.sin > halfYaw_.sin || turn.sin < -halfYaw_.sin;
    if (yawLimited_) {
      turn = {turn.sin < 0.0F ? -halfYaw_.sin : halfYaw_.sin, halfYaw_.cos};
      halfReference = {half.sin * turn.cos + half.cos * turn.sin,
                       half.cos * turn.cos - half.sin * turn.sin};
    }
    const float down = clamped(reference_.accelerationNed.z(), config_.acceleration);
    if (position) {
      // What moves the estimate and not the aircraft is flown against.
      const Vector2f level = reference_.accelerationNed.head<2>() - state.correctionAcceleration;
      const SinCos heading = doubled(halfReference);
      tilt = tiltFor(shortening(level, config_.acceleration) * toHeading(heading, level), down);
      // How fast that tilt changes, to first order: nose down for more forward.
      const Vector2f jerk = toHeading(heading, reference_.jerkNed.head<2>());
      tiltRate_ += Vector2f{jerk.y(), -jerk.x()} / (kGravity - down);
    } else {
      tilt *= shortening(tilt, attitudeTiltMost_);
    }
    attitudeReference_ = compose(halfReference, tilt);
    tiltReference_ = turned(doubled(turn), tilt);
    nominal_.thrust = reference.mode == ReferenceMode::Attitude
                          ? (reference.thrust > 0.0F ? reference.thrust : 0.0F)
                          : mass_ * (kGravity - down);
  }

  /// Errors of `state` from the reference last taken.
  void updateError(const VehicleState& state) {
    if (reference_.mode != ReferenceMode::Position) error_.head<6>().setZero();
    if (reference_.mode != ReferenceMode::Attitude) {
      const float p = state.positionNed.z() - reference_.positionNed.z();
      const float v = state.velocityNed.z() - reference_.velocityNed.z();
      error_[2] = clamped(p, config_.positionVertical);
      error_[5] = clamped(v, config_.velocityVertical);
      downTransient_ = error_[2] != p && (p * v < 0.0F || error_[5] != v);
    }
    if (reference_.mode == ReferenceMode::Position) {
      // K is designed at yaw 0: the horizontal errors are turned into the aircraft's own heading.
      const Vector2f p =
          toHeading(heading_, state.positionNed.head<2>() - reference_.positionNed.head<2>());
      const Vector2f v =
          toHeading(heading_, state.velocityNed.head<2>() - reference_.velocityNed.head<2>());
      const float scaleP = shortening(p, config_.positionHorizontal);
      const float scaleV = shortening(v, config_.velocityHorizontal);
      error_.head<2>() = scaleP * p;
      error_.segment<2>(3) = scaleV * v;
      horizontalTransient_ = scaleP < 1.0F && (p.dot(v) < 0.0F || scaleV < 1.0F);
    }
    error_.segment<3>(6) = attitudeError(attitudeReference_, state.attitude);
    // The reference turns about down, not about the body's z axis, and tilts about level axes.
    error_.tail<3>() = state.rateBody - reference_.yawRate * downInBody(state.attitude);
    error_.segment<2>(9) -= tiltRate_;
  }

  /// The wrench wanted: thrust in N, torque in N m.
  [[nodiscard]] const Wrench& getControl() const { return control_; }

  /// Reports what the motors made of the wanted wrench.
  void setAchieved(const Wrench& achieved) {
    achieved_ = achieved;
    if (reducedObserver_) reducedObserver_->setAchieved(achieved.torque);
  }

  [[nodiscard]] const Wrench& achieved() const { return achieved_; }
  [[nodiscard]] const ControlError& error() const { return error_; }
  /// The reference last taken, as the filter made it.
  [[nodiscard]] const Reference& reference() const { return reference_; }
  [[nodiscard]] const Quaternion& attitudeReference() const { return attitudeReference_; }
  /// u_nom: what the reference needs if all is well.
  [[nodiscard]] const Wrench& nominalControl() const { return nominal_; }
  [[nodiscard]] const Gains& gains() const { return gains_; }
  [[nodiscard]] const IntegralAction& integral() const { return integral_; }
  [[nodiscard]] const WrenchEstimate& wrenchEstimate() const { return motors_; }
  [[nodiscard]] std::uint32_t overruns() const { return task_.overruns(); }
  /// Steps with NaN, infinity or something absurd in the estimate or the reference.
  [[nodiscard]] std::uint32_t invalid() const { return invalid_; }

 private:
  /// The columns of one lateral channel over its alpha column: rad per m, m/s and m s.
  struct ToTilt {
    float position;
    float velocity;
    float integral;
  };

  [[nodiscard]] static ToTilt perAlpha(const Gains& gains, std::size_t row, std::size_t alpha) {
    const float scale = 1.0F / gains.k[row][alpha];
    const std::size_t position = 2 - row;  // tau_x: right, 1; tau_y: forward, 0
    return {scale * gains.k[row][position], scale * gains.k[row][position + 3],
            scale * gains.integral[row]};
  }

  /// The integrals that ask for as much as the configuration allows. Without integral action: none.
  [[nodiscard]] static IntegralAction::Bounds bounds(const Vehicle& vehicle, const Gains& gains,
                                                     const ControlConfig& config) {
    const float tilt = 2.0F * sine(0.5F * config.integralTilt);
    const float right = reach(tilt, perAlpha(gains, 1, 6).integral);
    const float forward = reach(tilt, perAlpha(gains, 2, 7).integral);
    // In rest w_hat is u: of what an integral adds to u_nom, the lag's feedback leaves 1/(1 + lag).
    const float thrust = config.integralThrust * vehicle.mass * kGravity * (1.0F + gains.lag[0]);
    const float drag =
        vehicle.mass * kGravity * vehicle.torqueConstant / vehicle.thrustConstant;  // N m, in hover
    const float yaw = config.integralYaw * drag * (1.0F + gains.lag[3]);
    return {right < forward ? right : forward, reach(thrust, gains.integral[0]),
            // Ugglan's law has its own.
            config.reducedObserver == nullptr ? reach(yaw, gains.integral[3]) : 0.0F};
  }

  [[nodiscard]] static float reach(float most, float gain) {
    if (gain == 0.0F) return 0.0F;
    return most / (gain < 0.0F ? -gain : gain);
  }

  /// N along -z body.
  [[nodiscard]] float thrust() const {
    if (reference_.mode == ReferenceMode::Attitude) return nominal_.thrust;
    const float vertical = nominal_.thrust - gains_.k[0][2] * error_[2] -
                           gains_.k[0][5] * error_[5] -
                           gains_.lag[0] * (motors_.now()[0] - nominal_.thrust) -
                           gains_.integral[0] * integral_.down();
    return vertical / lift_;
  }

  /// The tilt, as of attitudeError, that the position, velocity and integral columns ask for beside
  /// the reference's. Together they stay below the limit.
  [[nodiscard]] Vector2f virtualTilt() {
    tiltLacking_.setZero();
    if (reference_.mode != ReferenceMode::Position) return Vector2f::Zero();
    const Vector2f integral = toHeading(heading_, integral_.horizontalNed());
    const auto& [right, forward] = toTilt_;
    Vector2f tilt{
        -right.position * error_[1] - right.velocity * error_[4] - right.integral * integral.y(),
        -forward.position * error_[0] - forward.velocity * error_[3] -
            forward.integral * integral.x()};
    const Vector2f whole = tiltReference_ + tilt;
    const float scale = shortening(whole, tiltMost_);
    if (!(scale < 1.0F)) return tilt;
    tiltLacking_ = (1.0F - scale) * whole;
    return tilt - tiltLacking_;
  }

  /// The attitude law on the error from the virtual tilt, of which no more is taken than asks for
  /// the largest rates.
  /// @param virtualTilt  rad, roll and pitch, beside the attitude reference
  /// @return N m
  [[nodiscard]] Vector3f torque(const Vector2f& virtualTilt, const Vector3f& rateBody) {
    Vector2f tilt = error_.segment<2>(6) - virtualTilt;
    tilt *= shortening(toRate_.cwiseProduct(tilt), config_.rollPitchRate);
    const Vector3f alpha{tilt.x(), tilt.y(), clamped(error_[8], yawErrorMost_)};
    if (reducedObserver_) {
      const float yawRate = rateBody.z() - error_[11];
      return reducedObserver_->update(alpha, rateBody,
                                      reducedObserver_->headingRate(alpha.z(), yawRate));
    }
    const auto& k = gains_.k;
    const auto& lag = gains_.lag;
    const WrenchEstimate::Rows& now = motors_.now();
    const Vector3f& u = nominal_.torque;
    return {u.x() - k[1][6] * alpha.x() - k[1][9] * error_[9] - lag[1] * (now[1] - u.x()),
            u.y() - k[2][7] * alpha.y() - k[2][10] * error_[10] - lag[2] * (now[2] - u.y()),
            u.z() - k[3][8] * alpha.z() - k[3][11] * error_[11] - lag[3] * (now[3] - u.z()) -
                gains_.integral[3] * integral_.yaw()};
  }

  /// Adds this step's errors to the integrals of the channels that are controlled. An integral
  /// holds while it would push a control further into its limit, and in a transient: while an error
  /// beyond its limit is closing or moving fast. The way from a far reference is no offset to be
  /// learnt.
  /// @param lacking  wanted minus achieved wrench of the last step
  void integrate(const Wrench& lacking) {
    const bool vertical = reference_.mode != ReferenceMode::Attitude;
    if (vertical && !downTransient_ &&
        !IntegralAction::deeper(-gains_.integral[0] * error_[2], lacking.thrust,
                                config_.thrustTolerance)) {
      integral_.addDown(error_[2]);
    }
    const bool yawTransient = yawLimited_ && error_[8] * error_[11] < 0.0F;
    if (!yawTransient && !IntegralAction::deeper(-gains_.integral[3] * error_[8],
                                                 lacking.torque.z(), config_.torqueTolerance)) {
      integral_.addYaw(error_[8]);
    }
    if (reference_.mode != ReferenceMode::Position) return;
    const Vector2f error = error_.head<2>();
    const Vector2f step{-toTilt_[0].integral * error.y(), -toTilt_[1].integral * error.x()};
    const bool deeper =
        step.dot(tiltLacking_) > 0.0F ||
        IntegralAction::deeper(step.x(), lacking.torque.x(), config_.torqueTolerance) ||
        IntegralAction::deeper(step.y(), lacking.torque.y(), config_.torqueTolerance);
    if (!horizontalTransient_ && !deeper) integral_.addHorizontal(turned(heading_, error));
  }

  /// False with NaN, infinity or a number beyond any sense, of which the squares overflow.
  [[nodiscard]] static bool plausible(const Reference& r, const VehicleState& s) {
    const float yaw = wrapAngle(r.yaw);  // NaN beyond its domain
    float sum =
        s.positionNed.squaredNorm() + s.velocityNed.squaredNorm() + s.rateBody.squaredNorm() +
        square(s.attitude) + s.correctionAcceleration.squaredNorm() + r.positionNed.squaredNorm() +
        r.velocityNed.squaredNorm() + r.accelerationNed.squaredNorm() + r.jerkNed.squaredNorm() +
        yaw * yaw + r.yawRate * r.yawRate + r.yawAcceleration * r.yawAcceleration;
    if (r.mode != ReferenceMode::Position) sum += square(r.attitude) + r.thrust * r.thrust;
    return sum < 1e12F;
  }

  [[nodiscard]] static float square(const Quaternion& q) {
    return q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  }

  const Gains& gains_;
  ControlConfig config_;
  float mass_;                    ///< kg
  Vector3f inertia_;              ///< kg m^2, diagonal
  std::array<ToTilt, 2> toTilt_;  ///< right, forward
  Vector2f toRate_;               ///< 1/s, of roll and pitch: alpha column over rate column
  float yawErrorMost_;            ///< rad, that asks for the largest yaw rate
  SinCos halfYaw_;                ///< of half the largest yaw error
  float tiltMost_;                ///< 2 sin(limit/2), in Position
  float attitudeTiltMost_;        ///< the same of a given attitude
  PeriodicTask task_{periodFromHz(kRateHz)};
  ReferenceFilter filter_;
  WrenchEstimate motors_;
  IntegralAction integral_;
  std::optional<ReducedObserverController> reducedObserver_;  ///< when it is the attitude law
  bool grounded_ = false;

  Reference reference_;
  Quaternion attitudeReference_;
  Vector2f tiltReference_ = Vector2f::Zero();  ///< its tilt, at the aircraft's heading
  Vector2f tiltRate_ = Vector2f::Zero();       ///< rad/s, of the reference
  Wrench nominal_;                             ///< u_nom
  SinCos heading_{0.0F, 1.0F};                 ///< of the estimate
  ControlError error_ = ControlError::Zero();
  bool horizontalTransient_ = false;
  bool downTransient_ = false;
  bool yawLimited_ = false;
  Vector2f tiltLacking_ = Vector2f::Zero();  ///< what the tilt limit took from the virtual tilt
  float lift_ = 1.0F;                        ///< vertical part of the thrust
  Wrench control_;
  Wrench achieved_;
  std::uint32_t invalid_ = 0;
};

}  // namespace strix
