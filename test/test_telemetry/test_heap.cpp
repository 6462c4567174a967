// The link takes nothing from the heap, whatever it is asked.
#include <cstdlib>
#include <new>

#include "TelemetryBench.h"
#include "suites.h"

namespace {
unsigned allocations = 0;
}

// C++'s own allocations; the library has no others: neither malloc nor printf is called.
void* operator new(std::size_t size) {
  ++allocations;
  void* memory = std::malloc(size);
  if (memory == nullptr) std::abort();
  return memory;
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }

using namespace strix;

namespace {

/// A port with all its memory beforehand.
struct PlainPort {
  const std::uint8_t* next = nullptr;
  const std::uint8_t* end = nullptr;
  std::size_t written = 0;
  std::size_t read(std::uint8_t* out, std::size_t /*most*/) {
    if (next == end) return 0;
    *out = *next++;
    return 1;
  }
  [[nodiscard]] static std::size_t room() { return 512; }
  void write(const std::uint8_t* /*data*/, std::size_t size) { written += size; }
};

void test_the_link_takes_nothing_from_the_heap() {
  TelemetryBench bench;
  bench.sign({1}, 1000);
  bench.say(mavlink_msg_param_request_list_encode_status, mavlink_param_request_list_t{1, 1});
  bench.say(mavlink_msg_mission_count_encode_status, mavlink_mission_count_t{2, 1, 1, 0});
  bench.say(mavlink_msg_mission_request_list_encode_status,
            mavlink_mission_request_list_t{1, 1, 0});
  bench.say(mavlink_msg_command_long_encode_status,
            TelemetryBench::longCommand(MAV_CMD_RUN_PREARM_CHECKS));
  FakeFlight flight;
  flight.key = {1};
  flight.now.preArm = prearm::kGps | prearm::kLog;
  flight.asked.reserve(100);
  PlainPort port{bench.port.input.data(), bench.port.input.data() + bench.port.input.size()};
  GroundLink<FakeFlight, PlainPort> link(flight, port, PortTrust::Radio);
  const unsigned before = allocations;
  for (Micros now = 0; now < 5'000'000; now += 1000) link.step(now);
  TEST_ASSERT_EQUAL_UINT(before, allocations);
  TEST_ASSERT_GREATER_THAN_size_t(5000, port.written);
  TEST_ASSERT_EQUAL_size_t(1, flight.count(CommandKind::MissionClear));
}

}  // namespace

void runHeapTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_link_takes_nothing_from_the_heap);
}
