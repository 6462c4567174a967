// The whole flight software and a card that stalls, dies or is pulled: the loop does not notice,
// and the log says to the record what it cost. Beside it the naive design, which waits for the
// card.
#include <algorithm>
#include <cstdio>
#include <map>
#include <random>
#include <vector>

#include "../test_logger/ULogReader.h"
#include "FakeFlight.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr std::uint32_t kSectorTime = 40;  // us of the loop's time: the Teensy's stated bound
constexpr Micros kComputing = 400;         // us a pass without the card
constexpr std::uint64_t kControlPeriod = 2000;
constexpr float kFlightTime = 13.0F;  // s: 5.5 to be ready, then arm, take off, hold, land

struct Fault {
  const char* name;
  std::uint64_t stall;  // us, 0 for those that are not one
  void (*begin)(FakeBoard&);
};

template <std::uint64_t Stall>
void stall(FakeBoard& board) {
  board.sd.stallUntil(board.time() + Stall);
}

const Fault kFaults[] = {
    {"no stall", 0, [](FakeBoard&) {}},
    {"0.2 s stall", 200'000, stall<200'000>},
    {"0.5 s stall", 500'000, stall<500'000>},
    {"2.5 s stall", 2'500'000, stall<2'500'000>},
    {"4 s stall", 4'000'000, stall<4'000'000>},
    {"dies", 0, [](FakeBoard& board) { board.sd.diesAt = board.sd.fullSectorWrites; }},
    {"pulled", 0, [](FakeBoard& board) { board.sd.pulledAt = board.sd.fullSectorWrites; }},
};

/// A flight from power-up to after the landing, on a card of random speed that has a fault from
/// `faultAt` on. Seeded: two flights on it differ by the loop alone.
struct CardFlight {
  FakeFlight flight;
  std::uint64_t worstPass = 0;  // us
  bool flew = false;            // was in state Hold

  /// @param passTime  us, what each pass takes; 0: the computing and what the card takes of it
  CardFlight(const Fault& fault, float faultAt, Micros passTime, bool naive = false) {
    FakeCard& card = flight.board.sd;
    card.writeTime = kSectorTime;
    std::mt19937 random(5);
    card.busyTime = [&random]() -> std::uint64_t {
      return random() % 500 == 0 ? random() % 20'000 : 100 + random() % 900;
    };
    flight.software.setup();
    bool begun = false;
    std::uint64_t nextSave = 0;
    while (seconds() < kFlightTime) {
      if (!begun && seconds() >= faultAt) {
        fault.begin(flight.board);
        begun = true;
      }
      flight.board.pilot.arm = seconds() >= 5.5F;
      flight.board.pilot.start = seconds() >= 6.0F;
      const std::uint64_t start = flight.board.time();
      std::uint64_t spent = flight.board.sd.timeTaken;
      flight.software.loop();
      flight.board.advance(passTime != 0 ? passTime : kComputing + cardTime(spent));
      if (naive && flight.board.time() >= nextSave) {
        save();
        nextSave += 50'000;
      }
      worstPass = std::max(worstPass, flight.board.time() - start);
      flew = flew || flight.state() == FlightState::Hold;
    }
    card.busyTime = nullptr;
  }

  [[nodiscard]] ULogFile savedLog() {
    save();
    ULogFile file(flight.board.sd.durableFile());
    TEST_ASSERT_EQUAL_STRING("", file.error.c_str());
    return file;
  }

  /// Longest time from one ESC write to the next, us.
  [[nodiscard]] std::uint64_t longestGap() const {
    const auto& writes = flight.board.escWrites;
    std::uint64_t longest = flight.board.time() - writes.back().time;
    for (std::size_t i = 1; i < writes.size(); ++i) {
      longest = std::max(longest, writes[i].time - writes[i - 1].time);
    }
    return longest;
  }

  /// Longest delay of an ESC write behind its place in the 2 ms grid, us.
  [[nodiscard]] std::uint64_t worstLateness() const {
    std::uint64_t worst = 0;
    std::uint64_t due = 0;
    for (const FakeBoard::EscWrite& write : flight.board.escWrites) {
      if (write.time < due) continue;  // one more, by a disarming
      worst = std::max(worst, write.time - due);
      due += kControlPeriod;
    }
    const std::uint64_t now = flight.board.time();
    return now > due ? std::max(worst, now - due) : worst;
  }

 private:
  [[nodiscard]] float seconds() const { return static_cast<float>(flight.board.time()) * 1e-6F; }

  /// us that the card took of the loop since `card` was noted, which is brought up to date.
  Micros cardTime(std::uint64_t& card) const {
    const std::uint64_t spent = flight.board.sd.timeTaken - card;
    card += spent;
    return static_cast<Micros>(spent);
  }

  /// Writes and flushes all there is, and waits for the card.
  void save() {
    std::uint64_t card = flight.board.sd.timeTaken;
    (void)flight.software.logger().forceWriteAndFlush(
        [&, this] {
          flight.board.advance(10 + cardTime(card));
          return flight.board.now();
        },
        60'000'000);
  }
};

void test_no_control_deadline_is_missed_whatever_the_card_does() {
  for (const Fault& fault : kFaults) {
    for (const float faultAt : {1.0F, 5.45F, 7.2F}) {  // calibration, arming, flight
      const CardFlight run(fault, faultAt, 0);
      TEST_ASSERT_LESS_OR_EQUAL_UINT64_MESSAGE(kComputing + kSectorTime, run.worstPass, fault.name);
      TEST_ASSERT_LESS_OR_EQUAL_UINT64_MESSAGE(run.worstPass, run.worstLateness(), fault.name);
      TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, run.flight.software.overruns(), fault.name);
      TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, run.flight.board.sd.accessesWhileBusy, fault.name);
      if (fault.stall != 0 || faultAt > 6.0F) TEST_ASSERT_TRUE_MESSAGE(run.flew, fault.name);
    }
  }
}

