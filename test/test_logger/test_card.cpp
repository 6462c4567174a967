// The log and a card that is slow, stalls, fails or never answers.
#include <unity.h>

#include <random>

#include "LogFlight.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr std::size_t kImuRing = std::tuple_element_t<0, LogStreams>::kRecords;

LogFlight flight;

void test_a_busy_card_is_left_alone_and_a_pass_costs_at_most_one_access() {
  std::mt19937 random(3);
  flight.begin(1000);
  flight.card.busyTime = [&] { return random() % 20 == 0 ? random() % 60000 : random() % 3000; };
  for (int i = 0; i < 10000; ++i) {
    const std::uint32_t before = flight.card.accesses;
    flight.pass();
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(before + 1, flight.card.accesses);
  }
  TEST_ASSERT_GREATER_THAN_UINT32(1000, flight.card.fullSectorWrites);
  TEST_ASSERT_TRUE(flight.finish(60'000'000));
  TEST_ASSERT_EQUAL_UINT32(0, flight.card.accessesWhileBusy);
  flight.assertNothingIsMissing(flight.readDurable());
}

void test_a_quick_card_loses_nothing_and_is_used_twenty_times_a_second() {
  flight.begin(1000);
  std::uint32_t bursts = 0;
  bool idle = true;
  for (int i = 0; i < 10000; ++i) {
    const std::uint32_t before = flight.card.fullSectorWrites;
    flight.pass();
    const bool wrote = flight.card.fullSectorWrites != before;
    if (wrote && idle) ++bursts;
    idle = !wrote;
  }
  TEST_ASSERT_UINT32_WITHIN(25, 200, bursts);  // a sync may split a burst in two
  TEST_ASSERT_UINT32_WITHIN(1, 20, flight.card.syncs);
  TEST_ASSERT_UINT32_WITHIN(1, 20, flight.readDurable().of("log_status").size());
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  TEST_ASSERT_EQUAL_UINT32(0, flight.logger.dropped());
  flight.assertNothingIsMissing(flight.readDurable());
}

