// Time that wraps every 71.6 minutes, periodic tasks, the log clock and the state hash.
#include <unity.h>

#include <array>
#include <cstring>
#include <vector>

#include "Random.h"
#include "StateHash.h"
#include "Time.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr std::uint64_t kWrap = std::uint64_t{1} << 32U;
/// 10 s before micros() wraps.
constexpr auto kBeforeWrap = static_cast<Micros>(kWrap - 10'000'000U);

static_assert(elapsed(5U, 0xFFFFFFFBU) == 10U);
static_assert(periodFromHz(500) == 2000U);

/// Runs a task in a loop of fixed passes and counts how often it ran.
std::uint32_t runsOf(PeriodicTask& task, Micros start, Micros pass, std::uint64_t duration) {
  task.start(start);
  std::uint32_t runs = 0;
  for (std::uint64_t t = 0; t < duration; t += pass) {
    if (task.run(static_cast<Micros>(start + t))) ++runs;
  }
  return runs;
}

void test_a_duration_is_right_across_the_wrap() {
  Random random(30);
  for (int i = 0; i < 10000; ++i) {
    const Micros then = (random.bits() << 8U) ^ random.bits();
    const Micros duration = (random.bits() << 8U) ^ random.bits();
    TEST_ASSERT_EQUAL_UINT32(duration, elapsed(then + duration, then));
  }
  TEST_ASSERT_FLOAT_WITHIN(1e-9F, 0.002F, toSeconds(2000));
}

void test_a_loop_of_1400_us_runs_a_500_hz_task_500_times_a_second() {
  // With `last = now` it would be every second pass, 357 times a second.
  for (const Micros start : {Micros{0}, kBeforeWrap}) {
    PeriodicTask task(periodFromHz(500));
    TEST_ASSERT_EQUAL_UINT32(10000, runsOf(task, start, 1400, 20'000'000));
    TEST_ASSERT_EQUAL_UINT32(0, task.overruns());
  }
}

void test_any_loop_faster_than_the_task_keeps_its_rate() {
  Random random(31);
  for (int trial = 0; trial < 50; ++trial) {
    PeriodicTask task(2000);
    const Micros start = random.bits() << 8U;
    task.start(start);
    std::uint32_t runs = 0;
    std::uint64_t t = 0;
    while (t < 10'000'000) {
      if (task.run(static_cast<Micros>(start + t))) ++runs;
      t += 100 + random.below(1900);
    }
    TEST_ASSERT_EQUAL_UINT32(5000, runs);
    TEST_ASSERT_EQUAL_UINT32(0, task.overruns());
  }
}

void test_a_late_run_does_not_shift_the_next_one() {
  PeriodicTask task(1000);
  task.start(0);
  TEST_ASSERT_TRUE(task.run(0));
  TEST_ASSERT_TRUE(task.run(1900));  // 0.9 ms late
  TEST_ASSERT_FALSE(task.run(1999));
  TEST_ASSERT_TRUE(task.run(2000));
  TEST_ASSERT_EQUAL_UINT32(0, task.overruns());
}

void test_a_task_more_than_a_period_late_starts_anew_and_counts_it() {
  PeriodicTask task(1000);
  task.start(0);
  TEST_ASSERT_TRUE(task.run(0));
  TEST_ASSERT_TRUE(task.run(2000));  // exactly one period late is made up for
  TEST_ASSERT_EQUAL_UINT32(0, task.overruns());
  TEST_ASSERT_TRUE(task.run(2000));
  TEST_ASSERT_TRUE(task.run(4500));  // 1.5 periods late: no burst of runs follows
  TEST_ASSERT_EQUAL_UINT32(1, task.overruns());
  TEST_ASSERT_FALSE(task.run(4501));
  TEST_ASSERT_FALSE(task.run(5499));
  TEST_ASSERT_TRUE(task.run(5500));
  TEST_ASSERT_EQUAL_UINT32(1, task.overruns());
}

void test_a_loop_slower_than_the_task_runs_it_every_pass_and_counts_overruns() {
  PeriodicTask task(2000);
  TEST_ASSERT_EQUAL_UINT32(1000, runsOf(task, kBeforeWrap, 5000, 5'000'000));
  TEST_ASSERT_EQUAL_UINT32(999, task.overruns());
}

void test_a_task_is_due_at_its_start_and_a_postponed_one_a_period_later() {
  for (const Micros now : {Micros{0}, Micros{77}, Micros{0xFFFFFFFF}, kBeforeWrap}) {
    PeriodicTask task(1000);
    task.start(now);
    TEST_ASSERT_TRUE(task.due(now));
    task.postpone(now);
    TEST_ASSERT_FALSE(task.due(now));
    TEST_ASSERT_FALSE(task.due(now + 999));
    TEST_ASSERT_TRUE(task.due(now + 1000));
  }
}

