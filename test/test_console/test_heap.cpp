// The console takes nothing from the heap, whatever is typed.
#include <cstdlib>
#include <new>

#include "ConsoleBench.h"
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
  std::string_view input;
  std::size_t written = 0;
  std::size_t read(std::uint8_t* out, std::size_t /*most*/) {
    if (input.empty()) return 0;
    *out = static_cast<std::uint8_t>(input.front());
    input.remove_prefix(1);
    return 1;
  }
  [[nodiscard]] static std::size_t room() { return 512; }
  void write(const std::uint8_t* /*data*/, std::size_t size) { written += size; }
};

void test_no_command_allocates() {
  FakeFlight flight;
  flight.asked.reserve(100);
  flight.motors.reserve(10);
  FakeLogs card;
  card.logs = {{1, std::string(3000, 'x')}};
  PlainPort port;
  Console<FakeFlight, PlainPort, FakeLogs> console(flight, port, card);
  const unsigned before = allocations;
  Micros now = 0;
  for (const std::string_view line : {"help\r",
                                      "help set\r",
                                      "status\r",
                                      "sensors\r",
                                      "checks\r",
                                      "params\r",
                                      "param TILT_TIME\r",
                                      "set TILT_TIME 1\r",
                                      "defaults\r",
                                      "arm\r",
                                      "disarm\r",
                                      "kill\r",
                                      "kill off\r",
                                      "land\r",
                                      "props off\r",
                                      "motor 1 10 1\r",
                                      "calibrate\r",
                                      "log list\r",
                                      "log get 1\r",
                                      "texts on\r",
                                      "version\r",
                                      "what\r",
                                      "save\r"}) {
    port.input = line;
    for (int i = 0; i < 6000; ++i, now += 1000) console.step(now);
  }
  TEST_ASSERT_EQUAL_UINT(before, allocations);
  TEST_ASSERT_GREATER_THAN_size_t(10'000, port.written);
  TEST_ASSERT_EQUAL_size_t(1, flight.motors.size());
}

}  // namespace

void runHeapTests() { RUN_TEST(test_no_command_allocates); }
