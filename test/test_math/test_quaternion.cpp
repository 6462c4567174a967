// Quaternions: what must hold for every rotation.
#include <unity.h>

#include <cmath>

#include "AssertNear.h"
#include "Random.h"
#include "Rotation.h"
#include "suites.h"

using namespace strix;

namespace {

// One product of unit quaternions rounds four products and three sums of size 1: up to 2e-7.
constexpr float kProduct = 5e-7F;
constexpr int kTrials = 2000;

const Quaternion kI{0.0F, 1.0F, 0.0F, 0.0F};
const Quaternion kJ{0.0F, 0.0F, 1.0F, 0.0F};
const Quaternion kK{0.0F, 0.0F, 0.0F, 1.0F};

Quaternion negative(const Quaternion& q) { return {-q.w, -q.x, -q.y, -q.z}; }

Quaternion yawed(float yaw) { return eulerToQuaternion({0.0F, 0.0F, yaw}); }

void test_the_convention_is_hamiltons() {
  assertNear(0.0F, kK, kI * kJ);
  assertNear(0.0F, kI, kJ * kK);
  assertNear(0.0F, kJ, kK * kI);
  assertNear(0.0F, negative(kK), kJ * kI);
  for (const Quaternion& unit : {kI, kJ, kK}) {
    assertNear(0.0F, Quaternion{-1.0F, 0.0F, 0.0F, 0.0F}, unit * unit);
  }
}

void test_products_are_associative_and_keep_length() {
  Random random(2);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion a = random.rotation();
    const Quaternion b = random.rotation();
    const Quaternion c = random.rotation();
    assertNear(2.0F * kProduct, (a * b) * c, a * (b * c));
    TEST_ASSERT_FLOAT_WITHIN(kProduct, 1.0F, norm(a * b));
  }
}

void test_the_conjugate_undoes_a_rotation() {
  Random random(3);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = random.rotation();
    assertNear(kProduct, Quaternion{}, q * conjugate(q));
    assertNear(kProduct, Quaternion{}, conjugate(q) * q);
  }
}

void test_normalising_gives_length_one_or_the_identity() {
  Random random(4);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = random.rotation();
    const float scale = exponential(random.uniform(-20.0F, 20.0F));
    assertNear(kProduct, q, normalized({q.w * scale, q.x * scale, q.y * scale, q.z * scale}));
  }
  assertNear(0.0F, Quaternion{}, normalized({0.0F, 0.0F, 0.0F, 0.0F}));
  assertNear(0.0F, Quaternion{}, normalized({1.0F, kNaN, 0.0F, 0.0F}));
  assertNear(0.0F, Quaternion{}, normalized({1.0F, 1e30F, 0.0F, 0.0F}));  // its square overflows
}

void test_the_exponential_turns_by_the_vectors_length_about_its_direction() {
  // Half a radian is where the series takes over; both sides of it are here.
  Random random(5);
  for (const double angle :
       {1e-8, 1e-5, 1e-3, 0.1, 0.3, 0.45, 0.499, 0.501, 1.0, 3.0, 6.0, 100.0}) {
    for (int i = 0; i < 200; ++i) {
      const Vector3f axis = random.direction();
      const Quaternion q = quaternionExp(axis * static_cast<float>(angle));
      // The rounded argument itself turns by up to 1e-7 of its size.
      const auto tolerance = static_cast<float>(2e-7 * (1.0 + angle));
      TEST_ASSERT_FLOAT_WITHIN(tolerance, std::cos(0.5 * angle), q.w);
      const auto sineHalf = static_cast<float>(std::sin(0.5 * angle));
      const float small = angle < 0.5 ? static_cast<float>(angle) : 1.0F;
      assertNear(small * tolerance, axis * sineHalf, q.vec());
    }
  }
}

/// The series alone, where it errs most: in float it must be as good as the numbers themselves.
void test_the_series_of_the_exponential_errs_by_less_than_its_rounding() {
  for (int i = 1; i <= 4999; ++i) {
    const auto angle = static_cast<float>(i) * 1e-4F;
    const Quaternion q = quaternionExp({0.0F, angle, 0.0F});
    const double half = 0.5 * static_cast<double>(angle);
    // Of a cosine near 1 one rounding is 6e-8 and three remain visible; the sine's is in parts of
    // itself. The next terms of the series are a^8/1e7 = 4e-10 and, of the sine, a^6/3e5 = 5e-8.
    TEST_ASSERT_DOUBLE_WITHIN(1.2e-7, std::cos(half), static_cast<double>(q.w));
    TEST_ASSERT_DOUBLE_WITHIN(2.4e-7 * std::sin(half), std::sin(half), static_cast<double>(q.y));
    TEST_ASSERT_EQUAL_FLOAT(0.0F, q.x);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, q.z);
  }
}

