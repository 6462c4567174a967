/// The flight software: everything that runs on the aircraft, for any Board.
#pragma once

#include "BatteryMonitor.h"
#include "Board.h"
#include "Conditions.h"
#include "Controller.h"
#include "Detectors.h"
#include "Estimation.h"
#include "FiniteStateMachine.h"
#include "FlightRecorder.h"
#include "FlightSoftwareConfig.h"
#include "FlightStatus.h"
#include "Guidance.h"
#include "Hazards.h"
#include "Logger.h"
#include "MissionText.h"
#include "MissionUpload.h"
#include "Motors.h"
#include "Navigation.h"
#include "ParameterStore.h"
#include "Pilot.h"
#include "PowerReadings.h"
#include "Sensors.h"
#include "StatusReport.h"
#include "Version.h"

namespace strix {

/// @tparam States  of the navigation filter: 18, or 9 without biases
template <class Board, int States = 18>
class FlightSoftware {
  static_assert(Motors::kRateHz == static_cast<float>(Controller::kRateHz));
  static_assert(kParameterCount <= LogParameters::kMost);

 public:
  FlightSoftware(Board& board, const FlightSoftwareConfig& config)
      : board_(board),
        config_(config),
        store_(board),
        logger_(board.card()),
        recorder_(logger_),
        estimation_(board, config, logger_, clock_),
        battery_(config.vehicle.batteryCells),
        guidance_(config.mission, config.guidance, weight()),
        controller_(config.vehicle, config.gains, config.control),
        motors_(config.vehicle, config.motors),
        touchDown_(config.touchDown.duration),
        hover_(config.hover.duration),
        wrongConfig_((sensors().mountingValid() ? 0U : prearm::kMounting) |
                     (estimation_.gyroFilter().valid() ? 0U : prearm::kGyroFilter) |
                     (motors_.valid() ? 0U : prearm::kLayout)) {
    applyParameters();
  }

  /// Starts the board and the log. Start-up calibration follows in the loop, in state BOOT.
  void setup() {
    found_ = board_.begin();
    reset_ = board_.resetStatus();
    board_.rememberMotors(false);
    const LoadReport stored = store_.load(config_.parameters, key_);
    if (stored.damaged || stored.refused > 0) wrongConfig_ |= prearm::kParameters;
    if (reset_.motorsWereOn) wrongConfig_ |= prearm::kRestarted;
    applyParameters();
    board_.beginRadio(static_cast<RadioProtocol>(config_.parameters.radioProtocol));
    now_ = board_.micros();
    lastPass_ = now_;
    time_ = clock_.update(now_);
    estimation_.start(now_);
    controller_.reset(now_);
    motors_.disarm();
    motors_.writeESC(board_);
    hover_.reset(now_);
    touchDown_.reset(now_);
    entered_ = now_;
    hazards_.start(now_);
    recorder_.start(now_);
    stateLog_.start(now_ + 8 * periodFromHz(Controller::kRateHz));
    logger_.begin(time_, {config_.vehicle.name,
                          Board::kName,
                          kVersion,
                          kGitCommit,
                          board_.bootId(),
                          {kParameterCount, logParameters_.data()}});
    if (reset_.motorsWereOn) {
      recorder_.say(ulog::LogLevel::Error, time_, "restarted while the motors were on: disarmed");
    }
    loadMission();
    logConfig(stored);
  }

  /// One pass. Nothing in it waits. Only a reading, a control tick or a command changes anything,
  /// and all are logged with the time of their pass: from those a replay makes the same passes
  /// again.
  void loop() {
    now_ = board_.micros();  // the one time stamp of this pass
    time_ = clock_.update(now_);
    watchPass();
    if (estimation_.read(now_, time_, motors_.throttle())) {
      estimation_.finishPass(now_);
      if (calibrating() && estimation_.calibrated()) {
        estimation_.align(now_, time_, config_.parameters.declination * kDegToRad);
      }
    }
    ticked_ = controller_.due(now_);
    if (ticked_) {
      controlTick(now_, time_);
    } else if (!motors_.armed()) {
      store_.step();
    }
    logger_.write(time_);
    logger_.flush(time_);
    lastPass_ = now_;
  }

