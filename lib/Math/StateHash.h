/// A fingerprint of the flight code's state, to tell whether two runs made the same bits.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "Vector3f.h"

namespace strix {

/// FNV-1a over 32-bit words (www.isthe.com/chongo/tech/comp/fnv): one multiplication a float.
class StateHash {
 public:
  void add(std::uint32_t word) { hash_ = (hash_ ^ word) * 16777619U; }

  /// All NaNs count as one: which of them inf - inf gives differs between x86 and ARM.
  void add(float value) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    const bool isNan = (bits & 0x7FFFFFFFU) > 0x7F800000U;
    add(isNan ? 0x7FC00000U : bits);
  }

  template <std::size_t Size>
  void add(const std::array<float, Size>& values) {
    std::size_t i = 0;
    for (; i + 4 <= Size; i += 4) {  // a loop of one costs a third more
      add(values[i]);
      add(values[i + 1]);
      add(values[i + 2]);
      add(values[i + 3]);
    }
    for (; i < Size; ++i) add(values[i]);
  }

  template <class Derived>
  void add(const Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) add(m.derived().coeff(i));
  }

  [[nodiscard]] std::uint32_t value() const { return hash_; }

 private:
  std::uint32_t hash_ = 2166136261U;
};

}  // namespace strix
