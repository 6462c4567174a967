/// The filter and everything that decides when it listens to which sensor.
///
/// The same calls as the filter's, once a loop pass in the loop's order; finishPass() ends it.
#pragma once

#include "ComplementaryFilter.h"
#include "ESKF.h"
#include "FieldTracker.h"
#include "MotionHistory.h"
#include "NavigationHealth.h"
#include "StandstillDetector.h"
#include "Vibration.h"

namespace strix {

/// What the motors do to the sensors.
enum class MotorState : std::uint8_t {
  Stopped,    ///< or nobody knows about motors
  Hover,      ///< steady thrust near the weight
  Disturbed,  ///< anything else
};

template <int States>
class Navigation {
 public:
  using Filter = ESKF<States>;

  explicit Navigation(const NavigationConfig& config)
      : config_(config),
        filter_(filterConfig(config)),
        complementary_(config.complementary),
        standstill_(config.standstill),
        field_(config.field) {}

  /// Starts from rest at the origin. Until then every call below does nothing.
  void initialize(const Alignment& alignment, float gravity, Micros now);

  /// Goes on from a state that no IMU led to; before the first predict() after the gap.
  void restart(const VehicleState& state, Micros now);

  /// @param motors  what they did in the last pass
  void setMotors(MotorState motors) { motors_ = motors; }

  /// @param accel  specific force, m/s^2, body    @param gyro  rad/s, body
  void predict(const Vector3f& accel, const Vector3f& gyro, Micros now);
  /// @param accel  the sample given to predict
  void updateTiltMeas(const Vector3f& accel);
  /// @param mag  uT, body
  void updateMagMeas(const Vector3f& mag, Micros now);
  /// @param height  m above the start, config.altDelay old
  void updateAltMeas(float height, Micros now);
  /// @param positionNed  m, config.gpsDelay old    @param velocityNed  m/s
  void updateGPSMeas(const Vector3f& positionNed, const Vector3f& velocityNed, Micros now);

  /// What no sensor measures but is known; then the correction; then the health checks.
  void finishPass(Micros now);

  /// The filter's state, or, with a filter that is lost, its last position and velocity and the
  /// complementary filter's attitude.
  [[nodiscard]] VehicleState state() const;

  [[nodiscard]] const Filter& filter() const { return filter_; }
  [[nodiscard]] const ComplementaryFilter& complementary() const { return complementary_; }
  [[nodiscard]] NavigationHealth health() const { return health_; }
  /// False when the state is not to be flown with.
  [[nodiscard]] bool healthy() const { return (health_ & health::kLost) == 0; }
  [[nodiscard]] bool standsStill() const { return standstill_.held(); }
  [[nodiscard]] bool gpsAids() const { return gpsUsed_; }
  /// Scalars taken in again after they had failed their gate for too long.
  [[nodiscard]] std::uint32_t readmissions() const {
    return filter_.tiltInnovation().readmissions + filter_.magInnovation().readmissions +
           filter_.altInnovation().readmissions + filter_.gpsInnovation().readmissions;
  }
  /// Times the filter was lost and began anew.
  [[nodiscard]] std::uint32_t restarts() const { return restarts_; }
  [[nodiscard]] float vibration() const { return vibration_.rms(); }  ///< m/s^2

 private:
  static constexpr Micros kAidPeriod = 50'000;
  static constexpr Micros kOutagePeriod = 1'000'000;
  static constexpr Micros kOutageStart = 1'000'000;  ///< later than this a fix is missing
  static constexpr Micros kFieldPatience = 20'000'000;
  static constexpr float kRefusedFieldFactor = 4.0F;  ///< on its variance
  static constexpr Micros kFieldAidTime = 5'000'000;
  static constexpr Micros kHealthPeriod = 100'000;
  static constexpr Micros kRestartPause = 10'000'000;
  static constexpr float kSpeedPart = 0.05F / 10.0F;  ///< of 10 s, in kAidPeriod

  [[nodiscard]] static NavigationConfig filterConfig(NavigationConfig config) {
    if (config.tiltFusion == TiltFusion::Vibration) config.tiltGate = kNoGate;
    return config;
  }
  static constexpr float kNoGate = 1e6F;  ///< m/s^2

