/// Counts the instructions of what flies around the navigation filter, call by call, on the
/// emulated Cortex-M7: sensor processing, guidance, controller, motors, state machine, the hash of
/// a tick, and the log. Prints one CSV line per function; bench.py sets them beside the budgets.
/// Every call sees other numbers.
#include <FlightConfig.h>
#include <FlightSoftware.h>

#include <array>
#include <cstdint>

#include "Counts.h"
#include "Noise.h"

namespace {

using m7::counter;
using m7::Counts;
using strix::Micros;
using strix::Vector3f;

constexpr std::uint32_t kCalls = 64;  ///< counted calls, where no flight decides how many there are

/// A board whose motors take everything; a call out of the flight code, as on the aircraft.
struct SilentBoard {
  [[gnu::noinline]] void writeEsc(const strix::EscCommands& commands) { last = commands; }
  strix::EscCommands last{};
};

template <class Functions>
[[nodiscard]] bool printAll(const Functions& functions, int states = 0) {
  bool complete = true;
  for (Counts* counts : functions) complete = counts->print(states) && complete;
  return complete;
}

/// Readings as a flight near 60 deg north gives them.
class SensorBench {
 public:
  void pass() {
    const strix::ImuRaw imu{0, noise_.vector(3.0F) - Vector3f{0.0F, 0.0F, strix::kGravity},
                            noise_.vector(1.0F), 30.0F};
    const strix::MagRaw mag{0, Vector3f{18.0F, 1.5F, 45.0F} + noise_.vector(20.0F)};
    const strix::AltRaw alt{0, 101325.0F + 200.0F * noise_(), 20.0F};
    strix::GpsRaw gps;
    gps.latitude = 600'000'000 + static_cast<std::int32_t>(3000.0F * noise_());
    gps.longitude = 180'000'000 + static_cast<std::int32_t>(6000.0F * noise_());
    gps.altitude = 40'000 + static_cast<std::int32_t>(5000.0F * noise_());
    gps.speedKnots = 2.0F + 2.0F * noise_();
    gps.courseDeg = 180.0F + 180.0F * noise_();

    imu_.add(counter.count([&] { imuSample_ = sensors_.processIMUMeas(imu); }));
    mag_.add(counter.count([&] { field_ = sensors_.processMagMeas(mag, 0.4F); }));
    alt_.add(counter.count([&] { height_ = sensors_.processAltMeas(alt); }));
    gps_.add(counter.count([&] { gpsSample_ = sensors_.processGPSMeas(gps); }));
  }
  [[nodiscard]] bool print() { return printAll(std::array{&imu_, &mag_, &alt_, &gps_}); }

 private:
  m7::Noise noise_;
  SilentBoard board_;
  strix::Sensors<SilentBoard> sensors_{board_, strix::flightConfig().sensors};
  strix::ImuSample imuSample_;
  Vector3f field_ = Vector3f::Zero();
  float height_ = 0.0F;
  strix::GpsSample gpsSample_;
  Counts imu_{"processIMUMeas"};
  Counts mag_{"processMagMeas"};
  Counts alt_{"processAltMeas"};
  Counts gps_{"processGPSMeas"};
};

/// The aircraft follows a mission's reference, with errors of which some ask for more than motors
/// and limits give.
class ControlBench {
 public:
  ControlBench() {
    guidance_.enter(strix::FlightState::Takeoff, now_, {});
    controller_.reset(now_);
    motors_.arm();
  }

  /// One control period: take-off for 6 s, then on the way to the first leg.
  void pass() {
    now_ += kPeriod;
    if (now_ == kLegStart) guidance_.enter(strix::FlightState::Waypoint, now_, state_);
    const m7::Counted guidance =
        counter.count([this] { reference_ = guidance_.update(now_, state_); });
    state_.positionNed = reference_.positionNed + noise_.vector(1.0F);
    state_.velocityNed = reference_.velocityNed + noise_.vector(0.5F);
    state_.attitude =
        strix::eulerToQuaternion({0.3F * noise_(), 0.3F * noise_(), reference_.yaw + noise_()});
    state_.rateBody = noise_.vector(1.0F);
    const m7::Counted update =
        counter.count([this] { controller_.updateControl(now_, reference_, state_); });
    if (now_ % kCountEvery != 0) return;
    toReference_.add(guidance);
    update_.add(update);
    error_.add(counter.count([this] { controller_.updateError(state_); }));
    allocate_.add(
        counter.count([this] { squares_ = motors_.allocateControl(controller_.getControl()); }));
    command_.add(counter.count([this] {
      motors_.commandControl(controller_.getControl());
      motors_.writeESC(board_);
    }));
  }
  void fly() {
    while (now_ < kCalls * kCountEvery) pass();
  }
  [[nodiscard]] bool print() {
    return printAll(std::array{&toReference_, &update_, &error_, &allocate_, &command_});
  }

