// The flight code takes nothing from the heap: memory cannot run out in the air.
#include <cstdlib>

#include "FakeFlight.h"
#include "suites.h"

// A program may put its own malloc in front of the C library's; C++'s operator new and Eigen both
// come through it. With another library than these two, or under a sanitizer that does the same,
// this suite is left out.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define STRIX_COUNTS_ALLOCATIONS 1

// NOLINTBEGIN(bugprone-reserved-identifier,readability-*): the names are glibc's
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}
// NOLINTEND(bugprone-reserved-identifier,readability-*)

namespace libc {
constexpr auto malloc = __libc_malloc;
constexpr auto calloc = __libc_calloc;
constexpr auto realloc = __libc_realloc;
constexpr auto memalign = __libc_memalign;
}  // namespace libc

#elif defined(_NEWLIB_VERSION)  // the emulated Cortex-M7
#define STRIX_COUNTS_ALLOCATIONS 1
#include <malloc.h>
#include <reent.h>

namespace libc {
void* malloc(std::size_t size) { return _malloc_r(_REENT, size); }
void* calloc(std::size_t count, std::size_t size) { return _calloc_r(_REENT, count, size); }
void* realloc(void* memory, std::size_t size) { return _realloc_r(_REENT, memory, size); }
void* memalign(std::size_t alignment, std::size_t size) {
  return _memalign_r(_REENT, alignment, size);
}
}  // namespace libc

extern "C" void free(void* memory) { _free_r(_REENT, memory); }  // comes with malloc or not at all
#endif

#ifdef STRIX_COUNTS_ALLOCATIONS
namespace {
unsigned allocations = 0;
}

extern "C" {
void* malloc(std::size_t size) {
  ++allocations;
  return libc::malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return libc::calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  ++allocations;
  return libc::realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return libc::memalign(alignment, size);
}
}
#endif

using namespace strix;

#ifdef STRIX_COUNTS_ALLOCATIONS
namespace {

/// Takes everything and keeps nothing: FakeCard itself allocates.
struct SinkCard {
  std::uint32_t sectors = 0;
  bool busy() { return false; }
  bool writeSector(std::uint32_t /*index*/, const std::uint8_t (& /*data*/)[kSectorSize]) {
    ++sectors;
    return true;
  }
  bool sync(std::uint32_t /*length*/) { return true; }
};

void test_this_test_sees_allocations() {
  unsigned before = allocations;
  const FakeBoard withRoomForItsWrites;
  TEST_ASSERT_TRUE(allocations > before);
  before = allocations;
  const Eigen::MatrixXf ofUnknownSize(3,
                                      static_cast<Eigen::Index>(withRoomForItsWrites.time() + 3));
  TEST_ASSERT_TRUE(allocations > before && ofUnknownSize.size() == 9);
}

void test_setup_and_a_whole_flight_take_nothing_from_the_heap() {
  BasicFakeFlight<BasicFakeBoard<SinkCard>> flight;
  const unsigned before = allocations;
  flight.getReady();
  TEST_ASSERT_FALSE(flight.software.logger().failed());
  flight.board.gps.reading.fix = 0;
  flight.run(0.2F);
  TEST_ASSERT_FALSE(flight.arm());  // refused, with a text
  flight.board.gps.reading.fix = 3;
  flight.run(0.2F);
  flight.reach(FlightState::Land);
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Idle, 10.0F));
  flight.reach(FlightState::Hold);
  flight.board.pilot.kill = true;
  flight.run(1.0F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);
  TEST_ASSERT_EQUAL_UINT(before, allocations);
  TEST_ASSERT_TRUE(flight.board.sd.sectors > 1000);
}

}  // namespace
#endif

void runHeapTests() {
#ifdef STRIX_COUNTS_ALLOCATIONS
  Unity.TestFile = __FILE__;
  RUN_TEST(test_this_test_sees_allocations);
  RUN_TEST(test_setup_and_a_whole_flight_take_nothing_from_the_heap);
#endif
}
