#include "Faults.h"

#include <cstdint>

#include "Reset.h"
#include "Watchdog.h"

#include <Arduino.h>

extern "C" {

void unused_interrupt_vector();  // the core's answer to a fault, startup.c

/// No pin gets a pulse: all outputs of all four generators are cut off from their pads.
void strixCutPulses() {
  FLEXPWM1_OUTEN = 0;
  FLEXPWM2_OUTEN = 0;
  FLEXPWM3_OUTEN = 0;
  FLEXPWM4_OUTEN = 0;
}

/// The core's handler wants stack and link register as the processor left them.
[[gnu::naked]] void strixFault() {
  asm volatile(
      "push {r4, lr}\n"
      "bl strixCutPulses\n"
      "pop {r4, lr}\n"
      "b unused_interrupt_vector\n");
}

// A watchdog that has just reset the chip still runs, and would again before set-up is done.

/// Called by the core's start-up before all else, when only flash and registers are there.
FLASHMEM void startup_early_hook() {
  CCM_CCGR5 |= CCM_CCGR5_WDOG3(CCM_CCGR_ON);
  WDOG3_CNT = strix::Watchdog::kRefresh;
}

/// Some milliseconds later, when the code is in its memory; the core then waits 300 ms for USB.
void startup_middle_hook() { strix::Watchdog::set(false); }

}  // extern "C"

namespace strix {

void catchFaults() {
  constexpr std::uint32_t kResetOnLockup = 1U << 4U;  // SRC_SCR, lockup_rst
  SRC_SCR |= kResetOnLockup;
  for (auto& vector : _VectorsRam) {
    if (vector == &unused_interrupt_vector) vector = &strixFault;
  }
  asm volatile("dsb" ::: "memory");
}

void restart() {
  SRC_GPR5 = kRestartAsked;
  SCB_AIRCR = 0x05FA0004;  // SYSRESETREQ, ARMv7-M Architecture Reference Manual B3.2.6
  for (;;) {
  }
}

}  // namespace strix
