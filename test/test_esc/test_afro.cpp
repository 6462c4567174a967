/// AfroEsc on an ESC of registers.
#include <AfroEsc.h>
#include <unity.h>

#include <cmath>
#include <cstdint>

#include "FakeAfroEsc.h"
#include "FakeClock.h"
#include "suites.h"

namespace {

using namespace strix;
using afro::Answer;
using afro::Status;

/// One chip, its transfers at once.
class Wire {
 public:
  explicit Wire(FakeAfroEsc& chip) : chip_(chip) {}

  bool plugged = true;
  std::size_t diesAt = 99;  ///< byte of a reading at which the bus fails

  bool read(std::uint8_t reg, std::uint8_t* data, std::size_t count) {
    if (!plugged) return false;
    for (std::size_t i = 0; i < count; ++i) {
      if (i == diesAt) return false;
      data[i] = chip_.readRegister(static_cast<std::uint8_t>(reg + i));
    }
    return true;
  }
  bool write(std::uint8_t reg, const std::uint8_t* data, std::size_t count) {
    if (!plugged) return false;
    for (std::size_t i = 0; i < count; ++i) {
      chip_.writeRegister(static_cast<std::uint8_t>(reg + i), data[i]);
    }
    return true;
  }

 private:
  FakeAfroEsc& chip_;
};

struct Bench {
  FakeClock clock;
  FakeAfroEsc chip{clock};
  Wire wire{chip};
  AfroEsc<Wire> esc{wire, 7};
  Status status;

