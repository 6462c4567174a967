/// The battery's voltage by a divider on an analog pin.
#pragma once

#include <cstdint>

#include "RawSamples.h"
#include "Time.h"

#include <Arduino.h>

namespace strix {

class Battery {
 public:
  static constexpr Micros kPeriod = 100'000;  ///< between two readings
  static constexpr std::uint8_t kBits = 12;
  static constexpr int kFullScale = (1 << kBits) - 1;
  static constexpr float kReference = 3.3F;  ///< V, the Teensy's supply

  /// @param ratio  of the battery's voltage to the pin's, (R1 + R2) / R2; 0: there is no divider
  constexpr Battery(std::uint8_t pin, float ratio) : pin_(pin), ratio_(ratio) {}

  void begin() {
    if (fitted()) analogReadResolution(kBits);
  }

  [[nodiscard]] constexpr bool fitted() const { return ratio_ > 0.0F; }

  /// True ten times a second. Bound: 20 us, four conversions of 49 clocks at 10 MHz at least (the
  /// core's analogRead with its own averaging; i.MX RT1060 manual, "ADC conversion time").
  [[nodiscard]] bool read(BatteryRaw& out) {
    if (!fitted()) return false;
    const Micros now = ::micros();
    if (elapsed(now, last_) < kPeriod) return false;
    last_ = now;
    const int counts = analogRead(pin_);
    if (counts >= kFullScale) {  // above the range: the divider is wrong, or its lower half is off
      ++clipped_;
      return false;
    }
    out.sampled = now;
    out.voltage = static_cast<float>(counts) * (kReference * ratio_ / static_cast<float>(kSteps));
    out.current = 0.0F;
    return true;
  }

  /// Readings at the top of the range, which tell nothing.
  [[nodiscard]] std::uint32_t clipped() const { return clipped_; }

 private:
  static constexpr int kSteps = 1 << kBits;

  std::uint8_t pin_;
  float ratio_;
  Micros last_ = 0;
  std::uint32_t clipped_ = 0;
};

}  // namespace strix
