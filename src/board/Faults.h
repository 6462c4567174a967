/// What happens when the processor faults: the motors' pulses end before anything else.
#pragma once

namespace strix {

/// The core answers a fault, or an interrupt that nobody awaits, with a record of it (CrashReport)
/// and a pause of 8 s for an upload, in which the pulses go on and, with the processor's clock
/// lowered, grow longer. Here the pulses end first. With motors on the watchdog ends the pause.
///
/// A fault in which even the stack is lost locks the processor up; the chip then resets at once.
void catchFaults();

/// Restarts the processor as asked; the next start will say so.
[[noreturn]] void restart();

}  // namespace strix
