/// One motor at a time, slowly, for two seconds, with propellers off.
#pragma once

#include "Motors.h"
#include "Vehicle.h"

namespace strix {

/// Where a rotor sits, in words.
[[nodiscard]] constexpr const char* placeOf(const Rotor& rotor) {
  if (rotor.x > 0.0F) return rotor.y > 0.0F ? "front right" : "front left";
  return rotor.y > 0.0F ? "rear right" : "rear left";
}
[[nodiscard]] constexpr const char* turnOf(const Rotor& rotor) {
  return rotor.spin == Spin::Clockwise ? "clockwise" : "counter-clockwise";
}

/// What a motor test has to know of the aircraft, now.
struct MotorTestInputs {
  bool kill = true;
  bool imuAlive = false;
  bool still = false;
  bool level = false;
  bool turning = true;
};

/// With EscCalibration the only part of the checkout that can command more than off. A test is a
/// countdown of 3 s and a run of at most 2 s at idle and 3 % of the flight range; anything amiss
/// ends it, in the step that sees it. A motor vibrates, so standing still is asked for up to its
/// start, and not tilting or turning to its end.
class MotorTest {
 public:
  static constexpr Micros kPromise = 60'000'000;  ///< how long `props off` is believed
  static constexpr Micros kCountdown = 3'000'000;
  static constexpr Micros kRun = 2'000'000;
  static constexpr float kAboveIdle = 0.03F;  ///< of the range from off to the cap in flight

  explicit MotorTest(const Vehicle& vehicle)
      : off_(vehicle.commandOff),
        turning_(Motors(vehicle).command(vehicle.speedFlightMin) +
                 kAboveIdle * (vehicle.commandFlightMax - vehicle.commandOff)) {}

  /// The pilot says that the propellers are off.
  void promise(Micros now) {
    promised_ = true;
    promisedAt_ = now;
  }

  /// @param motor  0 for M1    @return why not; nullptr when the countdown has begun
  [[nodiscard]] const char* start(Micros now, std::size_t motor, const MotorTestInputs& inputs) {
    stop();
    if (!promised_ || elapsed(now, promisedAt_) > kPromise) {
      return "take the propellers off, then type: props off (it counts for 60 s)";
    }
    if (const char* reason = obstacle(inputs)) return reason;
    if (motor >= kMotorCount) return "there are motors 1 to 4";
    motor_ = motor;
    state_ = State::Countdown;
    since_ = now;
    toldSeconds_ = kCountdown / kSecond + 1;
    return nullptr;
  }

  /// To be called every step, before commands().
  /// @return what has just happened, nullptr mostly
  const char* update(Micros now, const MotorTestInputs& inputs) {
    if (promised_ && elapsed(now, promisedAt_) > kPromise) promised_ = false;
    if (state_ == State::Off) return nullptr;
    if (const char* reason = obstacle(inputs)) {
      stop();
      return reason;
    }
    if (state_ == State::Countdown) {
      if (elapsed(now, since_) < kCountdown) return tellSecond(now);
      state_ = State::Running;
      since_ = now;
      return "turning: any key stops it";
    }
    if (elapsed(now, since_) < kRun) return nullptr;
    stop();
    return "stopped after 2 s";
  }

  void stop() { state_ = State::Off; }

  [[nodiscard]] bool active() const { return state_ != State::Off; }
  [[nodiscard]] std::size_t motor() const { return motor_; }

  /// What the motors get now: all off but the one under test.
  [[nodiscard]] EscCommands commands() const {
    EscCommands commands{};
    commands.fill(off_);
    if (state_ == State::Running) commands[motor_] = turning_;
    return commands;
  }

 private:
  static constexpr Micros kSecond = 1'000'000;

  enum class State { Off, Countdown, Running };

  [[nodiscard]] const char* obstacle(const MotorTestInputs& inputs) const {
    if (inputs.kill) return "kill is on: close the kill loop";
    if (!inputs.imuAlive) return "the IMU gives no data: see the command sensors";
    if (!inputs.level) return "the aircraft is not level: set it on its feet";
    if (state_ == State::Running) {
      return inputs.turning ? "the aircraft turns: are the propellers off?" : nullptr;
    }
    return inputs.still ? nullptr : "the aircraft moves: let it stand still for a second";
  }

  [[nodiscard]] const char* tellSecond(Micros now) {
    constexpr const char* kWords[] = {"in 1 s", "in 2 s", "in 3 s"};
    const Micros left = (kCountdown - elapsed(now, since_) - 1) / kSecond;  // 2, 1, 0
    if (left + 1 >= toldSeconds_) return nullptr;
    toldSeconds_ = left + 1;
    return kWords[left];
  }

  float off_;      ///< both in the vehicle's unit
  float turning_;  ///< idle is the least that a motor gets in flight
  bool promised_ = false;
  Micros promisedAt_ = 0;
  State state_ = State::Off;
  Micros since_ = 0;
  Micros toldSeconds_ = 0;
  std::size_t motor_ = 0;
};

}  // namespace strix
