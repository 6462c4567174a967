/// How far the aircraft has moved since a moment of the last half second.
#pragma once

#include <array>

#include "Mathpk.h"

namespace strix {

/// The way travelled and the velocity gained between two moments.
struct Motion {
  Vector3f position = Vector3f::Zero();  ///< m, NED
  Vector3f velocity = Vector3f::Zero();  ///< m/s, NED
};

/// A ring of the dead-reckoned motion. A measurement of age tau compares with the state as it was
/// then: z + (p(now) - p(then)) compares with the state as it is now. What the filter's corrections
/// moved in between is no motion and not in here, so it is not corrected twice.
class MotionHistory {
 public:
  static constexpr Micros kSpacing = 10'000;
  static constexpr std::size_t kLength = 64;
  static constexpr Micros kSpan = kSpacing * (kLength - 1);  ///< the oldest age it knows

  /// Starts at rest; a moment before `now` is taken as `now`.
  void clear(Micros now) {
    sum_ = Motion{};
    newest_ = 0;
    count_ = 1;
    ring_[0] = {now, sum_};
  }

  /// Adds what one prediction moved.
  void add(Micros now, const Vector3f& position, const Vector3f& velocity) {
    sum_.position += position;
    sum_.velocity += velocity;
    now_ = now;
    if (elapsed(now, ring_[newest_].time) < kSpacing) return;
    newest_ = (newest_ + 1) % kLength;
    ring_[newest_] = {now, sum_};
    if (count_ < kLength) ++count_;
  }

  /// Motion over the last `age` us, interpolated; the oldest known where it reaches back further.
  [[nodiscard]] Motion over(Micros age) const {
    Entry later{now_, sum_};
    for (std::size_t i = 0; i < count_; ++i) {
      const Entry& earlier = ring_[(newest_ + kLength - i) % kLength];
      const Micros earlierAge = elapsed(now_, earlier.time);
      if (earlierAge >= age) {
        const Micros laterAge = elapsed(now_, later.time);
        const float part = earlierAge == laterAge
                               ? 0.0F
                               : toSeconds(age - laterAge) / toSeconds(earlierAge - laterAge);
        return {
            sum_.position - later.sum.position - part * (earlier.sum.position - later.sum.position),
            sum_.velocity - later.sum.velocity -
                part * (earlier.sum.velocity - later.sum.velocity)};
      }
      later = earlier;
    }
    return {sum_.position - later.sum.position, sum_.velocity - later.sum.velocity};
  }

 private:
  struct Entry {
    Micros time = 0;
    Motion sum;
  };

  std::array<Entry, kLength> ring_{};
  std::size_t newest_ = 0;
  std::size_t count_ = 1;
  Motion sum_;  ///< since clear(); differences of it matter, not itself
  Micros now_ = 0;
};

}  // namespace strix
