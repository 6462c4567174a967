/// The one clock of the stand-ins: processor cycles, micros() and the bits on the wires.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <utility>

namespace strix {

/// Nanoseconds since power-up. Whatever takes time advances it; what is planned for the time that
/// passes is done on the way, interrupts included.
class FakeClock {
 public:
  using Nanos = std::uint64_t;

  [[nodiscard]] Nanos now() const { return now_; }

  void at(Nanos time, std::function<void()> action) { agenda_.emplace(time, std::move(action)); }
  void after(Nanos delay, std::function<void()> action) { at(now_ + delay, std::move(action)); }

  void advance(Nanos duration) {
    const Nanos end = now_ + duration;
    while (!agenda_.empty() && agenda_.begin()->first <= end) {
      if (agenda_.begin()->first > now_) now_ = agenda_.begin()->first;
      const std::function<void()> action = std::move(agenda_.begin()->second);
      agenda_.erase(agenda_.begin());
      action();
    }
    if (end > now_) now_ = end;
  }

  // What a call costs. The processor runs at 600 MHz; a peripheral's register is reached through
  // bridges at 150 MHz: some 10 of their clocks. Of no other effect than that waiting takes time.
  static constexpr Nanos kInstruction = 5;
  static constexpr Nanos kRegister = 70;

 private:
  Nanos now_ = 0;
  std::multimap<Nanos, std::function<void()>> agenda_;
};

constexpr FakeClock::Nanos nanosFromMicros(std::uint64_t us) { return us * 1000U; }

}  // namespace strix
