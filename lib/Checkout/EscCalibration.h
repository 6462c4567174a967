/// Teaches ESCs on a signal wire which pulses are full and off. Propellers and battery are off.
#pragma once

#include <string_view>

#include "MotorTest.h"
#include "Vehicle.h"

namespace strix {

/// An ESC that sees full at power-up takes it for the top of its range, beeps, and takes what comes
/// next for the bottom: BLHeli's manual (SiLabs, revision 10, "Throttle range calibration": 3 s
/// above the middle, 3 s below it), and others alike. An ESC that has power when full begins would
/// run its motor at full: so the pilot says that the battery is off as well, for each time anew,
/// and plugs it in while full is sent.
///
/// A countdown of 3 s and full for at most 30 s; any key, kill, and whatever ends a motor test end
/// it, in the step that sees it, at off.
class EscCalibration {
 public:
  static constexpr Micros kPromise = MotorTest::kPromise;
  static constexpr Micros kCountdown = 3'000'000;
  static constexpr Micros kFull = 30'000'000;  ///< ours: to plug a battery in and to listen

  explicit EscCalibration(const Vehicle& vehicle) : vehicle_(vehicle) {}

  void promisePropellersOff(Micros now) { propellers_.give(now); }
  void promiseBatteryOff(Micros now) { battery_.give(now); }

  /// @return why not; nullptr when the countdown has begun
  [[nodiscard]] const char* start(Micros now, const MotorTestInputs& inputs) {
    state_ = State::Off;
    if (std::string_view(vehicle_.commandUnit) != "us") {
      return "these ESCs are not told by the width of a pulse";
    }
    if (!propellers_.holds(now)) {
      return "take the propellers off, then type: props off (it counts for 60 s)";
    }
    if (!battery_.holds(now)) {
      return "unplug the battery, or the motors run at full; then type: battery off (60 s)";
    }
    if (const char* reason = obstacle(inputs)) return reason;
    state_ = State::Countdown;
    since_ = now;
    return nullptr;
  }

  /// To be called every step, before commands().
  /// @return what has just happened, nullptr mostly
  const char* update(Micros now, const MotorTestInputs& inputs) {
    propellers_.expire(now);
    battery_.expire(now);
    if (state_ == State::Off) return nullptr;
    if (const char* reason = obstacle(inputs)) {
      state_ = State::Off;
      return reason;
    }
    if (state_ == State::Countdown) {
      if (elapsed(now, since_) < kCountdown) return nullptr;
      state_ = State::Full;
      since_ = now;
      battery_.take();
      return "full: plug the battery in, wait for the beeps to end, press any key";
    }
    if (elapsed(now, since_) < kFull) return nullptr;
    return stop();
  }

  /// @return what that means to the ESCs
  const char* stop() {
    const bool full = state_ == State::Full;
    state_ = State::Off;
    return full ? "off: wait for the beeps again, then unplug the battery" : "stopped";
  }

  [[nodiscard]] bool active() const { return state_ != State::Off; }

  /// What all motors get now.
  [[nodiscard]] EscCommands commands() const {
    EscCommands commands{};
    commands.fill(state_ == State::Full ? vehicle_.commandMax : vehicle_.commandOff);
    return commands;
  }

 private:
  enum class State { Off, Countdown, Full };

  /// A word of the pilot's, believed for a while.
  class Promise {
   public:
    void give(Micros now) {
      given_ = true;
      at_ = now;
    }
    void take() { given_ = false; }
    /// To be called every step: the clock's wrap would renew it.
    void expire(Micros now) { given_ = holds(now); }
    [[nodiscard]] bool holds(Micros now) const { return given_ && elapsed(now, at_) <= kPromise; }

   private:
    bool given_ = false;
    Micros at_ = 0;
  };

  /// Plugging a battery in shakes the aircraft: standing still is asked for until full begins.
  [[nodiscard]] const char* obstacle(const MotorTestInputs& inputs) const {
    if (inputs.kill) return "kill is on: close the kill loop";
    if (!inputs.imuAlive) return "the IMU gives no data: see the command sensors";
    if (!inputs.level) return "the aircraft is not level: set it on its feet";
    if (state_ == State::Full) {
      return inputs.turning ? "the aircraft turns: hold it down, and begin again" : nullptr;
    }
    return inputs.still ? nullptr : "the aircraft moves: let it stand still for a second";
  }

  const Vehicle& vehicle_;
  Promise propellers_;
  Promise battery_;
  State state_ = State::Off;
  Micros since_ = 0;
};

}  // namespace strix
