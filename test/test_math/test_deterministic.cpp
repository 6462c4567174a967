// The elementary functions against the C library in double precision.
#include <unity.h>

#include <cmath>
#include <cstring>

#include "Deterministic.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr double kPiDouble = 3.14159265358979323846;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kSmallestNormal = std::numeric_limits<float>::min();
constexpr float kHuge = std::numeric_limits<float>::max();

// What sinCos's header promises: rounding of a result near 1 is 6e-8, the reduction adds a little.
constexpr double kSineError = 1e-7;
// And what the header promises of the others. A unit in the last place (ulp) is the step from one
// float to the next; perfect rounding would be 0.5.
constexpr double kUlpError = 3.0;
// arcTangent2 rounds the quotient and the sum besides.
constexpr double kUlpErrorTwoArguments = 4.0;

struct Errors {
  double absolute = 0.0;
  double ulp = 0.0;
};

double ulpOf(double exact) {
  auto magnitude = static_cast<float>(std::fabs(exact));
  if (magnitude < kSmallestNormal) magnitude = kSmallestNormal;
  return static_cast<double>(std::nextafterf(magnitude, kInfinity)) -
         static_cast<double>(magnitude);
}

void note(Errors& worst, float value, double exact) {
  const double error = std::fabs(static_cast<double>(value) - exact);
  // NaN must not pass as small.
  worst.absolute = error <= worst.absolute ? worst.absolute : error;
  worst.ulp = error / ulpOf(exact) <= worst.ulp ? worst.ulp : error / ulpOf(exact);
}

/// Visits floats of both signs in [low, high], as dense around zero as floats are: every 4001st.
template <class Visit>
void sweep(float low, float high, Visit&& visit) {
  constexpr std::uint32_t kFirst = 0x00800000;  // the smallest normal number
  constexpr std::uint32_t kInfinityBits = 0x7F800000;
  for (std::uint32_t bits = kFirst; bits < kInfinityBits; bits += 4001) {
    float x = 0.0F;
    std::memcpy(&x, &bits, sizeof x);
    if (x <= high && x >= low) visit(x);
    if (-x <= high && -x >= low) visit(-x);
  }
}

template <class Function, class Exact>
Errors errorsOf(float low, float high, Function&& function, Exact&& exact) {
  Errors worst;
  sweep(low, high, [&](float x) { note(worst, function(x), exact(static_cast<double>(x))); });
  return worst;
}

bool isNaN(float x) { return x != x; }

void test_sine_and_cosine_are_within_1e_7_up_to_8192_rad() {
  const Errors sin = errorsOf(-8192.0F, 8192.0F, sine, [](double x) { return std::sin(x); });
  const Errors cos = errorsOf(-8192.0F, 8192.0F, cosine, [](double x) { return std::cos(x); });
  TEST_ASSERT_TRUE(sin.absolute < kSineError);
  TEST_ASSERT_TRUE(cos.absolute < kSineError);
}

void test_sine_of_a_small_angle_keeps_all_its_digits() {
  // Small rotations are what a filter is made of: here the error must be relative.
  const Errors sin = errorsOf(-0.785F, 0.785F, sine, [](double x) { return std::sin(x); });
  TEST_ASSERT_TRUE(sin.ulp < 1.0);
}

void test_sine_and_cosine_lie_on_the_unit_circle() {
  // Two results with 1e-7 each, squared and summed.
  sweep(-8192.0F, 8192.0F, [](float x) {
    const SinCos p = sinCos(x);
    const double square = static_cast<double>(p.sin) * static_cast<double>(p.sin) +
                          static_cast<double>(p.cos) * static_cast<double>(p.cos);
    TEST_ASSERT_TRUE(std::fabs(square - 1.0) < 3e-7);
  });
}

void test_left_and_right_turns_are_mirror_images() {
  sweep(0.0F, 8192.0F, [](float x) {
    TEST_ASSERT_TRUE(sine(-x) == -sine(x));
    TEST_ASSERT_TRUE(cosine(-x) == cosine(x));
    TEST_ASSERT_TRUE(arcTangent(-x) == -arcTangent(x));
    TEST_ASSERT_TRUE(arcSine(-x) == -arcSine(x));
    if (x != kPi) TEST_ASSERT_TRUE(wrapAngle(-x) == -wrapAngle(x));
  });
}

