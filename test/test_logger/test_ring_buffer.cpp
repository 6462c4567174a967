#include <unity.h>

#include <deque>
#include <random>

#include "RingBuffer.h"
#include "suites.h"

namespace {

using Ring = strix::RingBuffer<5, 7>;  // neither divides the other

Ring::Record record(std::uint32_t number) {
  Ring::Record r{};
  std::memcpy(&r[1], &number, sizeof number);
  r[0] = static_cast<std::uint8_t>(number * 31U);
  return r;
}

void test_records_come_out_in_order_over_many_wraps() {
  Ring ring;
  std::deque<Ring::Record> model;
  std::mt19937 random(1);
  std::uint32_t dropped = 0;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    if (random() % 2 == 0) {
      const bool fits = model.size() < Ring::kCapacity;
      TEST_ASSERT_EQUAL(fits, ring.push(record(i)));
      fits ? model.push_back(record(i)) : void(++dropped);
    } else {
      const std::size_t records = ring.chunkSize() / Ring::kRecordSize;
      const std::size_t taken = records == 0 ? 0 : random() % (records + 1);
      for (std::size_t k = 0; k < taken; ++k) {
        TEST_ASSERT_EQUAL_MEMORY(model.front().data(), ring.tailPtr() + k * Ring::kRecordSize,
                                 Ring::kRecordSize);
        model.pop_front();
      }
      ring.advanceTail(taken * Ring::kRecordSize);
    }
    TEST_ASSERT_EQUAL(model.size(), ring.used());
    TEST_ASSERT_EQUAL(model.empty(), ring.empty());
    TEST_ASSERT_EQUAL(model.empty(), ring.chunkSize() == 0);
  }
  TEST_ASSERT_GREATER_THAN_UINT32(500, dropped);
  TEST_ASSERT_EQUAL_UINT32(dropped, ring.dropped());
}

void test_a_chunk_ends_at_the_end_of_the_memory_with_a_whole_record() {
  Ring ring;
  for (std::uint32_t i = 0; i < 7; ++i) ring.push(record(i));
  ring.advanceTail(4 * Ring::kRecordSize);
  for (std::uint32_t i = 7; i < 9; ++i) ring.push(record(i));
  TEST_ASSERT_EQUAL(3 * Ring::kRecordSize, ring.chunkSize());  // 4, 5, 6; then 7, 8 at the start
  ring.advanceTail(ring.chunkSize());
  TEST_ASSERT_EQUAL(2 * Ring::kRecordSize, ring.chunkSize());
  TEST_ASSERT_EQUAL_MEMORY(record(7).data(), ring.tailPtr(), Ring::kRecordSize);
}

void test_a_full_ring_drops_the_new_record_and_counts_it() {
  Ring ring;
  for (std::uint32_t i = 0; i < 7; ++i) TEST_ASSERT_TRUE(ring.push(record(i)));
  TEST_ASSERT_FALSE(ring.push(record(7)));
  TEST_ASSERT_FALSE(ring.push(record(8)));
  TEST_ASSERT_EQUAL_UINT32(2, ring.dropped());
  TEST_ASSERT_EQUAL_MEMORY(record(0).data(), ring.tailPtr(), Ring::kRecordSize);
  ring.advanceTail(Ring::kRecordSize);
  TEST_ASSERT_TRUE(ring.push(record(9)));
  ring.advanceTail(6 * Ring::kRecordSize);
  TEST_ASSERT_EQUAL_MEMORY(record(9).data(), ring.tailPtr(), Ring::kRecordSize);
  ring.clear();
  TEST_ASSERT_TRUE(ring.empty());
  TEST_ASSERT_EQUAL_UINT32(0, ring.dropped());
}

void test_a_part_of_a_record_is_not_freed_and_no_more_than_there_is() {
  Ring ring;
  for (std::uint32_t i = 0; i < 3; ++i) ring.push(record(i));
  ring.advanceTail(2 * Ring::kRecordSize - 1);
  TEST_ASSERT_EQUAL(2, ring.used());
  TEST_ASSERT_EQUAL_MEMORY(record(1).data(), ring.tailPtr(), Ring::kRecordSize);
  ring.advanceTail(100 * Ring::kRecordSize);
  TEST_ASSERT_TRUE(ring.empty());
  ring.push(record(5));
  TEST_ASSERT_EQUAL_MEMORY(record(5).data(), ring.tailPtr(), Ring::kRecordSize);
}

}  // namespace

void runRingBufferTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_records_come_out_in_order_over_many_wraps);
  RUN_TEST(test_a_chunk_ends_at_the_end_of_the_memory_with_a_whole_record);
  RUN_TEST(test_a_full_ring_drops_the_new_record_and_counts_it);
  RUN_TEST(test_a_part_of_a_record_is_not_freed_and_no_more_than_there_is);
}
