/// What the benchmark programs share: numbered counts, and the CSV that bench.py reads.
#pragma once

#include <algorithm>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "InstructionCounter.h"

namespace m7 {

/// One counted call.
struct Counted {
  std::uint32_t instructions;
  std::uint32_t number;  ///< among all calls that the program counts: by it trace_plugin.c finds it
};

/// Counts and numbers the calls of a program. There is one of it.
class CallCounter {
 public:
  template <class Call>
  [[nodiscard]] Counted count(Call call) {
    return {counter_.count(call), ++calls_};
  }

 private:
  InstructionCounter counter_;
  std::uint32_t calls_ = 1;  ///< the first is the counter's own, of nothing
};

inline CallCounter counter;

/// The counts of one function.
class Counts {
 public:
  /// @param scalars  that each call takes in, for a measurement update
  explicit Counts(const char* function, int scalars = 0) : function_(function), scalars_(scalars) {}

  void add(const Counted& call) { calls_.push_back(call); }

  [[nodiscard]] std::size_t size() const { return calls_.size(); }
  [[nodiscard]] int scalars() const { return scalars_; }

  static void printHead() {
    std::printf("function,states,scalars,calls,median,mean,min,max,median_call\n");
  }

  /// @param states  of the filter it belongs to; 0: to none
  /// @return false, and says so, when there was no such call
  [[nodiscard]] bool print(int states) {
    if (calls_.empty()) {
      std::printf("%s, %d states: no such call\n", function_, states);
      return false;
    }
    // Among equals the order is that of the calls: sort alone would leave it open.
    std::stable_sort(calls_.begin(), calls_.end(), [](const Counted& a, const Counted& b) {
      return a.instructions < b.instructions;
    });
    std::uint64_t sum = calls_.size() / 2;  // rounds the mean
    for (const Counted& call : calls_) sum += call.instructions;
    const Counted& median = calls_[calls_.size() / 2];
    std::printf("\"%s\",%d,%d,%u,%" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%" PRIu32 "\n",
                function_, states, scalars_, static_cast<unsigned>(calls_.size()),
                median.instructions, static_cast<std::uint32_t>(sum / calls_.size()),
                calls_.front().instructions, calls_.back().instructions, median.number);
    return true;
  }

 private:
  const char* function_;
  int scalars_;
  std::vector<Counted> calls_;
};

}  // namespace m7
