// What may be set to what, and when.
#include <unity.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "Parameters.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

void test_each_row_takes_its_range_to_the_ends_and_nothing_beyond() {
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const ParameterInfo& info = kParameterTable[i];
    TEST_ASSERT_NULL(checkParameter(i, info.standard, false));
    TEST_ASSERT_NULL(checkParameter(i, info.lowest, false));
    TEST_ASSERT_NULL(checkParameter(i, info.highest, false));
    for (const float wrong :
         {std::nextafter(info.lowest, -kInfinity), std::nextafter(info.highest, kInfinity),
          std::nanf(""), kInfinity, -kInfinity}) {
      TEST_ASSERT_NOT_NULL(checkParameter(i, wrong, false));
    }
  }
}

void test_a_number_of_things_is_whole() {
  const std::size_t channel = findParameter("RC_MAP_ROLL");
  TEST_ASSERT_NULL(checkParameter(channel, 3.0F, false));
  TEST_ASSERT_NOT_NULL(checkParameter(channel, 3.5F, false));
  const std::size_t fence = findParameter("FENCE_RADIUS");
  TEST_ASSERT_NULL(checkParameter(fence, 30.5F, false));
}

void test_a_refusal_names_the_parameter_and_its_range() {
  TEST_ASSERT_EQUAL_STRING("FENCE_RADIUS is from 5 to 500 m",
                           checkParameter(findParameter("FENCE_RADIUS"), 0.0F, false));
  TEST_ASSERT_EQUAL_STRING("TILT_TIME is from 0 to 5 s",
                           checkParameter(findParameter("TILT_TIME"), -1.0F, false));
  TEST_ASSERT_EQUAL_STRING("SPEED_XY is from 0.2 to 10 m/s",
                           checkParameter(findParameter("SPEED_XY"), 11.0F, false));
  TEST_ASSERT_EQUAL_STRING("DECLINATION is from -180 to 180 deg",
                           checkParameter(findParameter("DECLINATION"), 200.0F, false));
  TEST_ASSERT_EQUAL_STRING("RC_MAP_ROLL is a whole number from 1 to 16",
                           checkParameter(findParameter("RC_MAP_ROLL"), 1.5F, false));
  TEST_ASSERT_EQUAL_STRING("there is no such parameter",
                           checkParameter(kParameterCount, 1.0F, false));
}

void test_with_the_motors_on_only_what_may_change_in_the_air_does() {
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const ParameterInfo& info = kParameterTable[i];
    const char* refusal = checkParameter(i, info.standard, true);
    if (info.lock == ParameterLock::Air) {
      TEST_ASSERT_NULL(refusal);
      continue;
    }
    TEST_ASSERT_NOT_NULL(refusal);
    TEST_ASSERT_EQUAL_INT(0, std::strncmp(refusal, info.name.data(), info.name.size()));
  }
  TEST_ASSERT_EQUAL_STRING("RC_PROTOCOL can be changed with the motors off only",
                           checkParameter(findParameter("RC_PROTOCOL"), 1.0F, true));
}

void test_each_row_is_another_member() {
  Parameters parameters;
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    TEST_ASSERT_EQUAL_FLOAT(kParameterTable[i].standard, getParameter(parameters, i));
    setParameter(parameters, i, 1000.0F + static_cast<float>(i));
  }
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    TEST_ASSERT_EQUAL_FLOAT(1000.0F + static_cast<float>(i), getParameter(parameters, i));
    TEST_ASSERT_EQUAL_size_t(i, findParameter(kParameterTable[i].name));
  }
  TEST_ASSERT_EQUAL_size_t(kParameterCount, findParameter("FENCE"));
  TEST_ASSERT_EQUAL_size_t(kParameterCount, findParameter(""));
}

void test_the_sentences_fit_a_text_to_the_pilot() {
  constexpr std::size_t kText = 100;  // TextHistory::kLength
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    TEST_ASSERT_LESS_THAN_size_t(kText, std::strlen(checkParameter(i, std::nanf(""), false)));
    TEST_ASSERT_LESS_THAN_size_t(kText, std::strlen(kParameterTable[i].locked));
  }
}

}  // namespace

void runTableTests() {
  RUN_TEST(test_each_row_takes_its_range_to_the_ends_and_nothing_beyond);
  RUN_TEST(test_a_number_of_things_is_whole);
  RUN_TEST(test_a_refusal_names_the_parameter_and_its_range);
  RUN_TEST(test_with_the_motors_on_only_what_may_change_in_the_air_does);
  RUN_TEST(test_each_row_is_another_member);
  RUN_TEST(test_the_sentences_fit_a_text_to_the_pilot);
}