void test_the_log_clock_runs_on_across_many_wraps() {
  Random random(32);
  LogClock clock;
  std::uint64_t now = 0;
  std::uint64_t last = 0;
  while (now < 20 * kWrap) {
    now += 1 + (random.bits() << 7U);  // up to 36 min
    const std::uint64_t time = clock.update(static_cast<Micros>(now));
    TEST_ASSERT_EQUAL_UINT64(now, time);
    TEST_ASSERT_TRUE(time > last);
    last = time;
  }
}

void test_a_stamp_is_dated_from_before_and_after_a_wrap() {
  Random random(33);
  LogClock clock;
  std::uint64_t now = 0;
  for (int i = 0; i < 10000; ++i) {
    now += 60'000'000;
    clock.update(static_cast<Micros>(now));
    const std::uint64_t ago = (random.bits() << 7U) % (now < kWrap / 2 ? now : kWrap / 2);
    TEST_ASSERT_EQUAL_UINT64(now - ago, clock.at(static_cast<Micros>(now - ago)));
    TEST_ASSERT_EQUAL_UINT64(now + ago, clock.at(static_cast<Micros>(now + ago)));
  }
}

void test_a_reading_older_than_the_clock_is_dated_zero() {
  // A delayed reading in the first milliseconds after power-up: not the year 586 000.
  LogClock clock;
  clock.update(500);
  TEST_ASSERT_EQUAL_UINT64(0, clock.at(static_cast<Micros>(500 - 2000)));
}

std::uint32_t hashOf(const std::array<float, 12>& values) {
  StateHash hash;
  for (const float value : values) hash.add(value);
  return hash.value();
}

void test_any_single_bit_of_the_state_changes_its_hash() {
  Random random(34);
  std::array<float, 12> values{};
  for (float& value : values) value = random.uniform(-100.0F, 100.0F);
  const std::uint32_t original = hashOf(values);
  for (float& value : values) {
    const float kept = value;
    for (std::uint32_t bit = 0; bit < 32; ++bit) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &kept, sizeof bits);
      bits ^= std::uint32_t{1} << bit;
      std::memcpy(&value, &bits, sizeof value);
      TEST_ASSERT_TRUE(hashOf(values) != original);
    }
    value = kept;
  }
  TEST_ASSERT_EQUAL_HEX32(original, hashOf(values));
}

void test_the_order_of_the_state_counts() {
  StateHash ab;
  ab.add(1.0F);
  ab.add(2.0F);
  StateHash ba;
  ba.add(2.0F);
  ba.add(1.0F);
  TEST_ASSERT_TRUE(ab.value() != ba.value());
}

void test_a_matrix_hashes_as_its_elements_and_a_vector_of_words_as_published() {
  StateHash vector;
  vector.add(Vector3f{1.0F, -2.0F, 0.5F});
  StateHash elements;
  for (const float value : {1.0F, -2.0F, 0.5F}) elements.add(value);
  TEST_ASSERT_EQUAL_HEX32(elements.value(), vector.value());
  TEST_ASSERT_EQUAL_HEX32(2166136261U, StateHash().value());  // FNV's offset basis
  StateHash one;
  one.add(std::uint32_t{'a'});
  TEST_ASSERT_EQUAL_HEX32(0xE40C292CU, one.value());  // FNV-1a of "a", from its authors' list
}

void test_every_nan_hashes_alike() {
  // Which of the 16 million NaNs comes out of inf - inf is the processor's choice: x86 sets the
  // sign, ARM does not.
  std::uint32_t expected = 0;
  for (const std::uint32_t bits : {0x7FC00000U, 0xFFC00000U, 0x7F800001U, 0xFFFFFFFFU}) {
    float nan = 0.0F;
    std::memcpy(&nan, &bits, sizeof nan);
    StateHash hash;
    hash.add(nan);
    if (expected == 0) expected = hash.value();
    TEST_ASSERT_EQUAL_HEX32(expected, hash.value());
  }
}

}  // namespace

void runTimeTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_duration_is_right_across_the_wrap);
  RUN_TEST(test_a_loop_of_1400_us_runs_a_500_hz_task_500_times_a_second);
  RUN_TEST(test_any_loop_faster_than_the_task_keeps_its_rate);
  RUN_TEST(test_a_late_run_does_not_shift_the_next_one);
  RUN_TEST(test_a_task_more_than_a_period_late_starts_anew_and_counts_it);
  RUN_TEST(test_a_loop_slower_than_the_task_runs_it_every_pass_and_counts_overruns);
  RUN_TEST(test_a_task_is_due_at_its_start_and_a_postponed_one_a_period_later);
  RUN_TEST(test_the_log_clock_runs_on_across_many_wraps);
  RUN_TEST(test_a_stamp_is_dated_from_before_and_after_a_wrap);
  RUN_TEST(test_a_reading_older_than_the_clock_is_dated_zero);
  RUN_TEST(test_any_single_bit_of_the_state_changes_its_hash);
  RUN_TEST(test_the_order_of_the_state_counts);
  RUN_TEST(test_a_matrix_hashes_as_its_elements_and_a_vector_of_words_as_published);
  RUN_TEST(test_every_nan_hashes_alike);
}