  /// For telemetry and console, between two passes. What it changes is logged: a replay does it
  /// again.
  /// @return nullptr: accepted, else why not
  CommandRefusal command(const VehicleCommand& asked) {
    const CommandRefusal refusal = obey(asked);
    logger_.log(toRecord(time_, asked, refusal == nullptr));
    return refusal;
  }

  /// Turns one motor on the bench; the console asks with a countdown. A duration of 0 ends it.
  /// @param motor  from 0    @param throttle  0 to 1 of the ESC's range
  CommandRefusal testMotor(int motor, float throttle, Micros duration) {
    VehicleCommand asked{CommandKind::MotorTest, CommandSource::Console};
    asked.index = static_cast<std::uint16_t>(motor);
    asked.values[0] = throttle;
    asked.time = duration;
    return command(asked);
  }

  /// Keeps the parameters for the next start.
  CommandRefusal saveParameters() {
    if (motors_.armed()) return "parameters are saved with the motors off only: disarm first";
    wrongConfig_ &= ~prearm::kParameters;
    return store_.save(config_.parameters, key_);
  }

  /// This pass made a control tick: nothing that can wait shall come on top of it.
  [[nodiscard]] bool ticked() const { return ticked_; }
  [[nodiscard]] LogTime time() const { return time_; }  ///< of this pass
  [[nodiscard]] const FiniteStateMachine& stateMachine() const { return fsm_; }
  [[nodiscard]] ConditionSet conditions() const { return conditions_; }
  [[nodiscard]] PreArmSet preArm() const { return preArm_; }
  [[nodiscard]] const Navigation<States>& navigation() const { return estimation_.navigation(); }
  [[nodiscard]] const ESKF<States>& estimator() const { return estimation_.filter(); }
  [[nodiscard]] const Sensors<Board>& sensors() const { return estimation_.sensors(); }
  [[nodiscard]] const Motors& motors() const { return motors_; }
  [[nodiscard]] const Controller& controller() const { return controller_; }
  [[nodiscard]] const Guidance& guidance() const { return guidance_; }
  [[nodiscard]] const Mission& mission() const { return config_.mission; }
  [[nodiscard]] const Parameters& parameters() const { return config_.parameters; }
  [[nodiscard]] const ParameterStore<Board>& store() const { return store_; }
  /// That signs telemetry; all zero: none.
  [[nodiscard]] const SigningKey& signingKey() const { return key_; }
  void setSigningKey(const SigningKey& key) { key_ = key; }
  [[nodiscard]] const Pilot& pilot() const { return pilot_; }
  [[nodiscard]] const BatteryMonitor& battery() const { return battery_; }
  [[nodiscard]] const TextHistory& texts() const { return recorder_.texts(); }
  [[nodiscard]] Logger<typename Board::Card>& logger() { return logger_; }
  [[nodiscard]] const Logger<typename Board::Card>& logger() const { return logger_; }
  [[nodiscard]] FlightStatus status() const { return statusOf(*this, now_); }

  /// What the last control tick logged of itself.
  [[nodiscard]] const topic::ControlTick& lastTick() const { return lastTick_; }

  /// us, of the last second.
  [[nodiscard]] Micros longestPass() const { return longestPass_; }

  /// Periods of any task missed since the start.
  [[nodiscard]] std::uint32_t overruns() const {
    return sensors().missed() + controller_.overruns();
  }

 private:
  void watchPass() {
    const Micros pass = elapsed(now_, lastPass_);
    if (pass > longestSoFar_) longestSoFar_ = pass;
    if (!passWatch_.run(now_)) return;
    longestPass_ = longestSoFar_;
    longestSoFar_ = 0;
  }

