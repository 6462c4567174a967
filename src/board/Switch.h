/// One of the pilot's switches.
#pragma once

#include <cstdint>

#include "Time.h"

#include <Arduino.h>

namespace strix {

/// An input with pull-up that follows its pin once that has kept its level for kSettled: a spike
/// from the motors' wires is no switch. This adds 1 ms to the way of a disarm.
class Switch {
 public:
  static constexpr Micros kSettled = 1000;

  /// @param onWhenOpen  what an open contact, or a broken wire, means
  constexpr Switch(std::uint8_t pin, bool onWhenOpen)
      : pin_(pin), onWhenOpen_(onWhenOpen), on_(onWhenOpen) {}

  void begin() {
    pinMode(pin_, INPUT_PULLUP);
    since_ = ::micros();
  }

  /// Bound: 1 us.
  [[nodiscard]] bool read(Micros now) {
    const bool open = digitalRead(pin_) != LOW;
    const bool on = open == onWhenOpen_;
    if (on == on_) {
      since_ = now;
    } else if (elapsed(now, since_) >= kSettled) {
      on_ = on;
      since_ = now;
    }
    return on_;
  }

 private:
  std::uint8_t pin_;
  bool onWhenOpen_;
  bool on_;
  Micros since_ = 0;  ///< when the pin last agreed with on_
};

}  // namespace strix
