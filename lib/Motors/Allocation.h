/// Squared rotor speeds for a wrench, for any layout of rotors that stand still in the body.
#pragma once

#include <array>
#include <cstddef>

#include "Mathpk.h"
#include "Vehicle.h"
#include "Wrench.h"

namespace strix {

/// With E the wrench per squared speed, one column a rotor, the squared speeds of a wrench are
/// E^T (E E^T)^-1 of it: the smallest that give it, and for four rotors the only ones. It is made
/// once, from the rows' shape; nothing says that they are orthogonal.
template <std::size_t Rotors>
class Allocation {
 public:
  using Squares = std::array<float, Rotors>;  ///< of each rotor's speed

  /// Limits are to be set before solve().
  Allocation(const std::array<Rotor, Rotors>& rotors, float thrustConstant, float torqueConstant) {
    // Force on a rotor at (x, y) is -z, so its moment (r x F) is -y about x and +x about y; a rotor
    // turning clockwise is held by the body, which is turned to the left, -z.
    for (std::size_t i = 0; i < Rotors; ++i) {
      effect_[kThrust][i] = thrustConstant;
      effect_[kRoll][i] = -rotors[i].y * thrustConstant;
      effect_[kPitch][i] = rotors[i].x * thrustConstant;
      effect_[kYaw][i] = -static_cast<float>(rotors[i].spin) * torqueConstant;
    }
    solvable_ = invert();
    for (std::size_t i = 0; i < Rotors && solvable_; ++i) {
      solvable_ = inverse_[kThrust][i] > 0.0F;
      perLevel_[i] = 1.0F / inverse_[kThrust][i];
    }
  }

  /// Of every rotor's squared speed, 0 <= low < high.
  void setLimits(float low, float high) {
    low_ = low;
    high_ = high;
  }

  /// False for a layout that cannot give thrust and three torques each by itself, that needs a
  /// rotor to push down while it hovers, or that cannot be level with all rotors in their limits.
  [[nodiscard]] bool valid() const {
    if (!solvable_) return false;
    float least = inverse_[kThrust][0];
    float most = least;
    for (const float share : inverse_[kThrust]) {
      least = smaller(least, share);
      most = larger(most, share);
    }
    return least * high_ > most * low_;
  }

  /// Exact for a finite wrench that the limits allow. Otherwise, in this order: as much of the roll
  /// and pitch torque as can be, in its direction; the nearest thrust; as much of the yaw torque.
  /// Yaw is given from none of it to all of it, never with the other sign or more than wanted, also
  /// where that would help the others. With more than four rotors: of what the pseudo-inverse can
  /// express, which moves no thrust to where it changes nothing.
  [[nodiscard]] Squares solve(const Wrench& wanted) const {
    Shares shares;  // NOLINT(cppcoreguidelines-pro-type-member-init): the loop sets every one
    Squares squares;
    bool inside = true;
    for (std::size_t i = 0; i < Rotors; ++i) {
      const float tilting =
          inverse_[kRoll][i] * wanted.torque.x() + inverse_[kPitch][i] * wanted.torque.y();
      const float turning = inverse_[kYaw][i] * wanted.torque.z();
      const float square = inverse_[kThrust][i] * wanted.thrust + tilting + turning;
      inside = inside && square >= low_ && square <= high_;
      shares.tilting[i] = tilting;
      shares.turning[i] = turning;
      squares[i] = square;
    }
    return inside ? squares : nearest(wanted.thrust, shares);
  }

  /// Wrench of rotors at these squared speeds.
  [[nodiscard]] Wrench wrenchOf(const Squares& squares) const {
    std::array<float, kAxes> sum{};
    for (std::size_t row = 0; row < kAxes; ++row) {
      for (std::size_t i = 0; i < Rotors; ++i) sum[row] += effect_[row][i] * squares[i];
    }
    return {sum[kThrust], {sum[kRoll], sum[kPitch], sum[kYaw]}};
  }

 private:
  enum Axis : std::size_t { kThrust, kRoll, kPitch, kYaw, kAxes };
  using Rows = std::array<std::array<float, Rotors>, kAxes>;

  /// ours: squared sine of the angle between a row and the rows before it, at least; an X has 1. At
  /// 1.8 deg rounding is enlarged a thousand times.
  static constexpr float kIndependent = 1e-3F;
  static constexpr float kBeyondAny = 1e30F;  ///< thrust, N
  /// ours: a yaw share below this part of the largest square is rounding, and none.
  static constexpr float kNoShare = 1e-6F;

