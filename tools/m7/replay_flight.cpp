/// Replays a flight log and says in how many control ticks it came out other than logged, for any
/// processor and any compiler. Status 0: in none; 1: in some; 2: not a log that can be replayed.
///
///   replay_flight LOG [9]    with the 9-state filter: for a log that was written with it
#include <Crc32.h>
#include <Replay.h>

#include <cinttypes>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "NoCard.h"

namespace {

strix::Crc32 ownLog;  // sum of all bytes of the log that this one flight writes

class SummingCard : public m7::NoCard {
 public:
  using NoCard::NoCard;
  [[nodiscard]] static bool writeSector(std::uint32_t /*index*/,
                                        const std::uint8_t (&data)[strix::kSectorSize]) {
    ownLog.update(data, strix::kSectorSize);
    return true;
  }
};

template <int States>
int fly(const std::string& path) {
  const strix::FlightLogReader log(path);
  const auto replay =
      std::make_unique<strix::Replay<States, SummingCard>>(log, strix::replayConfig(log), "");
  const strix::ReplayResult result = replay->run(false);
  if (!replay->close()) return 2;
  std::printf("ticks %" PRIu32 "\ndifferences %" PRIu32 "\ndigest %08" PRIx32 "\nlog %08" PRIx32
              "\nend %" PRIu64 "\ngap %d\n",
              result.ticks, result.differences, result.digest, ownLog.value(), result.end,
              result.gap ? 1 : 0);
  if (result.differences > 0) {
    std::printf("first %" PRIu64 "\nfield %s\n", result.firstBad, result.field.c_str());
  }
  return result.differences == 0 && result.ticks > 0 ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    std::printf("usage: replay_flight LOG [9]\n");
    return 2;
  }
  const std::string states = count > 2 ? arguments[2] : "18";
  try {
    return states == "9" ? fly<9>(arguments[1]) : fly<18>(arguments[1]);
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
    return 2;
  }
}
