/// The firmware's other mode: a person at a terminal checks sensors and motors. docs/bring-up.md
/// walks through it.
#pragma once

#include "AxisCheck.h"
#include "Board.h"
#include "CheckoutConfig.h"
#include "CommandLine.h"
#include "EscCalibration.h"
#include "FlightSoftwareConfig.h"
#include "MotionWatch.h"
#include "MotorTest.h"
#include "SensorTable.h"
#include "Sensors.h"
#include "TextOut.h"

namespace strix {

/// Runs instead of FlightSoftware, never beside it: PowerUpChoice. Motors are off in each step but
/// those of a motor test (MotorTest) and of teaching the ESCs (EscCalibration). Nothing blocks;
/// nothing is measured but what a step sees.
template <class Board>
class Checkout {
 public:
  Checkout(Board& board, const FlightSoftwareConfig& config, const CheckoutPins& pins,
           const CheckoutRates& rates = {})
      : board_(board),
        config_(config),
        sensors_(board, config.sensors),
        motion_(config.startCalibration),
        motorTest_(config.vehicle),
        teaching_(config.vehicle),
        axes_(out_),
        table_(out_, pins, rates, limitsOf(config)),
        record_(config.sensors.accelRange, config.sensors.gyroRange, config.sensors.magRange),
        cosLevel_(cosine(config.parameters.armTilt * kDegToRad)) {}

  /// Starts the board. Takes seconds, as FlightSoftware::setup does.
  void begin() {
    record_.found = board_.begin();
    out_ << "\nStrix checkout: " << config_.vehicle.name << " on " << Board::kName
         << ". Motors are off.\n";
    help();
    prompt();
  }

  /// One pass: read, obey, drive the motors, talk.
  /// @param get  int(): the next character, -1 for none. Must not wait.
  /// @param put  std::size_t(const char*, std::size_t): takes what it has room for. Must not wait.
  template <class Get, class Put>
  void step(Get&& get, Put&& put) {
    const Micros now = board_.micros();
    readSensors(now);
    pilot_ = board_.readPilot();
    for (int i = 0; i < kCharactersAStep; ++i) {
      const int character = get();
      if (character < 0) break;
      take(now, static_cast<char>(character));
    }
    runMotors(now);
    board_.writeEsc(teaching_.active() ? teaching_.commands() : motorTest_.commands());
    if (activity_ == Activity::Measure) measure(now);
    if (activity_ == Activity::Watch && elapsed(now, since_) >= kWatchPeriod) {
      since_ = now;
      show();
    }
    out_.drain(put);
  }

  /// The command `reboot` was typed, and the motors are off: main.cpp restarts the processor.
  [[nodiscard]] bool rebootAsked() const { return rebootAsked_; }

 private:
  static constexpr int kCharactersAStep = 16;
  static constexpr Micros kMeasureTime = 5'000'000;
  static constexpr Micros kOneEnter = 50'000;  ///< no hand presses two keys as fast
  static constexpr Micros kWatchPeriod = 500'000;

  enum class Activity { None, Measure, Watch, Axes };
  enum class Shown { Imu, Mag, Baro, Gps, Pilot };

  [[nodiscard]] static CheckoutLimits limitsOf(const FlightSoftwareConfig& config) {
    CheckoutLimits limits;
    limits.lowestPressure = config.sensors.lowestPressure;
    limits.highestPressure = config.sensors.highestPressure;
    limits.satellites = config.sensors.gpsMinSatellites;
    limits.hdop = config.sensors.gpsMaxHdop;
    return limits;
  }

  /// The IMU in each step, the others in turn: all at once would take longer than from one IMU
  /// sample to the next, and miss some.
  void readSensors(Micros now) {
    const bool measuring = activity_ == Activity::Measure;
    if (board_.readImu(imu_)) {
      const ImuSample body = sensors_.processIMUMeas(imu_);
      const Micros step = elapsed(imu_.sampled, lastSample_);
      lastSample_ = imu_.sampled;
      heard(Shown::Imu);
      motion_.add(now, body.accel, body.gyro);
      if (step < MotionWatch::kSilence) axes_.addGyro(body.gyro, toSeconds(step));
      if (measuring) record_.accel.add(imu_.accel);
      if (measuring) record_.gyro.add(imu_.gyro);
    }
    motion_.update(now);
    turn_ = (turn_ + 1) % 3;
    if (turn_ == 0 && board_.readMag(mag_)) {
      heard(Shown::Mag);
      axes_.addField(sensors_.processMagMeas(mag_, 0.0F));
      if (measuring) record_.mag.add(mag_.field);
    } else if (turn_ == 1 && board_.readAlt(alt_)) {
      heard(Shown::Baro);
      if (measuring) record_.alt.add({alt_.pressure, 0.0F, 0.0F});
    } else if (turn_ == 2 && board_.readGps(gps_)) {
      heard(Shown::Gps);
      if (measuring) ++record_.gpsFixes;
    }
  }

