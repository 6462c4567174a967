/// Why the processor started, and what it was doing when it stopped.
#pragma once

#include <cstdint>

#include "Board.h"

#include <Arduino.h>

namespace strix {

/// In SRC_GPR5 while a restart that was asked for is on its way: the chip has one bit for that and
/// for a processor that locked up. The core writes another word there when it restarts after a
/// fault.
constexpr std::uint32_t kRestartAsked = 0x57524E21;

/// @param bits     of SRC_SRSR (i.MX RT1060 Reference Manual, "SRC Reset Status Register")
/// @param asked    SRC_GPR5
/// @param crashed  the core has kept the record of a fault (CrashReport)
[[nodiscard]] constexpr std::uint32_t resetCauses(std::uint32_t bits, std::uint32_t asked,
                                                  bool crashed) {
  const bool restarted = (bits & SRC_SRSR_LOCKUP_SYSRESETREQ) != 0;
  const bool wanted = restarted && asked == kRestartAsked;
  const bool bitten = (bits & (SRC_SRSR_WDOG_RST_B | SRC_SRSR_WDOG3_RST_B)) != 0;
  std::uint32_t causes = 0;
  // The Teensy's other chip drives this line when the supply has come: power-up and brown-out.
  if ((bits & SRC_SRSR_IPP_RESET_B) != 0) causes |= reset::kPowerUp;
  if ((bits & SRC_SRSR_IPP_USER_RESET_B) != 0) causes |= reset::kPin;
  if (wanted) causes |= reset::kSoftware;
  // A record may be old: it counts when the start was none that was wanted.
  if ((restarted && !wanted) || (bitten && crashed)) causes |= reset::kLockup;
  if (bitten) causes |= reset::kWatchdog;
  if ((bits & (SRC_SRSR_JTAG_RST_B | SRC_SRSR_JTAG_SW_RST)) != 0) causes |= reset::kDebugger;
  if ((bits & SRC_SRSR_TEMPSENSE_RST_B) != 0) causes |= reset::kTemperature;
  return causes != 0 ? causes : reset::kOther;
}

/// Whether the motors are on, in a register that no reset clears: SNVS_LPGPR2 is supplied by VBAT,
/// or without a cell there by the 3.3 V. The core uses none of the four. That it keeps its contents
/// has to be asked for (GPR_Z_DIS).
class RetainedMotors {
 public:
  static constexpr std::uint32_t kOn = 0x4D6F7452;  ///< what a register without supply never holds

  static void remember(bool on) {
    SNVS_LPCR |= SNVS_LPCR_GPR_Z_DIS;
    SNVS_LPGPR2 = on ? kOn : 0;
  }
  [[nodiscard]] static bool wereOn() { return SNVS_LPGPR2 == kOn; }
};

/// Reads the causes and forgets them, so that the next start finds its own.
[[nodiscard]] inline ResetStatus takeResetStatus() {
  const std::uint32_t bits = SRC_SRSR;
  const std::uint32_t asked = SRC_GPR5;
  SRC_SRSR = bits;  // ones clear
  SRC_GPR5 = 0;
  return {resetCauses(bits, asked, static_cast<bool>(CrashReport)), RetainedMotors::wereOn()};
}

}  // namespace strix