  void setProcessNoise(const Vector3f& gyro);
  /// Factor on a sensor's variance for what the motors do; zero: not used.
  [[nodiscard]] float factor(WithMotors use) const;
  void aidAtStandstill();
  void aidByBoundedMotion();
  void aidInOutage(Micros now);
  /// @param finite  what the state was before it was corrected: that would hide NaN
  void checkHealth(Micros now, bool finite);
  void keepStampsFresh(Micros now);
  /// What is lost again at once has a reason that a new start does not cure: it stays lost.
  [[nodiscard]] bool mayRestart(Micros now) const {
    return healthy() && (restarts_ == 0 || elapsed(now, restarted_) > kRestartPause);
  }
  void restartFromFallback(Micros now);

  NavigationConfig config_;
  Filter filter_;
  ComplementaryFilter complementary_;
  StandstillDetector standstill_;
  FieldTracker field_;
  Vibration vibration_;
  PositiveDefiniteCheck<States> definite_;
  MotionHistory history_;
  VehicleState lastGood_;
  MotorState motors_ = MotorState::Stopped;
  NavigationHealth health_ = health::kNone;
  std::uint32_t restarts_ = 0;
  Micros restarted_ = 0;
  float meanSquareVelocity_ = 0.0F;  ///< (m/s)^2, each axis, while GPS aided
  Micros lastSample_ = 0;
  Micros lastMag_ = 0;
  Micros fieldTrusted_ = 0;
  Micros gpsHeard_ = 0;
  Micros altHeard_ = 0;
  Micros gpsTaken_ = 0;  ///< heard, and passed the gate
  Micros altTaken_ = 0;
  Micros magTaken_ = 0;
  Micros lastOutageAid_ = 0;
  Micros agreed_ = 0;
  PeriodicTask aid_{kAidPeriod};
  PeriodicTask healthCheck_{kHealthPeriod};
  bool started_ = false;
  Vector3f anchor_ = Vector3f::Zero();  ///< m, NED: where bounded motion stays
  bool gpsUsed_ = false;                ///< a fix came within gpsAidTime
  bool gpsEver_ = false;
  bool altUsed_ = false;
  bool fieldUsed_ = false;  ///< the field aided heading within kFieldAidTime
};

template <int States>
void Navigation<States>::initialize(const Alignment& alignment, float gravity, Micros now) {
  filter_.initialize(alignment, gravity);
  complementary_.initialize(alignment, gravity);
  field_.start(alignment.magReference);
  history_.clear(now);
  lastGood_ = filter_.state();
  lastSample_ = lastMag_ = fieldTrusted_ = gpsHeard_ = altHeard_ = gpsTaken_ = altTaken_ =
      magTaken_ = agreed_ = lastOutageAid_ = now;
  aid_.start(now);
  healthCheck_.start(now);
  definite_ = {};
  health_ = health::kNone;
  started_ = true;
}

template <int States>
void Navigation<States>::restart(const VehicleState& state, Micros now) {
  history_.clear(now);
  standstill_ = StandstillDetector(config_.standstill);
  vibration_ = Vibration{};
  definite_ = {};
  filter_.restart(state.attitude, state.positionNed, state.velocityNed);
  complementary_.restart(state.attitude);
  lastGood_ = filter_.state();
  lastSample_ = agreed_ = now;
}

template <int States>
void Navigation<States>::predict(const Vector3f& accel, const Vector3f& gyro, Micros now) {
  if (!started_) return;
  setProcessNoise(gyro);
  const VehicleState before = filter_.state();
  filter_.predict(accel, gyro, now);
  const VehicleState& after = filter_.state();
  history_.add(now, after.positionNed - before.positionNed, after.velocityNed - before.velocityNed);
  complementary_.update(accel, gyro, toSeconds(elapsed(now, lastSample_)));
  standstill_.update(now, accel, gyro);
  vibration_.update(now, accel);
  lastSample_ = now;
}

/// Fast turns show the gyro's scale error, which GPS and field can mend. Bounded motion cannot: it
/// would take the wider covariance for leave to tilt.
template <int States>
void Navigation<States>::setProcessNoise(const Vector3f& gyro) {
  if (gpsUsed_) {
    filter_.setNoise(
        square(config_.accelNoise),
        square(config_.gyroNoise) + square(config_.gyroScaleNoise) * gyro.squaredNorm());
  } else {
    filter_.setNoise(square(config_.accelNoiseUnaided), square(config_.gyroNoiseUnaided));
  }
}

template <int States>
float Navigation<States>::factor(WithMotors use) const {
  if (motors_ == MotorState::Stopped || use == WithMotors::On) return 1.0F;
  const bool hover = motors_ == MotorState::Hover;
  if (use == WithMotors::Inflated) return hover ? 1.0F : config_.disturbedFactor;
  return use == WithMotors::HoverOnly && hover ? 1.0F : 0.0F;
}

template <int States>
void Navigation<States>::updateTiltMeas(const Vector3f& accel) {
  const float inflation = factor(config_.tiltWithMotors);
  const bool vibration = config_.tiltFusion == TiltFusion::Vibration;
  const float density2 = vibration ? square(config_.tiltVibration) * vibration_.meanSquare() : 0.0F;
  filter_.updateTiltMeas(accel, config_.tiltFusion == TiltFusion::Off ? 0.0F : inflation, density2);
}

template <int States>
void Navigation<States>::updateMagMeas(const Vector3f& mag, Micros now) {
  if (!started_) return;
  const float dt = toSeconds(elapsed(now, lastMag_));
  lastMag_ = now;
  const Vector3f field =
      motors_ == MotorState::Hover ? Vector3f(mag - config_.magHoverOffset) : mag;
  const Vector3f& rate = filter_.state().rateBody;
  float inflation = factor(config_.magWithMotors);
  if (inflation > 0.0F) complementary_.updateHeading(field, dt);
  if (config_.trackField) {
    const Vector3f fieldNed = rotateToNed(filter_.state().attitude, field - filter_.magBias());
    if (field_.update(fieldNed, rate.norm(), dt)) {
      fieldTrusted_ = now;
    } else {
      // Long refused, it may be that what is tracked is wrong: better a little of it than none.
      inflation *= elapsed(now, fieldTrusted_) > kFieldPatience ? kRefusedFieldFactor : 0.0F;
    }
  }
  // Lag, clock and scale errors of the field grow with the rate at which it turns.
  if (config_.magFusion == MagFusion::HeadingOnly) {
    inflation *= 1.0F + rate.squaredNorm() / square(config_.headingRate);
  }
  filter_.updateMagMeas(field, now, inflation);
  if (filter_.magInnovation().anyAccepted()) {
    magTaken_ = now;
    fieldUsed_ = true;
  }
}

template <int States>
void Navigation<States>::updateAltMeas(float height, Micros now) {
  if (!started_) return;
  filter_.updateAltMeas(height - history_.over(config_.altDelay).position.z(), now);
  altUsed_ = true;
  altHeard_ = now;
  if (filter_.altInnovation().anyAccepted()) altTaken_ = now;
}

template <int States>
void Navigation<States>::updateGPSMeas(const Vector3f& positionNed, const Vector3f& velocityNed,
                                       Micros now) {
  if (!started_) return;
  const Motion since = history_.over(config_.gpsDelay);
  filter_.updateGPSMeas(positionNed + since.position, velocityNed + since.velocity);
  gpsUsed_ = gpsEver_ = true;
  gpsHeard_ = now;
  if (filter_.gpsInnovation().anyAccepted()) gpsTaken_ = now;
}

template <int States>
void Navigation<States>::finishPass(Micros now) {
  if (!started_) return;
  if (gpsUsed_ && elapsed(now, gpsHeard_) > config_.gpsAidTime) {
    gpsUsed_ = false;
    anchor_ = filter_.state().positionNed;
  }
  if (fieldUsed_ && elapsed(now, magTaken_) > kFieldAidTime) fieldUsed_ = false;
  if (altUsed_ && elapsed(now, altHeard_) > config_.altTimeout) altUsed_ = false;
  if (aid_.run(now)) {
    if (config_.standstillAid && motors_ == MotorState::Stopped && standstill_.held()) {
      aidAtStandstill();
    } else if (config_.boundedMotion) {
      const bool mayFly = gpsEver_ && motors_ != MotorState::Stopped;
      gpsUsed_ || mayFly ? aidInOutage(now) : aidByBoundedMotion();
    }
  }
  const bool finite = filter_.finite();
  filter_.injectError();
  definite_.step();
  if (healthCheck_.run(now) || !finite || !definite_.definite()) checkHealth(now, finite);
}

template <int States>
void Navigation<States>::aidAtStandstill() {
  filter_.updateStandstill();
  filter_.updateStandstillRate(standstill_.meanGyro(), config_.standstillRateSigma);
}

/// What moves near a place, and has nothing to say so, is there, at rest, give or take. Not what
/// has flown by GPS and lost it: that goes on as in a gap.
template <int States>
void Navigation<States>::aidByBoundedMotion() {
  const VehicleState& s = filter_.state();
  const Vector3f away = anchor_ - s.positionNed;
  const float p = square(config_.boundedPositionSigma);
  const float v = square(config_.boundedVelocitySigma);
  // It holds at every heading, so it says nothing of it: where the magnetometer does, heading is
  // left alone. Where nothing does, the whole gain is needed to keep the tilt (measured on BROAD).
  const bool keep = fieldUsed_;
  filter_.template scalarAssumedUpdate<kPosition + 0>(away.x(), p, keep);
  filter_.template scalarAssumedUpdate<kPosition + 1>(away.y(), p, keep);
  if (!altUsed_) filter_.template scalarAssumedUpdate<kPosition + 2>(away.z(), p, keep);
  filter_.template scalarAssumedUpdate<kVelocity + 0>(-s.velocityNed.x(), v, keep);
  filter_.template scalarAssumedUpdate<kVelocity + 1>(-s.velocityNed.y(), v, keep);
  filter_.template scalarAssumedUpdate<kVelocity + 2>(-s.velocityNed.z(), v, keep);
}

/// While GPS aids, how fast the aircraft usually is; in a gap, that it still is.
template <int States>
void Navigation<States>::aidInOutage(Micros now) {
  const Vector3f& velocity = filter_.state().velocityNed;
  if (elapsed(now, gpsHeard_) < kOutageStart) {
    const float horizontal = 0.5F * (square(velocity.x()) + square(velocity.y()));
    meanSquareVelocity_ += kSpeedPart * (horizontal - meanSquareVelocity_);
    lastOutageAid_ = now;
  } else if (elapsed(now, lastOutageAid_) >= kOutagePeriod) {
    lastOutageAid_ = now;
    const float variance = square(config_.outageVelocitySigma) +
                           square(config_.outageVelocityFactor) * meanSquareVelocity_;
    filter_.template scalarAssumedUpdate<kVelocity + 0>(-velocity.x(), variance, false);
    filter_.template scalarAssumedUpdate<kVelocity + 1>(-velocity.y(), variance, false);
  }
}

template <int States>
void Navigation<States>::checkHealth(Micros now, bool finite) {
  keepStampsFresh(now);
  NavigationHealth found = health_ & (health::kRestarted | health::kLost);
  const auto setIf = [&found](bool bad, NavigationHealth bit) { found |= bad ? bit : 0U; };
  const bool sound = finite && filter_.healthy();
  setIf(!sound, health::kNotFinite);
  setIf(sound && !definite_.definite(), health::kNotPositiveDefinite);
  if (definite_.done()) definite_.start(filter_.packedCovariance());
  setIf(elapsed(now, gpsTaken_) > config_.gpsTimeout, health::kNoGps);
  setIf(elapsed(now, altTaken_) > config_.altTimeout, health::kNoAltimeter);
  setIf(elapsed(now, magTaken_) > config_.magTimeout, health::kNoMagnetometer);

  const Vector3f down = downInBody(filter_.state().attitude);
  const Vector3f other = downInBody(complementary_.attitude());
  if (down.dot(other) > 0.0F && down.cross(other).norm() < config_.disagreement) agreed_ = now;
  setIf(elapsed(now, agreed_) > config_.disagreementTime, health::kAttitudesDisagree);

  if ((found & health::kLost) == 0) {
    lastGood_ = filter_.state();
  } else if (isFinite(complementary_.attitude().w) && mayRestart(now)) {
    restartFromFallback(now);
    found = (found & ~health::kLost) | health::kRestarted;
  }
  health_ = found;
}

/// A stamp of long ago must not look like one of just now when the clock comes round, 71.6 min
/// later.
template <int States>
void Navigation<States>::keepStampsFresh(Micros now) {
  constexpr Micros kLongAgo = 2'000'000'000;
  for (Micros* stamp : {&gpsHeard_, &altHeard_, &gpsTaken_, &altTaken_, &magTaken_, &agreed_,
                        &restarted_, &fieldTrusted_}) {
    if (elapsed(now, *stamp) > kLongAgo) *stamp = now - kLongAgo;
  }
}

/// Begins anew with what is left: the complementary filter's attitude where the filter was last
/// known to be.
template <int States>
void Navigation<States>::restartFromFallback(Micros now) {
  restarted_ = now;
  history_.clear(now);  // what broke the filter may be in what it remembers
  standstill_ = StandstillDetector(config_.standstill);
  vibration_ = Vibration{};
  definite_ = {};
  filter_.restart(complementary_.attitude(), lastGood_.positionNed, lastGood_.velocityNed);
  ++restarts_;
}

template <int States>
VehicleState Navigation<States>::state() const {
  if (healthy()) return filter_.state();
  VehicleState fallback = lastGood_;
  fallback.attitude = complementary_.attitude();
  fallback.rateBody = filter_.state().rateBody;
  return fallback;
}

}  // namespace strix