void test_exact_points_are_exact() {
  TEST_ASSERT_TRUE(sine(0.0F) == 0.0F && cosine(0.0F) == 1.0F);
  TEST_ASSERT_TRUE(sine(kHalfPi) == 1.0F && cosine(kPi) == -1.0F);
  TEST_ASSERT_TRUE(arcTangent(0.0F) == 0.0F && arcTangent(kInfinity) == kHalfPi);
  TEST_ASSERT_TRUE(arcSine(0.0F) == 0.0F && arcSine(1.0F) == kHalfPi && arcSine(-1.0F) == -kHalfPi);
  TEST_ASSERT_TRUE(arcCosine(1.0F) == 0.0F && arcCosine(-1.0F) == kPi &&
                   arcCosine(0.0F) == kHalfPi);
  TEST_ASSERT_TRUE(arcTangent2(0.0F, 0.0F) == 0.0F && arcTangent2(0.0F, 1.0F) == 0.0F);
  TEST_ASSERT_TRUE(arcTangent2(1.0F, 0.0F) == kHalfPi && arcTangent2(-1.0F, 0.0F) == -kHalfPi);
  TEST_ASSERT_TRUE(arcTangent2(0.0F, -1.0F) == kPi);
  TEST_ASSERT_TRUE(logarithm(1.0F) == 0.0F && exponential(0.0F) == 1.0F);
  TEST_ASSERT_TRUE(squareRoot(0.0F) == 0.0F && squareRoot(9.0F) == 3.0F);
}

void test_inverse_functions_logarithm_and_exponential_are_within_3_ulp() {
  const Errors atan = errorsOf(-kHuge, kHuge, arcTangent, [](double x) { return std::atan(x); });
  const Errors asin = errorsOf(-1.0F, 1.0F, arcSine, [](double x) { return std::asin(x); });
  const Errors acos = errorsOf(-1.0F, 1.0F, arcCosine, [](double x) { return std::acos(x); });
  const Errors log =
      errorsOf(kSmallestNormal, kHuge, logarithm, [](double x) { return std::log(x); });
  const Errors exp = errorsOf(-87.0F, 88.0F, exponential, [](double x) { return std::exp(x); });
  TEST_ASSERT_TRUE(atan.ulp < kUlpError);
  TEST_ASSERT_TRUE(asin.ulp < kUlpError);
  TEST_ASSERT_TRUE(acos.ulp < kUlpError);
  TEST_ASSERT_TRUE(log.ulp < kUlpError);
  TEST_ASSERT_TRUE(exp.ulp < kUlpError);
}

void test_arc_cosine_resolves_the_smallest_angles() {
  // The neighbour of 1 below is an angle of 3.5e-4 rad; pi/2 - asin(x) would be 3e-8 rad off, 1e-4
  // of it.
  float x = 1.0F;
  while (x > 0.99999F) {
    x = std::nextafterf(x, 0.0F);
    Errors error;
    note(error, arcCosine(x), std::acos(static_cast<double>(x)));
    TEST_ASSERT_TRUE(error.ulp < kUlpError);
  }
}

void test_the_direction_of_a_point_is_right_in_all_quadrants() {
  Random random(1);
  Errors worst;
  for (int i = 0; i < 200000; ++i) {
    const float scale = exponential(random.uniform(-40.0F, 40.0F));
    const float y = random.uniform(-1.0F, 1.0F) * scale;
    const float x = random.uniform(-1.0F, 1.0F) * exponential(random.uniform(-5.0F, 5.0F)) * scale;
    note(worst, arcTangent2(y, x), std::atan2(static_cast<double>(y), static_cast<double>(x)));
  }
  TEST_ASSERT_TRUE(worst.ulp < kUlpErrorTwoArguments);
}

void test_a_direction_whose_quotient_overflows_or_vanishes_is_still_right() {
  TEST_ASSERT_TRUE(arcTangent2(1e30F, 1e-30F) == kHalfPi);
  TEST_ASSERT_TRUE(arcTangent2(-1e30F, -1e-30F) == -kHalfPi);
  TEST_ASSERT_TRUE(arcTangent2(1e-30F, 1e30F) == 0.0F);
  TEST_ASSERT_TRUE(arcTangent2(1e-30F, -1e30F) == kPi);
  TEST_ASSERT_TRUE(arcTangent2(-1e-30F, -1e30F) == -kPi);
}