  /// Every 2 ms: what the pilot wants, where to be, what it takes, and the motors.
  void controlTick(Micros now, LogTime time) {
    board_.feedWatchdog();
    VehicleState estimate = estimation_.estimate(motors_.armed());
    flyBlind(estimate);
    readPower(time);
    readRadio(now, time);
    updateStateMachine(now, time, estimate);
    guidance_.setPilot(pilot_.input(), !has(condition::kGpsLost), !has(condition::kAltLost),
                       has(condition::kOnGround));
    const Reference& reference = guidance_.update(now, estimate);
    const bool controlled = fsm_.getControlFlag() && !guidance_.idles();
    controller_.setGrounded(!controlled);
    controller_.updateControl(now, reference, estimate);
    if (fsm_.state() == FlightState::MotorTest) {
      motors_.commandOne(testedMotor_, testShare_);
    } else {
      motors_.commandControl(controlled ? controller_.getControl() : Wrench::none());
    }
    motors_.writeESC(board_);
    controller_.setAchieved(motors_.achieved());
    estimation_.setMotors(motorState(now), motors_);
    lastTick_ = tick(now, time);
    logger_.logGNC(toRecords(time, estimate, reference, controller_, motors_, lastTick_));
    recorder_.logNavigation(now, time, navigation());
    recorder_.logControl(now, time, controller_, motors_);
    recorder_.logPilot(now, time, pilot_, guidance_.effectiveMode());
    recorder_.logFaults(now, time, [this](SensorFaultCounts& counts) {
      board_.countFaults(counts);
      counts[SensorFault::ImuClipped] = sensors().clipped();
      counts[SensorFault::Invalid] = sensors().invalid();
    });
    recorder_.watchSaving(now, time);
  }

  /// What the model of the aircraft says, while no IMU does.
  void flyBlind(VehicleState& estimate) {
    const std::array<float, kControlCount>& wrench = controller_.wrenchEstimate().now();
    if (fsm_.state() == FlightState::Blind) {
      estimate = estimation_.blind().update(wrench, kControlPeriod);
    } else if (motors_.armed()) {
      estimation_.blind().observe(wrench, estimate, kControlPeriod);
    }
  }

  void readPower(LogTime time) {
    strix::readPower(board_, clock_, time, battery_, logger_);
    motors_.setBatteryVoltage(battery_.voltage());
  }

  void readRadio(Micros now, LogTime time) {
    RadioChannels channels;
    if (!board_.readRadio(channels)) return;
    pilot_.add(channels, now);
    logger_.log(toRecord(time, channels));
  }

  void applyParameters() {
    const Parameters& p = config_.parameters;
    fence_ = {p.fenceRadius, p.fenceHeight};
    cosArmTilt_ = cosine(p.armTilt * kDegToRad);
    pilot_.configure(p);
    hazards_.configure(p);
    guidance_.configure(p);
    missionGood_ = isFlyable(config_.mission, fence_);
    for (std::size_t i = 0; i < kParameterCount; ++i) {
      const ParameterInfo& row = kParameterTable[i];
      logParameters_[i] = {row.name, p.*row.member};
    }
  }

  /// The card's mission instead of the one compiled in; one that is wrong forbids arming.
  void loadMission() {
    const std::string_view text = board_.missionText();
    if (text.empty()) return;
    const ParsedMission parsed = parseMission("mission.txt", text, fence_);
    missionGood_ = parsed.valid();
    if (missionGood_) {
      takeMission(parsed.mission);
    } else {
      recorder_.say(ulog::LogLevel::Error, time_, MissionErrorText(parsed.error).text());
    }
  }

  void takeMission(const Mission& mission) {
    config_.mission = mission;
    missionGood_ = isFlyable(mission, fence_);
    guidance_ = Guidance(mission, config_.guidance, weight());
    guidance_.configure(config_.parameters);
  }