 private:
  static constexpr Micros kPeriod = 2'000;
  static constexpr Micros kCountEvery = 200'000;
  static constexpr Micros kLegStart = 6'000'000;

  m7::Noise noise_;
  SilentBoard board_;
  strix::Guidance guidance_{strix::kFirstFlight, strix::GuidanceConfig()};
  strix::Controller controller_{strix::kQuad5in, strix::kQuad5inGains};
  strix::Motors motors_{strix::kQuad5in};
  Micros now_ = 0;
  strix::Reference reference_;
  strix::VehicleState state_;
  strix::SquaredSpeeds squares_{};
  Counts toReference_{"Guidance::update"};
  Counts update_{"updateControl"};
  Counts error_{"updateError"};
  Counts allocate_{"allocateControl"};
  Counts command_{"commandControl and writeESC"};
};

/// Two flights over and over: one to its end, one ended by the kill switch.
class StateMachineBench {
 public:
  StateMachineBench() { machine_.update(strix::condition::kCalibrated); }

  void pass() {
    namespace c = strix::condition;
    static constexpr std::array<strix::ConditionSet, 10> kFlights = {
        c::kArmEdge, c::kStart,    c::kArrived,   c::kHoldDone | c::kLegsRemain,
        c::kArrived, c::kHoldDone, c::kTouchDown, c::kArmEdge,
        c::kStart,   c::kKill};
    const bool ground = machine_.state() == strix::FlightState::Idle ||
                        machine_.state() == strix::FlightState::Safe;
    const strix::ConditionSet quiet = c::kCalibrated | (ground ? c::kDisarm : c::kPreArmFailure);
    stay_.add(counter.count([&] { row_ = machine_.update(quiet); }));
    ordered_ = ordered_ && row_ == nullptr;
    const strix::ConditionSet event = c::kCalibrated | kFlights[next_];
    next_ = (next_ + 1) % kFlights.size();
    go_.add(counter.count([&] { row_ = machine_.update(event); }));
    ordered_ = ordered_ && row_ != nullptr;
  }
  /// @return also false when the machine did not go the way it was meant to
  [[nodiscard]] bool print() { return printAll(std::array{&stay_, &go_}) && ordered_; }

 private:
  strix::FiniteStateMachine machine_;
  const strix::Transition* row_ = nullptr;
  std::size_t next_ = 0;
  bool ordered_ = true;
  Counts stay_{"FiniteStateMachine::update, state stays"};
  Counts go_{"FiniteStateMachine::update, a transition"};
};

/// The same words as FlightSoftware::tick hashes.
template <int States>
class HashBench {
 public:
  HashBench() { filter_.initialize({}, strix::kGravity); }

  void pass() {
    now_ += 1'000;
    filter_.predict(noise_.vector(0.5F) - Vector3f{0.0F, 0.0F, strix::kGravity},
                    noise_.vector(0.5F), now_);
    for (int i = 0; i < error_.size(); ++i) error_[i] = noise_();
    for (float& element : remembered_) element = noise_();
    for (float& command : commands_) command = 1400.0F + 100.0F * noise_();
    hash_.add(counter.count([this] { value_ = hashed(); }));
  }
  [[nodiscard]] bool print() { return hash_.print(States); }

 private:
  [[nodiscard]] std::uint32_t hashed() const {
    strix::StateHash hash;
    const strix::VehicleState& s = filter_.state();
    hash.add(s.positionNed);
    hash.add(s.velocityNed);
    for (const float element : strix::toArray(s.attitude)) hash.add(element);
    hash.add(filter_.accelBias());
    hash.add(filter_.gyroBias());
    hash.add(filter_.magBias());
    for (const float element : filter_.packedCovariance().elements()) hash.add(element);
    hash.add(error_);
    for (const float element : remembered_) hash.add(element);
    hash.add(std::uint32_t{4});
    for (const float command : commands_) hash.add(command);
    return hash.value();
  }

