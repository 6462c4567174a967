// The flight code takes nothing from the heap: memory cannot run out in the air.
#include <cstdlib>

#include "FakeFlight.h"
#include "suites.h"

// glibc lets a program put its own malloc in front; C++'s operator new and Eigen both come through
// it. With another C library, or under a sanitizer that does the same, this suite is ignored.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define STRIX_COUNTS_ALLOCATIONS 1

namespace {
unsigned allocations = 0;
}

// NOLINTBEGIN(bugprone-reserved-identifier,readability-*): the names are glibc's
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  ++allocations;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ++allocations;
  return __libc_memalign(alignment, size);
}
}
// NOLINTEND(bugprone-reserved-identifier,readability-*)
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
