/// Battery: the voltage behind a divider on an analog pin.
#include <unity.h>

#include <cmath>
#include <cstdint>

#include "RawSamples.h"
#include "suites.h"

#include <Arduino.h>

namespace {

double pinVolt = 0.0;
std::uint8_t pinRead = 0;
unsigned bits = 10;  // the core's own choice

}  // namespace

// The core's calls, as pjrc.com describes them; no other suite needs them.
inline void analogReadResolution(unsigned wanted) { bits = wanted; }
inline int analogRead(std::uint8_t pin) {
  strix::arduinoClock().advance(strix::nanosFromMicros(20));
  pinRead = pin;
  const double top = static_cast<double>(1U << bits) - 1.0;
  const double steps = std::floor(pinVolt / 3.3 * (top + 1.0));
  return static_cast<int>(std::fmin(std::fmax(steps, 0.0), top));
}

#include "../../src/board/Battery.h"

namespace {

using strix::Battery;
using strix::BatteryRaw;

constexpr std::uint8_t kPin = 41;
constexpr float kRatio = 11.0F;  // 100 kOhm over 10 kOhm

bool readAfter(Battery& battery, std::uint32_t ms, BatteryRaw& out) {
  strix::arduinoClock().advance(strix::nanosFromMicros(1000ULL * ms));
  return battery.read(out);
}

void test_the_battery_s_voltage_comes_through_the_divider() {
  (void)strix::powerUpTeensy();
  Battery battery(kPin, kRatio);
  battery.begin();
  for (const double volt : {9.9, 19.8, 25.2, 36.0}) {
    pinVolt = volt / static_cast<double>(kRatio);
    BatteryRaw out;
    TEST_ASSERT_TRUE(readAfter(battery, 101, out));
    TEST_ASSERT_EQUAL_UINT8(kPin, pinRead);
    TEST_ASSERT_FLOAT_WITHIN(3.3 * 11.0 / 4096.0, volt, out.voltage);  // a step of 12 bits
    TEST_ASSERT_EQUAL_FLOAT(0.0F, out.current);
  }
}

void test_it_is_read_ten_times_a_second() {
  (void)strix::powerUpTeensy();
  Battery battery(kPin, kRatio);
  battery.begin();
  pinVolt = 2.0;
  int readings = 0;
  BatteryRaw out;
  for (int i = 0; i < 1000; ++i) {
    if (readAfter(battery, 1, out)) ++readings;
  }
  TEST_ASSERT_INT_WITHIN(1, 10, readings);
}

void test_without_a_ratio_nothing_is_read() {
  (void)strix::powerUpTeensy();
  Battery battery(kPin, 0.0F);
  battery.begin();
  pinRead = 0;
  BatteryRaw out;
  TEST_ASSERT_FALSE(readAfter(battery, 200, out));
  TEST_ASSERT_EQUAL_UINT8(0, pinRead);
}

void test_a_pin_at_the_top_of_its_range_is_no_reading() {
  (void)strix::powerUpTeensy();
  Battery battery(kPin, kRatio);
  battery.begin();
  pinVolt = 3.4;  // the divider's lower resistor is off
  BatteryRaw out;
  TEST_ASSERT_FALSE(readAfter(battery, 200, out));
  TEST_ASSERT_EQUAL_UINT32(1, battery.clipped());
}

}  // namespace

void runBatteryPinTests() {
  RUN_TEST(test_the_battery_s_voltage_comes_through_the_divider);
  RUN_TEST(test_it_is_read_ten_times_a_second);
  RUN_TEST(test_without_a_ratio_nothing_is_read);
  RUN_TEST(test_a_pin_at_the_top_of_its_range_is_no_reading);
}
