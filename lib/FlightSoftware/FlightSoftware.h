/// The flight software: everything that runs on the aircraft, for any Board.
#pragma once

#include "BatteryMonitor.h"
#include "Board.h"
#include "Conditions.h"
#include "Controller.h"
#include "CorrectionSmoother.h"
#include "Detectors.h"
#include "FiniteStateMachine.h"
#include "FlightLog.h"
#include "FlightSoftwareConfig.h"
#include "Guidance.h"
#include "Logger.h"
#include "MissionText.h"
#include "Motors.h"
#include "Navigation.h"
#include "PowerReadings.h"
#include "Sensors.h"
#include "Version.h"

namespace strix {

/// @tparam States  of the navigation filter: 18, or 9 without biases
template <class Board, int States = 18>
class FlightSoftware {
  static_assert(Motors::kRateHz == static_cast<float>(Controller::kRateHz));

 public:
  FlightSoftware(Board& board, const FlightSoftwareConfig& config)
      : board_(board),
        config_(config),
        sensors_(board, config.sensors),
        startCalibration_(config.startCalibration),
        navigation_(config.navigation),
        smoother_(config.gpsSmoothing, kControlPeriod),
        battery_(config.vehicle.batteryCells),
        guidance_(config.mission, config.guidance, config.vehicle.mass * kGravity),
        controller_(config.vehicle, config.gains, config.control),
        motors_(config.vehicle, config.motors),
        gyroFilter_(config.gyroFilter, 1e6F / static_cast<float>(config.sensors.imuPeriod),
                    static_cast<float>(Controller::kRateHz), config.vehicle.motorTimeConstant),
        logger_(board.card()),
        touchDown_(config.touchDown.duration),
        hover_(config.hover.duration),
        wrongConfig_((sensors_.mountingValid() ? 0U : prearm::kMounting) |
                     (gyroFilter_.valid() ? 0U : prearm::kGyroFilter) |
                     (motors_.valid() ? 0U : prearm::kLayout) |
                     (isFlyable(config.mission, config.fence) ? 0U : prearm::kMission)),
        cosArmTilt_(cosine(config.armTilt)) {}

  /// Starts the board and the log. Start-up calibration follows in the loop, in state BOOT.
  void setup() {
    found_ = board_.begin();
    const Micros now = board_.micros();
    lastPass_ = now;
    const LogTime time = clock_.update(now);
    sensors_.start(now);
    controller_.reset(now);
    motors_.disarm();
    motors_.writeESC(board_);
    hover_.reset(now);
    touchDown_.reset(now);
    entered_ = now;
    Micros phase = 0;  // each in a control tick of its own
    for (PeriodicTask* task : {&stateLog_, &switchLog_, &stdLog_, &statusLog_, &controlLog_,
                               &faultLog_, &faultRecord_}) {
      phase += periodFromHz(Controller::kRateHz);
      task->start(now + phase);
    }
    logger_.begin(time,
                  {config_.vehicle.name, Board::kName, kVersion, kGitCommit, board_.bootId()});
    loadMission(time);
    const Mission& mission = config_.mission;
    logger_.log(toRecord(time, config_, found_));
    for (std::size_t i = 0; i < mission.legCount && i < Mission::kMaxLegs; ++i) {
      logger_.log(toRecord(time, mission.legs[i]));
    }
  }