  /// What roll and pitch torque, and yaw torque, ask of each rotor.
  struct Shares {
    Squares tilting;
    Squares turning;
  };

  /// A rotor, or two, keep f, the part of the yaw torque that is given, between two limits that
  /// move with one unknown x: lower <= f + slope x <= upper.
  struct Band {
    float lower;
    float upper;
    float slope;
  };
  /// All of them; the first is that f is 0 to 1.
  template <std::size_t Most>
  struct Bands {
    std::array<Band, Most> of;
    std::size_t count = 1;
    Bands() { of[0] = {0.0F, 1.0F, 0.0F}; }
    /// low <= f turning + x rising <= high
    void add(float low, float high, float turning, float rising) {
      const float per = 1.0F / turning;
      of[count] = {low * per, high * per, rising * per};
      if (per < 0.0F) of[count] = {high * per, low * per, rising * per};
      ++count;
    }
  };

  [[nodiscard]] static float smaller(float a, float b) { return b < a ? b : a; }
  [[nodiscard]] static float larger(float a, float b) { return b > a ? b : a; }
  [[nodiscard]] static float clamp(float v, float low, float high) {
    return smaller(larger(v, low), high);
  }
  [[nodiscard]] static float magnitude(float v) { return v < 0.0F ? -v : v; }

  /// inverse_, transposed: E is its rows' lengths times unit rows, E = D U, and so the
  /// pseudo-inverse is U^T (U U^T)^-1 D^-1. Gauss-Jordan; U U^T has ones on its diagonal.
  /// @return whether the rows are independent
  [[nodiscard]] bool invert() {
    std::array<float, kAxes> length{};
    for (std::size_t row = 0; row < kAxes; ++row) {
      for (const float e : effect_[row]) length[row] += e * e;
      length[row] = squareRoot(length[row]);
      for (std::size_t i = 0; i < Rotors; ++i) inverse_[row][i] = effect_[row][i] / length[row];
    }
    std::array<std::array<float, kAxes>, kAxes> gram{};
    for (std::size_t row = 0; row < kAxes; ++row) {
      for (std::size_t other = 0; other < kAxes; ++other) {
        for (std::size_t i = 0; i < Rotors; ++i) {
          gram[row][other] += inverse_[row][i] * inverse_[other][i];
        }
      }
    }
    for (std::size_t pivot = 0; pivot < kAxes; ++pivot) {
      if (!(gram[pivot][pivot] > kIndependent)) {  // NaN too: a row of zeros
        inverse_ = Rows{};
        return false;
      }
      for (std::size_t row = 0; row < kAxes; ++row) {
        if (row == pivot) continue;
        const float factor = gram[row][pivot] / gram[pivot][pivot];
        for (std::size_t i = 0; i < kAxes; ++i) gram[row][i] -= factor * gram[pivot][i];
        for (std::size_t i = 0; i < Rotors; ++i) inverse_[row][i] -= factor * inverse_[pivot][i];
      }
    }
    for (std::size_t row = 0; row < kAxes; ++row) {
      for (float& share : inverse_[row]) share /= gram[row][row] * length[row];
    }
    return true;
  }

  /// At thrust x each rotor's limits are a band of f. The thrust nearest to the wanted one is
  /// where the bands meet.
  [[nodiscard]] Squares nearest(float thrust, Shares& shares) const {
    const Squares& level = inverse_[kThrust];
    Squares squares;
    if (onlyYaw(thrust, shares, squares)) return squares;
    Squares below;  // room that roll and pitch leave to thrust and yaw
    Squares above;
    if (!leaveRoom(shares.tilting, below, above)) {
      const float part = tiltingPart(shares);
      for (float& share : shares.tilting) share *= part;
      (void)leaveRoom(shares.tilting, below, above);
    }
    const float none = kNoShare * high_;
    Bands<Rotors + 1> bands;
    for (std::size_t i = 0; i < Rotors; ++i) {
      if (magnitude(shares.turning[i]) < none) {
        thrust = clamp(thrust, below[i] * perLevel_[i], above[i] * perLevel_[i]);
      } else {
        bands.add(below[i], above[i], shares.turning[i], level[i]);
      }
    }
    const float part = meet(bands, thrust);
    for (std::size_t i = 0; i < Rotors; ++i) {
      const float square = level[i] * thrust + shares.tilting[i] + part * shares.turning[i];
      squares[i] = clamp(square, low_, high_);
    }
    return squares;
  }