  [[nodiscard]] Micros now() const { return static_cast<Micros>(clock.now() / 1000U); }
  Answer read() { return esc.read(now(), status); }
  Answer readAfter(std::uint32_t ms) {
    clock.advance(nanosFromMicros(1000ULL * ms));
    return read();
  }
};

void test_the_throttle_arrives_with_its_sign_and_both_bytes() {
  Bench bench;
  TEST_ASSERT_TRUE(bench.esc.write(0));
  for (const int throttle : {1, 255, 256, 0x1234, 32767, -1, -300, -32767}) {
    TEST_ASSERT_TRUE(bench.esc.write(static_cast<std::int16_t>(throttle)));
    TEST_ASSERT_EQUAL_INT(throttle, bench.chip.driven());
  }
  TEST_ASSERT_TRUE(bench.esc.write(-32768));  // its opposite does not fit 16 bits
  TEST_ASSERT_EQUAL_INT(-32767, bench.chip.driven());
}

void test_no_command_of_a_vehicle_turns_a_propeller_backwards() {
  TEST_ASSERT_EQUAL_INT16(0, afro::throttleOf(-1.0F));
  TEST_ASSERT_EQUAL_INT16(0, afro::throttleOf(-9675.0F));  // 57 w - 9675 at rest
  TEST_ASSERT_EQUAL_INT16(0, afro::throttleOf(kNaN));
  TEST_ASSERT_EQUAL_INT16(0, afro::throttleOf(1e9F));
  TEST_ASSERT_EQUAL_INT16(0, afro::throttleOf(INFINITY));
  TEST_ASSERT_EQUAL_INT16(0, afro::throttleOf(-INFINITY));
  TEST_ASSERT_EQUAL_INT16(1725, afro::throttleOf(57.0F * 200.0F - 9675.0F));
  TEST_ASSERT_EQUAL_INT16(32767, afro::throttleOf(32767.0F));
  TEST_ASSERT_EQUAL_INT16(32767, afro::throttleOf(33000.0F));
}

void test_what_the_esc_measures_comes_back_in_si() {
  Bench bench;
  for (const double volt : {6.6, 11.4, 16.8, 25.2}) {
    for (const double celsius : {-10.0, 25.0, 60.0, 110.0}) {
      bench.chip.batteryVoltage = volt;
      bench.chip.celsius = celsius;
      bench.chip.amperes = volt - 8.0;
      TEST_ASSERT_TRUE(bench.read() == Answer::Good);
      // A step of the ESC's ten bits: 31 mV, and the published 6.45 for 6.4545.
      TEST_ASSERT_FLOAT_WITHIN(0.032 + 0.0008 * volt, volt, bench.status.voltage);
      // A step is 0.1 K at 25 degC, where the divider is near its middle, and 1 K at the ends.
      TEST_ASSERT_FLOAT_WITHIN(1.0, celsius, bench.status.temperature);
      TEST_ASSERT_FLOAT_WITHIN(0.073, bench.chip.amperes, bench.status.current);  // a step
    }
  }
}

void test_the_thermistor_formula_is_the_published_one() {
  // bluerobotics/Arduino_I2C_ESC, in double precision, over all words that are a temperature.
  for (std::uint32_t word = 64; word < 0xFFC0; word += 64) {
    const double ohm = 3300.0 / (65535.0 / word - 1.0);
    const double celsius = 1.0 / (std::log(ohm / 1e4) / 3900.0 + 1.0 / 298.15) - 273.15;
    // 300 K in float32 is 3e-5 K a bit; a few of them.
    TEST_ASSERT_FLOAT_WITHIN(1e-6 * (celsius + 273.15) + 1e-4, celsius,
                             afro::temperatureOf(static_cast<std::uint16_t>(word)));
  }
}

void test_what_is_not_measured_is_not_a_number() {
  Bench bench;
  bench.chip.hasCurrentSensor = false;
  TEST_ASSERT_TRUE(bench.read() == Answer::Good);
  TEST_ASSERT_FLOAT_IS_NAN(bench.status.current);
  TEST_ASSERT_FLOAT_IS_NOT_NAN(bench.status.voltage);
  for (const double celsius : {-200.0, 2000.0}) {  // a thermistor that is torn off, or shorted
    bench.chip.celsius = celsius;
    TEST_ASSERT_TRUE(bench.read() == Answer::Good);
    TEST_ASSERT_FLOAT_IS_NAN(bench.status.temperature);
  }
}

void test_revolutions_are_the_mean_since_the_last_reading() {
  Bench bench;
  bench.chip.turn(80.0);
  TEST_ASSERT_TRUE(bench.read() == Answer::Good);
  TEST_ASSERT_FLOAT_IS_NAN(bench.status.revolutions);  // since when, nobody knows
  // One turn of the field more or less in 0.2 s with 7 pole pairs.
  constexpr double kStep = 1.0 / (7.0 * 0.2);
  for (const double speed : {80.0, 0.0, 113.0, 31.8}) {
    bench.chip.turn(speed);
    TEST_ASSERT_TRUE(bench.readAfter(200) == Answer::Good);
    TEST_ASSERT_FLOAT_WITHIN(kStep, speed, bench.status.revolutions);
  }
  bench.chip.turn(50.0);  // half the time 50, half 100
  bench.clock.advance(nanosFromMicros(100'000));
  bench.chip.turn(100.0);
  TEST_ASSERT_TRUE(bench.readAfter(100) == Answer::Good);
  TEST_ASSERT_FLOAT_WITHIN(kStep, 75.0, bench.status.revolutions);
}

void test_a_slow_reader_gets_no_wrapped_count() {
  Bench bench;
  bench.chip.turn(300.0);  // 2100 turns of the field a second: 16 bits last 31 s
  (void)bench.read();
  TEST_ASSERT_TRUE(bench.readAfter(12'000) == Answer::Good);
  TEST_ASSERT_FLOAT_WITHIN(0.1, 300.0, bench.status.revolutions);
  TEST_ASSERT_TRUE(bench.readAfter(35'000) == Answer::Good);
  TEST_ASSERT_FLOAT_IS_NAN(bench.status.revolutions);
  TEST_ASSERT_TRUE(bench.readAfter(200) == Answer::Good);
  TEST_ASSERT_FLOAT_WITHIN(0.8, 300.0, bench.status.revolutions);
}

void test_the_loop_clock_may_wrap_between_two_readings() {
  Bench bench;
  bench.clock.advance(nanosFromMicros(0xFFFFFFFFULL - 100'000U));
  bench.chip.turn(90.0);
  (void)bench.read();
  TEST_ASSERT_TRUE(bench.readAfter(200) == Answer::Good);
  TEST_ASSERT_LESS_THAN_UINT32(100'000, bench.now());
  TEST_ASSERT_FLOAT_WITHIN(0.8, 90.0, bench.status.revolutions);
}

// The ESC clears its counter with the first byte of a reading: one that breaks off has lost the
// count, and the next one covers less time than it seems.
void test_behind_a_failed_reading_no_revolutions_are_told() {
  for (const std::size_t byte : {0U, 1U, 4U, 8U}) {
    Bench bench;
    bench.chip.turn(100.0);
    (void)bench.read();
    bench.wire.diesAt = byte;
    TEST_ASSERT_TRUE(bench.readAfter(200) == Answer::Silent);
    TEST_ASSERT_FLOAT_IS_NAN(bench.status.voltage);
    bench.wire.diesAt = 99;
    TEST_ASSERT_TRUE(bench.readAfter(200) == Answer::Good);
    TEST_ASSERT_FLOAT_IS_NAN(bench.status.revolutions);
    TEST_ASSERT_TRUE(bench.readAfter(200) == Answer::Good);
    TEST_ASSERT_FLOAT_WITHIN(0.8, 100.0, bench.status.revolutions);
    TEST_ASSERT_EQUAL_UINT32(1, bench.esc.faults().failedReads);
  }
}

void test_counts_that_no_motor_makes_are_refused() {
  Bench bench;
  (void)bench.read();
  bench.chip.turn(5208.0 / 7.0 * 1.1);  // 10 % faster than the firmware commutates
  TEST_ASSERT_TRUE(bench.readAfter(200) == Answer::Good);
  TEST_ASSERT_FLOAT_IS_NAN(bench.status.revolutions);
  TEST_ASSERT_EQUAL_UINT32(1, bench.esc.faults().implausible);
  bench.chip.turn(5208.0 / 7.0 * 0.99);
  TEST_ASSERT_TRUE(bench.readAfter(200) == Answer::Good);
  TEST_ASSERT_FLOAT_WITHIN(0.8, 5208.0 / 7.0 * 0.99, bench.status.revolutions);
}

void test_a_missing_and_a_wrong_device_are_told_apart() {
  Bench bench;
  TEST_ASSERT_TRUE(bench.esc.identify() == Answer::Good);
  bench.chip.identity = 0xFF;
  TEST_ASSERT_TRUE(bench.esc.identify() == Answer::WrongIdentity);
  TEST_ASSERT_TRUE(bench.read() == Answer::WrongIdentity);
  TEST_ASSERT_FLOAT_IS_NAN(bench.status.voltage);
  bench.wire.plugged = false;
  TEST_ASSERT_TRUE(bench.esc.identify() == Answer::Silent);
  TEST_ASSERT_TRUE(bench.read() == Answer::Silent);
  TEST_ASSERT_FALSE(bench.esc.write(1000));
  const afro::Faults& faults = bench.esc.faults();
  TEST_ASSERT_EQUAL_UINT32(2, faults.wrongIdentity);
  TEST_ASSERT_EQUAL_UINT32(2, faults.failedReads);
  TEST_ASSERT_EQUAL_UINT32(1, faults.failedWrites);
}

}  // namespace

void runAfroTests() {
  RUN_TEST(test_the_throttle_arrives_with_its_sign_and_both_bytes);
  RUN_TEST(test_no_command_of_a_vehicle_turns_a_propeller_backwards);
  RUN_TEST(test_what_the_esc_measures_comes_back_in_si);
  RUN_TEST(test_the_thermistor_formula_is_the_published_one);
  RUN_TEST(test_what_is_not_measured_is_not_a_number);
  RUN_TEST(test_revolutions_are_the_mean_since_the_last_reading);
  RUN_TEST(test_a_slow_reader_gets_no_wrapped_count);
  RUN_TEST(test_the_loop_clock_may_wrap_between_two_readings);
  RUN_TEST(test_behind_a_failed_reading_no_revolutions_are_told);
  RUN_TEST(test_counts_that_no_motor_makes_are_refused);
  RUN_TEST(test_a_missing_and_a_wrong_device_are_told_apart);
}