  /// One pass. Nothing in it waits. Only a reading or a control tick changes anything, and both are
  /// logged with the time of their pass: from those a replay makes the same passes again.
  void loop() {
    const Micros now = board_.micros();  // the one time stamp of this pass
    const LogTime time = clock_.update(now);
    bool heard = false;
    bool fixed = false;  // by GPS

    if (sensors_.imuUpdate(now)) {
      heard = true;
      const ImuRaw& raw = sensors_.getIMUMeas();
      const ImuSample imu = sensors_.processIMUMeas(raw);
      startCalibration_.addImu(imu.sampled, imu.accel, imu.gyro);  // until it is done;
      navigation_.predict(imu.accel, imu.gyro, imu.sampled);       // from then on
      navigation_.updateTiltMeas(imu.accel);
      controlRate_ = gyroFilter_.update(estimator().state().rateBody);
      logger_.logIMU(toRecord(time, clock_.at(raw.sampled), raw));
      logAid<AidSource::Tilt>(time, estimator().tiltInnovation());
    }
    if (sensors_.magUpdate(now)) {
      heard = true;
      const MagRaw& raw = sensors_.getMagMeas();
      const Vector3f field = sensors_.processMagMeas(raw, motors_.throttle());
      startCalibration_.addMag(field);
      navigation_.updateMagMeas(field, now);
      logger_.logMag(toRecord(time, clock_.at(raw.sampled), raw));
      logAid<AidSource::Magnetometer>(time, estimator().magInnovation());
    }
    if (sensors_.altUpdate(now)) {
      heard = true;
      const AltRaw& raw = sensors_.getAltMeas();
      startCalibration_.addPressure(raw.pressure);
      navigation_.updateAltMeas(sensors_.processAltMeas(raw), now);
      logger_.logAlt(toRecord(time, clock_.at(raw.sampled), raw));
      logAid<AidSource::Altimeter>(time, estimator().altInnovation());
    }
    if (sensors_.gpsUpdate(now)) {
      heard = true;
      const GpsRaw& raw = sensors_.getGPSMeas();
      if (sensors_.gpsUsable(raw)) {
        if (!everArmed_) averageOrigin(raw);
        const GpsSample gps = sensors_.processGPSMeas(raw);
        navigation_.updateGPSMeas(gps.positionNed, gps.velocityNed, now);
        fixed = true;
      }
      logger_.logGPS(toRecord(time, clock_.at(raw.sampled), raw));
      logAid<AidSource::Gps>(time, estimator().gpsInnovation());
    }
    if (heard) {
      const VehicleState before = fixed ? navigation_.state() : VehicleState{};
      navigation_.finishPass(now);
      if (fixed) smoother_.correct(before, navigation_.state());
      if (calibrating() && startCalibration_.done()) finishCalibration(now, time);
    }
    if (controller_.due(now)) controlTick(now, time);
    logger_.write(time);
    logger_.flush(time);
    lastPass_ = now;
  }

  [[nodiscard]] const FiniteStateMachine& stateMachine() const { return fsm_; }
  [[nodiscard]] const Navigation<States>& navigation() const { return navigation_; }
  [[nodiscard]] const ESKF<States>& estimator() const { return navigation_.filter(); }
  [[nodiscard]] const Sensors<Board>& sensors() const { return sensors_; }
  [[nodiscard]] const Motors& motors() const { return motors_; }
  [[nodiscard]] const Controller& controller() const { return controller_; }
  [[nodiscard]] const Guidance& guidance() const { return guidance_; }
  [[nodiscard]] Logger<typename Board::Card>& logger() { return logger_; }

  /// What the last control tick logged of itself.
  [[nodiscard]] const topic::ControlTick& lastTick() const { return lastTick_; }

  /// Periods of any task missed since the start.
  [[nodiscard]] std::uint32_t overruns() const {
    return sensors_.missed() + controller_.overruns();
  }

 private:
  /// Every 2 ms: what the pilot wants, where to be, what it takes, and the motors.
  void controlTick(Micros now, LogTime time) {
    VehicleState estimate = navigation_.state();
    estimate.rateBody = controlRate_;
    smoother_.advance();
    if (!motors_.armed()) smoother_.clear();  // what stands still has nothing to jump after
    smoother_.apply(estimate);
    readPower(time);
    updateStateMachine(now, time, estimate);
    const Reference& reference = guidance_.update(now);
    const bool controlled = fsm_.getControlFlag() && !guidance_.idles();
    controller_.setGrounded(!controlled);
    controller_.updateControl(now, reference, estimate);
    motors_.commandControl(controlled ? controller_.getControl() : Wrench::none());
    motors_.writeESC(board_);
    controller_.setAchieved(motors_.achieved());
    navigation_.setMotors(motorState(now));
    if (gyroFilter_.active()) gyroFilter_.setMotorSpeed(motors_.meanRevolutions());
    lastTick_ = tick(now, time);
    logger_.logGNC(toRecords(time, estimate, reference, controller_, motors_, lastTick_));
    logNavigation(now, time);
    if (controlLog_.run(now)) logger_.log(toRecord(time, controller_, motors_));
    if (faultLog_.run(now)) logFaults(now, time);
  }

