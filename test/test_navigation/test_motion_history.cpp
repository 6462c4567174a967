/// How far the aircraft has moved since: what a delayed measurement is compared by.
#include <unity.h>

#include "MotionHistory.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr Micros kSample = 1'000;  // us, of the IMU

Motion motionOf(const Vector3f& position, const Vector3f& velocity) { return {position, velocity}; }

/// A smooth flight, 2 m and 3 rad/s: at most 18 m/s^2.
constexpr float kSize = 2.0F;
constexpr float kRate = 3.0F;
Motion smoothFlight(Micros since) {
  const SinCos s = sinCos(kRate * toSeconds(since));
  return motionOf({kSize * s.sin, -kSize * s.cos, 0.5F * kSize * s.sin},
                  {kSize * kRate * s.cos, kSize * kRate * s.sin, 0.5F * kSize * kRate * s.cos});
}

/// Ends at start + length, with samples in between as `step` gives them.
template <class Step>
MotionHistory flown(Micros start, Micros length, const Step& step) {
  MotionHistory history;
  history.clear(start);
  for (Micros since = 0; since < length;) {
    const Micros next = since + step() < length ? since + step() : length;
    const Motion a = smoothFlight(since);
    const Motion b = smoothFlight(next);
    history.add(start + next, b.position - a.position, b.velocity - a.velocity);
    since = next;
  }
  return history;
}

void assertMotion(float tolerance, const Motion& expected, const Motion& actual) {
  for (int i = 0; i < 3; ++i) {
    TEST_ASSERT_FLOAT_WITHIN(tolerance, expected.position(i), actual.position(i));
    TEST_ASSERT_FLOAT_WITHIN(tolerance * kRate, expected.velocity(i), actual.velocity(i));
  }
}

void test_the_motion_over_any_age_is_the_integral_since_then() {
  for (const Micros step : {250U, 889U, 1'000U, 3'700U}) {
    const Micros length = 2'000'000;
    const MotionHistory history = flown(0, length, [step] { return step; });
    // The chord between two entries, kSpacing + step apart, misses the curve by a h^2/8. The sums
    // hold 2 m in float32 steps of 2.4e-7 m, half of one lost in each of 8000 additions, of either
    // sign: 1e-5 m is ten times the root of their number.
    const float h = toSeconds(MotionHistory::kSpacing + step);
    const float tolerance = kSize * kRate * kRate * h * h / 8.0F + 2e-5F;
    for (Micros age = 0; age <= MotionHistory::kSpan; age += 1'111) {
      const Motion now = smoothFlight(length);
      const Motion then = smoothFlight(length - age);
      assertMotion(tolerance, {now.position - then.position, now.velocity - then.velocity},
                   history.over(age));
    }
  }
}

void test_at_a_steady_speed_no_age_is_off_by_the_spacing() {
  MotionHistory history;
  history.clear(0);
  const Vector3f velocity(8.0F, -4.0F, 1.0F);
  for (Micros now = kSample; now <= 1'003'000; now += kSample) {
    history.add(now, toSeconds(kSample) * velocity, Vector3f::Zero());
  }
  for (Micros age = 0; age <= MotionHistory::kSpan; age += 777) {
    const Motion motion = history.over(age);
    for (int i = 0; i < 3; ++i) {
      // 1000 additions to a sum of 8 m, each off by half of 9.5e-7 m at most; in 0.63 s 630 of
      // them.
      TEST_ASSERT_FLOAT_WITHIN(3e-4F, toSeconds(age) * velocity(i), motion.position(i));
    }
    TEST_ASSERT_TRUE(motion.velocity.isZero(0.0F));
  }
}

