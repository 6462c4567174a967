/// MagLis2mdl on a LIS2MDL of registers.
#include <unity.h>

#include "BoardRig.h"
#include "suites.h"

namespace {

using strix::BoardRig;
using strix::FakeLis2mdl;
using strix::I2cBus;
using strix::MagLis2mdl;
using strix::MagRaw;

void test_the_field_comes_in_the_axes_that_are_printed() {
  BoardRig rig;
  rig.magChip.field = {21.0, -3.0, 48.0};
  TEST_ASSERT_TRUE(rig.mag.begin());
  const BoardRig::Flight flight = rig.fly(100);
  // Two counts of noise and half of one for the rounding, 0.15 uT each.
  TEST_ASSERT_FLOAT_WITHIN(0.38F, 21.0F, flight.mag.field.x());
  TEST_ASSERT_FLOAT_WITHIN(0.38F, -3.0F, flight.mag.field.y());
  TEST_ASSERT_FLOAT_WITHIN(0.38F, 48.0F, flight.mag.field.z());
}

void test_every_measurement_is_handed_out_once() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.mag.begin());
  (void)rig.fly(20);
  const std::uint64_t before = rig.magChip.measured();
  const BoardRig::Flight flight = rig.fly(2000);
  TEST_ASSERT_UINT32_WITHIN(1, static_cast<std::uint32_t>(rig.magChip.measured() - before),
                            flight.mags);
  TEST_ASSERT_UINT32_WITHIN(1, 2'000'000 / MagLis2mdl::kPeriod, flight.mags);
}

void test_a_reading_is_stamped_within_2_ms() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.mag.begin());
  for (int i = 0; i < 50; ++i) {
    const std::uint64_t before = rig.magChip.measured();
    while (rig.magChip.measured() == before) rig.teensy.clock.advance(1000);
    const std::uint32_t measured = micros();
    MagRaw out;
    while (!rig.mag.read(out)) rig.teensy.clock.advance(300'000);
    // kPollPeriod, 0.3 ms between the passes of this loop, and a burst that came just too early.
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(2600, out.sampled - measured);
  }
}

void test_a_call_stays_within_its_stated_bound() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.mag.begin());
  const BoardRig::Flight flight = rig.fly(500);
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(I2cBus::transferBound(10), flight.longestMag);
  TEST_ASSERT_UINT32_WITHIN(10, 240, flight.longestMag);  // what the header says it takes
}