  void logConfig(const LoadReport& stored) {
    topic::FlightConfig record = toRecord(time_, config_, found_);
    record.reset = static_cast<std::uint8_t>(reset_.causes);
    record.in_flight = reset_.motorsWereOn ? 1 : 0;
    record.stored = stored.empty ? 1 : 0;
    if ((wrongConfig_ & prearm::kParameters) != 0) record.stored = 2;
    logger_.log(record);
    const Mission& mission = config_.mission;
    for (std::size_t i = 0; i < mission.legCount && i < Mission::kMaxLegs; ++i) {
      logger_.log(toRecord(time_, mission.legs[i]));
    }
  }

  [[nodiscard]] float weight() const { return config_.vehicle.mass * kGravity; }
  [[nodiscard]] bool calibrating() const { return fsm_.state() == FlightState::Boot; }
  [[nodiscard]] bool has(ConditionSet bit) const { return (conditions_ & bit) != 0; }

  /// What the motors do to magnetometer and accelerometer.
  [[nodiscard]] MotorState motorState(Micros now) {
    const float excess = motors_.achieved().thrust / weight() - 1.0F;
    hover_.update(now, motors_.armed() && excess < config_.hover.thrustBand &&
                           excess > -config_.hover.thrustBand);
    if (!motors_.armed()) return MotorState::Stopped;
    return hover_.held() ? MotorState::Hover : MotorState::Disturbed;
  }

  void updateStateMachine(Micros now, LogTime time, const VehicleState& estimate) {
    const ConditionSet wishes = pilot_.update(now, board_.readPilot(), motors_.armed());
    const float cosine = cosTilt(estimate.attitude);
    preArm_ = preArmFailures(now, estimate, cosine);
    conditions_ = wishes | guidance_.conditions(now, estimate) |
                  hazards_.update(signs(now, estimate, cosine, estimation_.takeFixed()), now) |
                  ownConditions(now, estimate);
    linkHeard_ = false;
    const Transition* row = fsm_.update(conditions_);
    if (row != nullptr) take(*row, now, time, estimate);
    if (row == nullptr && !stateLog_.due(now)) return;
    stateLog_.postpone(now);
    logger_.log(topic::FlightState{time, conditions_, preArm_,
                                   static_cast<std::uint8_t>(fsm_.state()), fsm_.getControlFlag(),
                                   fsm_.getMotorFlag(), fsm_.getCriticalErrorFlag()});
  }

  /// What a transition does beside changing the state.
  void take(const Transition& row, Micros now, LogTime time, const VehicleState& estimate) {
    entered_ = now;
    touchDown_.reset(now);
    pilot_.done(row.failsafe ? ~condition::kNone : row.when);
    if (fsm_.state() == FlightState::Armed) estimation_.blind().reset();
    if (fsm_.state() == FlightState::Blind) {
      estimation_.startBlind(estimate);
      imuBack_.reset(now);
    }
    guidance_.enter(fsm_.state(), now, estimate, (row.when & condition::kHoldAsked) != 0);
    if ((row.when & condition::kCalibrateAsked) != 0) estimation_.recalibrate();
    if (fsm_.getMotorFlag() != motors_.armed()) {  // written to the ESCs by this tick
      if (fsm_.getMotorFlag()) {
        motors_.arm();
      } else {
        motors_.disarm();
      }
      board_.rememberMotors(motors_.armed());
    }
    if (motors_.armed()) estimation_.keepOrigin();
    const bool cutOff = row.to == FlightState::Safe && (row.from & in(FlightState::Safe)) == 0;
    if (cutOff) recorder_.save(now);
    recorder_.say(cutOff || row.failsafe ? ulog::LogLevel::Error : ulog::LogLevel::Info, time,
                  row.said);
    if (row.to != FlightState::Armed && (row.when & condition::kArmEdge) != 0 && preArm_ != 0) {
      recorder_.say(ulog::LogLevel::Warning, time, firstRefusal(preArm_));
    }
  }

