/// Whether a covariance still is one, and what is said when the estimate is wrong.
#include <unity.h>

#include <cstring>

#include "NavigationHealth.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

template <int States>
using Dense = Eigen::Matrix<float, States, States>;

template <int States>
bool positive(const Dense<States>& dense) {
  SymmetricMatrix<States> p;
  p.set(dense);
  return isPositiveDefinite(p);
}

/// V diag(d) V^T with V a product of random turns in every plane: the eigenvalues are known.
template <int States>
Dense<States> withEigenvalues(const Eigen::Matrix<float, States, 1>& d, Random& random) {
  Dense<States> p = d.asDiagonal();
  for (int i = 0; i < States; ++i) {
    for (int j = i + 1; j < States; ++j) {
      const SinCos s = sinCos(random.uniform(-kPi, kPi));
      Dense<States> turn = Dense<States>::Identity();
      turn(i, i) = turn(j, j) = s.cos;
      turn(i, j) = -s.sin;
      turn(j, i) = s.sin;
      p = (turn * p * turn.transpose()).eval();
    }
  }
  return p;
}

template <int States>
void test_an_ordinary_covariance_is_positive_definite() {
  TEST_ASSERT_TRUE(positive<States>(Dense<States>::Identity()));
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::Matrix<float, States, 1> d;
    for (int i = 0; i < States; ++i) d(i) = random.uniform(0.1F, 10.0F);
    TEST_ASSERT_TRUE(positive<States>(withEigenvalues<States>(d, random)));
  }
}

/// Metres and radians: variances 1e8 apart, and strong correlations between them.
template <int States>
void test_units_that_differ_by_many_powers_of_ten_do_not_matter() {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::Matrix<float, States, 1> d;
    for (int i = 0; i < States; ++i) d(i) = random.uniform(0.1F, 10.0F);
    Dense<States> p = withEigenvalues<States>(d, random);
    for (int i = 0; i < States; ++i) {
      const float unit = i % 3 == 0 ? 1e4F : i % 3 == 1 ? 1.0F : 1e-4F;  // variances 1e16 apart
      p.row(i) *= unit;
      p.col(i) *= unit;
    }
    TEST_ASSERT_TRUE(positive<States>(p));
  }
  // On the diagonal alone, any float.
  Dense<States> p = Dense<States>::Identity();
  p(0, 0) = 1e30F;
  p(States - 1, States - 1) = 1e-30F;
  TEST_ASSERT_TRUE(positive<States>(p));
}

/// One eigenvalue below zero, wherever it is: in no case on the diagonal alone.
template <int States>
void test_a_matrix_with_one_negative_eigenvalue_is_found() {
  Random random(3);
  for (int index = 0; index < States; ++index) {
    Eigen::Matrix<float, States, 1> d;
    for (int i = 0; i < States; ++i) d(i) = random.uniform(0.1F, 10.0F);
    d(index) = -0.01F;  // rounding of these products is some 1e-5
    TEST_ASSERT_FALSE(positive<States>(withEigenvalues<States>(d, random)));
  }
}

/// The smallest case, at every pair: correlation above one, all variances positive.
template <int States>
void test_a_correlation_above_one_is_found() {
  for (int i = 0; i < States; ++i) {
    for (int j = 0; j < States; ++j) {
      if (i == j) continue;
      Dense<States> p = Dense<States>::Identity();
      p(i, i) = 1e4F;
      p(i, j) = p(j, i) = 99.0F;  // times 1 * 100: a correlation of 0.99
      TEST_ASSERT_TRUE(positive<States>(p));
      p(i, j) = p(j, i) = -101.0F;
      TEST_ASSERT_FALSE(positive<States>(p));
    }
  }
}

template <int States>
void test_a_state_that_is_known_exactly_is_left_out() {
  Random random(4);
  for (int known = 0; known < States; ++known) {
    Eigen::Matrix<float, States, 1> d;
    for (int i = 0; i < States; ++i) d(i) = random.uniform(0.1F, 10.0F);
    Dense<States> p = withEigenvalues<States>(d, random);
    p.row(known).setZero();
    p.col(known).setZero();
    TEST_ASSERT_TRUE(positive<States>(p));
    const int other = (known + 1) % States;  // what is left out hides nothing else
    p(other, other) = -0.1F;
    TEST_ASSERT_FALSE(positive<States>(p));
  }
  TEST_ASSERT_TRUE(positive<States>(Dense<States>::Zero()));
}

/// Variance zero and a covariance: no known state, but no covariance matrix either.
template <int States>
void test_a_variance_of_zero_with_a_correlation_is_found() {
  for (int i = 0; i < States; ++i) {
    for (int j = 0; j < States; ++j) {
      if (i == j) continue;
      Dense<States> p = Dense<States>::Identity();
      p(i, i) = 0.0F;
      p(i, j) = p(j, i) = 0.5F;
      TEST_ASSERT_FALSE(positive<States>(p));
    }
  }
}

template <int States>
void test_a_nan_anywhere_is_no_covariance() {
  for (int i = 0; i < States; ++i) {
    for (int j = 0; j < States; ++j) {
      Dense<States> p = Dense<States>::Identity();
      p(i, j) = p(j, i) = kNaN;
      TEST_ASSERT_FALSE(positive<States>(p));
    }
  }
}

template <int States>
void test_a_negative_variance_is_found() {
  for (int i = 0; i < States; ++i) {
    Dense<States> p = Dense<States>::Identity();
    p(i, i) = -1e-20F;
    TEST_ASSERT_FALSE(positive<States>(p));
  }
}

void test_every_health_bit_has_one_sentence_of_its_own() {
  NavigationHealth all = 0;
  for (const HealthText& text : kHealthTexts) {
    TEST_ASSERT_TRUE(text.bit != 0 && (text.bit & (text.bit - 1U)) == 0);  // one bit
    TEST_ASSERT_EQUAL_HEX32(0, all & text.bit);
    all |= text.bit;
    TEST_ASSERT_EQUAL(0, std::strncmp(text.said, "estimator: ", 11));
    for (const HealthText& other : kHealthTexts) {
      TEST_ASSERT_TRUE(&other == &text || std::strcmp(other.said, text.said) != 0);
    }
  }
  TEST_ASSERT_EQUAL_HEX32(health::kNotFinite | health::kNotPositiveDefinite | health::kRestarted |
                              health::kAttitudesDisagree | health::kNoGps | health::kNoAltimeter |
                              health::kNoMagnetometer,
                          all);
  // Losing an aid ends no flight; losing the state does.
  TEST_ASSERT_EQUAL_HEX32(health::kNotFinite | health::kNotPositiveDefinite, health::kLost);
}

}  // namespace

void runHealthTests() {
  Unity.TestFile = __FILE__;
  RUN_BOTH(test_an_ordinary_covariance_is_positive_definite);
  RUN_BOTH(test_units_that_differ_by_many_powers_of_ten_do_not_matter);
  RUN_BOTH(test_a_matrix_with_one_negative_eigenvalue_is_found);
  RUN_BOTH(test_a_correlation_above_one_is_found);
  RUN_BOTH(test_a_state_that_is_known_exactly_is_left_out);
  RUN_BOTH(test_a_variance_of_zero_with_a_correlation_is_found);
  RUN_BOTH(test_a_nan_anywhere_is_no_covariance);
  RUN_BOTH(test_a_negative_variance_is_found);
  RUN_TEST(test_every_health_bit_has_one_sentence_of_its_own);
}