void test_a_stall_of_nearly_two_seconds_loses_nothing() {
  flight.begin(1000);
  for (int i = 0; i < 1049; ++i) flight.pass();
  flight.card.stallUntil(flight.now + 1'900'000);  // 50 ms of data may wait in the rings already
  for (int i = 0; i < 4000; ++i) flight.pass();
  TEST_ASSERT_TRUE(flight.finish(2'000'000));
  TEST_ASSERT_EQUAL_UINT32(0, flight.logger.dropped());
  TEST_ASSERT_UINT32_WITHIN(100'000, 1'850'000, flight.logger.status(0).longest_stall_us);
  flight.assertNothingIsMissing(flight.readDurable());
}

void test_a_stall_of_four_seconds_drops_what_does_not_fit_and_says_how_much() {
  flight.begin(1000);
  for (int i = 0; i < 1000; ++i) flight.pass();
  flight.card.stallUntil(flight.now + 4'000'000);
  for (int i = 0; i < 6000; ++i) flight.pass();
  TEST_ASSERT_TRUE(flight.finish(2'000'000));
  const ULogFile file = flight.readDurable();
  flight.assertNothingIsMissing(file);
  // 4 s at 1000 Hz into a ring of 2250; what came in while the others were written adds nothing.
  TEST_ASSERT_UINT32_WITHIN(60, 4000 - kImuRing, flight.logger.status(0).dropped_by_id[0]);
  const auto statuses = file.of("log_status");
  TEST_ASSERT_EQUAL_UINT32(flight.logger.dropped(),
                           file.value<std::uint32_t>(statuses.back(), "dropped"));
  TEST_ASSERT_EQUAL_UINT32(flight.logger.status(0).dropped_by_id[0],
                           file.value<std::uint32_t>(statuses.back(), "dropped_by_id", 0));
}

void test_a_power_cut_loses_less_than_a_second() {
  flight.begin(1000);
  flight.card.busyTime = [] { return 1500; };
  for (int i = 0; i < 5000; ++i) {
    flight.pass();
    if (i < 1000 || i % 37 != 0) continue;
    const ULogFile file = flight.readDurable();
    const auto imu = file.of("sensor_combined");
    TEST_ASSERT_GREATER_THAN_UINT64(flight.now - 1'000'000,
                                    file.value<std::uint64_t>(imu.back(), "timestamp"));
    // What is durable ends with a closed block: its CRC vouches for all of it.
    TEST_ASSERT_EQUAL_STRING("log_block",
                             file.subscriptions.at(file.records.back().id).topic.c_str());
  }
}

void test_an_unfinished_sector_is_written_with_zeros_behind_and_again_as_it_fills() {
  flight.begin(0);
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const std::vector<std::uint8_t> first = flight.card.durableFile();
  const std::vector<std::uint8_t> sectors = flight.card.sectors();
  TEST_ASSERT_NOT_EQUAL(0, first.size() % kSectorSize);
  TEST_ASSERT_EQUAL((first.size() + kSectorSize - 1) / kSectorSize * kSectorSize, sectors.size());
  for (std::size_t i = first.size(); i < sectors.size(); ++i) TEST_ASSERT_EQUAL(0, sectors[i]);

  flight.logger.logText(ulog::LogLevel::Info, 1, "more");
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  TEST_ASSERT_GREATER_THAN_UINT32(0, flight.card.rewrites);
  const std::vector<std::uint8_t> second = flight.card.durableFile();
  TEST_ASSERT_GREATER_THAN(first.size(), second.size());
  TEST_ASSERT_EQUAL_MEMORY(first.data(), second.data(), first.size());
  TEST_ASSERT_EQUAL(1, flight.readDurable().texts.size());
}

void test_the_synced_length_is_what_the_log_holds() {
  flight.begin(0);
  for (int i = 0; i < 700; ++i) flight.pass();
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  TEST_ASSERT_EQUAL_UINT32(flight.logger.status(0).bytes, flight.card.syncedLength);
  // With nothing new since, nothing is written again.
  const std::uint32_t accesses = flight.card.accesses;
  for (int i = 0; i < 100; ++i) flight.logger.write(flight.now + static_cast<LogTime>(i) * 1000);
  TEST_ASSERT_EQUAL_UINT32(accesses, flight.card.accesses);
}

void test_a_card_that_dies_is_noticed_and_the_loop_goes_on() {
  flight.begin(0);
  for (int i = 0; i < 1000; ++i) flight.pass();
  flight.card.refuses = true;
  const std::uint32_t before = flight.card.accesses;
  for (int i = 0; i < 100; ++i) flight.pass();
  TEST_ASSERT_FALSE(flight.logger.failed());
  // One try each 50 ms: a try may cost the board time.
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(before + 3, flight.card.accesses);
  for (int i = 0; i < 2000; ++i) flight.pass();
  TEST_ASSERT_TRUE(flight.logger.failed());
  const std::uint32_t dead = flight.card.accesses;
  for (int i = 0; i < 3000; ++i) flight.pass();
  TEST_ASSERT_EQUAL_UINT32(dead, flight.card.accesses);
  TEST_ASSERT_FALSE(flight.finish(1'000'000));
  TEST_ASSERT_EQUAL_UINT32(20, flight.logger.status(0).write_errors);
  TEST_ASSERT_GREATER_THAN_UINT32(3000, flight.logger.dropped());
  flight.readDurable();  // what was made durable before is still a sound file
}

void test_a_card_that_fails_for_a_while_loses_nothing() {
  flight.begin(0);
  for (int i = 0; i < 1000; ++i) flight.pass();
  flight.card.refuses = true;
  for (int i = 0; i < 300; ++i) flight.pass();
  flight.card.refuses = false;
  for (int i = 0; i < 1000; ++i) flight.pass();
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  TEST_ASSERT_FALSE(flight.logger.failed());
  TEST_ASSERT_UINT32_WITHIN(1, 6, flight.logger.status(0).write_errors);
  TEST_ASSERT_EQUAL_UINT32(0, flight.logger.dropped());
  flight.assertNothingIsMissing(flight.readDurable());
}

void test_failures_with_successes_between_do_not_add_up() {
  flight.begin(0);
  for (int k = 0; k < 3; ++k) {
    flight.card.refuses = true;
    for (int i = 0; i < 600; ++i) flight.pass();
    flight.card.refuses = false;
    for (int i = 0; i < 1000; ++i) flight.pass();
  }
  TEST_ASSERT_UINT32_WITHIN(3, 36, flight.logger.status(0).write_errors);
  TEST_ASSERT_FALSE(flight.logger.failed());
}

void test_a_refused_sync_is_counted_and_tried_again() {
  flight.begin(0);
  for (int i = 0; i < 100; ++i) flight.pass();
  flight.card.refusesSync = true;
  const std::uint32_t durable = flight.card.syncedLength;
  for (int i = 0; i < 650; ++i) flight.pass();  // asked for at 0.5 s
  TEST_ASSERT_EQUAL_UINT32(durable, flight.card.syncedLength);
  TEST_ASSERT_UINT32_WITHIN(1, 6, flight.logger.status(0).write_errors);
  flight.card.refusesSync = false;
  for (int i = 0; i < 60; ++i) flight.pass();
  TEST_ASSERT_GREATER_THAN_UINT32(durable, flight.card.syncedLength);
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  flight.assertNothingIsMissing(flight.readDurable());
}

void test_the_longest_stall_is_told_not_the_last() {
  flight.begin(0);
  for (int i = 0; i < 1000; ++i) flight.pass();
  for (const LogTime stall : {300'000, 100'000}) {
    flight.card.stallUntil(flight.now + stall);
    for (int i = 0; i < 1000; ++i) flight.pass();
  }
  TEST_ASSERT_UINT32_WITHIN(50'000, 275'000, flight.logger.status(0).longest_stall_us);
}

void test_saving_ends_with_the_final_count_of_drops() {
  flight.begin(0);
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  for (std::size_t i = 0; i < kImuRing + 500; ++i) flight.logger.logIMU({});
  TEST_ASSERT_TRUE(flight.finish(400'000));
  const ULogFile file = flight.readDurable();
  TEST_ASSERT_EQUAL_UINT32(500, file.value<std::uint32_t>(file.of("log_status").back(), "dropped"));
}

void test_saving_gives_up_at_its_deadline_and_keeps_what_it_saved() {
  flight.begin(0);
  for (int i = 0; i < 1000; ++i) flight.pass();
  flight.card.stallUntil(~std::uint64_t{0});
  flight.pass();
  LogTime before = flight.now;
  TEST_ASSERT_FALSE(flight.finish(500'000));
  TEST_ASSERT_UINT64_WITHIN(30, 500'000, flight.now - before);

  // 2 s of data on a card of 20 ms a sector: no time for all, but every half second is durable.
  flight.begin(0);
  for (int i = 0; i < 1000; ++i) flight.pass();
  flight.card.stallUntil(flight.now + 1'900'000);
  for (int i = 0; i < 1900; ++i) flight.pass();
  flight.card.busyTime = [] { return 20'000; };
  before = flight.now;
  TEST_ASSERT_FALSE(flight.finish(3'000'000));
  TEST_ASSERT_UINT64_WITHIN(30, 3'000'000, flight.now - before);
  // A sync each 0.5 s: at most so much, 25 sectors, and what came on top of it is not durable.
  TEST_ASSERT_GREATER_THAN_UINT32(flight.card.sectors().size() - 30 * kSectorSize,
                                  flight.card.syncedLength);
  flight.readDurable();
}

void test_what_replay_recomputes_is_thinned_and_inputs_are_not() {
  flight.begin(0);
  for (int i = 0; i < 1000; ++i) flight.pass();
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const ULogFile file = flight.readDurable();
  TEST_ASSERT_EQUAL(1000, file.of("sensor_combined").size());
  TEST_ASSERT_EQUAL(500, file.of("control_tick").size());
  TEST_ASSERT_EQUAL(100, file.of("vehicle_local_position").size());
}

void test_a_second_log_starts_anew_even_after_a_failure() {
  flight.begin(0);
  for (int i = 0; i < 500; ++i) flight.pass();
  flight.card.refuses = true;
  TEST_ASSERT_FALSE(flight.finish(3'000'000));
  flight.logger.logText(ulog::LogLevel::Info, flight.now, "of the first log");
  TEST_ASSERT_TRUE(flight.logger.failed());
  flight.begin(9'000'000);
  flight.pass();
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const ULogFile file = flight.readDurable();
  TEST_ASSERT_EQUAL_UINT64(9'000'000, file.start);
  TEST_ASSERT_EQUAL(1, file.of("sensor_combined").size());
  TEST_ASSERT_EQUAL(0, file.texts.size());
  flight.assertNothingIsMissing(file);
}

}  // namespace

void runCardTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_busy_card_is_left_alone_and_a_pass_costs_at_most_one_access);
  RUN_TEST(test_a_quick_card_loses_nothing_and_is_used_twenty_times_a_second);
  RUN_TEST(test_a_stall_of_nearly_two_seconds_loses_nothing);
  RUN_TEST(test_a_stall_of_four_seconds_drops_what_does_not_fit_and_says_how_much);
  RUN_TEST(test_a_power_cut_loses_less_than_a_second);
  RUN_TEST(test_an_unfinished_sector_is_written_with_zeros_behind_and_again_as_it_fills);
  RUN_TEST(test_the_synced_length_is_what_the_log_holds);
  RUN_TEST(test_a_card_that_dies_is_noticed_and_the_loop_goes_on);
  RUN_TEST(test_a_card_that_fails_for_a_while_loses_nothing);
  RUN_TEST(test_failures_with_successes_between_do_not_add_up);
  RUN_TEST(test_a_refused_sync_is_counted_and_tried_again);
  RUN_TEST(test_the_longest_stall_is_told_not_the_last);
  RUN_TEST(test_saving_ends_with_the_final_count_of_drops);
  RUN_TEST(test_saving_gives_up_at_its_deadline_and_keeps_what_it_saved);
  RUN_TEST(test_what_replay_recomputes_is_thinned_and_inputs_are_not);
  RUN_TEST(test_a_second_log_starts_anew_even_after_a_failure);
}
