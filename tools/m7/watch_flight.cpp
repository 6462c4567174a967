/// Replays a flight log with the heap watched and the stack painted: prints the bytes of stack that
/// setup() took and the deepest pass, and how often the flight code called upon the heap.
///
///   watch_flight LOG
#include <Replay.h>

#include <cinttypes>
#include <cstdio>
#include <exception>
#include <memory>

#include "NoCard.h"
#include "Watch.h"

using Replay = strix::Replay<18, m7::NoCard>;
using Flight = Replay::Software;

// What is watched, by names that footprint.py finds in the call graph.
extern "C" {
void setup(void* flight) { static_cast<Flight*>(flight)->setup(); }
void loop(void* flight) { static_cast<Flight*>(flight)->loop(); }
}

namespace {

m7::PaintedStack setupStack;
m7::PaintedStack loopStack;

void watch(const char* path) {
  const strix::FlightLogReader log(path);
  const strix::FlightSoftwareConfig config = strix::replayConfig(log);

  // The replay calls its own setup(), unwatched; this flight software is there for setup() alone.
  strix::SimulatedBoard<m7::NoCard> board("", 0);
  const auto flight = std::make_unique<Flight>(board, config);
  setupStack.call(setup, flight.get());

  const auto replay = std::make_unique<Replay>(log, config, "");
  const strix::ReplayResult result =
      replay->run(false, [](Flight& software) { loopStack.call(loop, &software); });
  std::printf("setup %" PRIu32 "\nloop %" PRIu32 "\nheap %" PRIu32 "\nticks %" PRIu32 "\n",
              setupStack.used(), loopStack.used(), m7::heapCalls, result.ticks);
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::printf("usage: watch_flight LOG\n");
    return 2;
  }
  try {
    watch(arguments[1]);
    return 0;
  } catch (const std::exception& error) {
    std::printf("%s\n", error.what());
    return 2;
  }
}
