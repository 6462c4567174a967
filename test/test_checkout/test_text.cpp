// What is typed and what is printed: numbers, slow terminals, editing, the choice at power-up.
#include "CheckoutBench.h"
#include "PowerUpChoice.h"
#include "suites.h"

using namespace strix;

namespace {

std::string printed(TextOut& out) {
  std::string text;
  out.drain([&text](const char* from, std::size_t count) {
    text.append(from, count);
    return count;
  });
  return text;
}

void test_numbers_are_printed_as_a_person_writes_them() {
  TextOut out;
  out << Fixed{9.80665F, 3} << " " << Fixed{-0.0004F, 3} << " " << Fixed{-12.5F, 1} << " "
      << Fixed{0.996F, 2} << " " << Fixed{1013.25F, 0} << " " << Fixed{kNaN, 2} << " "
      << Fixed{3e20F, 1} << " " << Degrees{-119'700'001} << " " << Degrees{574'200'000};
  TEST_ASSERT_EQUAL_STRING("9.807 0.000 -12.5 1.00 1013 no number > 1e9 -11.9700001 57.4200000",
                           printed(out).c_str());
}

void test_a_slow_terminal_gets_every_character() {
  CheckoutBench bench;
  bench.begin();
  const std::string quick = bench.say("help");
  TextOut out;
  for (const char c : quick) out << std::array<char, 2>{c, '\0'}.data();
  std::string slow;
  for (int i = 0; i < 20'000 && !out.empty(); ++i) {
    out.drain([&slow](const char* from, std::size_t) {
      if (*from != '\r') slow += *from;
      return std::size_t{1};
    });
  }
  TEST_ASSERT_EQUAL_STRING(quick.c_str(), slow.c_str());
}

void test_what_a_terminal_loses_is_counted_and_told() {
  TextOut out;
  for (std::size_t i = 0; i < TextOut::kCapacity + 7; ++i) out << "x";
  TEST_ASSERT_EQUAL_UINT32(TextOut::kCapacity, printed(out).size());
  assertHas(printed(out), "(7 characters lost");
}

void test_a_terminal_that_takes_nothing_holds_up_nothing() {
  CheckoutBench bench;
  bench.begin();
  bench.terminalTakes = false;
  bench.say("imu", 600.0F);
  const std::uint32_t before = bench.board.imu.taken;
  bench.run(1.0F);
  TEST_ASSERT_UINT32_WITHIN(2, 1125, bench.board.imu.taken - before);
}

void test_a_line_can_be_corrected_and_a_long_one_is_none() {
  CheckoutBench bench;
  bench.begin();
  assertHas(bench.say("hell\bp"), "5 s of standstill");
  assertHas(bench.say("stop" + std::string(60, ' ')), "too long");
  assertHas(bench.say("  stop  "), "all motors are off");
  assertHas(bench.say("motor"), "no such command");
}

/// The answer when a terminal opens at `opens` us and sends `text` at `sends` us.
PowerUpChoice::Answer choice(Micros opens, Micros sends, const std::string& text,
                             Micros closes = 60'000'000) {
  constexpr Micros kBeforeWrap = 0U - 1'000'000U;
  PowerUpChoice power(kBeforeWrap);
  std::size_t sent = 0;
  for (Micros time = 0; time < 10'000'000; time += 1000) {
    const bool typing = time >= sends && sent < text.size();
    const int c = typing ? static_cast<unsigned char>(text[sent++]) : -1;
    const auto answer = power.update(kBeforeWrap + time, time >= opens && time < closes, c);
    if (answer != PowerUpChoice::Answer::Open) return answer;
  }
  return PowerUpChoice::Answer::Open;
}

void test_the_checkout_is_chosen_within_5_s_of_the_terminal_and_never_later() {
  using Answer = PowerUpChoice::Answer;
  TEST_ASSERT_TRUE(choice(1'000'000, 3'000'000, "checkout\r") == Answer::Checkout);
  TEST_ASSERT_TRUE(choice(1'000'000, 5'900'000, "checkout\n") == Answer::Checkout);
  TEST_ASSERT_TRUE(choice(1'000'000, 6'000'000, "checkout\n") == Answer::Fly);
  TEST_ASSERT_TRUE(choice(1'000'000, 2'000'000, "hello\rcheckout\r") == Answer::Checkout);
  TEST_ASSERT_TRUE(choice(1'000'000, 2'000'000, "checkout") == Answer::Fly);  // no Enter
  TEST_ASSERT_TRUE(choice(1'000'000, 2'000'000, "checkouts\r") == Answer::Fly);
  TEST_ASSERT_TRUE(choice(2'500'000, 3'000'000, "checkout\r") ==
                   Answer::Fly);  // no terminal in time
  TEST_ASSERT_TRUE(choice(1'000'000, 3'000'000, "checkout\r", 2'000'000) == Answer::Fly);
  TEST_ASSERT_TRUE(choice(60'000'000, 500'000, "checkout\r") == Answer::Fly);  // none at all
}

}  // namespace

void runTextTests() {
  RUN_TEST(test_numbers_are_printed_as_a_person_writes_them);
  RUN_TEST(test_a_slow_terminal_gets_every_character);
  RUN_TEST(test_what_a_terminal_loses_is_counted_and_told);
  RUN_TEST(test_a_terminal_that_takes_nothing_holds_up_nothing);
  RUN_TEST(test_a_line_can_be_corrected_and_a_long_one_is_none);
  RUN_TEST(test_the_checkout_is_chosen_within_5_s_of_the_terminal_and_never_later);
}
