/// The whole flight software on a fake board that stands still on the ground.
#pragma once

#include <unity.h>

#include <string>

#include "FakeBoard.h"
#include "FlightConfig.h"
#include "FlightSoftware.h"

namespace strix {

/// A flight so low that an aircraft which stays on the ground arrives everywhere: its readings do
/// not have to move, and still every state is visited.
constexpr Mission kLowMission{"low", 0.3F, 500'000, 1, {{{0.1F, -0.1F, 0.3F, 0.1F, 300'000}}}};

/// Without integral action, which would rightly ask for ever more of an aircraft that cannot move.
[[nodiscard]] inline FlightSoftwareConfig lowFlight() {
  FlightSoftwareConfig config = flightConfig(kQuad5in, kQuad5inGainsNoIntegral, kLowMission, 0.07F);
  config.mission.end = MissionEnd::Home;
  config.parameters.returnHeight = 0.1F;  // no climb
  return config;
}

/// Takes the sensors' ranges away, to see what the software behind them does with such readings.
inline void believeAnything(FlightSoftwareConfig& config) {
  SensorConfig& sensors = config.sensors;
  sensors.accelRange = sensors.gyroRange = sensors.magRange = sensors.highestPressure = 3e38F;
  sensors.accelStep = sensors.gyroStep = std::numeric_limits<float>::infinity();
  sensors.lowestPressure = -3e38F;
}

template <class Board>
class BasicFakeFlight {
 public:
  explicit BasicFakeFlight(Micros start = 0, const FlightSoftwareConfig& config = lowFlight())
      : board(start), software(board, config) {
    board.magMounting = config.sensors.mag.sensorToBody.inverse();
    board.hold(Quaternion{});
  }

  Board board;
  FlightSoftware<Board> software;
  Micros passTime = 500;  ///< us

  void pass() {
    software.loop();
    board.advance(passTime);
  }

  /// Passes up to and with the next control tick, which looks at the switches.
  void tick() {
    const LogTime last = software.lastTick().timestamp;
    for (int i = 0; i < 100 && software.lastTick().timestamp == last; ++i) pass();
  }

  void run(float seconds) {
    const std::uint64_t end = board.time() + static_cast<std::uint64_t>(seconds * 1e6F);
    while (board.time() < end) pass();
  }

  [[nodiscard]] FlightState state() const { return software.stateMachine().state(); }

  /// Runs until the state machine is in `wanted`. False: it did not come to that in time.
  bool runUntil(FlightState wanted, float seconds) {
    const std::uint64_t end = board.time() + static_cast<std::uint64_t>(seconds * 1e6F);
    while (state() != wanted && board.time() < end) pass();
    return state() == wanted;
  }

  /// From power-up until nothing forbids arming: 2 s of calibration, 50 fixes, switches off.
  void getReady() {
    software.setup();
    run(5.5F);
    TEST_ASSERT_TRUE(state() == FlightState::Idle);
  }

  /// Switches off and on again; true when the motors are on after it.
  bool arm() {
    board.pilot = {};
    tick();
    board.pilot.arm = true;
    tick();
    return state() == FlightState::Armed;
  }

  /// From the ground, ready, into any state with motors on.
  void reach(FlightState wanted) {
    TEST_ASSERT_TRUE(arm());
    if (wanted == FlightState::Armed) return;
    board.pilot.start = true;
    TEST_ASSERT_TRUE(runUntil(wanted, 10.0F));
  }

  /// All that the card has after everything was written to it.
  std::string log() {
    software.logger().forceWriteAndFlush(
        [this] {
          board.advance(10);
          return board.now();
        },
        2'000'000);
    return board.sd.template sectors<std::string>();
  }

  bool logSays(const char* text) { return log().find(text) != std::string::npos; }
};

using FakeFlight = BasicFakeFlight<FakeBoard>;

/// But for the attitude stand, which has a mission and tests of its own.
constexpr FlightState kMotorStates[] = {FlightState::Armed,  FlightState::Takeoff,
                                        FlightState::Hold,   FlightState::Waypoint,
                                        FlightState::Return, FlightState::Land};

[[nodiscard]] inline bool areOff(const EscCommands& commands) {
  for (const float command : commands) {
    if (command != kQuad5in.commandOff) return false;
  }
  return true;
}

/// What a turning motor may be told: from the slowest flight speed to the cap. False for NaN.
[[nodiscard]] inline bool areOn(const EscCommands& commands) {
  const float slowest = Motors(kQuad5in).command(kQuad5in.speedFlightMin);
  for (const float command : commands) {
    if (!(command >= slowest && command <= kQuad5in.commandFlightMax)) return false;
  }
  return true;
}

}  // namespace strix
