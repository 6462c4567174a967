#include <unity.h>
#include "FieldTracker.h"
#include "suites.h"

namespace {

using strix::FieldTracker;
using strix::FieldTrackerConfig;
using strix::Vector3f;

constexpr float kStep = 0.01F;    // s between readings
constexpr float kTurning = 1.0F;  // rad/s
constexpr float kNorm = 50.0F;    // uT
constexpr float kDip = 1.1F;      // rad

/// @param heading  which way its horizontal part points, rad: of no interest to the tracker
Vector3f field(float norm, float dip, float heading = 0.3F) {
  const float level = norm * strix::cosine(dip);
  return {level * strix::cosine(heading), level * strix::sine(heading), norm * strix::sine(dip)};
}

FieldTracker tracker() {
  FieldTracker made{FieldTrackerConfig{}};
  made.start(field(kNorm, kDip));
  return made;
}

/// @return seconds after which the field was first taken for the earth's; negative if it never was
float trustedAfter(FieldTracker& t, const Vector3f& seen, float rate, float seconds) {
  const int steps = static_cast<int>(seconds / kStep);
  for (int i = 0; i < steps; ++i) {
    if (t.update(seen, rate, kStep)) return static_cast<float>(i) * kStep;
  }
  return -1.0F;
}

void test_the_earths_field_is_trusted_at_every_heading_and_with_the_errors_of_a_calibration() {
  FieldTracker t = tracker();
  for (int i = 0; i < 6'000; ++i) {  // a minute
    const auto phase = 0.05F * static_cast<float>(i);
    const float norm = kNorm * (1.0F + 0.05F * strix::sine(phase));
    const float dip = kDip + 0.07F * strix::cosine(0.7F * phase);
    TEST_ASSERT_TRUE(t.update(field(norm, dip, phase), kTurning, kStep));
  }
}

void test_a_field_of_another_length_or_dip_is_not_trusted() {
  for (const Vector3f& bent : {field(1.1F * kNorm, kDip), field(0.9F * kNorm, kDip),
                               field(kNorm, kDip + 0.15F), field(kNorm, kDip - 0.15F)}) {
    FieldTracker t = tracker();
    TEST_ASSERT_TRUE(trustedAfter(t, bent, kTurning, 10.0F) < 0.0F);
    // And leaves no trace: what it was before is trusted at once.
    TEST_ASSERT_TRUE(t.update(field(kNorm, kDip), kTurning, kStep));
  }
}

void test_a_new_field_is_adopted_after_its_time_of_motion_and_the_old_one_given_up() {
  FieldTracker t = tracker();
  const Vector3f moved = field(1.2F * kNorm, kDip - 0.3F);
  // The first reading only begins the trial.
  TEST_ASSERT_FLOAT_WITHIN(3.0F * kStep, FieldTrackerConfig{}.adopt,
                           trustedAfter(t, moved, kTurning, 60.0F));
  TEST_ASSERT_FALSE(t.update(field(kNorm, kDip), kTurning, kStep));
}

void test_what_lies_beside_iron_does_not_take_its_field_for_the_earths() {
  FieldTracker t = tracker();
  TEST_ASSERT_TRUE(trustedAfter(t, field(1.2F * kNorm, kDip), 0.02F, 600.0F) < 0.0F);
}

void test_a_field_that_changes_on_the_way_is_never_adopted() {
  FieldTracker t = tracker();
  for (int i = 0; i < 30'000; ++i) {  // 5 min; by a fifth of its length, ten times a minute
    const float phase = 0.01F * static_cast<float>(i);
    const Vector3f bent = field(kNorm * (1.4F + 0.2F * strix::sine(phase)), kDip);
    TEST_ASSERT_FALSE(t.update(bent, kTurning, kStep));
  }
}

void test_a_field_that_changes_slowly_is_followed() {
  FieldTracker t = tracker();
  float norm = kNorm;
  for (int i = 0; i < 60'000; ++i) {  // 10 min, 2 % a minute: a lag of 0.7 % at 20 s
    norm *= 1.0F + 0.02F * kStep / 60.0F;
    TEST_ASSERT_TRUE(t.update(field(norm, kDip), 0.0F, kStep));  // at rest: not adopted anew
  }
  TEST_ASSERT_TRUE(norm > 1.2F * kNorm);
  TEST_ASSERT_FALSE(t.update(field(kNorm, kDip), kTurning, kStep));
}

}  // namespace

void runFieldTrackerTests() {
  RUN_TEST(test_the_earths_field_is_trusted_at_every_heading_and_with_the_errors_of_a_calibration);
  RUN_TEST(test_a_field_of_another_length_or_dip_is_not_trusted);
  RUN_TEST(test_a_new_field_is_adopted_after_its_time_of_motion_and_the_old_one_given_up);
  RUN_TEST(test_what_lies_beside_iron_does_not_take_its_field_for_the_earths);
  RUN_TEST(test_a_field_that_changes_on_the_way_is_never_adopted);
  RUN_TEST(test_a_field_that_changes_slowly_is_followed);
}
