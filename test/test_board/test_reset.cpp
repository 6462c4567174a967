// What a start knows of the stop before it.
#include <unity.h>

#include "../../src/board/Reset.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr std::uint32_t kCoresWord = 0x0BAD00F1;  // it restarts 8 s after a fault

/// The chip resets: memory is lost, SNVS keeps what it has, and the reset controller knows why.
void restartTeensy(std::uint32_t causes, std::uint32_t word = 0, bool crashed = false) {
  const FakeRetained retained = fakeTeensy().retained;
  const std::uint32_t untaken = fakeTeensy().reset.causes;
  FakeTeensy& teensy = powerUpTeensy();
  teensy.retained = retained;
  teensy.reset = {untaken | causes, word, crashed};
}

void test_each_cause_is_told_once() {
  const struct {
    std::uint32_t bit;
    std::uint32_t cause;
  } kCauses[] = {
      {SRC_SRSR_IPP_RESET_B, reset::kPowerUp},      {SRC_SRSR_IPP_USER_RESET_B, reset::kPin},
      {SRC_SRSR_WDOG_RST_B, reset::kWatchdog},      {SRC_SRSR_WDOG3_RST_B, reset::kWatchdog},
      {SRC_SRSR_JTAG_RST_B, reset::kDebugger},      {SRC_SRSR_JTAG_SW_RST, reset::kDebugger},
      {SRC_SRSR_CSU_RESET_B, reset::kOther},        {SRC_SRSR_TEMPSENSE_RST_B, reset::kTemperature},
      {SRC_SRSR_LOCKUP_SYSRESETREQ, reset::kLockup}};
  powerUpTeensy();
  TEST_ASSERT_EQUAL_HEX32(reset::kPowerUp, takeResetStatus().causes);
  for (const auto& row : kCauses) {
    restartTeensy(row.bit);
    TEST_ASSERT_EQUAL_HEX32(row.cause, takeResetStatus().causes);
  }
}

void test_a_restart_that_was_asked_for_is_no_lock_up() {
  powerUpTeensy();
  (void)takeResetStatus();
  restartTeensy(SRC_SRSR_LOCKUP_SYSRESETREQ, kRestartAsked);
  TEST_ASSERT_EQUAL_HEX32(reset::kSoftware, takeResetStatus().causes);
  // The word was for that start alone.
  restartTeensy(SRC_SRSR_LOCKUP_SYSRESETREQ, fakeTeensy().reset.word);
  TEST_ASSERT_EQUAL_HEX32(reset::kLockup, takeResetStatus().causes);
  restartTeensy(SRC_SRSR_LOCKUP_SYSRESETREQ, kCoresWord, true);
  TEST_ASSERT_EQUAL_HEX32(reset::kLockup, takeResetStatus().causes);
}

void test_a_fault_that_the_watchdog_ended_is_told_from_a_loop_that_hung() {
  powerUpTeensy();
  (void)takeResetStatus();
  restartTeensy(SRC_SRSR_WDOG3_RST_B);
  TEST_ASSERT_EQUAL_HEX32(reset::kWatchdog, takeResetStatus().causes);
  restartTeensy(SRC_SRSR_WDOG3_RST_B, 0, true);
  TEST_ASSERT_EQUAL_HEX32(reset::kWatchdog | reset::kLockup, takeResetStatus().causes);
  // The record is still there when somebody types reboot.
  restartTeensy(SRC_SRSR_LOCKUP_SYSRESETREQ, kRestartAsked, true);
  TEST_ASSERT_EQUAL_HEX32(reset::kSoftware, takeResetStatus().causes);
}

void test_a_reset_in_flight_is_remembered_and_one_on_the_ground_is_not() {
  powerUpTeensy();
  TEST_ASSERT_FALSE(takeResetStatus().motorsWereOn);
  RetainedMotors::remember(true);
  // Without this bit the chip may clear the register when its supply glitches.
  TEST_ASSERT_TRUE((fakeTeensy().retained.control & SNVS_LPCR_GPR_Z_DIS) != 0);
  restartTeensy(SRC_SRSR_IPP_RESET_B);  // a brown-out
  TEST_ASSERT_TRUE(takeResetStatus().motorsWereOn);
  RetainedMotors::remember(false);
  restartTeensy(SRC_SRSR_WDOG3_RST_B);
  TEST_ASSERT_FALSE(takeResetStatus().motorsWereOn);
}

void test_a_register_that_lost_its_supply_says_nothing() {
  powerUpTeensy();
  for (const std::uint32_t rubbish : std::initializer_list<std::uint32_t>{
           0U, 0xFFFFFFFFU, 0xA5A5A5A5U, 1U, ~RetainedMotors::kOn}) {
    fakeTeensy().retained.word = rubbish;
    TEST_ASSERT_FALSE(takeResetStatus().motorsWereOn);
  }
  for (unsigned bit = 0; bit < 32; ++bit) {
    fakeTeensy().retained.word = RetainedMotors::kOn ^ (1U << bit);
    TEST_ASSERT_FALSE(takeResetStatus().motorsWereOn);
  }
}

}  // namespace

void runResetTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_each_cause_is_told_once);
  RUN_TEST(test_a_restart_that_was_asked_for_is_no_lock_up);
  RUN_TEST(test_a_fault_that_the_watchdog_ended_is_told_from_a_loop_that_hung);
  RUN_TEST(test_a_reset_in_flight_is_remembered_and_one_on_the_ground_is_not);
  RUN_TEST(test_a_register_that_lost_its_supply_says_nothing);
}
