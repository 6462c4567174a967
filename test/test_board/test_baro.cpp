/// BaroBmp390 on a BMP390 of registers.
#include <unity.h>

#include "BoardRig.h"
#include "suites.h"

namespace {

using strix::BaroBmp390;
using strix::BoardRig;
using strix::FakeBmp390;
using strix::I2cBus;

void test_pressure_and_temperature_are_what_the_air_has() {
  for (const double pressure : {31'000.0, 70'000.0, 101'325.0, 124'000.0}) {
    for (const double temperature : {-39.0, 0.0, 25.0, 84.0}) {
      BoardRig rig;
      rig.baroChip.pressure = pressure;
      rig.baroChip.temperature = temperature;
      TEST_ASSERT_TRUE(rig.baro.begin());
      const BoardRig::Flight flight = rig.fly(110);  // a conversion ends after 19 ms
      TEST_ASSERT_EQUAL_UINT32(5, flight.alts);
      // 30 counts of noise of 0.016 Pa; the float has 0.008 Pa at 1e5.
      TEST_ASSERT_FLOAT_WITHIN(0.6F, static_cast<float>(pressure), flight.alt.pressure);
      TEST_ASSERT_FLOAT_WITHIN(0.001F, static_cast<float>(temperature), flight.alt.temperature);
    }
  }
}

void test_every_conversion_is_handed_out_once() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.baro.begin());
  (void)rig.fly(40);
  const std::uint64_t before = rig.baroChip.measured();
  const BoardRig::Flight flight = rig.fly(2000);
  TEST_ASSERT_UINT32_WITHIN(1, static_cast<std::uint32_t>(rig.baroChip.measured() - before),
                            flight.alts);
  TEST_ASSERT_UINT32_WITHIN(1, 2'000'000 / BaroBmp390::kPeriod, flight.alts);
}

void test_a_call_stays_within_its_stated_bound() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.baro.begin());
  const BoardRig::Flight flight = rig.fly(500);
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(I2cBus::transferBound(4) + I2cBus::transferBound(9),
                                   flight.longestAlt);
  TEST_ASSERT_UINT32_WITHIN(10, 310, flight.longestAlt);  // what the header says it takes
}

void test_a_conversion_fits_into_its_period() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.baro.begin());
  TEST_ASSERT_EQUAL_UINT64(BaroBmp390::kPeriod, rig.baroChip.period() / 1000);
  TEST_ASSERT_TRUE(rig.baroChip.conversionTime() < rig.baroChip.period());
}

// What BaroBmp390::begin states.
constexpr std::uint32_t kBeginBound = 40'000;

void test_begin_stays_within_40_ms_whenever_the_device_dies() {
  for (std::uint32_t after = 0; after < 60; ++after) {
    BoardRig rig;
    rig.baroPlug.diesAfter = after;
    bool begun = true;
    const std::uint32_t took = rig.duration([&] { begun = rig.baro.begin(); });
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(kBeginBound, took);
    if (begun) {
      TEST_ASSERT_GREATER_THAN_UINT32(20, after);
      return;
    }
  }
  TEST_FAIL_MESSAGE("never began");
}

void test_begin_stays_within_40_ms_with_the_bus_held_from_any_moment() {
  for (const bool sda : {true, false}) {
    for (std::uint32_t at = 0; at < 10'000; at += 230) {
      BoardRig rig;
      rig.teensy.clock.after(strix::nanosFromMicros(at), [&] {
        sda ? rig.shortSda(rig.slowWire(), true) : rig.shortScl(rig.slowWire(), true);
      });
      const std::uint32_t took = rig.duration([&] { (void)rig.baro.begin(); });
      TEST_ASSERT_LESS_OR_EQUAL_UINT32(kBeginBound, took);
    }
  }
}

void test_another_device_at_its_address_is_not_taken_for_it() {
  BoardRig rig;
  rig.baroChip.identity = 0x58;  // a BMP280
  TEST_ASSERT_FALSE(rig.baro.begin());
}

void test_a_setting_that_is_not_taken_is_noticed() {
  // The filter's register has no place here: the value wanted is that of a power-up.
  for (const std::uint8_t reg :
       {FakeBmp390::kPower, FakeBmp390::kOversampling, FakeBmp390::kDataRate}) {
    BoardRig rig;
    rig.baroChip.deaf = reg;
    TEST_ASSERT_FALSE(rig.baro.begin());
  }
}

void test_a_coefficient_damaged_on_the_bus_is_noticed() {
  BoardRig rig;
  rig.baroChip.flipsCoefficient = true;
  TEST_ASSERT_FALSE(rig.baro.begin());
  TEST_ASSERT_EQUAL_UINT32(0, rig.fly(500).alts);  // it would be pressure of another sensor
  TEST_ASSERT_TRUE(rig.baro.begin());
}

void test_what_the_sensor_cannot_measure_is_no_reading() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.baro.begin());
  rig.baroChip.pressure = 20'000.0;
  TEST_ASSERT_EQUAL_UINT32(0, rig.fly(200).alts);
  TEST_ASSERT_UINT32_WITHIN(1, 10, rig.baro.implausible());
  rig.baroChip.pressure = 101'325.0;
  rig.baroChip.temperature = 95.0;
  TEST_ASSERT_EQUAL_UINT32(0, rig.fly(200).alts);
  TEST_ASSERT_UINT32_WITHIN(2, 20, rig.baro.implausible());
}

void test_a_sensor_that_repeats_itself_is_stuck() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.baro.begin());
  TEST_ASSERT_UINT32_WITHIN(1, 50, rig.fly(1000).alts);
  TEST_ASSERT_EQUAL_UINT32(0, rig.baro.stuck());
  rig.baroChip.frozen = true;
  TEST_ASSERT_UINT32_WITHIN(1, 10, rig.fly(1000).alts);
  TEST_ASSERT_UINT32_WITHIN(1, 40, rig.baro.stuck());
}

}  // namespace

void runBaroTests() {
  RUN_TEST(test_pressure_and_temperature_are_what_the_air_has);
  RUN_TEST(test_every_conversion_is_handed_out_once);
  RUN_TEST(test_a_call_stays_within_its_stated_bound);
  RUN_TEST(test_a_conversion_fits_into_its_period);
  RUN_TEST(test_begin_stays_within_40_ms_whenever_the_device_dies);
  RUN_TEST(test_begin_stays_within_40_ms_with_the_bus_held_from_any_moment);
  RUN_TEST(test_another_device_at_its_address_is_not_taken_for_it);
  RUN_TEST(test_a_setting_that_is_not_taken_is_noticed);
  RUN_TEST(test_a_coefficient_damaged_on_the_bus_is_noticed);
  RUN_TEST(test_what_the_sensor_cannot_measure_is_no_reading);
  RUN_TEST(test_a_sensor_that_repeats_itself_is_stuck);
}
