/// Counts the instructions of every pass of the whole loop over a logged flight, on the emulated
/// Cortex-M7. Prints one CSV line per kind of pass; bench.py sets them beside the budgets.
///
///   bench_loop LOG
///
/// The log's readings arrive at other times than they did: each waits for the pass that is a
/// multiple of its sensor's period, so that ten times a second everything is due in one pass.
#include <Replay.h>

#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "Counts.h"
#include "NoCard.h"

namespace {

using m7::Counts;
using strix::Micros;

template <int States>
class Flight {
 public:
  /// @param any  what all of its passes together are called
  Flight(const strix::FlightLogReader& log, const strix::FlightSoftwareConfig& config,
         const char* any)
      : log_(log), board_("", 1), software_(board_, config), any_(any) {}

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
    for (Counts* passes : {&imuOnly_, &imuAndLog_, &control_, &everything_, &any_}) {
      complete = passes->print(States) && complete;
    }
    return complete;
  }
  [[nodiscard]] bool printAny() { return any_.print(States); }

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
    const m7::Counted count = m7::counter.count([this] { software_.loop(); });
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
  Counts imuOnly_{"loop, IMU only"};
  Counts imuAndLog_{"loop, IMU and log"};
  Counts control_{"loop, IMU and control"};
  Counts everything_{"loop, everything due"};
  Counts any_;
};

template <int States>
[[nodiscard]] bool bench(const strix::FlightLogReader& log) {
  const strix::FlightSoftwareConfig asFlown = strix::replayConfig(log);
  strix::FlightSoftwareConfig heavy = asFlown;
  heavy.navigation.tiltFusion = strix::TiltFusion::Vibration;
  heavy.navigation.magFusion = strix::MagFusion::ThreeAxis;
  const auto most = std::make_unique<Flight<States>>(log, heavy, "loop, any");
  most->fly();
  const auto usual = std::make_unique<Flight<States>>(log, asFlown, "loop as flown, any");
  usual->fly();
  const bool complete = most->printAll();
  return usual->printAny() && complete;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::printf("usage: bench_loop LOG\n");
    return 2;
  }
  try {
    const strix::FlightLogReader log(arguments[1]);
    Counts::printHead();
    const bool complete = bench<9>(log);
    return bench<18>(log) && complete ? 0 : 1;
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
    return 2;
  }
}