void test_a_wrap_of_the_clock_changes_no_bit() {
  const auto step = [] { return Micros{889}; };
  const Micros length = 1'500'000;
  const MotionHistory reference = flown(0, length, step);
  // The wrap at the start, in what is remembered, and a moment ago.
  for (const Micros before : {1U, 500'000U, 1'000'000U, 1'450'000U, 1'499'500U}) {
    const MotionHistory wrapped = flown(Micros{0} - before, length, step);
    for (Micros age = 0; age <= 2 * MotionHistory::kSpan; age += 997) {
      TEST_ASSERT_TRUE(reference.over(age).position == wrapped.over(age).position);
      TEST_ASSERT_TRUE(reference.over(age).velocity == wrapped.over(age).velocity);
    }
  }
}

void test_an_age_before_the_start_gives_what_has_been_since() {
  for (const Micros length : {1'000U, 9'000U, 10'000U, 95'500U, 300'000U}) {
    const MotionHistory history = flown(0, length, [] { return Micros{500}; });
    const Motion start = smoothFlight(0);
    const Motion end = smoothFlight(length);
    const Micros ages[] = {length, length + 1, 3 * length, MotionHistory::kSpan, 5'000'000};
    for (const Micros age : ages) {
      if (age < length) continue;
      assertMotion(1e-5F, {end.position - start.position, end.velocity - start.velocity},
                   history.over(age));
    }
  }
}

void test_an_age_beyond_the_span_gives_the_oldest_known() {
  const Micros length = 3'000'000;  // a whole number of entries
  const MotionHistory history = flown(0, length, [] { return kSample; });
  TEST_ASSERT_TRUE(MotionHistory::kSpan >= 500'000);  // slower than any GPS receiver's answer
  const Motion oldest = history.over(MotionHistory::kSpan);
  TEST_ASSERT_TRUE(oldest.position.norm() > 1.0F);
  constexpr Micros kAges[] = {MotionHistory::kSpan + 1, 700'000, 2'000'000, 0x7FFF'FFFF};
  for (const Micros age : kAges) {
    // The same entry, once by interpolation with part 1, once by itself: rounding of a 4 m sum.
    assertMotion(2e-6F, oldest, history.over(age));
  }
}

void test_what_was_before_a_new_start_is_forgotten() {
  MotionHistory history = flown(0, 1'000'000, [] { return kSample; });
  history.clear(1'000'000);
  for (const Micros age : {0U, 5'000U, 500'000U, 5'000'000U}) {
    TEST_ASSERT_TRUE(history.over(age).position.isZero(0.0F));
    TEST_ASSERT_TRUE(history.over(age).velocity.isZero(0.0F));
  }
  history.add(1'020'000, {1.0F, 2.0F, 3.0F}, {4.0F, 5.0F, 6.0F});
  for (const Micros age : {20'000U, 50'000U, 5'000'000U}) {
    TEST_ASSERT_TRUE(history.over(age).position == Vector3f(1.0F, 2.0F, 3.0F));
    TEST_ASSERT_TRUE(history.over(age).velocity == Vector3f(4.0F, 5.0F, 6.0F));
  }
}

void test_samples_at_uneven_times_add_up_all_the_same() {
  Random random(3);
  const Micros length = 2'000'000;
  const MotionHistory history =
      flown(0, length, [&random] { return Micros{200} + random.below(4'000); });
  const float h = toSeconds(MotionHistory::kSpacing + 4'200);
  const float tolerance = kSize * kRate * kRate * h * h / 8.0F + 2e-5F;  // as above
  for (Micros age = 0; age <= MotionHistory::kSpan; age += 1'234) {
    const Motion now = smoothFlight(length);
    const Motion then = smoothFlight(length - age);
    assertMotion(tolerance, {now.position - then.position, now.velocity - then.velocity},
                 history.over(age));
  }
}

}  // namespace

void runMotionHistoryTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_motion_over_any_age_is_the_integral_since_then);
  RUN_TEST(test_at_a_steady_speed_no_age_is_off_by_the_spacing);
  RUN_TEST(test_a_wrap_of_the_clock_changes_no_bit);
  RUN_TEST(test_an_age_before_the_start_gives_what_has_been_since);
  RUN_TEST(test_an_age_beyond_the_span_gives_the_oldest_known);
  RUN_TEST(test_what_was_before_a_new_start_is_forgotten);
  RUN_TEST(test_samples_at_uneven_times_add_up_all_the_same);
}
