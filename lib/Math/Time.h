/// Time in the loop: microseconds in 32 bits that wrap after 71.6 minutes, never float seconds.
#pragma once

#include <cstdint>

namespace strix {

using Micros = std::uint32_t;

/// Microseconds from `then` to `now`, right across the wrap as long as less than 71.6 min passed.
[[nodiscard]] constexpr Micros elapsed(Micros now, Micros then) { return now - then; }

/// For settings, which people give in seconds; up to 71 min.
[[nodiscard]] constexpr Micros toMicros(float seconds) {
  return static_cast<Micros>(seconds * 1e6F);
}

/// A short duration as seconds, for use in equations only.
[[nodiscard]] constexpr float toSeconds(Micros duration) {
  return static_cast<float>(duration) * 1e-6F;
}

constexpr Micros periodFromHz(std::uint32_t hz) { return 1'000'000U / hz; }

/// A periodic task that keeps its phase: `last += period`, so a loop of 1.4 ms still runs a 500 Hz
/// task 500 times a second. More than one period late, it starts a new phase and counts an overrun.
class PeriodicTask {
 public:
  constexpr explicit PeriodicTask(Micros period) : period_(period) {}

  /// Starts the phase so that the task is due at `now`.
  constexpr void start(Micros now) { last_ = now - period_; }

  [[nodiscard]] constexpr bool due(Micros now) const { return elapsed(now, last_) >= period_; }

  /// Starts the phase so that the task is due one period after `now`.
  constexpr void postpone(Micros now) { last_ = now; }

  /// Marks this period's work as done.
  constexpr void done(Micros now) {
    last_ += period_;
    if (elapsed(now, last_) > period_) {
      last_ = now;
      ++overruns_;
    }
  }

  /// due() and done() in one, for work that never waits for a device.
  [[nodiscard]] constexpr bool run(Micros now) {
    if (!due(now)) return false;
    done(now);
    return true;
  }

  [[nodiscard]] constexpr Micros period() const { return period_; }
  [[nodiscard]] constexpr std::uint32_t overruns() const { return overruns_; }

 private:
  Micros period_;
  Micros last_ = 0;
  std::uint32_t overruns_ = 0;
};

/// The 64-bit log clock, unwrapped from the loop's 32 bits.
class LogClock {
 public:
  /// @param now  to be called at least once every 71.6 min, which the loop does
  std::uint64_t update(Micros now) {
    time_ += elapsed(now, last_);
    last_ = now;
    return time_;
  }

  /// The 64-bit time of a 32-bit stamp taken up to 35 min before or after the last update; a stamp
  /// from before the clock's zero is dated zero.
  [[nodiscard]] std::uint64_t at(Micros stamp) const {
    const auto offset = static_cast<std::int64_t>(static_cast<std::int32_t>(stamp - last_));
    if (offset < 0 && time_ < static_cast<std::uint64_t>(-offset)) return 0;
    return time_ + static_cast<std::uint64_t>(offset);
  }

 private:
  std::uint64_t time_ = 0;
  Micros last_ = 0;
};

}  // namespace strix
