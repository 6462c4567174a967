/// Ugglan's own pipeline, for any Board: complementary filter, reduced-observer attitude controller
/// and the pilot's sticks at 50 Hz. No navigation, no mission: the pilot flies.
///
/// Beside FlightSoftware, not in it: they share the board, the sensors' processing, the motors and
/// the log, and nothing of either's states. What comes in between two ticks is held or averaged:
///
///   IMU       read in each pass; the mean since the last tick. Its turn over the tick is exact,
///             and the mean over 20 ms is blind to the propellers, which a single sample at 50 Hz
///             would fold down to any frequency. It costs 10 ms of age: observer_gains.py counts
///             with it.
///   field     the last, once
///   pressure  10 Hz, the last; for the log: nothing here flies by height
///   ESCs      5 Hz, the last voltage
#pragma once

#include "BatteryMonitor.h"
#include "Board.h"
#include "ComplementaryFilter.h"
#include "Detectors.h"
#include "FlightLog.h"
#include "Logger.h"
#include "Motors.h"
#include "Pilot.h"
#include "PowerReadings.h"
#include "ReducedObserver.h"
#include "Sensors.h"
#include "StartCalibration.h"
#include "StateHash.h"
#include "States.h"
#include "StickMapping.h"
#include "Version.h"

namespace strix {

struct UgglanFlightConfig {
  const Vehicle& vehicle;
  const ObserverGains& gains;
  SensorConfig sensors{};
  StartCalibrationConfig startCalibration{};
  ComplementaryConfig filter{};
  StickLimits sticks{};
  Parameters parameters{};            ///< of the radio: its receiver, channels and time-out
  float declination = 0.0F;           ///< rad, east positive: magnetic to true north
  float armTilt = 20.0F * kDegToRad;  ///< rad, most tilt at arming
  float armRate = 0.1F;               ///< rad/s: turning faster is no standing still
  float armThrottle = 0.05F;          ///< of its way: the throttle is low below it
  float controlThrust = 0.5F;         ///< of the weight: from there on the law acts
  Micros groundedAfter = 2'000'000;   ///< with the throttle low: the law rests again
};

template <class Board>
class UgglanFlight {
 public:
  static constexpr std::uint32_t kRateHz = 50;
  static constexpr std::uint32_t kPressureHz = 10;
  static constexpr std::uint32_t kEscHz = 5;

  UgglanFlight(Board& board, const UgglanFlightConfig& config)
      : board_(board),
        config_(config),
        sensors_(board, config.sensors),
        startCalibration_(config.startCalibration),
        battery_(config.vehicle.batteryCells),
        filter_(config.filter),
        mapping_(config.sticks),
        law_(config.vehicle, config.gains, 1.0F / static_cast<float>(kRateHz)),
        motors_(config.vehicle),
        logger_(board.card()),
        throttleLow_(config.groundedAfter),
        cosArmTilt_(cosine(config.armTilt)) {}

  /// Starts the board and the log. Start-up calibration follows in the loop.
  void setup() {
    pilot_.configure(config_.parameters);
    (void)board_.begin();  // a device that did not answer gives nothing, and so forbids arming
    board_.beginRadio(static_cast<RadioProtocol>(config_.parameters.radioProtocol));
    const Micros now = board_.micros();
    const LogTime time = clock_.update(now);
    lastPass_ = lastTick_ = lastField_ = now;
    sensors_.start(now);
    control_.start(now);
    pressure_.start(now);
    power_.start(now);
    stateLog_.start(now);
    law_.reset();
    motors_.disarm();
    motors_.writeESC(board_);
    logger_.begin(time,
                  {config_.vehicle.name, Board::kName, kVersion, kGitCommit, board_.bootId()});
  }

  /// One pass. Nothing in it waits.
  void loop() {
    const Micros now = board_.micros();  // the one time stamp of this pass
    const LogTime time = clock_.update(now);
    readSensors(now, time);
    if (!aligned_ && startCalibration_.done()) finishCalibration(time);
    arming(now, time);  // in each pass: off is off at once
    if (control_.run(now)) controlTick(now, time);
    logger_.write(time);
    logger_.flush(time);
    lastPass_ = now;
  }

