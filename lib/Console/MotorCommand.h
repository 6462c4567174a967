/// `props off` and `motor N PERCENT SECONDS`: one motor, on the bench, without its propeller.
#pragma once

#include "ConsoleText.h"
#include "Countdown.h"

namespace strix {

/// The console's part of it: who may ask, the countdown, the key that stops it. That a motor turns
/// at no other time, and what else has to be fulfilled, is the flight software's.
template <class Flight>
class MotorCommand {
 public:
  static constexpr Micros kPromise = 60'000'000;  ///< how long `props off` is believed
  static constexpr Micros kCountdown = 3'000'000;
  // Ours: enough to see, hear and feel a motor; beyond that one without its propeller races.
  static constexpr std::uint32_t kMostPercent = 30;
  static constexpr float kLeastSeconds = 0.1F;
  static constexpr float kMostSeconds = 10.0F;

  MotorCommand(Flight& flight, TextOut& out) : flight_(flight), out_(out) {}

  /// The pilot says that the propellers are off.
  const char* promise(Micros now, const Words& words) {
    if (words.count != 1 || !sameWord(words.numbers[0], "off")) return "expected: props off";
    promised_ = true;
    promisedAt_ = now;
    out_ << "noted: propellers off, for 60 s\n";
    return nullptr;
  }

  /// To be called every step: a promise of 71 min ago must not come back as a new one.
  void forget(Micros now) {
    if (promised_ && elapsed(now, promisedAt_) > kPromise) promised_ = false;
  }

  const char* start(Micros now, const Words& words) {
    std::uint32_t number = 0;
    std::uint32_t percent = 0;
    float seconds = 0.0F;
    if (words.count != 3) return "expected: motor N PERCENT SECONDS";
    if (!toWhole(words.numbers[0], 4, number) || number == 0) return "there are motors 1 to 4";
    if (!toWhole(words.numbers[1], kMostPercent, percent) || percent == 0) {
      return "PERCENT is a whole number from 1 to 30";
    }
    if (!toNumber(words.numbers[2], seconds) ||
        !(seconds >= kLeastSeconds && seconds <= kMostSeconds)) {
      return "SECONDS is from 0.1 to 10";
    }
    if (flight_.status().motorsOn) return "the motors are on: disarm first";
    if (!promised_) return "take the propellers off, then type: props off (it counts for 60 s)";
    motor_ = static_cast<int>(number) - 1;
    throttle_ = static_cast<float>(percent) * 0.01F;
    duration_ = static_cast<Micros>(seconds * 1e6F);
    countdown_.start(now, kCountdown);
    state_ = State::Soon;
    return nullptr;
  }

  /// @return nullptr, or why it has stopped
  const char* step(Micros now) {
    if (state_ == State::Turning && elapsed(now, since_) >= duration_) state_ = State::Off;
    if (state_ != State::Soon || !countdown_.over(now, out_, "turning")) return nullptr;
    state_ = State::Off;
    if (const char* refusal = flight_.testMotor(motor_, throttle_, duration_)) return refusal;
    state_ = State::Turning;
    since_ = now;
    out_ << "M" << static_cast<std::uint32_t>(motor_ + 1) << " turns: any key stops it\n";
    return nullptr;
  }

  void stop() {
    if (state_ == State::Turning) (void)flight_.testMotor(motor_, 0.0F, 0);
    state_ = State::Off;
  }

  [[nodiscard]] bool active() const { return state_ != State::Off; }

 private:
  enum class State { Off, Soon, Turning };

  Flight& flight_;
  TextOut& out_;
  Countdown countdown_;
  State state_ = State::Off;
  bool promised_ = false;
  Micros promisedAt_ = 0;
  Micros since_ = 0;  ///< when it began to turn
  int motor_ = 0;     ///< 0 for M1
  float throttle_ = 0.0F;
  Micros duration_ = 0;
};

}  // namespace strix
