// The power fails at any moment: what the card keeps is sound, and lacks at most the last second.
#include <unity.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "LogBlocks.h"
#include "LogFlight.h"
#include "ULogReader.h"
#include "suites.h"

using namespace strix;

namespace {

LogFlight flight;

constexpr LogTime kMostLost = 1'000'000;  // us

/// One moment at which the power failed, and what was intact then.
struct Cut {
  LogTime time;
  std::size_t intact;  // bytes
};

/// What a card has left, followed from cut to cut.
struct Survivor {
  LogBlocks blocks;
  std::vector<Cut> cuts;

  void note() { cuts.push_back({flight.now, blocks.intact()}); }
};

/// Flies and cuts the power before and after every access: on a card that has in memory of its own
/// all that came after the last sync, and on one that programs each sector at once and leaves the
/// one in its hands old, half new or as noise.
struct CutFlight {
  Survivor synced;
  Survivor programmed[3];

  explicit CutFlight(int seconds) {
    std::mt19937 random(11);
    flight.begin(1000);
    flight.card.busyTime = [&random] { return 300 + random() % 1200; };
    std::vector<std::uint8_t> bytes;
    flight.card.onAccess = [this, &bytes] { cut(bytes); };
    for (int i = 0; i < seconds * 1000; ++i) flight.pass();
    flight.card.onAccess = nullptr;
    TEST_ASSERT_TRUE(flight.finish(2'000'000));
    TEST_ASSERT_EQUAL_UINT32(0, flight.logger.dropped());
    TEST_ASSERT_EQUAL_UINT32(0, flight.card.accessesWhileBusy);
  }

 private:
  /// @param bytes  what a card had left at the last cut
  void cut(std::vector<std::uint8_t>& bytes) {
    constexpr FakeCard::Tear kTears[] = {FakeCard::Tear::Old, FakeCard::Tear::HalfNew,
                                         FakeCard::Tear::Noise};
    // A sector is written again only while it is the last: before it, all cards have the same.
    const std::size_t unchanged = bytes.empty() ? 0 : bytes.size() - kSectorSize;
    for (std::size_t i = 0; i < 3; ++i) {
      flight.card.cutFile(kTears[i], bytes, unchanged);
      programmed[i].blocks.update(bytes, unchanged);
      programmed[i].note();
    }
    if (flight.card.syncedLength != syncedLength_) {
      const std::vector<std::uint8_t> file = flight.card.durableFile();
      synced.blocks.update(file, syncedLength_);
      syncedLength_ = file.size();
    }
    synced.note();
  }

  std::size_t syncedLength_ = 0;
};

/// Time of the oldest record from any byte of the whole file on.
class OldestBehind {
 public:
  explicit OldestBehind(const ULogFile& file) {
    for (const ULogFile::Record& record : file.records) {
      records_.push_back({record.messageStart, file.value<std::uint64_t>(record, "timestamp")});
    }
    for (std::size_t i = records_.size(); i-- > 1;) {
      records_[i - 1].time = std::min(records_[i - 1].time, records_[i].time);
    }
  }

  [[nodiscard]] LogTime operator()(std::size_t place) const {
    const auto found = std::lower_bound(
        records_.begin(), records_.end(), place,
        [](const Start& start, std::size_t wanted) { return start.place < wanted; });
    return found == records_.end() ? ~LogTime{0} : found->time;
  }

 private:
  struct Start {
    std::size_t place;
    LogTime time;
  };
  std::vector<Start> records_;
};

/// us of flight that the worst cut cost. Before the first second is over nothing can be asked.
LogTime worstLoss(const Survivor& survivor, const OldestBehind& oldest) {
  LogTime worst = 0;
  for (const Cut& cut : survivor.cuts) {
    const LogTime lost = oldest(cut.intact);
    if (lost < cut.time) worst = std::max(worst, cut.time - lost);
  }
  return worst;
}

void test_power_cut_at_any_access_of_20_s_loses_less_than_a_second() {
  const CutFlight run(20);
  const ULogFile file(flight.card.durableFile());
  TEST_ASSERT_EQUAL_STRING("", file.error.c_str());
  const OldestBehind oldest(file);
  // Two an access; a second has 340 sectors and 2 syncs.
  TEST_ASSERT_GREATER_THAN(2 * 20 * 320, run.synced.cuts.size());
  const LogTime synced = worstLoss(run.synced, oldest);
  LogTime programmed = 0;
  for (const Survivor& survivor : run.programmed) {
    programmed = std::max(programmed, worstLoss(survivor, oldest));
  }
  std::printf(
      "%u power cuts: at most %.3f s lost of what was not synced, %.3f s of what was not "
      "programmed\n",
      static_cast<unsigned>(run.synced.cuts.size()), static_cast<double>(synced) * 1e-6,
      static_cast<double>(programmed) * 1e-6);
  TEST_ASSERT_LESS_THAN_UINT64(kMostLost, synced);
  TEST_ASSERT_LESS_THAN_UINT64(kMostLost / 4, programmed);
  TEST_ASSERT_GREATER_THAN_UINT64(400'000, synced);  // or the cuts missed the moments that hurt
}

void test_the_last_intact_block_is_less_than_a_second_old() {
  const CutFlight run(5);
  for (const Survivor* survivor : {&run.synced, &run.programmed[0]}) {
    const auto& blocks = survivor->blocks.blocks();
    std::size_t last = 0;
    for (const Cut& cut : survivor->cuts) {
      while (last + 1 < blocks.size() && blocks[last + 1].end <= cut.intact) ++last;
      if (cut.time < kMostLost) continue;
      TEST_ASSERT_LESS_THAN_UINT64(blocks[last].time + kMostLost, cut.time);
    }
  }
}

}  // namespace

void runPowerCutTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_power_cut_at_any_access_of_20_s_loses_less_than_a_second);
  RUN_TEST(test_the_last_intact_block_is_less_than_a_second_old);
}
