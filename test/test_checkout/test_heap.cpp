// The checkout takes nothing from the heap, whatever is typed.
#include <cstdlib>
#include <new>

#include "CheckoutBench.h"
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

void test_no_command_allocates() {
  FakeBoard board;
  Checkout<FakeBoard> checkout(board, benchConfig(), kTestPins);
  constexpr std::string_view kTyped =
      "help\rsensors\r\raxes\r\r\r\r\r\rimu\rmag\rbaro\rgps\rpilot\rprops off\rmotor "
      "2\rstop\rwhat\r";
  std::array<char, 100'000> printed{};
  std::size_t size = 0;
  std::size_t sent = 0;
  checkout.begin();
  const unsigned before = allocations;
  std::uint32_t step = 0;
  for (; sent < kTyped.size(); ++step) {
    // A line every 6 s; the bench's own list of ESC commands was reserved by the board.
    bool typing = step % 1000 == 0 || (sent > 0 && kTyped[sent - 1] != '\r');
    checkout.step(
        [&] {
          if (!typing) return -1;
          typing = false;  // one character a step
          return int{kTyped[sent++]};
        },
        [&](const char* text, std::size_t count) {
          const std::size_t room = printed.size() - size;
          const std::size_t taken = count < room ? count : room;
          std::copy(text, text + taken, &printed[size]);
          size += taken;
          return taken;
        });
    board.escWrites.clear();
    board.advance(6000);
  }
  TEST_ASSERT_EQUAL_UINT(before, allocations);
  const std::string_view text(printed.data(), size);
  for (const char* part : {"FAIL", "5 of 5", "hPa", "M2, front right", "there is no such"}) {
    TEST_ASSERT_TRUE_MESSAGE(text.find(part) != std::string_view::npos, part);
  }
}

}  // namespace

void runHeapTests() { RUN_TEST(test_no_command_allocates); }