  void readPower(LogTime time) {
    strix::readPower(board_, clock_, time, battery_, logger_);
    motors_.setBatteryVoltage(battery_.voltage());
  }

  /// The card's mission instead of the one compiled in; one that is wrong forbids arming.
  void loadMission(LogTime time) {
    const std::string_view text = board_.missionText();
    if (text.empty()) return;
    const ParsedMission parsed = parseMission("mission.txt", text, config_.fence);
    if (!parsed.valid()) {
      wrongConfig_ |= prearm::kMission;
      logger_.logText(ulog::LogLevel::Error, time, MissionErrorText(parsed.error).text());
      return;
    }
    wrongConfig_ &= ~prearm::kMission;
    config_.mission = parsed.mission;
    guidance_ = Guidance(parsed.mission, config_.guidance, config_.vehicle.mass * kGravity);
  }

  [[nodiscard]] bool calibrating() const { return fsm_.state() == FlightState::Boot; }

  /// Aligns the filter with what the still aircraft showed.
  void finishCalibration(Micros now, LogTime time) {
    const StartCalibration& found = startCalibration_;
    const Alignment alignment = alignStill(found.accel(), found.mag(), config_.declination);
    const float gravity = found.accel().norm();
    sensors_.setStartCalibration(found.gyroBias(), found.groundPressure());
    navigation_.initialize(alignment, gravity, now);
    const GeoPoint& origin = sensors_.origin();
    logger_.log(topic::EstimatorStart{
        time, toArray(found.gyroBias()), gravity, toArray(alignment.magReference),
        found.groundPressure(), origin.latitude, origin.longitude, toArray(alignment.attitude)});
  }

  /// Before the first flight every fix makes the origin better. Then it stands still, also when the
  /// aircraft has landed somewhere else.
  void averageOrigin(const GpsRaw& raw) {
    origin_.add(Sensors<Board>::geoPoint(raw));
    sensors_.setOrigin(origin_.origin());
  }

  /// What the motors do to magnetometer and accelerometer.
  [[nodiscard]] MotorState motorState(Micros now) {
    const float weight = config_.vehicle.mass * kGravity;
    const float excess = motors_.achieved().thrust / weight - 1.0F;
    hover_.update(now, motors_.armed() && excess < config_.hover.thrustBand &&
                           excess > -config_.hover.thrustBand);
    if (!motors_.armed()) return MotorState::Stopped;
    return hover_.held() ? MotorState::Hover : MotorState::Disturbed;
  }

  void updateStateMachine(Micros now, LogTime time, const VehicleState& estimate) {
    const PilotSwitches pilot = board_.readPilot();
    const ConditionSet failures = preArmFailures(now, pilot, estimate);
    const ConditionSet conditions = conditionsNow(now, pilot, estimate, failures);
    const Transition* row = fsm_.update(conditions);
    if (row != nullptr) {
      entered_ = now;
      touchDown_.reset(now);
      guidance_.enter(fsm_.state(), now, estimate);
      if (fsm_.getMotorFlag() && !motors_.armed()) motors_.arm();
      everArmed_ = everArmed_ || motors_.armed();
      if (!fsm_.getMotorFlag() && motors_.armed()) motors_.disarm();  // written by this tick
      say(time, *row, failures);
    }
    if (row != nullptr || stateLog_.due(now)) {
      stateLog_.postpone(now);
      logger_.log(topic::FlightState{time, conditions, failures,
                                     static_cast<std::uint8_t>(fsm_.state()), fsm_.getControlFlag(),
                                     fsm_.getMotorFlag(), fsm_.getCriticalErrorFlag()});
    }
    logSwitches(now, time, pilot);
  }

