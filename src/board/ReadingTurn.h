/// Whose turn the card is when somebody on the ground reads an old log while the new one is
/// written.
#pragma once

#include "Time.h"

namespace strix {

/// To change from writing to reading costs the card some 10 ms. So the reader gets kReading at
/// once, which the log's rings absorb (25 KB), and then the log the card for kWriting.
class ReadingTurn {
 public:
  static constexpr Micros kReading = 150'000;
  static constexpr Micros kWriting = 50'000;

  /// The reader asks, before each piece.
  [[nodiscard]] bool take(Micros now) {
    if (reading_) return !over(now);
    if (elapsed(now, since_) < kWriting) return false;
    reading_ = true;
    since_ = now;
    return true;
  }

  [[nodiscard]] bool reading() const { return reading_; }
  /// The reader has had its time, whether it asked again or not.
  [[nodiscard]] bool over(Micros now) const { return reading_ && elapsed(now, since_) >= kReading; }

  void end(Micros now) {
    reading_ = false;
    since_ = now;
  }

 private:
  bool reading_ = false;
  Micros since_ = 0;
};

}  // namespace strix