  /// The usual case: the wrench but for its yaw torque is within the limits, and what is left to do
  /// is the largest part of that.
  [[nodiscard]] bool onlyYaw(float thrust, const Shares& shares, Squares& squares) const {
    float part = 1.0F;
    for (std::size_t i = 0; i < Rotors; ++i) {
      const float base = inverse_[kThrust][i] * thrust + shares.tilting[i];
      if (!(base >= low_ && base <= high_)) return false;
      const float turning = shares.turning[i];
      const float square = base + turning;
      if (square > high_) part = smaller(part, (high_ - base) / turning);
      if (square < low_) part = smaller(part, (low_ - base) / turning);
      squares[i] = base;
    }
    for (std::size_t i = 0; i < Rotors; ++i) {
      squares[i] = clamp(squares[i] + part * shares.turning[i], low_, high_);
    }
    return true;
  }

  /// @return whether that is enough for some thrust without yaw
  [[nodiscard]] bool leaveRoom(const Squares& tilting, Squares& below, Squares& above) const {
    float least = 0.0F;
    float most = kBeyondAny;
    for (std::size_t i = 0; i < Rotors; ++i) {
      below[i] = low_ - tilting[i];
      above[i] = high_ - tilting[i];
      least = larger(least, below[i] * perLevel_[i]);
      most = smaller(most, above[i] * perLevel_[i]);
    }
    return least <= most;
  }

  /// The largest part, 0 to 1, of the roll and pitch torque for which there is a thrust and an f.
  /// With thrust eliminated from the limits of two rotors they are a band of f, and x is that part.
  [[nodiscard]] float tiltingPart(const Shares& shares) const {
    const Squares& level = inverse_[kThrust];
    float part = 1.0F;
    Bands<Rotors*(Rotors - 1) / 2 + 1> bands;
    for (std::size_t i = 1; i < Rotors; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const float tilting = shares.tilting[i] * level[j] - shares.tilting[j] * level[i];
        const float turning = shares.turning[i] * level[j] - shares.turning[j] * level[i];
        const float least = low_ * level[j] - high_ * level[i];  // below 0: see valid()
        const float most = high_ * level[j] - low_ * level[i];
        if (magnitude(turning) < kNoShare * most) {
          if (part * tilting > most) part = most / tilting;
          if (part * tilting < least) part = least / tilting;
        } else {
          bands.add(least, most, turning, tilting);
        }
      }
    }
    (void)meet(bands, part);
    return larger(part, 0.0F);
  }

  /// Moves x to the nearest value at which some f is in all bands. Newton's method on the distance
  /// between the lowest upper and the highest lower limit, which is concave and of straight pieces:
  /// each step goes to where two limits cross, none goes too far, and the last is exact. There are
  /// no more pieces than limits; rounding must not make more steps of them.
  /// @return the largest f there
  template <std::size_t Most>
  [[nodiscard]] static float meet(const Bands<Most>& bands, float& x) {
    std::size_t lastUpper = 0;
    std::size_t lastLower = 0;
    for (std::size_t step = 0;; ++step) {
      std::size_t upper = 0;
      std::size_t lower = 0;
      float top = bands.of[0].upper;
      float bottom = bands.of[0].lower;
      for (std::size_t i = 1; i < bands.count; ++i) {
        const Band& band = bands.of[i];
        const float shift = band.slope * x;
        if (band.upper - shift < top) {
          top = band.upper - shift;
          upper = i;
        }
        if (band.lower - shift > bottom) {
          bottom = band.lower - shift;
          lower = i;
        }
      }
      const float closing = bands.of[upper].slope - bands.of[lower].slope;
      const bool there = upper == lastUpper && lower == lastLower;  // but for rounding
      if (bottom <= top || there || closing == 0.0F || step == 2 * bands.count) {
        return clamp(top, 0.0F, 1.0F);
      }
      x = (bands.of[upper].upper - bands.of[lower].lower) / closing;
      lastUpper = upper;
      lastLower = lower;
    }
  }

  Rows effect_{};                         ///< wrench per squared speed
  Rows inverse_{};                        ///< its pseudo-inverse, transposed
  std::array<float, Rotors> perLevel_{};  ///< thrust per squared speed, all torques none
  bool solvable_ = false;
  float low_ = 0.0F;
  float high_ = 0.0F;
};

}  // namespace strix