  [[nodiscard]] bool calibrated() const { return aligned_; }
  [[nodiscard]] const Quaternion& attitude() const { return filter_.attitude(); }
  [[nodiscard]] const Vector3f& rate() const { return rate_; }  ///< rad/s, body
  [[nodiscard]] float height() const { return height_; }        ///< m, from the last pressure
  [[nodiscard]] float voltage() const { return battery_.voltage(); }
  [[nodiscard]] const Reference& reference() const { return reference_; }
  [[nodiscard]] const Wrench& wanted() const { return wanted_; }
  [[nodiscard]] const ReducedObserverController& law() const { return law_; }
  /// The law acts: since take-off, until the throttle was low for a while.
  [[nodiscard]] bool controlling() const { return !grounded_; }
  [[nodiscard]] const Motors& motors() const { return motors_; }
  [[nodiscard]] Logger<typename Board::Card>& logger() { return logger_; }
  [[nodiscard]] std::uint32_t overruns() const { return control_.overruns(); }

 private:
  void readSensors(Micros now, LogTime time) {
    if (sensors_.imuUpdate(now)) {
      const ImuRaw& raw = sensors_.getIMUMeas();
      const ImuSample imu = sensors_.processIMUMeas(raw);
      startCalibration_.addImu(imu.sampled, imu.accel, imu.gyro);  // until it is done
      accelMean_.add(imu.accel);
      gyroMean_.add(imu.gyro);
      logger_.logIMU(toRecord(time, clock_.at(raw.sampled), raw));
    }
    if (sensors_.magUpdate(now)) {
      const MagRaw& raw = sensors_.getMagMeas();
      field_ = sensors_.processMagMeas(raw, motors_.throttle());
      fieldIsNew_ = true;
      startCalibration_.addMag(field_);
      logger_.logMag(toRecord(time, clock_.at(raw.sampled), raw));
    }
    if (pressure_.due(now) && sensors_.altUpdate(now)) {
      pressure_.done(now);
      const AltRaw& raw = sensors_.getAltMeas();
      startCalibration_.addPressure(raw.pressure);
      height_ = sensors_.processAltMeas(raw);
      logger_.logAlt(toRecord(time, clock_.at(raw.sampled), raw));
    }
    if (power_.run(now)) readPower(board_, clock_, time, battery_, logger_);
  }

  /// Aligns the filter with what the still aircraft showed.
  void finishCalibration(LogTime time) {
    const StartCalibration& found = startCalibration_;
    const Alignment alignment = alignStill(found.accel(), found.mag(), config_.declination);
    const float gravity = found.accel().norm();
    sensors_.setStartCalibration(found.gyroBias(), found.groundPressure());
    filter_.initialize(alignment, gravity);
    accelMean_.clear();  // they have the bias in them
    gyroMean_.clear();
    aligned_ = true;
    logger_.log(topic::EstimatorStart{time, toArray(found.gyroBias()), gravity,
                                      toArray(alignment.magReference), found.groundPressure(), 0, 0,
                                      toArray(alignment.attitude)});
  }

