// The card's logs through the terminal.
#include "ConsoleBench.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

std::string someBytes(std::size_t size) {
  Random random(static_cast<unsigned>(size) + 1);
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) {
    bytes += static_cast<char>(random.below(256));
  }
  return bytes;
}

/// RFC 4648 read the slow way, letter by letter.
std::string decoded(const std::string& line) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  unsigned held = 0;
  for (const char c : line) {
    if (c == '=') break;
    const std::size_t value = letters.find(c);
    TEST_ASSERT_NOT_EQUAL(std::string::npos, value);
    held = (held << 6U | static_cast<unsigned>(value)) & 0xFFFFU;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(held >> bits & 0xFFU);
  }
  TEST_ASSERT_EQUAL_UINT(0, line.size() % 4);
  return bytes;
}

void test_a_log_arrives_byte_for_byte_with_its_length_and_crc() {
  for (const std::size_t size : {0U, 1U, 2U, 3U, 47U, 48U, 49U, 511U, 512U, 513U, 10'000U}) {
    ConsoleBench bench;
    const std::string bytes = someBytes(size);
    bench.card.logs = {{3, "another"}, {12, bytes}};
    const std::vector<std::string> lines = bench.say("log get 12", 2.0F);
    assertIs(("log 12 " + std::to_string(size) + " bytes").c_str(), lines.front());
    assertIs("ok", lines.back());
    std::string found;
    for (std::size_t i = 1; i + 2 < lines.size(); ++i) {
      TEST_ASSERT_LESS_OR_EQUAL_size_t(80, lines[i].size());
      found += decoded(lines[i]);
    }
    TEST_ASSERT_TRUE(found == bytes);
    Crc32 crc;
    crc.update(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    std::array<char, 16> check{};
    std::snprintf(check.data(), check.size(), "%08lx", static_cast<unsigned long>(crc.value()));
    const std::string end =
        "end " + std::to_string(size) + " bytes crc32 " + std::string(check.data());
    assertIs(end.c_str(), lines[lines.size() - 2]);
  }
}

void test_the_list_has_each_log_and_its_size() {
  ConsoleBench bench;
  assertIs("error: there are no logs: is there a card?", bench.outcome("log list"));
  for (std::uint32_t i = 1; i <= 500; ++i) bench.card.logs.emplace_back(i, std::string(i, 'x'));
  const std::vector<std::string> lines = bench.say("log list", 2.0F);
  TEST_ASSERT_EQUAL_size_t(502, lines.size());
  assertIs("500     500", lines[500]);
  assertIs("error: there is no log of that number: see log list",
           bench.outcome("log get 501", 2.0F));
}

void test_a_log_that_is_on_its_way_stops_at_a_key_and_when_motors_go_on() {
  ConsoleBench bench;
  bench.card.logs = {{1, someBytes(1'000'000)}};
  bench.type("log get 1\n", 0.2F);
  assertHas(bench.type("x"), "error: stopped by a key\n");
  bench.type("\nlog get 1\n", 0.2F);
  bench.setMotors(true);
  assertHas(bench.type(""), "error: the motors are on: disarm first\n");
  bench.type("echo off\n");
  assertIs("error: the motors are on: disarm first", bench.outcome("log get 1"));
  assertIs("error: the motors are on: disarm first", bench.outcome("log list"));
}

void test_a_slow_terminal_makes_a_log_slow_and_loses_nothing() {
  ConsoleBench bench;
  const std::string bytes = someBytes(2000);
  bench.card.logs = {{1, bytes}};
  bench.port.free = 1;
  const std::vector<std::string> lines = bench.say("log get 1", 8.0F);
  assertIs("ok", lines.back());
  std::string found;
  for (std::size_t i = 1; i + 2 < lines.size(); ++i) found += decoded(lines[i]);
  TEST_ASSERT_TRUE(found == bytes);
}

void test_a_card_that_gives_nothing_is_told_after_two_seconds() {
  ConsoleBench bench;
  bench.card.logs = {{1, "log"}};
  bench.card.silent = true;
  TEST_ASSERT_EQUAL_size_t(1, bench.say("log get 1", 1.9F).size());
  assertIs("error: the card does not give the log\n", bench.type("", 0.2F));
}

}  // namespace

void runLogTests() {
  RUN_TEST(test_a_log_arrives_byte_for_byte_with_its_length_and_crc);
  RUN_TEST(test_the_list_has_each_log_and_its_size);
  RUN_TEST(test_a_log_that_is_on_its_way_stops_at_a_key_and_when_motors_go_on);
  RUN_TEST(test_a_slow_terminal_makes_a_log_slow_and_loses_nothing);
  RUN_TEST(test_a_card_that_gives_nothing_is_told_after_two_seconds);
}
