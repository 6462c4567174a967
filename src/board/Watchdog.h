/// The hardware watchdog: ends the motors' pulses when the loop stops.
#pragma once

#include <cstdint>

#include "Time.h"

#include <Arduino.h>

namespace strix {

/// The RT1062's third watchdog (RTWDOG, WDOG3), which counts a 32.768 kHz clock of its own: the
/// other two count half seconds. Unfed for kTime it resets the chip, whatever the processor does:
/// hangs with interrupts off, runs in a fault handler, sleeps.
///
/// It runs while motors turn, and only then: on the ground the flash is erased with interrupts off
/// for up to 0.4 s, a card is read, and the Teensy's loader, which runs on this processor, would be
/// reset in the middle of an upload. A loop that stops with the motors off leaves them off.
///
/// Its settings survive the reset that it causes (seen on a Teensy 4.1 by others, docs/board.md),
/// so it is switched off first thing after a reset: Faults.cpp.
class Watchdog {
 public:
  /// Ours: fifty control ticks, thirty times the longest pass. It must be longer than the way from
  /// a reset to Faults.cpp, 10 ms by our reckoning, or the chip would not come up again.
  static constexpr Micros kTime = 100'000;

  /// Takes effect at once. Bound: 0.4 ms when it changes, 1 us when it does not.
  void run(bool on) {
    if (on == on_) return;
    on_ = on;
    tries_ = 1;
    set(on);
    changed_ = ::micros();
  }

  /// Tells it that the loop is alive. A watchdog that is not as it should be is set again, each
  /// kSettled and kTries times at most. Bound: 1 us; 0.4 ms when it is set.
  void feed() {
    if (on_) WDOG3_CNT = kRefresh;
    if (obeys() || tries_ == kTries) return;
    const Micros now = ::micros();
    if (elapsed(now, changed_) < kSettled) return;
    changed_ = now;
    ++tries_;
    set(on_);
  }

  /// It does what run() asked for; shortly after that not yet.
  [[nodiscard]] bool obeys() const {
    if (!on_) return (WDOG3_CS & WDOG_CS_EN) == 0;
    return (WDOG3_CS & kMeaning) == kRunning && WDOG3_TOVAL == kTicks;
  }

  /// Registers alone, for the start-up. The settings are taken within 128 clocks of the bus after
  /// the unlocking (i.MX RT1060 Reference Manual, "RTWDOG, Configuring the Watchdog"), too few for
  /// code that runs from the flash; the unlocking itself may take two clocks of the watchdog.
  static void set(bool on) {
    CCM_CCGR5 |= CCM_CCGR5_WDOG3(CCM_CCGR_ON);
    noInterrupts();
    WDOG3_CNT = kUnlock;
    std::uint32_t polls = 0;
    while ((WDOG3_CS & WDOG_CS_ULK) == 0 && polls < kPolls) ++polls;
    if (polls < kPolls) {
      WDOG3_TOVAL = kTicks;
      WDOG3_WIN = 0;
      WDOG3_CS = on ? kRunning : kStopped;
    }
    interrupts();
  }
  static constexpr std::uint32_t kRefresh = 0xB480A602;  ///< to WDOG3_CNT

 private:
  static constexpr std::uint32_t kUnlock = 0xD928C520;
  static constexpr std::uint32_t kTicks = kTime * 4096ULL / 125'000;  // 32.768 kHz
  static_assert(kTicks <= 0xFFFF);
  /// Counts on in wait and stop mode, where an abort() ends, but not in debug mode. Its settings
  /// may be changed by who knows the word.
  static constexpr std::uint32_t kStopped =
      WDOG_CS_CMD32EN | WDOG_CS_CLK(1) | WDOG_CS_UPDATE | WDOG_CS_WAIT | WDOG_CS_STOP;
  static constexpr std::uint32_t kRunning = kStopped | WDOG_CS_EN;
  /// The others are flags.
  static constexpr std::uint32_t kMeaning = kRunning | WDOG_CS_PRES | WDOG_CS_DBG | WDOG_CS_WIN |
                                            WDOG_CS_INT | WDOG_CS_CLK(3) | WDOG_CS_TST(3);
  static constexpr std::uint32_t kPolls = 4000;  // of 70 ns and more
  /// Settings are seen some clocks of the watchdog after they were written: 0.3 ms on a Teensy 4.1.
  static constexpr Micros kSettled = 2'000;
  static constexpr std::uint32_t kTries = 5;

  bool on_ = false;
  Micros changed_ = 0;
  std::uint32_t tries_ = 0;
};

}  // namespace strix