  m7::Noise noise_;
  Micros now_ = 0;
  strix::ESKF<States> filter_{strix::NavigationConfig()};
  strix::ControlError error_ = strix::ControlError::Zero();
  std::array<float, 12> remembered_{};  ///< of smoother, integrals and wrench estimate
  strix::EscCommands commands_{};
  std::uint32_t value_ = 0;
  Counts hash_{"hash of a tick"};
};

/// The log of a flight on a card that is never busy, every call of 10 s counted.
class LogBench {
 public:
  LogBench() { logger_.begin(0, {"Quad5in", "bench", strix::kVersion, "", 1}); }

  void fly() {
    while (now_ < 12'000'000) pass();
  }
  [[nodiscard]] bool print() {
    return printAll(std::array{&imu_, &gnc_, &idle_, &sector_, &rest_, &blockEnd_, &sync_,
                               &flushIdle_, &flush_});
  }

 private:
  /// Counts what it takes.
  struct Card {
    [[nodiscard]] static bool busy() { return false; }
    [[nodiscard]] bool writeSector(std::uint32_t /*index*/,
                                   const std::uint8_t (& /*data*/)[strix::kSectorSize]) {
      ++sectors;
      return true;
    }
    [[nodiscard]] bool sync(std::uint32_t /*length*/) {
      ++syncs;
      return true;
    }
    std::uint32_t sectors = 0;
    std::uint32_t syncs = 0;
  };

  static constexpr strix::LogTime kWarmUp = 2'000'000;  // us: the header is out, a ring went round

  void measure(Counts& counts, const m7::Counted& call) {
    if (now_ > kWarmUp) counts.add(call);
  }

  /// What FlightSoftware::loop() logs in a millisecond, in its order.
  void pass() {
    now_ += 1'000;
    const strix::topic::SensorCombined imu{
        now_, now_ - 100, {noise_(), noise_(), noise_()}, {noise_(), noise_(), noise_()}, 30.0F};
    measure(imu_, counter.count([&] { logger_.logIMU(imu); }));
    logger_.logAid<strix::AidSource::Tilt>({now_, {}, {}, {}, 3, 0});
    if (now_ % 10'000 == 0) logger_.logMag({now_, now_, {noise_(), noise_(), noise_()}});
    if (now_ % 2'000 == 0) {
      records_.attitude = {now_, {noise_(), noise_(), noise_(), noise_()}};
      records_.tick.timestamp = now_;
      measure(gnc_, counter.count([&] { logger_.logGNC(records_); }));
    }
    write();
    const m7::Counted flush = counter.count([&] { logger_.flush(now_); });
    const bool due = now_ % 500'000 == 0;  // kLogSyncRateHz
    measure(due ? flush_ : flushIdle_, flush);
    syncing_ = syncing_ || due;
  }

  void write() {
    const Card before = card_;
    if (now_ % 50'000 == 0) draining_ = true;  // kLogWriteRateHz
    const m7::Counted call = counter.count([&] { logger_.write(now_); });
    const bool sector = card_.sectors != before.sectors;
    if (syncing_) {
      syncing_ = card_.syncs == before.syncs;
      measure(syncing_ ? blockEnd_ : sync_, call);
    } else if (sector) {
      measure(sector_, call);
    } else {
      measure(draining_ ? rest_ : idle_, call);
      draining_ = false;
    }
  }

  m7::Noise noise_;
  Card card_;
  strix::Logger<Card> logger_{card_};
  strix::LogTime now_ = 0;
  strix::GncRecords records_{};
  bool draining_ = false;
  bool syncing_ = false;
  Counts imu_{"logIMU"};
  Counts gnc_{"logGNC"};
  Counts idle_{"Logger::write, nothing to do"};
  Counts sector_{"Logger::write, one sector"};
  Counts rest_{"Logger::write, less than a sector left"};
  Counts blockEnd_{"Logger::write, block ended for a sync"};
  Counts sync_{"Logger::write, sync"};
  Counts flushIdle_{"Logger::flush, not due"};
  Counts flush_{"Logger::flush, due"};
};

template <class Bench>
void repeat(Bench& bench) {
  for (std::uint32_t call = 0; call < kCalls; ++call) bench.pass();
}

}  // namespace

int main() {
  static SensorBench sensors;
  static ControlBench control;
  static StateMachineBench machine;
  static HashBench<9> hash9;
  static HashBench<18> hash18;
  static LogBench log;
  repeat(sensors);
  control.fly();
  repeat(machine);
  repeat(hash9);
  repeat(hash18);
  log.fly();

  Counts::printHead();
  bool complete = sensors.print();
  complete = control.print() && complete;
  complete = machine.print() && complete;
  complete = hash9.print() && complete;
  complete = hash18.print() && complete;
  return log.print() && complete ? 0 : 1;
}
