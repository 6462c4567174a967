// Stalls of every length at every place, cards that die or are pulled: what is lost is counted, and
// nothing waits for longer than it may.
#include <unity.h>

#include <random>

#include "LogBlocks.h"
#include "LogFlight.h"
#include "suites.h"

using namespace strix;

namespace {

LogFlight flight;

constexpr LogTime kStalls[] = {200'000, 500'000, 2'500'000, 4'000'000};  // us

/// What the table says of one row.
struct RingRow {
  std::string topic;
  int instance;
  std::uint32_t records;
};

template <class... Streams>
std::vector<RingRow> ringRows(const std::tuple<Streams...>* /*types*/) {
  return {{std::string(kTopicName<typename Streams::Topic>), Streams::kInstance,
           static_cast<std::uint32_t>(Streams::kRecords)}...};
}

const std::vector<RingRow> kRings = ringRows(static_cast<const LogStreams*>(nullptr));

void test_a_stall_drops_exactly_what_does_not_fit_into_each_ring() {
  for (const LogTime stall : kStalls) {
    flight.begin(1000);
    for (int i = 0; i < 1049; ++i) flight.pass();
    TEST_ASSERT_TRUE(flight.finish(1'000'000));  // every ring is empty
    const auto before = flight.given;
    flight.card.stallUntil(flight.now + stall);
    for (LogTime i = 0; i < stall / 1000; ++i) flight.pass();
    TEST_ASSERT_TRUE(flight.finish(2'000'000));
    const ULogFile file = flight.readDurable();
    flight.assertNothingIsMissing(file);

    std::uint32_t dropped = 0;
    const topic::LogStatus status = flight.logger.status(flight.now);
    for (std::size_t id = 0; id < kRings.size(); ++id) {
      const RingRow& ring = kRings[id];
      if (ring.topic == "log_status") continue;
      const LogFlight::Key key{ring.topic, ring.instance};
      const auto old = before.find(key);
      const std::uint32_t kept = old == before.end() ? 0 : old->second;
      const std::uint32_t given = flight.given[key] - kept;
      const std::uint32_t lost = given > ring.records ? given - ring.records : 0;
      TEST_ASSERT_EQUAL_UINT32_MESSAGE(lost, status.dropped_by_id[id], ring.topic.c_str());
      dropped += lost;
    }
    TEST_ASSERT_EQUAL(stall > 2'000'000, dropped > 0);
    const auto last = file.of("log_status").back();
    TEST_ASSERT_EQUAL_UINT32(flight.logger.dropped(), file.value<std::uint32_t>(last, "dropped"));
    for (std::size_t id = 0; id < kRings.size(); ++id) {
      TEST_ASSERT_EQUAL_UINT32(status.dropped_by_id[id],
                               file.value<std::uint32_t>(last, "dropped_by_id", id));
    }
  }
}

void test_a_full_ring_drops_the_newest_so_that_the_begin_of_a_stall_is_kept() {
  flight.begin(1000);
  for (int i = 0; i < 1049; ++i) flight.pass();
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const std::size_t before = flight.given[{"sensor_combined", 0}];
  flight.card.stallUntil(flight.now + 4'000'000);
  const LogTime begun = flight.now;
  for (int i = 0; i < 4000; ++i) flight.pass();
  TEST_ASSERT_TRUE(flight.finish(2'000'000));
  const ULogFile file = flight.readDurable();
  const auto imu = file.of("sensor_combined");
  constexpr std::size_t kRing = std::tuple_element_t<0, LogStreams>::kRecords;
  TEST_ASSERT_EQUAL(before + kRing, imu.size());
  for (std::size_t i = 0; i < kRing; ++i) {
    TEST_ASSERT_EQUAL_UINT64(begun + i * 1000,
                             file.value<std::uint64_t>(imu[before + i], "timestamp"));
  }
}

void test_a_stall_behind_any_sector_loses_nothing_while_the_rings_have_room() {
  for (std::uint32_t sector = 0; sector < 120; ++sector) {  // header, bursts, rewrites, syncs
    flight.begin(1000);
    flight.card.busyTime = [] { return 700; };
    flight.card.stalls[sector] = sector % 2 == 0 ? 200'000 : 500'000;
    for (int i = 0; i < 1200; ++i) flight.pass();
    TEST_ASSERT_TRUE(flight.finish(1'000'000));
    TEST_ASSERT_EQUAL_UINT32(0, flight.logger.dropped());
    TEST_ASSERT_EQUAL_UINT32(0, flight.card.accessesWhileBusy);
    TEST_ASSERT_GREATER_THAN_UINT32(190'000, flight.logger.status(0).longest_stall_us);
    flight.assertNothingIsMissing(flight.readDurable());
  }
}

void test_random_busy_times_and_stalls_lose_only_what_is_counted() {
  std::uint32_t flightsWithDrops = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    flight.begin(1000);
    flight.card.busyTime = [&random]() -> std::uint64_t {
      const std::uint64_t kind = random() % 12'000;
      return kind < 4 ? kStalls[kind] : random() % (kind < 100 ? 30'000 : 2000);
    };
    for (int i = 0; i < 15'000; ++i) {
      const std::uint32_t before = flight.card.accesses;
      flight.pass();
      TEST_ASSERT_LESS_OR_EQUAL_UINT32(before + 1, flight.card.accesses);
    }
    flight.card.busyTime = nullptr;
    TEST_ASSERT_TRUE(flight.finish(20'000'000));
    TEST_ASSERT_EQUAL_UINT32(0, flight.card.accessesWhileBusy);
    const ULogFile file = flight.readDurable();
    flight.assertNothingIsMissing(file);
    const auto last = file.of("log_status").back();
    TEST_ASSERT_EQUAL_UINT32(flight.logger.dropped(), file.value<std::uint32_t>(last, "dropped"));
    if (flight.logger.dropped() != 0) ++flightsWithDrops;
  }
  TEST_ASSERT_GREATER_THAN_UINT32(5, flightsWithDrops);
  TEST_ASSERT_LESS_THAN_UINT32(20, flightsWithDrops);
}

void test_what_came_before_a_card_died_or_was_pulled_is_readable() {
  for (const bool pulled : {false, true}) {
    for (const std::uint32_t sector : {0U, 1U, 7U, 137U, 600U}) {
      flight.begin(1000);
      flight.card.busyTime = [] { return 700; };
      (pulled ? flight.card.pulledAt : flight.card.diesAt) = sector;
      for (int i = 0; i < 14'000; ++i) flight.pass();
      TEST_ASSERT_TRUE(flight.logger.failed());  // or the pilot would arm without a log
      TEST_ASSERT_FALSE(flight.finish(1'000'000));
      TEST_ASSERT_EQUAL_UINT32(0, flight.card.accessesWhileBusy);

      std::vector<std::uint8_t> bytes;
      flight.card.cutFile(FakeCard::Tear::Noise, bytes);
      LogBlocks blocks;
      blocks.update(bytes, 0);
      // A dead card has the sectors before; of a pulled one the last is torn.
      const std::size_t sound = sector * kSectorSize;
      TEST_ASSERT_LESS_OR_EQUAL(sound, blocks.intact());
      TEST_ASSERT_GREATER_THAN(sound, blocks.intact() + 4096 + kSectorSize);
      if (blocks.intact() == 0) continue;
      bytes.resize(blocks.intact());
      const ULogFile file(bytes);
      TEST_ASSERT_EQUAL_STRING("", file.error.c_str());
      TEST_ASSERT_EQUAL(blocks.blocks().size(), file.of("log_block").size());
    }
  }
}

void test_a_card_busy_for_ten_seconds_has_failed_until_it_comes_back() {
  flight.begin(0);
  for (int i = 0; i < 1000; ++i) flight.pass();
  flight.card.stallUntil(flight.now + 12'000'000);
  for (int i = 0; i < 9900; ++i) flight.pass();
  TEST_ASSERT_FALSE(flight.logger.failed());
  for (int i = 0; i < 1000; ++i) flight.pass();
  TEST_ASSERT_TRUE(flight.logger.failed());
  for (int i = 0; i < 1200; ++i) flight.pass();
  TEST_ASSERT_FALSE(flight.logger.failed());
  TEST_ASSERT_TRUE(flight.finish(2'000'000));
  flight.assertNothingIsMissing(flight.readDurable());
}

struct Fault {
  const char* name;
  void (*begin)(FakeCard&);
};

const Fault kFaults[] = {
    {"none", [](FakeCard&) {}},
    {"busy for ever", [](FakeCard& card) { card.stallUntil(FakeCard::kForEver); }},
    {"refuses", [](FakeCard& card) { card.refuses = true; }},
    {"refuses to sync", [](FakeCard& card) { card.refusesSync = true; }},
    {"dies later", [](FakeCard& card) { card.diesAt = card.fullSectorWrites + 9; }},
    {"pulled later", [](FakeCard& card) { card.pulledAt = card.fullSectorWrites + 9; }},
    {"20 ms a sector", [](FakeCard& card) { card.busyTime = [] { return 20'000; }; }},
    {"stalls 4 s", [](FakeCard& card) { card.stallUntil(card.now + 4'000'000); }},
};

void test_saving_keeps_its_deadline_with_every_faulty_card() {
  for (const Fault& fault : kFaults) {
    for (const Micros budget : {0U, 1U, 1000U, 50'000U, 900'000U, 3'000'000U}) {
      for (const int passes : {3, 500, 1025, 1500}) {  // in the header, a sync, a burst, idle
        flight.begin(0);
        for (int i = 0; i < passes; ++i) flight.pass();
        fault.begin(flight.card);
        const LogTime before = flight.now;
        const bool saved = flight.finish(budget);
        TEST_ASSERT_LESS_OR_EQUAL_UINT64_MESSAGE(before + budget + 30, flight.now, fault.name);
        if (saved) {
          TEST_ASSERT_EQUAL_UINT32(flight.logger.status(0).bytes, flight.card.syncedLength);
        }
      }
    }
  }
}

void test_saved_means_that_the_card_is_done_with_it() {
  flight.begin(0);
  for (int i = 0; i < 1000; ++i) flight.pass();
  flight.card.busyTime = [] { return 3000; };
  TEST_ASSERT_TRUE(flight.finish(5'000'000));
  TEST_ASSERT_FALSE(flight.card.busy());
  TEST_ASSERT_EQUAL_UINT32(flight.logger.status(0).bytes, flight.card.syncedLength);

  // A card that never ends a sync: not saved, and told in time.
  flight.begin(0);
  for (int i = 0; i < 1000; ++i) flight.pass();
  flight.card.onAccess = [] {
    if (flight.card.syncs > 1) flight.card.stallUntil(FakeCard::kForEver);
  };
  TEST_ASSERT_FALSE(flight.finish(500'000));
}

}  // namespace

void runStallTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_stall_drops_exactly_what_does_not_fit_into_each_ring);
  RUN_TEST(test_a_full_ring_drops_the_newest_so_that_the_begin_of_a_stall_is_kept);
  RUN_TEST(test_a_stall_behind_any_sector_loses_nothing_while_the_rings_have_room);
  RUN_TEST(test_random_busy_times_and_stalls_lose_only_what_is_counted);
  RUN_TEST(test_what_came_before_a_card_died_or_was_pulled_is_readable);
  RUN_TEST(test_a_card_busy_for_ten_seconds_has_failed_until_it_comes_back);
  RUN_TEST(test_saved_means_that_the_card_is_done_with_it);
  RUN_TEST(test_saving_keeps_its_deadline_with_every_faulty_card);
}
