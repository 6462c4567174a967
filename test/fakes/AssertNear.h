/// Comparisons of vectors and rotations within a tolerance. NaN is near nothing.
#pragma once

#include <unity.h>

#include "Quaternion.h"

namespace strix {

/// Two vectors or matrices, element by element.
template <class A, class B>
void assertNear(float tolerance, const Eigen::MatrixBase<A>& expected,
                const Eigen::MatrixBase<B>& actual) {
  const auto wanted = expected.eval();
  const auto got = actual.eval();
  TEST_ASSERT_EQUAL_INT(wanted.size(), got.size());
  for (Eigen::Index i = 0; i < wanted.size(); ++i) {
    TEST_ASSERT_FLOAT_WITHIN(tolerance, wanted(i % wanted.rows(), i / wanted.rows()),
                             got(i % got.rows(), i / got.rows()));
  }
}

/// The same four numbers.
inline void assertNear(float tolerance, const Quaternion& expected, const Quaternion& actual) {
  TEST_ASSERT_FLOAT_WITHIN(tolerance, expected.w, actual.w);
  assertNear(tolerance, expected.vec(), actual.vec());
}

/// The same rotation: q and -q are one.
inline void assertSameRotation(float tolerance, const Quaternion& expected,
                               const Quaternion& actual) {
  const Quaternion between = shortest(conjugate(expected) * actual);
  assertNear(tolerance, Quaternion{}, between);
}

}  // namespace strix
