// The packed covariance against the dense matrix it stands for.
#include <unity.h>

#include <vector>

#include "AssertNear.h"
#include "Random.h"
#include "Rotation.h"
#include "SymmetricMatrix.h"
#include "suites.h"

using namespace strix;

namespace {

/// Every element another number, so that no two can be taken for each other.
template <int Size>
SymmetricMatrix<Size> numbered() {
  SymmetricMatrix<Size> m;
  for (int row = 0; row < Size; ++row) {
    for (int column = row; column < Size; ++column) {
      m(row, column) = static_cast<float>(100 * row + column + 1);
    }
  }
  return m;
}

template <int Size>
void test_the_index_covers_the_triangle_exactly_once() {
  using Matrix = SymmetricMatrix<Size>;
  std::vector<int> hits(static_cast<std::size_t>(Matrix::kElements), 0);
  for (int row = 0; row < Size; ++row) {
    for (int column = row; column < Size; ++column) {
      const int index = Matrix::index(row, column);
      TEST_ASSERT_TRUE(index >= 0 && index < Matrix::kElements);
      TEST_ASSERT_EQUAL_INT(index, Matrix::index(column, row));
      ++hits[static_cast<std::size_t>(index)];
    }
  }
  for (const int count : hits) TEST_ASSERT_EQUAL_INT(1, count);
}

template <int Size>
void test_the_dense_matrix_is_symmetric_and_comes_back() {
  const SymmetricMatrix<Size> m = numbered<Size>();
  const typename SymmetricMatrix<Size>::Dense dense = m.dense();
  TEST_ASSERT_TRUE(dense == dense.transpose());
  for (int row = 0; row < Size; ++row) {
    for (int column = row; column < Size; ++column) {
      TEST_ASSERT_EQUAL_FLOAT(static_cast<float>(100 * row + column + 1), dense(row, column));
    }
  }
  SymmetricMatrix<Size> back;
  back.set(dense);
  TEST_ASSERT_TRUE(m.elements() == back.elements());
  back.setZero();
  TEST_ASSERT_TRUE(back.dense().isZero(0.0F));
}

/// Only the upper triangle of what is set counts: rounding below it cannot come in.
template <int Size>
void test_setting_takes_the_upper_triangle() {
  typename SymmetricMatrix<Size>::Dense dense = numbered<Size>().dense();
  dense.template triangularView<Eigen::StrictlyLower>().setConstant(-1.0F);
  SymmetricMatrix<Size> m;
  m.set(dense);
  TEST_ASSERT_TRUE(m.elements() == numbered<Size>().elements());
}

template <int Size>
void test_constant_indices_find_the_same_elements_on_both_sides_of_the_diagonal() {
  SymmetricMatrix<Size> m = numbered<Size>();
  unrolled<Size>([&](auto row) {
    unrolled<Size>([&](auto column) {
      const SymmetricMatrix<Size>& constant = m;
      TEST_ASSERT_TRUE((constant.template element<row(), column()>()) == m(row, column));
      TEST_ASSERT_TRUE((&m.template element<row(), column()>()) == &m(column, row));
    });
  });
}

template <int Size>
void test_triples_are_pieces_of_columns_and_add_to_them() {
  unrolled<Size / 3>([&](auto block) {
    constexpr int kRow = 3 * block();
    unrolled<Size>([&](auto column) {
      SymmetricMatrix<Size> m = numbered<Size>();
      typename SymmetricMatrix<Size>::Dense expected = m.dense();
      const Vector3f piece = expected.template block<3, 1>(kRow, column());
      TEST_ASSERT_TRUE((m.template triple<kRow, column()>().vector() == piece));
      // Inside a block on the diagonal two of the three lie in one row: a column of it cannot be
      // added to on its own, and nothing does.
      if constexpr (column() < kRow || column() >= kRow + 3) {
        const Vector3f step(0.5F, -2.0F, 8.0F);
        m.template add<kRow, column()>(Triple(step));
        expected.template block<3, 1>(kRow, column()) += step;
        expected.template block<1, 3>(column(), kRow) += step.transpose();
        TEST_ASSERT_TRUE(m.dense() == expected);
      }
    });
    SymmetricMatrix<Size> m = numbered<Size>();
    typename SymmetricMatrix<Size>::Dense expected = m.dense();
    m.template addDiagonal<kRow>(0.5F);
    expected.diagonal().template segment<3>(kRow).array() += 0.5F;
    TEST_ASSERT_TRUE(m.dense() == expected);
  });
}

template <int Size>
void test_subtracting_a_square_equals_the_dense_product() {
  Random random(21);
  for (int trial = 0; trial < 50; ++trial) {
    SymmetricMatrix<Size> m = numbered<Size>();
    const typename SymmetricMatrix<Size>::Dense before = m.dense();
    std::array<float, Size> column{};
    for (float& element : column) element = random.uniform(-2.0F, 2.0F);
    const Eigen::Map<const Eigen::Matrix<float, Size, 1>> c(column.data());
    const float s = random.uniform(-3.0F, 3.0F);
    m.subtractSquare(s, column);
    const typename SymmetricMatrix<Size>::Dense expected = before - s * c * c.transpose();
    // Elements up to 1800: four roundings of one part in 1.6e7.
    assertNear(5e-4F, expected, m.dense());
  }
}

/// One step of an elimination: what a perfect measurement of the first state leaves.
void test_a_matrix_less_the_square_of_its_own_first_column_over_its_corner_has_none() {
  SymmetricMatrix<9> m;
  m.set(Eigen::Matrix<float, 9, 9>::Identity() + Eigen::Matrix<float, 9, 9>::Ones());
  std::array<float, 9> column{};
  for (std::size_t i = 0; i < 9; ++i) column[i] = m(static_cast<int>(i), 0);
  m.subtractSquare(1.0F / m(0, 0), column);
  for (int i = 0; i < 9; ++i) TEST_ASSERT_FLOAT_WITHIN(1e-6F, 0.0F, m(i, 0));
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 1.5F, m(4, 4));  // 2 - 1/2
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 0.5F, m(4, 5));  // 1 - 1/2
}

