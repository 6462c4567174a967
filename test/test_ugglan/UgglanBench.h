/// Ugglan's pipeline on a fake board: on the ground, or in the air as a rigid body.
#pragma once

#include <unity.h>

#include <string>

#include "FakeBoard.h"
#include "FlightConfig.h"
#include "RigidQuad.h"
#include "Transmitter.h"
#include "UgglanFlight.h"
#include "gains/UgglanQ450Observer.h"

namespace strix {

[[nodiscard]] inline UgglanFlightConfig ugglanConfig() {
  UgglanFlightConfig config{kUgglanQ450, kUgglanQ450ObserverGains};
  config.sensors.mag.sensorToBody = magSensorToBody();
  return config;
}

class UgglanBench {
 public:
  static constexpr Micros kPass = 1000;  ///< us

  explicit UgglanBench(Micros start = 0) : board(start), software(board, ugglanConfig()) {
    board.magMounting = magSensorToBody().inverse();
    board.hold(Quaternion{});
    board.escs.dead = false;
    board.escs.reading.voltage.fill(11.4F);
    sticks.valid = true;
  }

  void pass() {
    transmit();
    software.loop();
    board.advance(kPass);
  }
  void run(float seconds) {
    for (int k = 0; k < static_cast<int>(seconds * 1000.0F); ++k) pass();
  }

  /// From power-up until nothing forbids arming.
  void getReady(const Quaternion& attitude = {}) {
    board.hold(attitude);
    software.setup();
    run(4.0F);
    TEST_ASSERT_TRUE(software.calibrated());
    TEST_ASSERT_FALSE(software.motors().armed());
  }

  /// The arm switch off and on again; true when the motors are on after it.
  bool arm() {
    board.pilot.arm = false;
    pass();
    board.pilot.arm = true;
    pass();
    return software.motors().armed();
  }

  /// The throttle at which the thrust is the weight.
  [[nodiscard]] static float hoverThrottle() { return kUgglanQ450.mass * kGravity / 20.0F; }

  /// One pass in the air: the readings are those of `quad`, which then moves by a pass.
  void fly(RigidQuad& quad) {
    transmit();
    const Eigen::Vector3d before = quad.velocity;
    const Eigen::Quaterniond q = quad.attitude();
    const Quaternion attitude{static_cast<float>(q.w()), static_cast<float>(q.x()),
                              static_cast<float>(q.y()), static_cast<float>(q.z())};
    board.hold(attitude, quad.rate.cast<float>());
    board.imu.reading.accel = accel_;
    software.loop();
    quad.step(board.esc(), 1e-3);
    const Eigen::Vector3d gravity(0.0, 0.0, static_cast<double>(kGravity));
    accel_ = (q.conjugate() * ((quad.velocity - before) / 1e-3 - gravity)).cast<float>();
    board.advance(kPass);
  }

  [[nodiscard]] bool off() const {
    for (const float command : board.esc()) {
      if (command != kUgglanQ450.commandOff) return false;
    }
    return true;
  }

  /// All that the card has after everything was written to it.
  std::string log() {
    software.logger().forceWriteAndFlush(
        [this] {
          board.advance(10);
          return board.now();
        },
        2'000'000);
    return board.sd.sectors<std::string>();
  }
  bool logSays(const char* text) { return log().find(text) != std::string::npos; }

  static constexpr std::uint64_t kFrame = 7000;  ///< us, as iBUS sends them

  PilotInput sticks;  ///< what the transmitter sends
  FakeBoard board;
  UgglanFlight<FakeBoard> software;

 private:
  void transmit() {
    if (board.time() % kFrame == 0) board.radio.push_back(frameOf(sticks));
  }

  Vector3f accel_{0.0F, 0.0F, -kGravity};
};

}  // namespace strix
