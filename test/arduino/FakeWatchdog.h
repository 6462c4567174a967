/// The third watchdog of the i.MX RT1062 (RTWDOG): locked settings, unlocking, refresh, expiry.
///
/// Written from the "i.MX RT1060 Processor Reference Manual", chapter RTWDOG, with two
/// observations of others on a Teensy 4.1 (docs/board.md): it finds itself switched off by the boot
/// ROM, and its settings survive the reset that it causes.
#pragma once

#include <cstdint>

#include "FakeClock.h"

namespace strix {

class FakeWatchdog {
 public:
  using Nanos = FakeClock::Nanos;

  // Bits of CS, numbered as in the manual.
  static constexpr std::uint32_t kUpdate = 1U << 5U;
  static constexpr std::uint32_t kEnable = 1U << 7U;
  static constexpr std::uint32_t kReconfigured = 1U << 10U;
  static constexpr std::uint32_t kUnlocked = 1U << 11U;
  static constexpr std::uint32_t kPrescaler = 1U << 12U;
  static constexpr std::uint32_t kWords = 1U << 13U;  // commands of 32 bits
  static constexpr std::uint32_t kAfterBoot = 0x2520;

  static constexpr Nanos kTick = 30'518;        ///< of 32.768 kHz
  static constexpr Nanos kWindow = 853;         ///< 128 clocks of 150 MHz
  static constexpr Nanos kLatency = 3 * kTick;  ///< of settings

  explicit FakeWatchdog(FakeClock& clock) : clock_(clock) {}

  bool clocked = false;   ///< its gate in CCM_CCGR5
  bool deaf = false;      ///< never unlocks
  unsigned settings = 0;  ///< times that they were changed

  /// ns of the clock when it reset the chip; 0: it has not.
  [[nodiscard]] Nanos bitten() {
    run();
    return bitten_;
  }
  [[nodiscard]] bool running() {
    run();
    return (cs_ & kEnable) != 0;
  }
  /// The chip after its reset: the settings are those of before.
  void restart() {
    run();
    bitten_ = 0;
    fed_ = clock_.now();
    clocked = false;
  }

  [[nodiscard]] std::uint32_t control() {
    run();
    return clocked ? cs_ | (unlocked() ? kUnlocked : 0U) : 0U;
  }
  void control(std::uint32_t value) {
    run();
    if (!clocked || !unlocked()) return;
    next_ = {value & ~(kReconfigured | kUnlocked), nextTimeout_};
    due_ = clock_.now() + kLatency;
    cs_ &= ~kReconfigured;
    unlockedAt_ = kNever;
    ++settings;
  }
  [[nodiscard]] std::uint32_t timeout() {
    run();
    return timeout_;
  }
  void timeout(std::uint32_t value) {
    run();
    if (clocked && unlocked()) nextTimeout_ = value & 0xFFFFU;
  }

  void command(std::uint32_t word) {
    run();
    if (!clocked) return;
    if (word == 0xB480A602) {
      fed_ = clock_.now();
    } else if (word == 0xD928C520) {
      if ((cs_ & kUpdate) != 0 && !deaf) unlockedAt_ = clock_.now() + 2 * kTick;
    } else {
      bitten_ = clock_.now();  // anything else is a program gone wild
    }
  }

 private:
  static constexpr Nanos kNever = ~Nanos{0};
  struct Settings {
    std::uint32_t control;
    std::uint32_t timeout;
  };

  [[nodiscard]] bool unlocked() const {
    return unlockedAt_ != kNever && clock_.now() >= unlockedAt_ &&
           clock_.now() < unlockedAt_ + kWindow;
  }

  /// What time has done meanwhile.
  void run() {
    const auto expire = [this](Nanos until) {
      if ((cs_ & kEnable) == 0 || bitten_ != 0) return;
      const Nanos tick = (cs_ & kPrescaler) != 0 ? 256 * kTick : kTick;
      if (until >= fed_ + timeout_ * tick) bitten_ = fed_ + timeout_ * tick;
    };
    if (due_ != kNever && clock_.now() >= due_) {
      expire(due_);
      cs_ = next_.control | kReconfigured;
      timeout_ = next_.timeout;
      fed_ = due_;
      due_ = kNever;
    }
    expire(clock_.now());
  }

  FakeClock& clock_;
  std::uint32_t cs_ = kAfterBoot;
  std::uint32_t timeout_ = 0x400;
  std::uint32_t nextTimeout_ = 0x400;
  Settings next_{0, 0};
  Nanos due_ = kNever;  // when next_ takes effect
  Nanos unlockedAt_ = kNever;
  Nanos fed_ = 0;
  Nanos bitten_ = 0;
};

}  // namespace strix