  // FlightConditions.h: what is true now.
  [[nodiscard]] PreArmSet preArmFailures(Micros now, const VehicleState& estimate,
                                         float cosine) const;
  [[nodiscard]] HazardSigns signs(Micros now, const VehicleState& estimate, float cosine,
                                  bool fixed) const;
  [[nodiscard]] ConditionSet ownConditions(Micros now, const VehicleState& estimate);
  [[nodiscard]] bool standsOnGround(Micros now, const VehicleState& estimate);

  // FlightCommands.h: what commands do.
  [[nodiscard]] CommandRefusal obey(const VehicleCommand& c);
  [[nodiscard]] CommandRefusal wish(ConditionSet bit);
  [[nodiscard]] CommandRefusal takeMotorTest(const VehicleCommand& c);
  [[nodiscard]] CommandRefusal takeSetpoint(const VehicleCommand& c);
  [[nodiscard]] CommandRefusal upload(const VehicleCommand& c);

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
    hash.add(estimation_.smoother().position());
    hash.add(estimation_.smoother().velocity());
    hash.add(controller_.error());
    hash.add(controller_.integral().horizontalNed());
    hash.add(controller_.integral().down());
    hash.add(controller_.integral().yaw());
    hash.add(controller_.wrenchEstimate().now());
    hash.add(static_cast<std::uint32_t>(fsm_.state()));
    hash.add(motors_.commands());
    return {time, hash.value(), elapsed(now, lastPass_), overruns()};
  }

  static constexpr float kMostTest = 0.3F;  ///< ours: less than hovering takes
  static constexpr Micros kLongestTest = 10'000'000;
  static constexpr Micros kSetpointFresh = 500'000;  ///< as PX4's COM_OF_LOSS_T began

  Board& board_;
  FlightSoftwareConfig config_;
  ParameterStore<Board> store_;
  SigningKey key_{};
  LogClock clock_;
  Logger<typename Board::Card> logger_;
  FlightRecorder<Logger<typename Board::Card>> recorder_;
  Estimation<Board, States, Logger<typename Board::Card>> estimation_;
  BatteryMonitor battery_;
  Pilot pilot_;
  Hazards hazards_;
  FiniteStateMachine fsm_;
  Guidance guidance_;
  MissionUpload upload_;
  Controller controller_;
  Motors motors_;
  SensorSet found_;
  ResetStatus reset_;
  Fence fence_;
  std::array<LogParameter, kParameterCount> logParameters_{};
  Persistence touchDown_;
  Persistence hover_;
  Persistence imuBack_{200'000};  ///< ours: 200 samples in a row
  PreArmSet wrongConfig_;         ///< what no flight can mend
  float cosArmTilt_ = 0.0F;
  PeriodicTask stateLog_{periodFromHz(10)};
  topic::ControlTick lastTick_;
  ConditionSet conditions_ = condition::kNone;  ///< of the last tick
  PreArmSet preArm_ = prearm::kNotCalibrated;
  LogTime time_ = 0;    ///< of this pass
  Micros now_ = 0;      ///< of this pass
  Micros entered_ = 0;  ///< when the present state began
  Micros lastPass_ = 0;
  Micros longestPass_ = 0;   ///< of the last whole second
  Micros longestSoFar_ = 0;  ///< of this one
  PeriodicTask passWatch_{periodFromHz(1)};
  Micros testEnds_ = 0;  ///< of the motor test
  float testShare_ = 0.0F;
  std::uint8_t testedMotor_ = 0;
  Micros guidedAt_ = 0;  ///< when the last setpoint came
  bool guidedKnown_ = false;
  bool ticked_ = false;
  bool linkHeard_ = false;  ///< since the last tick
  bool missionGood_ = true;
};

}  // namespace strix

#include "FlightCommands.h"
#include "FlightConditions.h"
