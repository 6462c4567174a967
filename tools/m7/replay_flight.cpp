/// Replays a flight log and says whether every control tick came out as logged, for any processor
/// and any compiler. Status 0: bit for bit the same; 1: not; 2: not a log that can be replayed.
///
///   replay_flight LOG [9]    with the 9-state filter, which did not fly: only `digest` can be
///   compared
#include <Replay.h>

#include <cinttypes>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "NoCard.h"

namespace {

template <int States>
int fly(const std::string& path) {
  const strix::FlightLogReader log(path);
  const auto replay =
      std::make_unique<strix::Replay<States, m7::NoCard>>(log, strix::replayConfig(log), "");
  const strix::ReplayResult result = replay->run(false);
  std::printf("ticks %" PRIu32 "\ndigest %08" PRIx32 "\nend %" PRIu64 "\n", result.ticks,
              result.digest, result.end);
  if (States == 9) return 0;
  if (result.firstBad != 0) {
    std::printf("first difference %" PRIu64 " in %s\n", result.firstBad, result.field.c_str());
  }
  return result.firstBad == 0 && result.ticks > 0 && !result.gap ? 0 : 1;
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
