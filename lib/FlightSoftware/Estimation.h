/// From readings to the estimate that guidance and control get.
#pragma once

#include "BlindFlight.h"
#include "Controller.h"
#include "CorrectionSmoother.h"
#include "FlightLog.h"
#include "FlightSoftwareConfig.h"
#include "GyroFilter.h"
#include "Motors.h"
#include "Navigation.h"
#include "Sensors.h"
#include "StartCalibration.h"
#include "Wrench.h"

namespace strix {

/// Takes each reading once, logs it as it came, and keeps the filter.
/// @tparam Log  the Logger
template <class Board, int States, class Log>
class Estimation {
 public:
  Estimation(Board& board, const FlightSoftwareConfig& config, Log& logger, const LogClock& clock)
      : logger_(logger),
        clock_(clock),
        sensors_(board, config.sensors),
        startCalibration_(config.startCalibration),
        navigation_(config.navigation),
        smoother_(config.gpsSmoothing, kControlPeriod),
        blind_(config.vehicle),
        gyroFilter_(config.gyroFilter, 1e6F / static_cast<float>(config.sensors.imuPeriod),
                    static_cast<float>(Controller::kRateHz), config.vehicle.motorTimeConstant) {}

  void start(Micros now) { sensors_.start(now); }

  /// What has come since the last pass.
  /// @param throttle  0 to 1 of the motors: their currents turn the magnetometer
  /// @return true when something has
  bool read(Micros now, LogTime time, float throttle) {
    bool heard = false;
    fixed_ = false;
    if (sensors_.imuUpdate(now)) {
      heard = true;
      const ImuRaw& raw = sensors_.getIMUMeas();
      const ImuSample imu = sensors_.processIMUMeas(raw);
      if (blind_.active() && !resumed_) {  // in the gap only the model has gone on
        navigation_.restart(blind_.state(), imu.sampled);
        resumed_ = true;
      }
      startCalibration_.addImu(imu.sampled, imu.accel, imu.gyro);  // until it is done;
      navigation_.predict(imu.accel, imu.gyro, imu.sampled);       // from then on
      navigation_.updateTiltMeas(imu.accel);
      controlRate_ = gyroFilter_.update(filter().state().rateBody);
      specificForce_ = imu.accel;
      logger_.logIMU(toRecord(time, clock_.at(raw.sampled), raw));
      logAid<AidSource::Tilt>(time, filter().tiltInnovation());
    }
    if (sensors_.magUpdate(now)) {
      heard = true;
      const MagRaw& raw = sensors_.getMagMeas();
      const Vector3f field = sensors_.processMagMeas(raw, throttle);
      startCalibration_.addMag(field);
      navigation_.updateMagMeas(field, now);
      blind_.updateMagMeas(field);
      logger_.logMag(toRecord(time, clock_.at(raw.sampled), raw));
      logAid<AidSource::Magnetometer>(time, filter().magInnovation());
    }
    if (sensors_.altUpdate(now)) {
      heard = true;
      const AltRaw& raw = sensors_.getAltMeas();
      startCalibration_.addPressure(raw.pressure);
      const float height = sensors_.processAltMeas(raw);
      navigation_.updateAltMeas(height, now);
      blind_.updateAltMeas(height);
      logger_.logAlt(toRecord(time, clock_.at(raw.sampled), raw));
      logAid<AidSource::Altimeter>(time, filter().altInnovation());
    }
    if (sensors_.gpsUpdate(now)) {
      heard = true;
      const GpsRaw& raw = sensors_.getGPSMeas();
      const bool flies = throttle > 0.0F;  // a receiver may keep its place while it is not moved
      if (sensors_.gpsUsable(raw) && !(flies && sensors_.gpsStuck())) {
        if (!originStands_) averageOrigin(raw);
        const GpsSample gps = sensors_.processGPSMeas(raw);
        navigation_.updateGPSMeas(gps.positionNed, gps.velocityNed, now);
        fixed_ = fixedSinceTick_ = true;
      }
      logger_.logGPS(toRecord(time, clock_.at(raw.sampled), raw));
      logAid<AidSource::Gps>(time, filter().gpsInnovation());
    }
    return heard;
  }

  /// After read() has brought something.
  void finishPass(Micros now) {
    const VehicleState before = fixed_ ? navigation_.state() : VehicleState{};
    navigation_.finishPass(now);
    if (fixed_) smoother_.correct(before, navigation_.state());
  }

