/// Calls with the heap watched and the stack painted. For one source file of a program.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

struct _reent;

namespace m7 {

inline bool watching = false;
inline std::uint32_t heapCalls = 0;  ///< allocations and releases during watched calls

/// Calls function(argument) on another stack.
/// @param top  where that stack ends and its use begins: a multiple of 8, as the procedure call
///             standard wants it (AAPCS32, 6.2.1.2)
[[gnu::naked, gnu::noinline]] inline void callOn(std::uint32_t* /*r0: top*/, void (* /*r1*/)(void*),
                                                 void* /*r2: argument*/) {
  asm volatile(
      "push {r4, lr}\n"
      "mov r4, sp\n"
      "mov sp, r0\n"
      "mov r0, r2\n"
      "blx r1\n"
      "mov sp, r4\n"
      "pop {r4, pc}\n");
}

/// A stack for watched calls alone, filled with a pattern that they overwrite.
class PaintedStack {
 public:
  PaintedStack() { words_.fill(kPaint); }

  void call(void (*function)(void*), void* argument) {
    watching = true;
    callOn(words_.data() + words_.size(), function, argument);
    watching = false;
  }

  /// Bytes from its beginning to the deepest word ever written. What calls reserved below that and
  /// did not write does not show.
  [[nodiscard]] std::uint32_t used() const {
    const auto touched = [](std::uint32_t word) { return word != kPaint; };
    const auto deepest = std::find_if(words_.begin(), words_.end(), touched);
    return static_cast<std::uint32_t>(words_.end() - deepest) * sizeof(std::uint32_t);
  }

 private:
  static constexpr std::uint32_t kPaint = 0xA5C3A5C3;

  alignas(8) std::array<std::uint32_t, 64 * 1024 / sizeof(std::uint32_t)> words_;
};

}  // namespace m7

// newlib calls these around everything that it does to the heap, operator new and delete included
// (its manual, "__malloc_lock"), and leaves it to a program to define them.
extern "C" {
void __malloc_lock(_reent* /*unused*/) { m7::heapCalls += m7::watching ? 1U : 0U; }
void __malloc_unlock(_reent* /*unused*/) {}
}
