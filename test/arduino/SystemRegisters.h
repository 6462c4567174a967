/// Watchdog, reset controller and the registers that keep their contents, under the core's names
/// (imxrt.h). "i.MX RT1060 Processor Reference Manual": chapters RTWDOG, SRC, SNVS, CCM.
#pragma once

#include <cstdint>

#include "FakeTeensy.h"

namespace strix {

/// A pair of actions that looks like a volatile word.
struct FakeWord {
  std::uint32_t (*read)();
  void (*write)(std::uint32_t value);

  operator std::uint32_t() const {  // NOLINT(google-explicit-constructor): as a word
    fakeTeensy().clock.advance(FakeClock::kRegister);
    return read();
  }
  const FakeWord& operator=(std::uint32_t value) const {  // NOLINT: of the word, not of this
    fakeTeensy().clock.advance(FakeClock::kRegister);
    write(value);
    return *this;
  }
  const FakeWord& operator|=(std::uint32_t bits) const {
    return *this = static_cast<std::uint32_t>(*this) | bits;
  }
};

constexpr std::uint32_t kWatchdogGate = 3U << 4U;

inline constexpr FakeWord ccgr5{
    [] { return fakeTeensy().watchdog.clocked ? kWatchdogGate : 0U; },
    [](std::uint32_t v) { fakeTeensy().watchdog.clocked = (v & kWatchdogGate) == kWatchdogGate; }};
inline constexpr FakeWord wdog3Cs{[] { return fakeTeensy().watchdog.control(); },
                                  [](std::uint32_t v) { fakeTeensy().watchdog.control(v); }};
inline constexpr FakeWord wdog3Cnt{[] { return std::uint32_t{0}; },
                                   [](std::uint32_t v) { fakeTeensy().watchdog.command(v); }};
inline constexpr FakeWord wdog3Toval{[] { return fakeTeensy().watchdog.timeout(); },
                                     [](std::uint32_t v) { fakeTeensy().watchdog.timeout(v); }};
inline constexpr FakeWord wdog3Win{[] { return std::uint32_t{0}; }, [](std::uint32_t /*v*/) {}};

inline constexpr FakeWord srsr{[] { return fakeTeensy().reset.causes; },
                               [](std::uint32_t ones) { fakeTeensy().reset.causes &= ~ones; }};
inline constexpr FakeWord gpr5{[] { return fakeTeensy().reset.word; },
                               [](std::uint32_t v) { fakeTeensy().reset.word = v; }};
inline constexpr FakeWord lpcr{[] { return fakeTeensy().retained.control; },
                               [](std::uint32_t v) { fakeTeensy().retained.control = v; }};
inline constexpr FakeWord lpgpr2{[] { return fakeTeensy().retained.word; },
                                 [](std::uint32_t v) { fakeTeensy().retained.word = v; }};

/// The core's record of a fault.
struct FakeCrashReport {
  explicit operator bool() const { return fakeTeensy().reset.crashed; }
};

}  // namespace strix

inline constexpr strix::FakeCrashReport CrashReport;

inline void noInterrupts() {}
inline void interrupts() {}

// NOLINTBEGIN(cppcoreguidelines-macro-usage)
#define CCM_CCGR5 (strix::ccgr5)
#define CCM_CCGR5_WDOG3(n) ((std::uint32_t)(((n) & 3U) << 4U))
#define CCM_CCGR_ON 3

#define WDOG3_CS (strix::wdog3Cs)
#define WDOG3_CNT (strix::wdog3Cnt)
#define WDOG3_TOVAL (strix::wdog3Toval)
#define WDOG3_WIN (strix::wdog3Win)
#define WDOG_CS_STOP (1U << 0U)
#define WDOG_CS_WAIT (1U << 1U)
#define WDOG_CS_DBG (1U << 2U)
#define WDOG_CS_TST(n) ((n) << 3U)
#define WDOG_CS_UPDATE (1U << 5U)
#define WDOG_CS_INT (1U << 6U)
#define WDOG_CS_EN (1U << 7U)
#define WDOG_CS_CLK(n) ((n) << 8U)
#define WDOG_CS_ULK (1U << 11U)
#define WDOG_CS_PRES (1U << 12U)
#define WDOG_CS_CMD32EN (1U << 13U)
#define WDOG_CS_WIN (1U << 15U)

#define SRC_SRSR (strix::srsr)
#define SRC_GPR5 (strix::gpr5)
#define SRC_SRSR_IPP_RESET_B (1U << 0U)
#define SRC_SRSR_LOCKUP_SYSRESETREQ (1U << 1U)
#define SRC_SRSR_CSU_RESET_B (1U << 2U)
#define SRC_SRSR_IPP_USER_RESET_B (1U << 3U)
#define SRC_SRSR_WDOG_RST_B (1U << 4U)
#define SRC_SRSR_JTAG_RST_B (1U << 5U)
#define SRC_SRSR_JTAG_SW_RST (1U << 6U)
#define SRC_SRSR_WDOG3_RST_B (1U << 7U)
#define SRC_SRSR_TEMPSENSE_RST_B (1U << 8U)

#define SNVS_LPCR (strix::lpcr)
#define SNVS_LPCR_GPR_Z_DIS (1U << 24U)
#define SNVS_LPGPR2 (strix::lpgpr2)
// NOLINTEND(cppcoreguidelines-macro-usage)