  /// Begins anew, as after power-up.
  void recalibrate() {
    sensors_.setStartCalibration(Vector3f::Zero(), sensors_.groundPressure());
    startCalibration_.begin();
  }
  [[nodiscard]] bool calibrated() const { return startCalibration_.done(); }

  /// Aligns the filter with what the still aircraft showed.
  /// @param declination  rad, east positive
  void align(Micros now, LogTime time, float declination) {
    const StartCalibration& found = startCalibration_;
    const Alignment alignment = alignStill(found.accel(), found.mag(), declination);
    const float gravity = found.accel().norm();
    sensors_.setStartCalibration(found.gyroBias(), found.groundPressure());
    navigation_.initialize(alignment, gravity, now);
    const GeoPoint& origin = sensors_.origin();
    logger_.log(topic::EstimatorStart{
        time, toArray(found.gyroBias()), gravity, toArray(alignment.magReference),
        found.groundPressure(), origin.latitude, origin.longitude, toArray(alignment.attitude)});
  }

  /// The estimate of a control tick. On the ground corrections need no smoothing: what stands still
  /// has nothing to jump after.
  [[nodiscard]] VehicleState estimate(bool motorsOn) {
    VehicleState estimate = navigation_.state();
    estimate.rateBody = controlRate_;
    smoother_.advance();
    if (!motorsOn) smoother_.clear();
    smoother_.apply(estimate);
    return estimate;
  }

  /// What the motors do to the sensors from now on.
  void setMotors(MotorState state, const Motors& motors) {
    navigation_.setMotors(state);
    if (gyroFilter_.active()) gyroFilter_.setMotorSpeed(motors.meanRevolutions());
  }

  /// From the first flight on the origin stands still, also when the aircraft lands elsewhere.
  void keepOrigin() { originStands_ = true; }
  [[nodiscard]] std::uint32_t originFixes() const { return origin_.count(); }

  /// A usable fix has come since this was asked last.
  [[nodiscard]] bool takeFixed() {
    const bool fixed = fixedSinceTick_;
    fixedSinceTick_ = false;
    return fixed;
  }

  /// m/s^2, body, of the last sample.
  [[nodiscard]] const Vector3f& specificForce() const { return specificForce_; }
  [[nodiscard]] const Sensors<Board>& sensors() const { return sensors_; }
  [[nodiscard]] const Navigation<States>& navigation() const { return navigation_; }
  [[nodiscard]] const ESKF<States>& filter() const { return navigation_.filter(); }
  [[nodiscard]] const CorrectionSmoother& smoother() const { return smoother_; }
  [[nodiscard]] const GyroFilter& gyroFilter() const { return gyroFilter_; }
  [[nodiscard]] BlindFlight& blind() { return blind_; }
  /// The IMU is lost.
  void startBlind(const VehicleState& estimate) {
    blind_.start(estimate);
    resumed_ = false;
  }
  /// The filter's attitude is near the model's: ours, 15 deg.
  [[nodiscard]] bool agreesWithModel() const {
    constexpr float kNear = 15.0F * kDegToRad;
    return attitudeError(blind_.state().attitude, filter().state().attitude).squaredNorm() <
           kNear * kNear;
  }

 private:
  void averageOrigin(const GpsRaw& raw) {
    origin_.add(Sensors<Board>::geoPoint(raw));
    sensors_.setOrigin(origin_.origin());
  }

  template <AidSource Source>
  void logAid(LogTime time, const Innovation& innovation) {
    logger_.template logAid<Source>(toRecord(time, innovation));
  }

  Log& logger_;
  const LogClock& clock_;
  Sensors<Board> sensors_;
  StartCalibration startCalibration_;
  OriginAverage origin_;
  Navigation<States> navigation_;
  CorrectionSmoother smoother_;
  BlindFlight blind_;
  GyroFilter gyroFilter_;
  Vector3f controlRate_ = Vector3f::Zero();    ///< rad/s, body, filtered for the controller
  Vector3f specificForce_ = Vector3f::Zero();  ///< m/s^2, body
  bool fixed_ = false;                         ///< by GPS, in this pass
  bool fixedSinceTick_ = false;
  bool originStands_ = false;
  bool resumed_ = false;  ///< from the model
};

}  // namespace strix