using Bytes = std::vector<std::uint8_t>;

std::vector<Bytes> recordsOf(const ULogFile& file, const ULogFile::Subscription& stream) {
  std::vector<Bytes> all;
  for (const ULogFile::Record& record : file.of(stream.topic, stream.instance)) {
    all.emplace_back(file.data(record), file.data(record) + record.size);
  }
  return all;
}

/// True when `part` is `whole` with some elements left out.
bool isSubsequence(const std::vector<Bytes>& part, const std::vector<Bytes>& whole) {
  auto next = whole.begin();
  for (const Bytes& record : part) {
    next = std::find(next, whole.end(), record);
    if (next == whole.end()) return false;
    ++next;
  }
  return true;
}

void test_every_record_offered_is_in_the_log_or_counted_and_none_is_false() {
  // The flight does not depend on the card, so a perfect card has all that was offered.
  CardFlight perfect(kFaults[0], 0.0F, 500);
  const ULogFile offered = perfect.savedLog();
  TEST_ASSERT_TRUE(perfect.flew);
  TEST_ASSERT_EQUAL_UINT32(0, perfect.flight.software.logger().dropped());
  for (const Fault& fault : kFaults) {
    if (fault.stall == 0) continue;
    CardFlight stalled(fault, 7.2F, 500);
    const ULogFile file = stalled.savedLog();
    const topic::LogStatus status = stalled.flight.software.logger().status(0);
    for (const auto& [id, stream] : offered.subscriptions) {
      if (stream.topic == "log_status" || stream.topic == "log_block") continue;
      const auto whole = recordsOf(offered, stream);
      const auto kept = recordsOf(file, stream);
      TEST_ASSERT_EQUAL_UINT32_MESSAGE(whole.size(), kept.size() + status.dropped_by_id[id],
                                       stream.topic.c_str());
      TEST_ASSERT_TRUE_MESSAGE(isSubsequence(kept, whole), stream.topic.c_str());
    }
    TEST_ASSERT_EQUAL_UINT32(offered.texts.size(), file.texts.size() + status.dropped_text);
    const auto last = file.of("log_status").back();
    TEST_ASSERT_EQUAL_UINT32(status.dropped, file.value<std::uint32_t>(last, "dropped"));
    // 1125 IMU samples a second; 2250 fit. Up to 50 ms wait already as the stall begins, and the
    // rings take a little to be emptied as it ends.
    constexpr std::uint32_t kFit = std::tuple_element_t<0, LogStreams>::kRecords;
    const auto imu = static_cast<std::uint32_t>(fault.stall / 889);
    const std::uint32_t expected = imu > kFit ? imu - kFit : 0;
    TEST_ASSERT_UINT32_WITHIN(expected == 0 ? 0 : 100, expected, status.dropped_by_id[0]);
    std::printf("%s: %u of %u records lost, IMU %u\n", fault.name,
                static_cast<unsigned>(status.dropped),
                static_cast<unsigned>(offered.records.size()),
                static_cast<unsigned>(status.dropped_by_id[0]));
  }
}

void test_the_naive_design_waits_for_the_card_and_ours_does_not() {
  std::printf("worst pass, us: %u to compute, %u a sector\n", static_cast<unsigned>(kComputing),
              static_cast<unsigned>(kSectorTime));
  for (const Fault& fault : kFaults) {
    if (fault.stall == 0 && &fault != &kFaults[0]) continue;  // it would wait for ever
    const CardFlight ours(fault, 7.2F, 0);
    const CardFlight naive(fault, 7.2F, 0, true);
    std::printf("  %-12s ours %4u   write and flush in the loop %8u   ESC silent for %4u and %8u\n",
                fault.name, static_cast<unsigned>(ours.worstPass),
                static_cast<unsigned>(naive.worstPass), static_cast<unsigned>(ours.longestGap()),
                static_cast<unsigned>(naive.longestGap()));
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(kComputing + kSectorTime, ours.worstPass);
    // The naive one saves each 50 ms, so that much of the stall may go by before it comes.
    const std::uint64_t hit = fault.stall > 60'000 ? fault.stall - 50'000 : 10'000;
    TEST_ASSERT_GREATER_THAN_UINT64(hit, naive.worstPass);
    TEST_ASSERT_GREATER_THAN_UINT64(hit, naive.longestGap());
  }
}

void test_without_a_card_that_writes_the_pilot_cannot_arm() {
  for (const Fault& fault : kFaults) {
    if (fault.stall != 0) continue;
    FakeFlight flight;
    flight.software.setup();
    flight.run(1.0F);
    fault.begin(flight.board);
    flight.run(12.0F);
    TEST_ASSERT_EQUAL_MESSAGE(&fault == &kFaults[0], flight.arm(), fault.name);
  }
}

}  // namespace

void runCardStallTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_no_control_deadline_is_missed_whatever_the_card_does);
  RUN_TEST(test_every_record_offered_is_in_the_log_or_counted_and_none_is_false);
  RUN_TEST(test_the_naive_design_waits_for_the_card_and_ours_does_not);
  RUN_TEST(test_without_a_card_that_writes_the_pilot_cannot_arm);
}