void test_triples_do_what_vectors_do() {
  Random random(22);
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3f a = random.vector(2.0F);
    const Vector3f b = random.vector(2.0F);
    const Matrix3f m = q2R(random.rotation());
    // Sums of at most six products of size 4.
    constexpr float kRounding = 2e-6F;
    assertNear(0.0F, a, Triple(a).vector());
    assertNear(0.0F, (a + b).eval(), (Triple(a) + Triple(b)).vector());
    assertNear(0.0F, (a - b).eval(), (Triple(a) - Triple(b)).vector());
    assertNear(kRounding, a.cross(b).eval(), cross(Triple(a), Triple(b)).vector());
    TEST_ASSERT_FLOAT_WITHIN(kRounding, a.dot(b), dot(Triple(a), Triple(b)));
    for (int i = 0; i < 3; ++i) TEST_ASSERT_EQUAL_FLOAT(a(i), Triple(a).get(i));
    const TripleRows rows = transposedRowsOf(m);
    assertNear(0.0F, m.transpose().eval(), rows.matrix());
    assertNear(0.0F, (2.0F * m.transpose()).eval(), (2.0F * rows).matrix());
    assertNear(kRounding, (m.transpose() * a).eval(), (rows * Triple(a)).vector());
    assertNear(kRounding, (m.transpose() * skew(a)).eval(), timesSkew(rows, Triple(a)).matrix());
  }
}

}  // namespace

void runSymmetricMatrixTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_index_covers_the_triangle_exactly_once<9>);
  RUN_TEST(test_the_index_covers_the_triangle_exactly_once<18>);
  RUN_TEST(test_the_dense_matrix_is_symmetric_and_comes_back<18>);
  RUN_TEST(test_setting_takes_the_upper_triangle<18>);
  RUN_TEST(test_constant_indices_find_the_same_elements_on_both_sides_of_the_diagonal<9>);
  RUN_TEST(test_triples_are_pieces_of_columns_and_add_to_them<9>);
  RUN_TEST(test_subtracting_a_square_equals_the_dense_product<9>);
  RUN_TEST(test_subtracting_a_square_equals_the_dense_product<18>);
  RUN_TEST(test_a_matrix_less_the_square_of_its_own_first_column_over_its_corner_has_none);
  RUN_TEST(test_triples_do_what_vectors_do);
}