  /// Everything that forbids arming now.
  [[nodiscard]] ConditionSet preArmFailures(Micros now, const PilotSwitches& pilot,
                                            const VehicleState& estimate) const {
    ConditionSet set = wrongConfig_;
    const auto refuseIf = [&set](bool bad, ConditionSet bit) { set |= bad ? bit : 0U; };
    refuseIf(calibrating(), prearm::kNotCalibrated);
    refuseIf(!found_.imu || !sensors_.imuFresh(now), prearm::kImu);
    refuseIf(!found_.mag || !sensors_.magFresh(now), prearm::kMag);
    refuseIf(!found_.alt || !sensors_.altFresh(now), prearm::kAlt);
    if (!config_.mission.onStand()) {  // which has no place, and may be under a roof
      refuseIf(!sensors_.gpsFresh(now) || !sensors_.gpsUsable(sensors_.getGPSMeas()), prearm::kGps);
      refuseIf(origin_.count() < config_.originFixes, prearm::kOrigin);
      refuseIf(!config_.fence.contains(estimate.positionNed), prearm::kFence);
    }
    refuseIf((navigation_.health() & health::kNoArming) != 0, prearm::kEstimator);
    refuseIf(!(cosTilt(estimate.attitude) > cosArmTilt_), prearm::kTilt);
    refuseIf(!navigation_.standsStill(), prearm::kMoving);
    refuseIf(pilot.kill, prearm::kKillSwitch);
    refuseIf(pilot.start, prearm::kStartSwitch);
    refuseIf(!found_.card || logger_.failed(), prearm::kLog);
    return set;
  }

  [[nodiscard]] ConditionSet conditionsNow(Micros now, const PilotSwitches& pilot,
                                           const VehicleState& estimate, ConditionSet failures) {
    ConditionSet set = guidance_.conditions(now, estimate);
    const auto setIf = [&set](bool present, ConditionSet bit) { set |= present ? bit : 0U; };
    setIf(startCalibration_.done(), condition::kCalibrated);
    setIf(pilot.arm && !armSwitchWasOn_, condition::kArmEdge);
    armSwitchWasOn_ = pilot.arm;
    setIf(!pilot.arm, condition::kDisarm);
    setIf(failures != 0, condition::kPreArmFailure);
    setIf(pilot.start, condition::kStart);
    setIf(elapsed(now, entered_) >= config_.armedTimeout, condition::kArmedTooLong);
    setIf(touchDown(now, estimate), condition::kTouchDown);
    setIf(pilot.kill, condition::kKill);
    setIf(!(cosTilt(estimate.attitude) > 0.0F), condition::kUpset);
    setIf(!config_.fence.contains(navigation_.state().positionNed), condition::kOutsideFence);
    setIf(!sensors_.imuFresh(now), condition::kImuLost);
    setIf(!navigation_.healthy(), condition::kEstimatorUnhealthy);
    return set;
  }

  [[nodiscard]] bool touchDown(Micros now, const VehicleState& estimate) {
    const float weight = config_.vehicle.mass * kGravity;
    return touchDown_.update(
        now, fsm_.state() == FlightState::Land &&
                 motors_.achieved().thrust < config_.touchDown.thrustFraction * weight &&
                 estimate.velocityNed.z() < config_.touchDown.sinkRate);
  }

  /// Tells the pilot and the log what happened, and why arming was refused.
  void say(LogTime time, const Transition& row, ConditionSet failures) {
    const bool cutOff = row.to == FlightState::Safe && (row.from & in(FlightState::Safe)) == 0;
    logger_.logText(cutOff ? ulog::LogLevel::Error : ulog::LogLevel::Info, time, row.said);
    if (row.to != FlightState::Armed && (row.when & condition::kArmEdge) != 0) {
      logger_.logText(ulog::LogLevel::Warning, time, firstRefusal(failures));
    }
  }

  [[nodiscard]] topic::ControlTick tick(Micros now, LogTime time) const {
    StateHash hash;
    const VehicleState& s = estimator().state();
    hash.add(s.positionNed);
    hash.add(s.velocityNed);
    hash.add(toArray(s.attitude));
    hash.add(estimator().accelBias());
    hash.add(estimator().gyroBias());
    hash.add(estimator().magBias());
    hash.add(estimator().packedCovariance().elements());
    hash.add(smoother_.position());
    hash.add(smoother_.velocity());
    hash.add(controller_.error());
    hash.add(controller_.integral().horizontalNed());
    hash.add(controller_.integral().down());
    hash.add(controller_.integral().yaw());
    hash.add(controller_.wrenchEstimate().now());
    hash.add(static_cast<std::uint32_t>(fsm_.state()));
    hash.add(motors_.commands());
    return {time, hash.value(), elapsed(now, lastPass_), overruns()};
  }

