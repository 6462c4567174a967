// Rotation matrices, vectors and Euler angles.
#include <unity.h>

#include "AssertNear.h"
#include "Random.h"
#include "Rotation.h"
#include "suites.h"

using namespace strix;

namespace {

// Elements of a matrix made of a quaternion round three products and sums of size 1.
constexpr float kMatrix = 6e-7F;
constexpr int kTrials = 2000;

const Vector3f kForward{1.0F, 0.0F, 0.0F};
const Vector3f kRight{0.0F, 1.0F, 0.0F};
const Vector3f kDown{0.0F, 0.0F, 1.0F};

void test_the_matrix_of_a_quaternion_takes_ned_vectors_into_the_body() {
  Random random(20);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = random.rotation();
    const Vector3f ned = random.vector(1.0F);
    assertNear(3.0F * kMatrix, rotateToBody(q, ned), q2R(q) * ned);
    assertNear(3.0F * kMatrix, rotateToNed(q, ned), q2R(q).transpose() * ned);
    // And the definition, v_ned = q v q*.
    const Quaternion product = q * Quaternion{0.0F, ned.x(), ned.y(), ned.z()} * conjugate(q);
    assertNear(3.0F * kMatrix, product.vec(), rotateToNed(q, ned));
  }
}

void test_north_is_to_the_left_of_an_aircraft_that_looks_east() {
  const Quaternion east = eulerToQuaternion({0.0F, 0.0F, kHalfPi});
  assertNear(kMatrix, Vector3f{0.0F, -1.0F, 0.0F}, q2R(east) * kForward);
  assertNear(kMatrix, kRight, rotateToNed(east, kForward));  // its nose points east
}

void test_a_rotation_keeps_lengths_and_angles() {
  Random random(21);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = random.rotation();
    const Vector3f a = random.direction();
    const Vector3f b = random.direction();
    TEST_ASSERT_FLOAT_WITHIN(kMatrix, 1.0F, rotateToNed(q, a).norm());
    TEST_ASSERT_FLOAT_WITHIN(3.0F * kMatrix, a.dot(b), rotateToNed(q, a).dot(rotateToNed(q, b)));
    // No mirror: right-handed stays right-handed.
    assertNear(3.0F * kMatrix, rotateToNed(q, a.cross(b)),
               rotateToNed(q, a).cross(rotateToNed(q, b)));
    assertNear(3.0F * kMatrix, a, rotateToBody(q, rotateToNed(q, a)));
  }
}

void test_the_matrix_is_orthonormal() {
  Random random(22);
  for (int i = 0; i < kTrials; ++i) {
    const Matrix3f r = q2R(random.rotation());
    assertNear(3.0F * kMatrix, Matrix3f::Identity(), r * r.transpose());
  }
}

void test_rotations_compose_in_the_order_of_the_products() {
  Random random(23);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion a = random.rotation();
    const Quaternion b = random.rotation();
    const Vector3f v = random.vector(1.0F);
    assertNear(6.0F * kMatrix, rotateToNed(a, rotateToNed(b, v)), rotateToNed(a * b, v));
    assertNear(6.0F * kMatrix, q2R(b) * q2R(a), q2R(a * b));  // NED to body: the other way round
  }
}

void test_any_attitude_survives_the_way_through_its_matrix() {
  Random random(24);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = shortest(random.rotation());
    const Quaternion back = R2q(q2R(q));
    TEST_ASSERT_TRUE(back.w >= 0.0F);
    assertSameRotation(1e-6F, q, back);
  }
}

void test_each_of_the_four_pivots_is_exact_at_its_own_turn_and_beside_it() {
  // Identity and the half turns about the axes: one of |w|, |x|, |y|, |z| is 1, the others vanish,
  // and dividing by any of those would be 0/0.
  const Quaternion turns[] = {{1.0F, 0.0F, 0.0F, 0.0F},
                              {0.0F, 1.0F, 0.0F, 0.0F},
                              {0.0F, 0.0F, 1.0F, 0.0F},
                              {0.0F, 0.0F, 0.0F, 1.0F}};
  Random random(25);
  for (const Quaternion& turn : turns) {
    assertSameRotation(0.0F, turn, R2q(q2R(turn)));
    for (int i = 0; i < kTrials; ++i) {
      const Quaternion beside = turn * quaternionExp(random.vector(0.5F));
      assertSameRotation(1e-6F, beside, R2q(q2R(beside)));
    }
  }
  // Where two pivots are equally large, as after a quarter turn.
  for (const Vector3f& axis : {kForward, kRight, kDown}) {
    const Quaternion quarter = quaternionExp(axis * kHalfPi);
    assertSameRotation(1e-6F, quarter, R2q(q2R(quarter)));
  }
}

void test_positive_roll_lowers_the_right_side() {
  const Quaternion q = eulerToQuaternion({0.3F, 0.0F, 0.0F});
  assertNear(kMatrix, Vector3f{0.0F, cosine(0.3F), sine(0.3F)}, rotateToNed(q, kRight));
}

void test_positive_pitch_raises_the_nose() {
  const Quaternion q = eulerToQuaternion({0.0F, 0.3F, 0.0F});
  assertNear(kMatrix, Vector3f{cosine(0.3F), 0.0F, -sine(0.3F)}, rotateToNed(q, kForward));
}

void test_positive_yaw_turns_the_nose_from_north_to_east() {
  const Quaternion q = eulerToQuaternion({0.0F, 0.0F, 0.3F});
  assertNear(kMatrix, Vector3f{cosine(0.3F), sine(0.3F), 0.0F}, rotateToNed(q, kForward));
}

