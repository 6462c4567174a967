/// Seconds told one by one before something happens.
#pragma once

#include "TextOut.h"
#include "Time.h"

namespace strix {

class Countdown {
 public:
  void start(Micros now, Micros whole) {
    since_ = now;
    whole_ = whole;
    told_ = 0;
  }

  /// Tells each second once.
  /// @return true at its end
  [[nodiscard]] bool over(Micros now, TextOut& out, const char* what) {
    const Micros gone = elapsed(now, since_);
    if (gone >= whole_) return true;
    const Micros left = (whole_ - gone + kSecond - 1) / kSecond;
    if (left == told_) return false;
    told_ = left;
    out << what << " in " << std::uint32_t{left} << " s: any key stops it\n";
    return false;
  }

 private:
  static constexpr Micros kSecond = 1'000'000;
  Micros since_ = 0;
  Micros whole_ = 0;
  Micros told_ = 0;
};

}  // namespace strix