void test_begin_takes_0_21_s_and_leaves_the_bus_fast() {
  BoardRig rig;
  bool begun = false;
  const std::uint32_t took = rig.duration([&] { begun = rig.mag.begin(); });
  TEST_ASSERT_TRUE(begun);
  TEST_ASSERT_UINT32_WITHIN(5000, 208'000, took);
  std::uint8_t byte = 0;
  TEST_ASSERT_LESS_THAN_UINT32(110, rig.duration([&] {
    TEST_ASSERT_TRUE(rig.slowBus.read(FakeLis2mdl::kAddress, FakeLis2mdl::kWhoAmI, &byte, 1));
  }));
}

void test_without_the_device_begin_is_over_at_once() {
  BoardRig rig;
  rig.magPlug.unplug();
  bool begun = true;
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(200, rig.duration([&] { begun = rig.mag.begin(); }));
  TEST_ASSERT_FALSE(begun);
}

// The identity is asked for on I2cBus: Wire, with its waiting, comes only to a sensor that answers.
void test_on_a_held_bus_begin_is_over_at_once() {
  BoardRig rig;
  rig.shortSda(rig.slowWire(), true);
  bool begun = true;
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(I2cBus::transferBound(4) + I2cBus::kFailureBound,
                                   rig.duration([&] { begun = rig.mag.begin(); }));
  TEST_ASSERT_FALSE(begun);
}

void test_another_device_at_its_address_is_not_taken_for_it() {
  BoardRig rig;
  rig.magChip.identity = 0x3D;  // an LIS3MDL
  TEST_ASSERT_FALSE(rig.mag.begin());
}

void test_a_setting_that_is_not_taken_is_noticed() {
  for (const std::uint8_t reg : {FakeLis2mdl::kConfigA, FakeLis2mdl::kConfigC}) {
    BoardRig rig;
    rig.magChip.deaf = reg;
    TEST_ASSERT_FALSE(rig.mag.begin());
    TEST_ASSERT_EQUAL_UINT32(0, rig.fly(200).mags);  // its rate or its scale may be another
  }
}

// What MagLis2mdl::begin states: 21 phases of 17 + 51 ms and 0.2 s of fixed waits.
constexpr std::uint32_t kBeginBound = 1'700'000;

void test_begin_ends_in_time_whenever_the_device_dies() {
  for (std::uint32_t after = 1; after < 30; ++after) {
    BoardRig rig;
    rig.magPlug.diesAfter = after;
    bool begun = true;
    const std::uint32_t took = rig.duration([&] { begun = rig.mag.begin(); });
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(kBeginBound, took);
    // 20 transfers in Wire and 6 of ours address it; with fewer it cannot have been set up.
    if (after < 20) TEST_ASSERT_FALSE(begun);
  }
}

void test_begin_ends_in_time_with_the_bus_held_from_any_moment() {
  std::uint32_t longest = 0;
  for (const bool sda : {true, false}) {
    for (std::uint32_t at = 50; at < 200'000; at += at < 1200 ? 90 : 17'000) {
      BoardRig rig;
      rig.teensy.clock.after(strix::nanosFromMicros(at), [&] {
        sda ? rig.shortSda(rig.slowWire(), true) : rig.shortScl(rig.slowWire(), true);
      });
      bool begun = true;
      const std::uint32_t took = rig.duration([&] { begun = rig.mag.begin(); });
      TEST_ASSERT_FALSE(begun);
      TEST_ASSERT_LESS_OR_EQUAL_UINT32(kBeginBound, took);
      if (took > longest) longest = took;
    }
  }
  TEST_ASSERT_GREATER_THAN_UINT32(400'000, longest);  // or Wire's waiting was not there
}

/// Holds SDA for `low` and lets it go for `high`, for ever: phases that begin and do not end.
void flutter(BoardRig& rig, std::uint32_t low_us, std::uint32_t high_us) {
  rig.shortSda(rig.slowWire(), !rig.slowWire().sdaShorted);
  const bool isLow = rig.slowWire().sdaShorted;
  rig.teensy.clock.after(strix::nanosFromMicros(isLow ? low_us : high_us),
                         [&rig, low_us, high_us] { flutter(rig, low_us, high_us); });
}

void test_begin_ends_in_time_with_a_line_that_flutters() {
  for (const std::uint32_t low_us : {1000U, 16'000U, 66'500U}) {
    for (const std::uint32_t high_us : {60U, 300U, 2000U}) {
      BoardRig rig;
      rig.teensy.clock.after(strix::nanosFromMicros(700), [&] { flutter(rig, low_us, high_us); });
      const std::uint32_t took = rig.duration([&] { (void)rig.mag.begin(); });
      TEST_ASSERT_LESS_OR_EQUAL_UINT32(kBeginBound, took);
    }
  }
}

void test_a_magnet_beside_it_is_no_reading() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.mag.begin());
  rig.magChip.field = {60.0, 5000.0, 0.0};  // beyond the range: the sensor says 4915 uT
  const BoardRig::Flight flight = rig.fly(200);
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(1, flight.mags);  // one was measured before
  TEST_ASSERT_UINT32_WITHIN(2, 19, rig.mag.implausible());
}

void test_a_sensor_that_repeats_itself_is_stuck() {
  BoardRig rig;
  TEST_ASSERT_TRUE(rig.mag.begin());
  (void)rig.fly(100);
  TEST_ASSERT_EQUAL_UINT32(0, rig.mag.stuck());
  rig.magChip.frozen = true;
  const BoardRig::Flight flight = rig.fly(1000);
  TEST_ASSERT_UINT32_WITHIN(1, 10, flight.mags);
  // 100 less those ten; of one that ends behind the status byte nothing is seen when it is the
  // same.
  TEST_ASSERT_UINT32_WITHIN(15, 80, rig.mag.stuck());
  rig.magChip.frozen = false;
  TEST_ASSERT_UINT32_WITHIN(1, 10, rig.fly(100).mags);
}

}  // namespace

void runMagTests() {
  RUN_TEST(test_the_field_comes_in_the_axes_that_are_printed);
  RUN_TEST(test_every_measurement_is_handed_out_once);
  RUN_TEST(test_a_reading_is_stamped_within_2_ms);
  RUN_TEST(test_a_call_stays_within_its_stated_bound);
  RUN_TEST(test_begin_takes_0_21_s_and_leaves_the_bus_fast);
  RUN_TEST(test_without_the_device_begin_is_over_at_once);
  RUN_TEST(test_on_a_held_bus_begin_is_over_at_once);
  RUN_TEST(test_another_device_at_its_address_is_not_taken_for_it);
  RUN_TEST(test_a_setting_that_is_not_taken_is_noticed);
  RUN_TEST(test_begin_ends_in_time_whenever_the_device_dies);
  RUN_TEST(test_begin_ends_in_time_with_the_bus_held_from_any_moment);
  RUN_TEST(test_begin_ends_in_time_with_a_line_that_flutters);
  RUN_TEST(test_a_magnet_beside_it_is_no_reading);
  RUN_TEST(test_a_sensor_that_repeats_itself_is_stuck);
}