void test_yaw_comes_first_then_pitch_then_roll() {
  const EulerAngles e{0.4F, -0.7F, 2.0F};
  const Quaternion q = quaternionExp(kDown * e.yaw) * quaternionExp(kRight * e.pitch) *
                       quaternionExp(kForward * e.roll);
  assertSameRotation(kMatrix, q, eulerToQuaternion(e));
}

void test_euler_angles_survive_the_way_through_a_quaternion() {
  Random random(26);
  for (int i = 0; i < kTrials; ++i) {
    // Up to 85 deg of pitch: at 90 deg roll and yaw turn about the same axis.
    const EulerAngles e{random.uniform(-3.14F, 3.14F), random.uniform(-1.48F, 1.48F),
                        random.uniform(-3.14F, 3.14F)};
    const EulerAngles back = quaternionToEuler(eulerToQuaternion(e));
    // Rounding of 6e-7 in sin(pitch), divided by cos(85 deg) = 0.09.
    constexpr float kTolerance = 1e-5F;
    TEST_ASSERT_FLOAT_WITHIN(kTolerance, 0.0F, wrapAngle(back.roll - e.roll));
    TEST_ASSERT_FLOAT_WITHIN(kTolerance, e.pitch, back.pitch);
    TEST_ASSERT_FLOAT_WITHIN(kTolerance, 0.0F, wrapAngle(back.yaw - e.yaw));
    TEST_ASSERT_TRUE(back.yaw == yawOf(eulerToQuaternion(e)));
  }
}

void test_any_attitude_survives_the_way_through_euler_angles() {
  Random random(27);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = random.rotation();
    // Near vertical, asin loses half the digits: sqrt(6e-7) rad at the very worst.
    assertSameRotation(1e-3F, q, eulerToQuaternion(quaternionToEuler(q)));
  }
}

void test_a_vertical_nose_gives_a_pitch_of_90_deg_and_no_nan() {
  for (const float sign : {1.0F, -1.0F}) {
    const EulerAngles e = quaternionToEuler(eulerToQuaternion({0.0F, sign * kHalfPi, 0.5F}));
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, sign * kHalfPi, e.pitch);
    TEST_ASSERT_TRUE(e.roll == e.roll && e.yaw == e.yaw);
  }
}

void test_the_cosine_of_tilt_is_the_bodys_down_seen_along_down() {
  Random random(28);
  for (int i = 0; i < kTrials; ++i) {
    const Quaternion q = random.rotation();
    TEST_ASSERT_FLOAT_WITHIN(kMatrix, rotateToNed(q, kDown).z(), cosTilt(q));
  }
  TEST_ASSERT_TRUE(cosTilt(Quaternion{}) == 1.0F);
  TEST_ASSERT_FLOAT_WITHIN(kMatrix, 1.0F, cosTilt(eulerToQuaternion({0.0F, 0.0F, 2.0F})));
  TEST_ASSERT_FLOAT_WITHIN(kMatrix, 0.0F, cosTilt(eulerToQuaternion({kHalfPi, 0.0F, 1.0F})));
  TEST_ASSERT_FLOAT_WITHIN(kMatrix, 0.0F, cosTilt(eulerToQuaternion({0.0F, -kHalfPi, 1.0F})));
  TEST_ASSERT_FLOAT_WITHIN(kMatrix, -1.0F, cosTilt(eulerToQuaternion({kPi, 0.0F, 0.0F})));
}

void test_the_cross_product_matrix_crosses() {
  Random random(29);
  for (int i = 0; i < kTrials; ++i) {
    const Vector3f a = random.vector(1.0F);
    const Vector3f b = random.vector(1.0F);
    assertNear(2e-7F, a.cross(b), skew(a) * b);
    assertNear(0.0F, skew(a), -skew(a).transpose());
  }
}

void test_a_vector_with_nan_or_infinity_anywhere_is_not_finite() {
  for (int i = 0; i < 3; ++i) {
    for (const float bad :
         {kNaN, std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()}) {
      Vector3f v{1.0F, -2.0F, 3e38F};
      TEST_ASSERT_TRUE(isFinite(v));
      v(i) = bad;
      TEST_ASSERT_FALSE(isFinite(v));
    }
  }
}

}  // namespace

void runRotationTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_matrix_of_a_quaternion_takes_ned_vectors_into_the_body);
  RUN_TEST(test_north_is_to_the_left_of_an_aircraft_that_looks_east);
  RUN_TEST(test_a_rotation_keeps_lengths_and_angles);
  RUN_TEST(test_the_matrix_is_orthonormal);
  RUN_TEST(test_rotations_compose_in_the_order_of_the_products);
  RUN_TEST(test_any_attitude_survives_the_way_through_its_matrix);
  RUN_TEST(test_each_of_the_four_pivots_is_exact_at_its_own_turn_and_beside_it);
  RUN_TEST(test_positive_roll_lowers_the_right_side);
  RUN_TEST(test_positive_pitch_raises_the_nose);
  RUN_TEST(test_positive_yaw_turns_the_nose_from_north_to_east);
  RUN_TEST(test_yaw_comes_first_then_pitch_then_roll);
  RUN_TEST(test_euler_angles_survive_the_way_through_a_quaternion);
  RUN_TEST(test_any_attitude_survives_the_way_through_euler_angles);
  RUN_TEST(test_a_vertical_nose_gives_a_pitch_of_90_deg_and_no_nan);
  RUN_TEST(test_the_cosine_of_tilt_is_the_bodys_down_seen_along_down);
  RUN_TEST(test_the_cross_product_matrix_crosses);
  RUN_TEST(test_a_vector_with_nan_or_infinity_anywhere_is_not_finite);
}
