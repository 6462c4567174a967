/// Counts the instructions of every pass of the whole loop over a logged flight, on the emulated
/// Cortex-M7. Prints one CSV line per kind of pass; bench.py sets them beside the budgets.
///
///   bench_loop LOG
///
/// The log's readings arrive at other times than they did: each waits for the pass that is a
/// multiple of its sensor's period, so that ten times a second everything is due in one pass.
#include <Replay.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "InstructionCounter.h"
#include "NoCard.h"

namespace {

using strix::Micros;

/// The counts of one kind of pass.
class Passes {
 public:
  explicit Passes(const char* name) : name_(name) {}

  void add(std::uint32_t count) { counts_.push_back(count); }

  /// @return false, and says so, when there was no such pass
  [[nodiscard]] bool print(int states) { return print(states, name_); }
  [[nodiscard]] bool print(int states, const char* name) {
    if (counts_.empty()) {
      std::printf("%s, %d states: no such pass\n", name, states);
      return false;
    }
    std::sort(counts_.begin(), counts_.end());
    std::uint64_t sum = 0;
    for (const std::uint32_t count : counts_) sum += count;
    std::printf("\"%s\",%d,0,%u,%lu,%lu,%lu,%lu\n", name, states, counts_.size(),
                counts_[counts_.size() / 2], static_cast<unsigned long>(sum / counts_.size()),
                counts_.front(), counts_.back());
    return true;
  }

 private:
  const char* name_;
  std::vector<std::uint32_t> counts_;
};

template <int States>
class Flight {
 public:
  Flight(const strix::FlightLogReader& log, const strix::FlightSoftwareConfig& config)
      : log_(log), board_("", 1), software_(board_, config) {}

  void fly() {
    const Micros start = static_cast<Micros>(strix::loggedConfig(log_).timestamp);
    board_.setTime(start);
    software_.setup();
    for (const strix::topic::SensorCombined& imu : log_.records<strix::topic::SensorCombined>()) {
      const Micros now = static_cast<Micros>(imu.timestamp);
      const Micros since = strix::elapsed(now, start);
      board_.setTime(now);
      board_.put(strix::asRead(imu));
      const bool slow = give(imu.timestamp, since);
      pass(now, slow, since % kGpsPeriod == 0);
    }
  }

  [[nodiscard]] bool printAll() {
    bool complete = true;
    for (Passes* passes : {&imuOnly_, &imuAndLog_, &control_, &everything_, &any_}) {
      complete = passes->print(States) && complete;
    }
    return complete;
  }
  [[nodiscard]] bool printAny(const char* name) { return any_.print(States, name); }

 private:
  static constexpr Micros kMagPeriod = 10'000;  // us, DESIGN.md section 3
  static constexpr Micros kAltPeriod = 20'000;
  static constexpr Micros kGpsPeriod = 100'000;

  /// @return whether any of the slower sensors had something
  bool give(std::uint64_t time, Micros since) {
    while (switches_.time() <= time) {
      board_.setPilot(strix::asRead(*switches_.take(switches_.time())));
    }
    bool given = false;
    if (since % kMagPeriod == 0) given = putLatest(mag_, time) || given;
    if (since % kAltPeriod == 0) given = putLatest(alt_, time) || given;
    if (since % kGpsPeriod == 0) given = putLatest(gps_, time) || given;
    return given;
  }

  template <class Topic>
  bool putLatest(strix::Cursor<Topic>& cursor, std::uint64_t time) {
    bool given = false;
    while (cursor.time() <= time) {
      board_.put(strix::asRead(*cursor.take(cursor.time())));
      given = true;
    }
    return given;
  }

  void pass(Micros now, bool slow, bool all) {
    const std::uint32_t logged = software_.logger().status(0).bytes;
    const std::uint32_t count = counter_.count([this] { software_.loop(); });
    if (software_.stateMachine().state() == strix::FlightState::Boot) return;
    const bool log = software_.logger().status(0).bytes != logged;  // went to the card's sector
    const bool ticked = static_cast<Micros>(software_.lastTick().timestamp) == now;
    any_.add(count);
    if (!software_.motors().armed()) return;
    if (all && slow && ticked && log) everything_.add(count);
    if (!slow && ticked && !log) control_.add(count);
    if (!slow && !ticked) (log ? imuAndLog_ : imuOnly_).add(count);
  }

  const strix::FlightLogReader& log_;
  strix::SimulatedBoard<m7::NoCard> board_;
  strix::FlightSoftware<strix::SimulatedBoard<m7::NoCard>, States> software_;
  strix::Cursor<strix::topic::SensorMag> mag_{log_};
  strix::Cursor<strix::topic::SensorBaro> alt_{log_};
  strix::Cursor<strix::topic::VehicleGpsPosition> gps_{log_};
  strix::Cursor<strix::topic::ManualControlSwitches> switches_{log_};
  m7::InstructionCounter counter_;
  Passes imuOnly_{"loop, IMU only"};
  Passes imuAndLog_{"loop, IMU and log"};
  Passes control_{"loop, IMU and control"};
  Passes everything_{"loop, everything due"};
  Passes any_{"loop, any"};
};

template <int States>
[[nodiscard]] bool bench(const strix::FlightLogReader& log) {
  const strix::FlightSoftwareConfig asFlown = strix::replayConfig(log);
  strix::FlightSoftwareConfig heavy = asFlown;
  heavy.navigation.tiltFusion = strix::TiltFusion::Vibration;
  heavy.navigation.magFusion = strix::MagFusion::ThreeAxis;
  const auto most = std::make_unique<Flight<States>>(log, heavy);
  most->fly();
  const auto usual = std::make_unique<Flight<States>>(log, asFlown);
  usual->fly();
  const bool complete = most->printAll();
  return usual->printAny("loop as flown, any") && complete;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::printf("usage: bench_loop LOG\n");
    return 2;
  }
  try {
    const strix::FlightLogReader log(arguments[1]);
    std::printf("function,states,scalars,calls,median,mean,min,max\n");
    const bool complete = bench<9>(log);
    return bench<18>(log) && complete ? 0 : 1;
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
    return 2;
  }
}