  /// Any character stops a motor; then it counts as typed. Only the line feed that a terminal sends
  /// with its return belongs to the command before it.
  void take(Micros now, char c) {
    const bool sameEnter = c == '\n' && elapsed(now, returned_) < kOneEnter && line_.returned();
    if (c == '\r') returned_ = now;
    if (sameEnter) {
      (void)line_.take(c);
      return;
    }
    if (motorTest_.active()) {
      motorTest_.stop();
      out_ << "\nstopped\n";
      prompt();
    }
    if (teaching_.active()) {
      out_ << "\n" << teaching_.stop() << "\n";
      prompt();
    }
    switch (line_.take(c)) {
      case CommandLine::Event::Typed:
        out_ << std::array<char, 2>{c, '\0'}.data();
        break;
      case CommandLine::Event::Erased:
        out_ << "\b \b";
        break;
      case CommandLine::Event::TooLong:
        out_ << "\nthat line is too long\n";
        prompt();
        break;
      case CommandLine::Event::Line:
        if (!out_.atLineStart()) out_ << "\n";
        obey(now, line_.text());
        prompt();
        break;
      case CommandLine::Event::Nothing:
        break;
    }
  }

  void obey(Micros now, std::string_view line) {
    if (activity_ == Activity::Axes && line.empty()) {
      axes_.confirm(motion_);
      if (!axes_.active()) activity_ = Activity::None;
      return;
    }
    if (activity_ == Activity::Measure && line.empty()) return;
    endActivity();
    if (line.empty()) return;
    if (line == "help") return help();
    if (line == "sensors") return startMeasuring(now);
    if (line == "axes") return startAxes();
    if (line == "imu") return watch(now, Shown::Imu);
    if (line == "mag") return watch(now, Shown::Mag);
    if (line == "baro") return watch(now, Shown::Baro);
    if (line == "gps") return watch(now, Shown::Gps);
    if (line == "pilot") return watch(now, Shown::Pilot);
    if (line == "props off") return promise(now);
    if (line.size() == 7 && line.substr(0, 6) == "motor ") return startMotor(now, line[6]);
    if (line == "battery off") return promiseBattery(now);
    if (line == "teach escs") return startTeaching(now);
    if (line == "stop") {
      out_ << "all motors are off\n";
      return;
    }
    if (line == "reboot") {
      out_ << "restarting\n";
      rebootAsked_ = true;
      return;
    }
    out_ << "there is no such command: type help\n";
  }

  void help() {
    out_ << "  sensors          5 s of standstill: each sensor, PASS or FAIL\n"
            "  axes             turn the aircraft: are axes and signs right?\n"
            "  imu mag baro gps pilot\n"
            "                   what it reads, twice a second until Enter\n"
            "  props off        you have taken the propellers off; counts for 60 s\n"
            "  motor 1 .. 4     turns that motor slowly for 2 s; any key stops it\n"
            "  battery off      the ESCs have no power; counts for 60 s\n"
            "  teach escs       full, then off at any key: ESCs take them for their range\n"
            "  stop             ends whatever runs\n"
            "  reboot           starts again\n";
  }

  void prompt() {
    if (activity_ == Activity::None && !motorTest_.active() && !teaching_.active()) out_ << "> ";
  }

  void endActivity() {
    activity_ = Activity::None;
    axes_.stop();
  }

  void startMeasuring(Micros now) {
    out_ << "measuring for 5 s: touch nothing\n";
    activity_ = Activity::Measure;
    since_ = now;
    record_.moved = false;
    record_.accel.clear();
    record_.gyro.clear();
    record_.mag.clear();
    record_.alt.clear();
    record_.gpsFixes = 0;
    record_.gps = GpsRaw{};
    board_.countFaults(record_.before);
  }

  void measure(Micros now) {
    // The first second tells whether it was still before.
    const Micros time = elapsed(now, since_);
    if (time > MotionWatch::kStillTime && motion_.alive() && !motion_.still()) {
      record_.moved = true;
    }
    if (time < kMeasureTime) return;
    record_.seconds = toSeconds(time);
    if (record_.gpsFixes != 0) record_.gps = gps_;
    record_.accelBody = calibratedAccel();
    record_.fieldBody = calibratedField();
    board_.countFaults(record_.after);
    table_.print(record_);
    endActivity();
    prompt();
  }

  /// Calibration is a sum and a product, so that of the mean is the mean of it.
  [[nodiscard]] Vector3f calibratedAccel() const {
    ImuRaw mean;
    mean.accel = record_.accel.mean();
    return sensors_.processIMUMeas(mean).accel;
  }
  [[nodiscard]] Vector3f calibratedField() const {
    MagRaw mean;
    mean.field = record_.mag.mean();
    return sensors_.processMagMeas(mean, 0.0F);
  }