void test_small_turns_add_up() {
  // One rad/s for a second at 1 kHz: 1000 products, each rounded, a random walk of 2e-7 each.
  Quaternion q;
  for (int i = 0; i < 1000; ++i) q = renormalized(q * quaternionExp({0.0F, 0.0F, 1e-3F}));
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 1.0F, quaternionLog(q).z());
}

void test_renormalising_takes_out_small_errors_of_the_length() {
  Random random(12);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = random.rotation();
    const float error = random.uniform(-1e-3F, 1e-3F);
    const float scale = 1.0F + error;
    const Quaternion off{q.w * scale, q.x * scale, q.y * scale, q.z * scale};
    // One Newton step: 1.5 e^2 is left, beside rounding; the direction stays.
    TEST_ASSERT_FLOAT_WITHIN(1.5F * error * error + 2e-7F, 1.0F, norm(renormalized(off)));
    assertNear(1.5F * error * error + kProduct, q, renormalized(off));
  }
}

void test_renormalising_holds_the_length_for_a_million_products() {
  Random random(13);
  const Quaternion turn = quaternionExp(random.direction() * 0.003F);
  Quaternion q = random.rotation();
  for (int i = 0; i < 1'000'000; ++i) {
    q = renormalized(q * turn);
    if (i % 1000 == 0) TEST_ASSERT_FLOAT_WITHIN(3e-7F, 1.0F, norm(q));
  }
}

void test_renormalising_lets_a_nan_be_seen() {
  TEST_ASSERT_FALSE(isFinite(renormalized({1.0F, kNaN, 0.0F, 0.0F}).w));
}

void test_the_exponential_makes_unit_quaternions() {
  Random random(6);
  for (int i = 0; i < kTrials; ++i) {
    const Vector3f v = random.direction() * exponential(random.uniform(-20.0F, 3.0F));
    TEST_ASSERT_FLOAT_WITHIN(2e-7F, 1.0F, norm(quaternionExp(v)));
  }
  assertNear(0.0F, Quaternion{}, quaternionExp(Vector3f::Zero()));
}

void test_the_logarithm_is_the_inverse_of_the_exponential() {
  Random random(7);
  // 2e-4 rad is where the logarithm changes its form; pi is where its domain ends.
  for (const float angle : {1e-20F, 1e-8F, 1e-5F, 1.99e-4F, 2.01e-4F, 9.99e-4F, 1.001e-3F, 0.1F,
                            1.0F, 2.0F, 3.0F, 3.14F, 3.1415F}) {
    for (int i = 0; i < 200; ++i) {
      const Vector3f v = random.direction() * angle;
      assertNear(1e-6F * angle, v, quaternionLog(quaternionExp(v)));
    }
  }
  assertNear(0.0F, Vector3f::Zero(), quaternionLog(Quaternion{}));
}

void test_the_logarithm_of_any_rotation_is_the_short_way_back_to_it() {
  Random random(8);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = random.rotation();
    const Vector3f v = quaternionLog(q);
    TEST_ASSERT_TRUE(v.norm() <= kPi + 1e-6F);
    assertSameRotation(1e-6F, q, quaternionExp(v));
    assertNear(0.0F, v, quaternionLog(negative(q)));  // q and -q are the same rotation
  }
}

void test_the_logarithm_of_half_a_turn_is_pi_long() {
  Random random(9);
  for (int i = 0; i < kTrials; ++i) {
    const Vector3f axis = random.direction();
    const Quaternion q{0.0F, axis.x(), axis.y(), axis.z()};
    TEST_ASSERT_FLOAT_WITHIN(1e-6F, kPi, quaternionLog(q).norm());
    assertSameRotation(1e-6F, q, quaternionExp(quaternionLog(q)));
  }
}

void test_an_error_injected_on_the_right_is_a_turn_about_the_bodys_axes_at_every_yaw() {
  // Rolled by alpha to the right, the right side is down whichever way the nose points. On the left
  // the same alpha turns about north: right at yaw 0, to the wrong side at yaw 180.
  const float alpha = 0.1F;
  for (int degree = 0; degree < 360; degree += 15) {
    const Quaternion q = yawed(static_cast<float>(degree) * kDegToRad);
    const EulerAngles e = quaternionToEuler(injectRight(q, {alpha, 0.0F, 0.0F}));
    // [1, alpha/2] normalised turns by 2 atan(alpha/2) = alpha - alpha^3/12.
    TEST_ASSERT_FLOAT_WITHIN(1e-4F, alpha, e.roll);
    TEST_ASSERT_FLOAT_WITHIN(1e-6F, 0.0F, e.pitch);
  }
}