  /// Arms on the switch's edge when nothing forbids it; any one reason stops the motors, and then
  /// only another edge starts them.
  void arming(Micros now, LogTime time) {
    RadioChannels channels;
    if (board_.readRadio(channels)) {
      pilot_.add(channels, now);
      logger_.log(toRecord(time, channels));
    }
    const ConditionSet wishes = pilot_.update(now, board_.readPilot(), motors_.armed());
    const bool off = (wishes & condition::kDisarm) != 0;
    const bool kill = (wishes & condition::kKill) != 0;
    const bool edge = (wishes & condition::kArmEdge) != 0;
    if (motors_.armed()) {
      if (const char* reason = reasonToStop(now, off, kill)) {
        motors_.disarm();
        motors_.writeESC(board_);
        board_.rememberMotors(false);
        logger_.logText(off ? ulog::LogLevel::Info : ulog::LogLevel::Error, time, reason);
      }
    } else if (edge) {
      const char* refusal = reasonNotToArm(now, kill);
      if (refusal == nullptr) {
        motors_.arm();
        board_.rememberMotors(true);
        grounded_ = true;
        throttleLow_.reset(now);
      }
      logger_.logText(refusal == nullptr ? ulog::LogLevel::Info : ulog::LogLevel::Warning, time,
                      refusal == nullptr ? "armed" : refusal);
    }
    const PilotSwitches& wired = pilot_.switches();
    const bool changed = wired.arm != loggedPilot_.arm || wired.kill != loggedPilot_.kill ||
                         wired.start != loggedPilot_.start || motors_.armed() != loggedArmed_;
    if (!changed && !stateLog_.due(now)) return;
    stateLog_.postpone(now);
    loggedPilot_ = wired;
    loggedArmed_ = motors_.armed();
    logger_.log(toRecord(time, wired));
    const FlightState state = motors_.armed() ? FlightState::Armed
                              : aligned_      ? FlightState::Idle
                                              : FlightState::Boot;
    logger_.log(topic::FlightState{time, 0, 0, static_cast<std::uint8_t>(state), controlling(),
                                   motors_.armed(), false});
  }

  [[nodiscard]] const char* reasonToStop(Micros now, bool off, bool kill) const {
    if (kill) return "kill switch: motors off";
    if (off) return "disarmed";
    if (pilot_.radioLost()) return "sticks lost: motors off";
    if (!sensors_.imuFresh(now)) return "IMU lost: motors off";
    if (!(cosTilt(filter_.attitude()) > 0.0F)) return "tilted past 90 deg: motors off";
    return nullptr;
  }

  [[nodiscard]] const char* reasonNotToArm(Micros now, bool kill) const {
    if (!sensors_.imuFresh(now)) return "IMU gives no data: check its wiring";
    if (!aligned_) return "start-up calibration is not done: let the aircraft stand still";
    if (kill) return "kill switch is on: release it";
    if (pilot_.radioLost()) return "no sticks: switch the transmitter on";
    if (!(pilot_.input().throttle <= config_.armThrottle))
      return "throttle is not low: pull it down";
    if (!(cosTilt(filter_.attitude()) > cosArmTilt_)) {
      return "aircraft is tilted more than 20 deg: set it level";
    }
    if (!(rate_.norm() < config_.armRate)) return "aircraft is moving: let it stand still";
    if (!motors_.valid()) return "this layout of rotors cannot fly: see the vehicle's file";
    return nullptr;
  }

  /// Every 20 ms.
  void controlTick(Micros now, LogTime time) {
    board_.feedWatchdog();
    const float dt = toSeconds(elapsed(now, lastTick_));
    lastTick_ = now;
    updateAttitude(now, dt);
    const float heading = yawOf(filter_.attitude());
    const PilotDemand demand = mapping_.demand(pilot_.input());
    updateGrounded(now, demand);
    if (grounded_) {
      law_.reset();
      mapping_.reset(heading);
    }
    reference_ = mapping_.reference(demand, heading, dt);
    wanted_ = Wrench::none();
    if (motors_.armed()) {
      wanted_.thrust = demand.thrust;
      if (!grounded_) {
        // A pilot's roll and pitch are about his aircraft's own axes, whatever it heads for.
        const Quaternion tilted = eulerToQuaternion({demand.roll, demand.pitch, heading});
        wanted_.torque =
            law_.update(attitudeError(tilted, filter_.attitude()), rate_, demand.yawRate);
      }
    }
    motors_.setBatteryVoltage(battery_.voltage());
    motors_.commandControl(wanted_);
    motors_.writeESC(board_);
    if (!grounded_) law_.setAchieved(motors_.achieved().torque);
    logTick(now, time);
  }

  void updateAttitude(Micros now, float dt) {
    if (gyroMean_.count() > 0) {
      accel_ = accelMean_.mean();
      gyro_ = gyroMean_.mean();
      accelMean_.clear();
      gyroMean_.clear();
    }
    if (aligned_) {
      filter_.update(accel_, gyro_, dt);
      if (fieldIsNew_) {
        filter_.updateHeading(field_, toSeconds(elapsed(now, lastField_)));
        lastField_ = now;
      }
    }
    fieldIsNew_ = false;
    rate_ = gyro_ - filter_.gyroBias();
  }

