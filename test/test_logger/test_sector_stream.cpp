#include <unity.h>

#include "FakeCard.h"
#include "SectorStream.h"
#include "suites.h"

using namespace strix;

namespace {

using Stream = SectorStream<FakeCard>;

std::vector<std::uint8_t> ramp(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i * 7 + i / 251 + 1);
  return bytes;
}

void test_a_block_without_bytes_is_not_closed() {
  FakeCard card;
  Stream stream(card);
  stream.begin(1, 2);
  stream.closeBlock(0);
  TEST_ASSERT_EQUAL_UINT32(0, stream.length());
  stream.append(ramp(10).data(), 10);
  stream.closeBlock(0);
  stream.closeBlock(0);
  TEST_ASSERT_EQUAL_UINT32(10 + Stream::kBlockEnd, stream.length());
}

void test_length_counts_a_sector_in_the_cards_hands_once() {
  FakeCard card;
  Stream stream(card);
  stream.begin(1, 2);
  stream.append(ramp(600).data(), 600);
  TEST_ASSERT_EQUAL_UINT32(600, stream.length());
  TEST_ASSERT_TRUE(stream.writeFull());
  TEST_ASSERT_EQUAL_UINT32(600, stream.length());
  TEST_ASSERT_TRUE(stream.ready());
  TEST_ASSERT_EQUAL_UINT32(600, stream.length());
  TEST_ASSERT_EQUAL(kSectorSize - 88, stream.sectorRoom());
}

void test_a_partial_sector_is_pending_again_after_more_bytes() {
  FakeCard card;
  Stream stream(card);
  const std::vector<std::uint8_t> bytes = ramp(100);
  stream.begin(1, 2);
  TEST_ASSERT_FALSE(stream.partialPending());
  stream.append(bytes.data(), 60);
  TEST_ASSERT_TRUE(stream.partialPending());
  TEST_ASSERT_TRUE(stream.writePartial());
  TEST_ASSERT_FALSE(stream.partialPending());
  TEST_ASSERT_EQUAL_UINT32(0, stream.durable());
  TEST_ASSERT_TRUE(stream.ready());
  stream.append(&bytes[60], 40);
  TEST_ASSERT_TRUE(stream.partialPending());
  TEST_ASSERT_TRUE(stream.writePartial());
  TEST_ASSERT_TRUE(stream.ready() && stream.sync());
  TEST_ASSERT_EQUAL_UINT32(100, stream.durable());
  TEST_ASSERT_EQUAL_UINT32(1, card.rewrites);
  TEST_ASSERT_EQUAL_MEMORY(bytes.data(), card.durableFile().data(), 100);
}

void test_what_the_card_refused_is_kept() {
  FakeCard card;
  Stream stream(card);
  const std::vector<std::uint8_t> bytes = ramp(600);
  stream.begin(1, 2);
  stream.append(bytes.data(), 600);
  card.refuses = true;
  TEST_ASSERT_FALSE(stream.writeFull());
  TEST_ASSERT_TRUE(stream.ready());
  TEST_ASSERT_TRUE(stream.sectorFull());
  card.refuses = false;
  TEST_ASSERT_TRUE(stream.writeFull());
  TEST_ASSERT_TRUE(stream.ready());
  TEST_ASSERT_TRUE(stream.writePartial());
  TEST_ASSERT_EQUAL_MEMORY(bytes.data(), card.sectors().data(), 600);
}

}  // namespace

void runSectorStreamTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_block_without_bytes_is_not_closed);
  RUN_TEST(test_length_counts_a_sector_in_the_cards_hands_once);
  RUN_TEST(test_a_partial_sector_is_pending_again_after_more_bytes);
  RUN_TEST(test_what_the_card_refused_is_kept);
}