void test_arguments_beyond_the_domain_are_clamped() {
  // Rounding makes 1.0000001 out of a unit vector's component.
  TEST_ASSERT_TRUE(arcSine(1.0000001F) == kHalfPi && arcSine(-3.0F) == -kHalfPi);
  TEST_ASSERT_TRUE(arcCosine(1.0000001F) == 0.0F && arcCosine(-3.0F) == kPi);
  TEST_ASSERT_TRUE(arcCosine(kInfinity) == 0.0F && arcSine(-kInfinity) == -kHalfPi);
  TEST_ASSERT_TRUE(exponential(1000.0F) == exponential(88.0F));
  TEST_ASSERT_TRUE(exponential(-kInfinity) == exponential(-87.0F));
  TEST_ASSERT_TRUE(logarithm(0.0F) == -88.0F && logarithm(-1.0F) == -88.0F);
  TEST_ASSERT_TRUE(logarithm(kNaN) == -88.0F);
}

void test_nan_is_passed_on_and_never_hangs() {
  TEST_ASSERT_TRUE(isNaN(sine(kNaN)) && isNaN(cosine(kNaN)));
  TEST_ASSERT_TRUE(isNaN(arcTangent(kNaN)) && isNaN(arcSine(kNaN)) && isNaN(arcCosine(kNaN)));
  TEST_ASSERT_TRUE(isNaN(arcTangent2(kNaN, 1.0F)) && isNaN(arcTangent2(1.0F, kNaN)));
  TEST_ASSERT_TRUE(isNaN(arcTangent2(kNaN, 0.0F)) && isNaN(arcTangent2(0.0F, kNaN)));
  TEST_ASSERT_TRUE(isNaN(exponential(kNaN)) && isNaN(wrapAngle(kNaN)));
}

void test_an_angle_that_cannot_be_one_is_not_taken_for_one() {
  for (const float angle : {kInfinity, 1e10F, kHuge, 5.1e4F}) {
    TEST_ASSERT_TRUE(isNaN(sine(angle)) && isNaN(cosine(-angle)));
    TEST_ASSERT_TRUE(isNaN(wrapAngle(angle)) && isNaN(wrapAngle(-angle)));
  }
}

void test_wrapped_angles_point_the_same_way() {
  // Three roundings of up to 1.2e-7 (half a step between floats near pi).
  constexpr double kTolerance = 4e-7;
  sweep(-8192.0F, 8192.0F, [](float x) {
    const float wrapped = wrapAngle(x);
    TEST_ASSERT_TRUE(wrapped > -kPi && wrapped <= kPi);
    TEST_ASSERT_TRUE(wrapAngle(wrapped) == wrapped);
    const double apart =
        std::remainder(static_cast<double>(x) - static_cast<double>(wrapped), 2.0 * kPiDouble);
    TEST_ASSERT_TRUE(std::fabs(apart) < kTolerance);
  });
}

void test_a_wrapped_angle_is_left_alone_and_half_a_turn_is_positive() {
  sweep(-3.14159F, 3.14159F, [](float x) { TEST_ASSERT_TRUE(wrapAngle(x) == x); });
  TEST_ASSERT_TRUE(wrapAngle(kPi) == kPi);
  TEST_ASSERT_FLOAT_WITHIN(4e-7F, kPi, wrapAngle(-kPi));
  TEST_ASSERT_FLOAT_WITHIN(4e-7F, -0.5F * kPi, wrapAngle(1.5F * kPi));
  TEST_ASSERT_FLOAT_WITHIN(4e-7F, 0.5F * kPi, wrapAngle(-1.5F * kPi));
}

}  // namespace

void runDeterministicTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_sine_and_cosine_are_within_1e_7_up_to_8192_rad);
  RUN_TEST(test_sine_of_a_small_angle_keeps_all_its_digits);
  RUN_TEST(test_sine_and_cosine_lie_on_the_unit_circle);
  RUN_TEST(test_left_and_right_turns_are_mirror_images);
  RUN_TEST(test_exact_points_are_exact);
  RUN_TEST(test_inverse_functions_logarithm_and_exponential_are_within_3_ulp);
  RUN_TEST(test_arc_cosine_resolves_the_smallest_angles);
  RUN_TEST(test_the_direction_of_a_point_is_right_in_all_quadrants);
  RUN_TEST(test_a_direction_whose_quotient_overflows_or_vanishes_is_still_right);
  RUN_TEST(test_arguments_beyond_the_domain_are_clamped);
  RUN_TEST(test_nan_is_passed_on_and_never_hangs);
  RUN_TEST(test_an_angle_that_cannot_be_one_is_not_taken_for_one);
  RUN_TEST(test_wrapped_angles_point_the_same_way);
  RUN_TEST(test_a_wrapped_angle_is_left_alone_and_half_a_turn_is_positive);
}
