// Bytes that survive power-off, and the card that log and reader share.
#include <unity.h>

#include <array>

#include <Arduino.h>

#include "../../src/board/ReadingTurn.h"
#include "../../src/board/Storage.h"
#include "suites.h"

using namespace strix;

namespace {

using Piece = std::array<std::uint8_t, 8>;

std::uint32_t millisOf(const Piece& piece, std::size_t offset) {
  const std::uint32_t start = millis();
  TEST_ASSERT_TRUE(Storage::write(offset, piece.data(), piece.size()));
  return millis() - start;
}

void startAnew() {
  powerUpTeensy();
  fakeEeprom() = FakeEeprom{};
}

void test_what_was_written_is_read_up_to_the_last_byte() {
  startAnew();
  TEST_ASSERT_EQUAL_UINT32(4284, Storage::kBytes);
  const Piece piece{1, 2, 3, 4, 5, 6, 7, 8};
  for (const std::size_t offset : {std::size_t{0}, std::size_t{2142}, Storage::kBytes - 8}) {
    TEST_ASSERT_TRUE(Storage::write(offset, piece.data(), piece.size()));
    Piece found{};
    Storage::read(offset, found.data(), found.size());
    TEST_ASSERT_TRUE(found == piece);
  }
  Piece erased{};
  Storage::read(100, erased.data(), erased.size());
  TEST_ASSERT_EQUAL_HEX8(0xFF, erased[0]);
}

void test_beyond_the_end_nothing_is_written() {
  startAnew();
  const FakeEeprom before = fakeEeprom();
  const Piece piece{1, 2, 3, 4, 5, 6, 7, 8};
  TEST_ASSERT_FALSE(Storage::write(Storage::kBytes - 7, piece.data(), piece.size()));
  TEST_ASSERT_FALSE(Storage::write(Storage::kBytes, piece.data(), piece.size()));
  TEST_ASSERT_FALSE(Storage::write(~std::size_t{0} - 3, piece.data(), piece.size()));
  TEST_ASSERT_TRUE(before.bytes == fakeEeprom().bytes);
}

void test_a_byte_takes_milliseconds_a_full_sector_half_a_second_and_an_equal_one_nothing() {
  startAnew();
  Piece piece{};
  std::uint32_t longest = 0;
  for (std::uint32_t i = 0; i < 5000; ++i) {
    piece.fill(static_cast<std::uint8_t>(i));
    const unsigned erasures = fakeEeprom().erasures;
    const std::uint32_t took = millisOf(piece, 0);
    if (fakeEeprom().erasures == erasures) {
      TEST_ASSERT_LESS_OR_EQUAL_UINT32(8 * 3, took);
    }
    if (took > longest) longest = took;
    TEST_ASSERT_EQUAL_UINT32(0, millisOf(piece, 0));
  }
  TEST_ASSERT_GREATER_THAN_UINT32(0, fakeEeprom().erasures);
  TEST_ASSERT_UINT32_WITHIN(250, 650,
                            longest);  // Storage.h: 0.6 s, twice when both sectors are full
}

void test_a_flash_that_keeps_nothing_is_told() {
  startAnew();
  fakeEeprom().worn = true;
  const Piece piece{1, 2, 3, 4, 5, 6, 7, 8};
  TEST_ASSERT_FALSE(Storage::write(0, piece.data(), piece.size()));
}

/// ms of 10 s that each had the card; the log asks in each pass, the reader while it wants.
struct Shares {
  int reader = 0;
  int log = 0;
  int longestWait = 0;  ///< of the log
};

Shares share(int readerUntil_ms) {
  ReadingTurn turn;
  Shares shares;
  int waited = 0;
  for (int ms = 0; ms < 10'000; ++ms) {
    const Micros now = 1'000'000U + static_cast<Micros>(ms) * 1000U;
    if (turn.over(now)) turn.end(now);  // as SdCard::busy()
    if (ms < readerUntil_ms && turn.take(now)) ++shares.reader;
    if (turn.reading()) {
      ++waited;
    } else {
      ++shares.log;
      waited = 0;
    }
    if (waited > shares.longestWait) shares.longestWait = waited;
  }
  return shares;
}

void test_a_reader_gets_most_of_the_card_and_the_log_never_waits_longer_than_its_rings_last() {
  const Shares shares = share(10'000);
  TEST_ASSERT_INT_WITHIN(200, 7500, shares.reader);
  TEST_ASSERT_INT_WITHIN(200, 2500, shares.log);
  TEST_ASSERT_LESS_OR_EQUAL_INT(150, shares.longestWait);
}

void test_a_reader_that_leaves_gives_the_card_back() {
  const Shares shares = share(10);
  TEST_ASSERT_LESS_OR_EQUAL_INT(150, shares.longestWait);
  TEST_ASSERT_GREATER_OR_EQUAL_INT(9840, shares.log);
  TEST_ASSERT_EQUAL_INT(10'000, share(0).log);
}

}  // namespace

void runStorageTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_what_was_written_is_read_up_to_the_last_byte);
  RUN_TEST(test_beyond_the_end_nothing_is_written);
  RUN_TEST(test_a_byte_takes_milliseconds_a_full_sector_half_a_second_and_an_equal_one_nothing);
  RUN_TEST(test_a_flash_that_keeps_nothing_is_told);
  RUN_TEST(test_a_reader_gets_most_of_the_card_and_the_log_never_waits_longer_than_its_rings_last);
  RUN_TEST(test_a_reader_that_leaves_gives_the_card_back);
}
