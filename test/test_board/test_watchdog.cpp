// The hardware watchdog on a model of its registers.
#include <unity.h>

#include <algorithm>

#include "../../src/board/Watchdog.h"
#include "suites.h"

using namespace strix;

namespace {

using Nanos = FakeClock::Nanos;

/// A chip as it leaves the boot ROM and the core's start-up with Faults.cpp's hook.
struct Bench {
  Bench() : teensy(powerUpTeensy()) { Watchdog::set(false); }

  FakeTeensy& teensy;
  Watchdog watchdog;
  Nanos longest = 0;  ///< that a feed() took

  void fly(std::uint32_t ms) {
    for (std::uint32_t i = 0; i < ms / 2; ++i) {
      const Nanos start = teensy.clock.now();
      watchdog.feed();
      longest = std::max(longest, teensy.clock.now() - start);
      delay(2);
    }
  }
};

void test_a_loop_that_stops_with_the_motors_on_is_reset_after_a_tenth_of_a_second() {
  Bench bench;
  bench.watchdog.run(true);
  bench.fly(5000);
  TEST_ASSERT_TRUE(bench.watchdog.obeys());
  bench.watchdog.feed();
  const Nanos fed = bench.teensy.clock.now();
  delay(99);
  TEST_ASSERT_EQUAL_UINT64(0, bench.teensy.watchdog.bitten());
  delay(2);
  // Two ticks of its clock: kTime is cut to whole ones.
  TEST_ASSERT_UINT64_WITHIN(2 * FakeWatchdog::kTick, fed + nanosFromMicros(Watchdog::kTime),
                            bench.teensy.watchdog.bitten());
}

void test_on_the_ground_nothing_is_reset_however_long_an_erasure_or_an_upload_takes() {
  Bench bench;
  delay(20'000);
  bench.watchdog.run(true);
  bench.fly(1000);
  bench.watchdog.run(false);
  delay(20'000);
  bench.fly(10);
  delay(20'000);
  TEST_ASSERT_EQUAL_UINT64(0, bench.teensy.watchdog.bitten());
  TEST_ASSERT_TRUE(bench.watchdog.obeys());
}

void test_it_survives_its_own_reset_and_is_off_before_it_can_bite_again() {
  Bench bench;
  bench.watchdog.run(true);
  bench.fly(100);
  delay(200);
  TEST_ASSERT_TRUE(bench.teensy.watchdog.bitten() != 0);
  bench.teensy.watchdog.restart();
  delay(10);  // boot ROM
  TEST_ASSERT_TRUE(bench.teensy.watchdog.running());
  // As startup_early_hook and startup_middle_hook do.
  CCM_CCGR5 |= CCM_CCGR5_WDOG3(CCM_CCGR_ON);
  WDOG3_CNT = Watchdog::kRefresh;
  delay(90);
  Watchdog::set(false);
  delay(8000);  // set-up
  TEST_ASSERT_EQUAL_UINT64(0, bench.teensy.watchdog.bitten());
  TEST_ASSERT_FALSE(bench.teensy.watchdog.running());
}

void test_it_is_set_once_and_feeding_costs_next_to_nothing() {
  Bench bench;
  delay(1);
  const unsigned before = bench.teensy.watchdog.settings;
  bench.watchdog.run(true);
  bench.fly(2000);
  bench.watchdog.run(true);
  bench.fly(2000);
  TEST_ASSERT_EQUAL_UINT32(1, bench.teensy.watchdog.settings - before);
  TEST_ASSERT_LESS_OR_EQUAL_UINT64(nanosFromMicros(1), bench.longest);
}

void test_one_that_lost_its_settings_is_set_again() {
  Bench bench;
  bench.watchdog.run(true);
  bench.fly(100);
  Watchdog::set(false);  // as a program gone wild may
  delay(1);
  TEST_ASSERT_FALSE(bench.watchdog.obeys());
  bench.fly(10);
  TEST_ASSERT_TRUE(bench.watchdog.obeys());
  delay(200);
  TEST_ASSERT_TRUE(bench.teensy.watchdog.bitten() != 0);
}

void test_one_that_does_not_answer_costs_a_bounded_time_and_is_known() {
  Bench bench;
  bench.teensy.watchdog.deaf = true;
  const Nanos start = bench.teensy.clock.now();
  bench.watchdog.run(true);
  TEST_ASSERT_LESS_OR_EQUAL_UINT64(nanosFromMicros(400), bench.teensy.clock.now() - start);
  bench.fly(1000);
  TEST_ASSERT_LESS_OR_EQUAL_UINT64(nanosFromMicros(400), bench.longest);
  TEST_ASSERT_FALSE(bench.watchdog.obeys());
  bench.longest = 0;
  bench.fly(1000);  // it is left alone by now
  TEST_ASSERT_LESS_OR_EQUAL_UINT64(nanosFromMicros(1), bench.longest);
}

}  // namespace

void runWatchdogTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_loop_that_stops_with_the_motors_on_is_reset_after_a_tenth_of_a_second);
  RUN_TEST(test_on_the_ground_nothing_is_reset_however_long_an_erasure_or_an_upload_takes);
  RUN_TEST(test_it_survives_its_own_reset_and_is_off_before_it_can_bite_again);
  RUN_TEST(test_it_is_set_once_and_feeding_costs_next_to_nothing);
  RUN_TEST(test_one_that_lost_its_settings_is_set_again);
  RUN_TEST(test_one_that_does_not_answer_costs_a_bounded_time_and_is_known);
}