  /// On the ground the law would turn against the ground, and its integrals would remember that.
  /// In the air it acts also with the throttle pulled down.
  void updateGrounded(Micros now, const PilotDemand& demand) {
    const bool low = demand.thrust <= config_.armThrottle * config_.sticks.thrust;
    const float weight = config_.vehicle.mass * kGravity;
    if (throttleLow_.update(now, low) || !motors_.armed()) grounded_ = true;
    if (motors_.armed() && demand.thrust >= config_.controlThrust * weight) grounded_ = false;
  }

  void logTick(Micros now, LogTime time) {
    const Quaternion& q = filter_.attitude();
    const std::array<float, 3> none{kNaN, kNaN, kNaN};  // is not controlled
    const Wrench& achieved = motors_.achieved();
    const Vector3f integral = law_.integral();
    const Vector3f torque = law_.torqueNow();
    StateHash hash;
    hash.add(toArray(q));
    hash.add(rate_);
    hash.add(integral);
    hash.add(torque);
    hash.add(motors_.commands());
    logger_.log(topic::VehicleAttitude{time, toArray(q)});
    logger_.log(topic::VehicleAngularVelocity{time, toArray(rate_)});
    logger_.log(
        topic::VehicleLocalPosition{time, kNaN, kNaN, -height_, kNaN, kNaN, kNaN, yawOf(q)});
    logger_.log(
        topic::TrajectorySetpoint{time, none, none, none, reference_.yaw, reference_.yawRate});
    logger_.log(topic::VehicleAttitudeSetpoint{time, toArray(reference_.attitude)});
    logger_.log(topic::WrenchSetpoint{time, wanted_.thrust, toArray(wanted_.torque)});
    logger_.log(topic::WrenchAchieved{time, achieved.thrust, toArray(achieved.torque)});
    // Its integrals are of other errors than the record's; the rest has the same meaning.
    logger_.log(topic::ControllerStatus{time,
                                        {kNaN, kNaN, kNaN, kNaN},
                                        {kNaN, torque.x(), torque.y(), torque.z()},
                                        motors_.supply()});
    logger_.log(toRecord(time, pilot_.input(), PilotMode::Attitude));
    logger_.log(topic::ActuatorOutputs{time, kMotorCount, motors_.commands()});
    logger_.log(topic::ControlTick{time, hash.value(), elapsed(now, lastPass_), overruns()});
  }

  Board& board_;
  UgglanFlightConfig config_;
  Sensors<Board> sensors_;
  StartCalibration startCalibration_;
  BatteryMonitor battery_;
  ComplementaryFilter filter_;
  StickMapping mapping_;
  ReducedObserverController law_;
  Motors motors_;
  Logger<typename Board::Card> logger_;
  LogClock clock_;
  PeriodicTask control_{periodFromHz(kRateHz)};
  PeriodicTask pressure_{periodFromHz(kPressureHz)};
  PeriodicTask power_{periodFromHz(kEscHz)};
  PeriodicTask stateLog_{periodFromHz(1)};
  RunningMean accelMean_;  ///< since the last tick
  RunningMean gyroMean_;
  Vector3f accel_ = Vector3f::Zero();  ///< m/s^2, body, of the last tick
  Vector3f gyro_ = Vector3f::Zero();   ///< rad/s, body
  Vector3f rate_ = Vector3f::Zero();   ///< rad/s, body, without the filter's bias
  Vector3f field_ = Vector3f::Zero();  ///< uT, body
  float height_ = 0.0F;                ///< m
  Pilot pilot_;
  Reference reference_;
  Wrench wanted_;
  Persistence throttleLow_;
  const float cosArmTilt_;
  Micros lastPass_ = 0;
  Micros lastTick_ = 0;
  Micros lastField_ = 0;
  PilotSwitches loggedPilot_;
  bool loggedArmed_ = false;
  bool fieldIsNew_ = false;
  bool aligned_ = false;
  bool grounded_ = true;
};

}  // namespace strix