  void startAxes() {
    activity_ = Activity::Axes;
    axes_.start();
  }

  void watch(Micros now, Shown what) {
    activity_ = Activity::Watch;
    shown_ = what;
    fresh_ = false;
    since_ = now;
  }

  /// The sensor that is shown has said something since it was shown last.
  void heard(Shown what) { fresh_ = fresh_ || shown_ == what; }

  void show() {
    if (!fresh_ && shown_ != Shown::Pilot) {
      out_ << "no data: see the command sensors\n";
      return;
    }
    fresh_ = false;
    switch (shown_) {
      case Shown::Imu: {
        const ImuSample body = sensors_.processIMUMeas(imu_);
        out_ << "accel " << Fixed3{body.accel, 2} << " m/s^2  gyro " << Fixed3{body.gyro, 3}
             << " rad/s  " << Fixed{imu_.temperature, 1} << " degC (body axes)\n";
        break;
      }
      case Shown::Mag: {
        const Vector3f body = sensors_.processMagMeas(mag_, 0.0F);
        out_ << "field " << Fixed3{body, 1} << " uT, " << Fixed{body.norm(), 1}
             << " uT (body axes)\n";
        break;
      }
      case Shown::Baro:
        out_ << Fixed{alt_.pressure * 0.01F, 2} << " hPa  " << Fixed{alt_.temperature, 1}
             << " degC\n";
        break;
      case Shown::Gps:
        out_ << (gps_.fix >= 3 ? "3D" : "no") << " fix  " << std::uint32_t{gps_.satellites}
             << " satellites  HDOP " << Fixed{gps_.hdop, 1} << "  " << Degrees{gps_.latitude}
             << " N " << Degrees{gps_.longitude} << " E  "
             << Fixed{static_cast<float>(gps_.altitude) * 1e-3F, 1} << " m\n";
        break;
      case Shown::Pilot:
        out_ << "arm " << onOff(pilot_.arm) << "  kill " << onOff(pilot_.kill) << "  start "
             << onOff(pilot_.start) << "\n";
        break;
    }
  }

  [[nodiscard]] static const char* onOff(bool on) { return on ? "ON" : "off"; }

  void promise(Micros now) {
    motorTest_.promise(now);
    teaching_.promisePropellersOff(now);
    out_ << "noted: propellers off, for 60 s\n";
  }

  void promiseBattery(Micros now) {
    teaching_.promiseBatteryOff(now);
    out_ << "noted: battery off, for 60 s\n";
  }

  [[nodiscard]] MotorTestInputs motorTestInputs() const {
    return {pilot_.kill, motion_.alive(), motion_.still(), motion_.level(cosLevel_),
            motion_.turning()};
  }

  void startMotor(Micros now, char digit) {
    const auto motor = static_cast<std::size_t>(static_cast<unsigned char>(digit - '1'));
    if (const char* reason = motorTest_.start(now, motor, motorTestInputs())) {
      out_ << "refused: " << reason << "\n";
      return;
    }
    const Rotor& rotor = config_.vehicle.rotors[motor];
    out_ << "M" << std::uint32_t(motor + 1) << ", " << placeOf(rotor) << ", turns " << turnOf(rotor)
         << " seen from above; any key stops it\n";
  }

  void startTeaching(Micros now) {
    if (const char* reason = teaching_.start(now, motorTestInputs())) {
      out_ << "refused: " << reason << "\n";
      return;
    }
    out_ << "full in 3 s, for 30 s; any key ends it\n";
  }

  /// At most one of them is active: each starts by a command, and any character ends it.
  void runMotors(Micros now) {
    const char* turned = motorTest_.update(now, motorTestInputs());
    const char* taught = teaching_.update(now, motorTestInputs());
    for (const char* happened : {turned, taught}) {
      if (happened == nullptr) continue;
      out_ << happened << "\n";
      prompt();
    }
  }

  Board& board_;
  FlightSoftwareConfig config_;
  Sensors<Board> sensors_;
  TextOut out_;
  CommandLine line_;
  MotionWatch motion_;
  MotorTest motorTest_;
  EscCalibration teaching_;
  AxisCheck axes_;
  SensorTable table_;
  SensorRecord record_;
  const float cosLevel_;
  ImuRaw imu_;
  MagRaw mag_;
  AltRaw alt_;
  GpsRaw gps_;
  PilotSwitches pilot_;
  Activity activity_ = Activity::None;
  Shown shown_ = Shown::Imu;
  bool fresh_ = false;
  Micros since_ = 0;  ///< of the activity
  Micros lastSample_ = 0;
  Micros returned_ = 0;  ///< when a return came last
  unsigned turn_ = 0;
  bool rebootAsked_ = false;
};

}  // namespace strix