  template <AidSource Source>
  void logAid(LogTime time, const Innovation& innovation) {
    logger_.template logAid<Source>(toRecord(time, innovation));
  }

  /// How sure the filter is, and in words what has just gone wrong with it.
  void logNavigation(Micros now, LogTime time) {
    if (stdLog_.run(now)) logger_.log(toStdRecord(time, estimator()));
    if (!statusLog_.run(now)) return;
    logger_.log(toBiasRecord(time, estimator()));
    logger_.log(toRecord(time, navigation_));
    const NavigationHealth begun = navigation_.health() & ~loggedHealth_;
    loggedHealth_ = navigation_.health();
    for (const HealthText& text : kHealthTexts) {
      if ((begun & text.bit) != 0) logger_.logText(ulog::LogLevel::Warning, time, text.said);
    }
    if (navigation_.readmissions() == loggedReadmissions_) return;
    loggedReadmissions_ = navigation_.readmissions();
    logger_.logText(ulog::LogLevel::Warning, time,
                    "estimator: takes in again a sensor it had rejected for long");
  }

  /// Nothing is decided by these counts: a reading that does not come is seen as that.
  void logFaults(Micros now, LogTime time) {
    SensorFaultCounts counts;
    board_.countFaults(counts);
    counts[SensorFault::ImuClipped] = sensors_.clipped();
    counts[SensorFault::Invalid] = sensors_.invalid();
    const std::uint32_t before = faults_.flags();
    const std::uint32_t begun = faults_.update(now, counts);
    for (std::size_t i = 0; i < kSensorFaultCount; ++i) {
      if ((begun >> i & 1U) == 0) continue;
      logger_.logText(ulog::LogLevel::Warning, time, kSensorFaultTexts[i]);
    }
    if (faults_.flags() == before && !faultRecord_.due(now)) return;
    faultRecord_.postpone(now);
    logger_.log(topic::SensorFaults{time, faults_.flags(), counts.all()});
  }

  void logSwitches(Micros now, LogTime time, const PilotSwitches& pilot) {
    const bool changed = pilot.arm != loggedPilot_.arm || pilot.kill != loggedPilot_.kill ||
                         pilot.start != loggedPilot_.start;
    if (!changed && !switchLog_.due(now)) return;
    switchLog_.postpone(now);
    loggedPilot_ = pilot;
    logger_.log(toRecord(time, pilot));
  }

  Board& board_;
  FlightSoftwareConfig config_;
  Sensors<Board> sensors_;
  StartCalibration startCalibration_;
  OriginAverage origin_;
  Navigation<States> navigation_;
  CorrectionSmoother smoother_;
  BatteryMonitor battery_;
  FiniteStateMachine fsm_;
  Guidance guidance_;
  Controller controller_;
  Motors motors_;
  GyroFilter gyroFilter_;
  Vector3f controlRate_ = Vector3f::Zero();  ///< rad/s, body, filtered for the controller
  Logger<typename Board::Card> logger_;
  LogClock clock_;
  SensorSet found_;
  Persistence touchDown_;
  Persistence hover_;
  ConditionSet wrongConfig_;  ///< what no flight can mend
  const float cosArmTilt_;
  PeriodicTask stateLog_{periodFromHz(10)};
  PeriodicTask switchLog_{periodFromHz(1)};
  PeriodicTask stdLog_{periodFromHz(50)};
  PeriodicTask statusLog_{periodFromHz(10)};
  PeriodicTask controlLog_{periodFromHz(50)};
  PeriodicTask faultLog_{periodFromHz(10)};
  PeriodicTask faultRecord_{periodFromHz(1)};
  SensorFaultWatch faults_;
  NavigationHealth loggedHealth_ = health::kNone;
  std::uint32_t loggedReadmissions_ = 0;
  PilotSwitches loggedPilot_;
  topic::ControlTick lastTick_;
  Micros entered_ = 0;  ///< when the present state began
  Micros lastPass_ = 0;
  bool everArmed_ = false;
  bool armSwitchWasOn_ = true;  ///< so that a switch held through power-up is no edge
};

}  // namespace strix
