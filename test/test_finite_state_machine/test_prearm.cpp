// Every reason to refuse arming has a bit and a sentence, and the first of several is told.
#include <unity.h>

#include <cstring>

#include "Conditions.h"
#include "suites.h"

using namespace strix;

namespace {

void test_every_reason_to_refuse_arming_has_one_bit_and_one_sentence() {
  PreArmSet seen = 0;
  for (const PreArmCheck& check : kPreArmChecks) {
    TEST_ASSERT_TRUE(check.bit != 0 && (check.bit & (check.bit - 1)) == 0);
    TEST_ASSERT_EQUAL_HEX32(0, seen & check.bit);
    seen |= check.bit;
    TEST_ASSERT_TRUE(std::strlen(check.refusal) > 10);
    TEST_ASSERT_EQUAL_STRING(check.refusal, firstRefusal(check.bit));
    for (const PreArmCheck& other : kPreArmChecks) {
      if (&other != &check) TEST_ASSERT_TRUE(std::strcmp(check.refusal, other.refusal) != 0);
    }
  }
  // Without a gap, so that no bit in use lacks a sentence.
  TEST_ASSERT_EQUAL_HEX32((PreArmSet{1} << kPreArmChecks.size()) - 1U, seen);
  TEST_ASSERT_NULL(firstRefusal(0));
}

void test_the_first_of_several_reasons_is_told() {
  // It is the first of each two: so it is of any number.
  for (std::size_t i = 0; i < kPreArmChecks.size(); ++i) {
    PreArmSet andAllAfter = 0;
    for (std::size_t j = i; j < kPreArmChecks.size(); ++j) {
      TEST_ASSERT_TRUE(firstRefusal(kPreArmChecks[i].bit | kPreArmChecks[j].bit) ==
                       kPreArmChecks[i].refusal);
      andAllAfter |= kPreArmChecks[j].bit;
    }
    TEST_ASSERT_TRUE(firstRefusal(andAllAfter) == kPreArmChecks[i].refusal);
  }
  // A missing device keeps the calibration from ending: the device is the reason to name.
  TEST_ASSERT_EQUAL_STRING(firstRefusal(prearm::kMag),
                           firstRefusal(prearm::kMag | prearm::kNotCalibrated));
}

}  // namespace

void runPreArmTests() {
  RUN_TEST(test_every_reason_to_refuse_arming_has_one_bit_and_one_sentence);
  RUN_TEST(test_the_first_of_several_reasons_is_told);
}