void test_an_error_injected_on_the_left_would_roll_the_wrong_way_at_yaw_180() {
  const Quaternion south = yawed(kPi);
  const Quaternion small{1.0F, 0.05F, 0.0F, 0.0F};
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, -0.1F, quaternionToEuler(normalized(small * south)).roll);
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, 0.1F,
                           quaternionToEuler(injectRight(south, {0.1F, 0.0F, 0.0F})).roll);
}

void test_injection_moves_the_attitude_by_the_error() {
  Random random(10);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = random.rotation();
    const Vector3f alpha = random.vector(0.02F);
    const Quaternion moved = injectRight(q, alpha);
    TEST_ASSERT_FLOAT_WITHIN(2e-7F, 1.0F, norm(moved));
    // First order in alpha: a turn of 2 atan(|alpha|/2), short by |alpha|^3 / 12 < 4e-6 rad.
    assertNear(4e-6F, alpha, quaternionLog(conjugate(q) * moved));
  }
}

void test_the_attitude_error_is_the_estimate_seen_from_the_reference() {
  // Rolled right of the reference: positive about x. Nose up: positive about y. Nose right: about
  // z.
  const float angle = 0.2F;
  const float size = 2.0F * sine(0.5F * angle);
  const Quaternion level{};
  assertNear(kProduct, Vector3f{size, 0.0F, 0.0F},
             attitudeError(level, eulerToQuaternion({angle, 0.0F, 0.0F})));
  assertNear(kProduct, Vector3f{0.0F, size, 0.0F},
             attitudeError(level, eulerToQuaternion({0.0F, angle, 0.0F})));
  assertNear(kProduct, Vector3f{0.0F, 0.0F, size}, attitudeError(level, yawed(angle)));
  // The frame is local: to a reference that looks south, a roll is a roll.
  assertNear(kProduct, Vector3f{size, 0.0F, 0.0F},
             attitudeError(yawed(kPi), yawed(kPi) * eulerToQuaternion({angle, 0.0F, 0.0F})));
}

void test_the_attitude_error_takes_the_short_way_round() {
  const float size = 2.0F * sine(10.0F * kDegToRad);
  const Quaternion left = yawed(170.0F * kDegToRad);
  const Quaternion right = yawed(-170.0F * kDegToRad);  // 20 deg further to the right
  assertNear(kProduct, Vector3f{0.0F, 0.0F, size}, attitudeError(left, right));
  assertNear(kProduct, Vector3f{0.0F, 0.0F, -size}, attitudeError(right, left));
  Random random(11);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion a = random.rotation();
    const Quaternion b = random.rotation();
    const Vector3f error = attitudeError(a, b);
    TEST_ASSERT_TRUE(error.norm() <= 2.0F + 1e-6F);
    assertNear(kProduct, error, attitudeError(negative(a), b));
    assertNear(kProduct, error, attitudeError(a, negative(b)));
  }
}

void test_an_inverted_aircraft_has_an_error_and_not_none() {
  // At exactly half a turn w is 0: 2 vec must still be 2 long.
  const Quaternion inverted = eulerToQuaternion({kPi, 0.0F, 0.0F});
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 2.0F, attitudeError(Quaternion{}, inverted).norm());
}

}  // namespace

void runQuaternionTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_convention_is_hamiltons);
  RUN_TEST(test_products_are_associative_and_keep_length);
  RUN_TEST(test_the_conjugate_undoes_a_rotation);
  RUN_TEST(test_normalising_gives_length_one_or_the_identity);
  RUN_TEST(test_the_exponential_turns_by_the_vectors_length_about_its_direction);
  RUN_TEST(test_the_series_of_the_exponential_errs_by_less_than_its_rounding);
  RUN_TEST(test_small_turns_add_up);
  RUN_TEST(test_renormalising_takes_out_small_errors_of_the_length);
  RUN_TEST(test_renormalising_holds_the_length_for_a_million_products);
  RUN_TEST(test_renormalising_lets_a_nan_be_seen);
  RUN_TEST(test_the_exponential_makes_unit_quaternions);
  RUN_TEST(test_the_logarithm_is_the_inverse_of_the_exponential);
  RUN_TEST(test_the_logarithm_of_any_rotation_is_the_short_way_back_to_it);
  RUN_TEST(test_the_logarithm_of_half_a_turn_is_pi_long);
  RUN_TEST(test_an_error_injected_on_the_right_is_a_turn_about_the_bodys_axes_at_every_yaw);
  RUN_TEST(test_an_error_injected_on_the_left_would_roll_the_wrong_way_at_yaw_180);
  RUN_TEST(test_injection_moves_the_attitude_by_the_error);
  RUN_TEST(test_the_attitude_error_is_the_estimate_seen_from_the_reference);
  RUN_TEST(test_the_attitude_error_takes_the_short_way_round);
  RUN_TEST(test_an_inverted_aircraft_has_an_error_and_not_none);
}
