/// A symmetric matrix that is stored once, for code whose indices are known when compiled.
///
/// Eigen's expressions are left out here on purpose: at -O2 a compiler inlines them or not as it
/// likes, and a covariance update is worth counting (`make bench`).
#pragma once

#include <array>
#include <type_traits>
#include <utility>

#include "Vector3f.h"

namespace strix {

/// For what must melt into its caller, so that indices become constants there.
#define STRIX_INLINE __attribute__((always_inline))

template <class Function, int... I>
STRIX_INLINE inline void unrolledOver(std::integer_sequence<int, I...>, Function&& f) {
  (f(std::integral_constant<int, I>{}), ...);
}

/// Calls f(0), f(1), ... f(Count - 1), each number as a type that converts to it: a loop whose
/// index is a constant in every turn.
template <int Count, class Function>
STRIX_INLINE inline void unrolled(Function&& f) {
  unrolledOver(std::make_integer_sequence<int, Count>{}, f);
}

/// Three neighbouring elements of a column.
struct Triple {
  float x = 0.0F;
  float y = 0.0F;
  float z = 0.0F;

  Triple() = default;
  STRIX_INLINE Triple(float first, float second, float third) : x(first), y(second), z(third) {}
  STRIX_INLINE explicit Triple(const Vector3f& v) : x(v(0)), y(v(1)), z(v(2)) {}
  [[nodiscard]] STRIX_INLINE float get(int i) const { return i == 0 ? x : i == 1 ? y : z; }
  [[nodiscard]] STRIX_INLINE Vector3f vector() const { return {x, y, z}; }
};

[[nodiscard]] STRIX_INLINE inline Triple operator+(const Triple& a, const Triple& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
[[nodiscard]] STRIX_INLINE inline Triple operator-(const Triple& a, const Triple& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
[[nodiscard]] STRIX_INLINE inline Triple operator*(float s, const Triple& a) {
  return {s * a.x, s * a.y, s * a.z};
}
[[nodiscard]] STRIX_INLINE inline float dot(const Triple& a, const Triple& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
[[nodiscard]] STRIX_INLINE inline Triple cross(const Triple& a, const Triple& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A 3x3 matrix by rows.
struct TripleRows {
  Triple row0, row1, row2;

  [[nodiscard]] Matrix3f matrix() const {
    Matrix3f m;
    m << row0.x, row0.y, row0.z, row1.x, row1.y, row1.z, row2.x, row2.y, row2.z;
    return m;
  }
};
/// The rows of m^T.
[[nodiscard]] STRIX_INLINE inline TripleRows transposedRowsOf(const Matrix3f& m) {
  return {{m(0, 0), m(1, 0), m(2, 0)}, {m(0, 1), m(1, 1), m(2, 1)}, {m(0, 2), m(1, 2), m(2, 2)}};
}
[[nodiscard]] STRIX_INLINE inline TripleRows operator*(float s, const TripleRows& m) {
  return {s * m.row0, s * m.row1, s * m.row2};
}
[[nodiscard]] STRIX_INLINE inline Triple operator*(const TripleRows& m, const Triple& v) {
  return {dot(m.row0, v), dot(m.row1, v), dot(m.row2, v)};
}
/// m [v x], as a . (v x b) = (a x v) . b.
[[nodiscard]] STRIX_INLINE inline TripleRows timesSkew(const TripleRows& m, const Triple& v) {
  return {cross(m.row0, v), cross(m.row1, v), cross(m.row2, v)};
}

/// Symmetric Size x Size matrix, its upper triangle row by row: rounding cannot make it asymmetric.
template <int Size>
class SymmetricMatrix {
 public:
  static constexpr int kElements = Size * (Size + 1) / 2;
  using Dense = Eigen::Matrix<float, Size, Size>;

  [[nodiscard]] static constexpr int index(int row, int column) {
    return row <= column ? row * Size - row * (row - 1) / 2 + column - row : index(column, row);
  }

  [[nodiscard]] float& operator()(int row, int column) { return at(index(row, column)); }
  [[nodiscard]] float operator()(int row, int column) const { return at(index(row, column)); }

  /// The element of a constant row and column.
  template <int Row, int Column>
  [[nodiscard]] STRIX_INLINE float& element() {
    return elements_[std::integral_constant<std::size_t, index(Row, Column)>::value];
  }
  template <int Row, int Column>
  [[nodiscard]] STRIX_INLINE float element() const {
    return elements_[std::integral_constant<std::size_t, index(Row, Column)>::value];
  }

  /// Rows Row to Row + 2 of a column.
  template <int Row, int Column>
  [[nodiscard]] STRIX_INLINE Triple triple() const {
    return {element<Row, Column>(), element<Row + 1, Column>(), element<Row + 2, Column>()};
  }
  template <int Row, int Column>
  STRIX_INLINE void add(const Triple& d) {
    element<Row, Column>() += d.x;
    element<Row + 1, Column>() += d.y;
    element<Row + 2, Column>() += d.z;
  }

  /// Adds to the diagonal elements Row to Row + 2.
  template <int Row>
  STRIX_INLINE void addDiagonal(float value) {
    element<Row, Row>() += value;
    element<Row + 1, Row + 1>() += value;
    element<Row + 2, Row + 2>() += value;
  }

  /// M -= s c c^T.
  STRIX_INLINE void subtractSquare(float s, const std::array<float, Size>& column) {
    const std::array<float, Size> c = column;  // a copy: nothing written below can change it
    unrolled<Size>([&](auto row) STRIX_INLINE {
      const float scaled = s * c[row];
      unrolled<Size - row()>(
          [&](auto i) STRIX_INLINE { element<row(), row() + i()>() -= scaled * c[row() + i()]; });
    });
  }

  void setZero() { elements_.fill(0.0F); }

  /// Takes the upper triangle.
  void set(const Dense& m) {
    for (int row = 0; row < Size; ++row) {
      for (int column = row; column < Size; ++column) (*this)(row, column) = m(row, column);
    }
  }
  [[nodiscard]] Dense dense() const {
    Dense m;
    for (int row = 0; row < Size; ++row) {
      for (int column = 0; column < Size; ++column) m(row, column) = (*this)(row, column);
    }
    return m;
  }
  [[nodiscard]] const std::array<float, kElements>& elements() const { return elements_; }

 private:
  [[nodiscard]] float& at(int i) { return elements_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] float at(int i) const { return elements_[static_cast<std::size_t>(i)]; }

  std::array<float, kElements> elements_{};
};

}  // namespace strix
