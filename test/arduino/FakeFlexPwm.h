/// The chip's pulse generators as the core's analogWrite drives them: eight counters of 16 bits,
/// and pins that are high while their counter is below a number.
///
/// Written from the "i.MX RT1060 Processor Reference Manual", chapter eFlexPWM, and the core's
/// behaviour: it halves the 150 MHz of the bus until a period fits the counter, and takes
/// (value * period) >> resolution for the number, both rounded down.
#pragma once

#include <cstdint>
#include <map>

namespace strix {

class FakeFlexPwm {
 public:
  static constexpr double kBusClock = 150e6;  ///< Hz

  unsigned resolution = 8;  ///< bits

  void setFrequency(std::uint8_t pin, float frequency) {
    Counter& counter = counters_[counterOf(pin)];
    counter.period = static_cast<std::uint32_t>(static_cast<float>(kBusClock) / frequency + 0.5F);
    counter.halvings = 0;
    while (counter.period > 65535 && counter.halvings < 7) {
      counter.period >>= 1U;
      ++counter.halvings;
    }
  }

  void write(std::uint8_t pin, int value) {
    const Counter& counter = counters_[counterOf(pin)];
    const auto kept = static_cast<std::uint16_t>(value);  // all that the core looks at
    std::uint32_t high = (kept * counter.period) >> resolution;
    if (high > counter.period - 1) high = counter.period - 1;
    high_[pin] = high;
    ++writes;
  }

  unsigned writes = 0;

  /// Whether the pin was ever given to its counter: until then it is an input.
  [[nodiscard]] bool pulsing(std::uint8_t pin) const { return high_.count(pin) != 0; }
  /// us that the pin is high in each period
  [[nodiscard]] double pulse(std::uint8_t pin) { return high_.at(pin) * tick(pin) * 1e6; }
  /// us from one pulse's start to the next
  [[nodiscard]] double period(std::uint8_t pin) {
    return counters_[counterOf(pin)].period * tick(pin) * 1e6;
  }
  /// s, one count
  [[nodiscard]] double tick(std::uint8_t pin) {
    return static_cast<double>(1U << counters_[counterOf(pin)].halvings) / kBusClock;
  }

 private:
  struct Counter {
    std::uint32_t period = 33465;  ///< counts, as the core starts it: 4.5 kHz
    unsigned halvings = 0;
  };

  /// Pins that share one (pjrc.com, "Teensy 4.1 pins": FlexPWM3.1 and 2.3). Others have no ESC.
  [[nodiscard]] static int counterOf(std::uint8_t pin) {
    if (pin == 28 || pin == 29) return 31;
    if (pin == 36 || pin == 37) return 23;
    return -pin;
  }

  std::map<int, Counter> counters_;
  std::map<std::uint8_t, std::uint32_t> high_;
};

/// A test sets it anew for a power-up.
inline FakeFlexPwm& flexPwm() {
  static FakeFlexPwm pwm;
  return pwm;
}

}  // namespace strix

inline void analogWriteResolution(unsigned bits) { strix::flexPwm().resolution = bits; }
inline void analogWriteFrequency(std::uint8_t pin, float frequency) {
  strix::flexPwm().setFrequency(pin, frequency);
}
inline void analogWrite(std::uint8_t pin, int value) { strix::flexPwm().write(pin, value); }
