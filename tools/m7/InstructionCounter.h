/// Exact instruction counts on the emulated Cortex-M7.
///
/// QEMU's -icount shift=10 makes each instruction last 2^10 ns of the emulated time, and timer 0 of
/// the Cortex-M System Design Kit (Arm DDI 0479, "APB timer") counts that time down at 25 MHz:
/// 25.6 ticks per instruction. Instructions are not cycles: no cache, no pipeline, no memory.
#pragma once

#include <cstdint>

namespace m7 {

/// Calls function(argument) and returns the timer ticks from just before the call to just after it.
/// In assembly, so that the compiler can move nothing into the counted stretch or out of it.
[[gnu::naked, gnu::noinline]] inline std::uint32_t countedCall(void (* /*r0*/)(void*),
                                                               void* /*r1*/) {
  asm volatile(
      "push {r4, r5, r6, lr}\n"
      "mov r4, #0x40000000\n"  // timer 0; VALUE is its second register
      "mov r2, r0\n"
      "mov r0, r1\n"
      "ldr r5, [r4, #4]\n"
      "blx r2\n"
      "ldr r6, [r4, #4]\n"
      "subs r0, r5, r6\n"  // it counts down
      "pop {r4, r5, r6, pc}\n");
}

class InstructionCounter {
 public:
  InstructionCounter() {
    auto* timer = reinterpret_cast<volatile std::uint32_t*>(0x40000000);
    timer[2] = 0xFFFFFFFF;  // RELOAD
    timer[1] = 0xFFFFFFFF;  // VALUE
    timer[0] = 1;           // CTRL: enable
    overhead_ = count([] {});
  }

  /// Instructions of call(), its own call and return not counted. Good for up to 167 million.
  template <class Call>
  [[nodiscard]] std::uint32_t count(Call call) const {
    const auto ticks = countedCall([](void* c) { (*static_cast<Call*>(c))(); }, &call);
    // Each reading drops up to one tick, 1/25.6 of an instruction: rounding gives the whole number.
    const auto instructions = static_cast<std::uint32_t>((std::uint64_t{ticks} * 10 + 128) / 256);
    return instructions - overhead_;
  }

 private:
  std::uint32_t overhead_ = 0;  ///< of an empty call
};

}  // namespace m7
