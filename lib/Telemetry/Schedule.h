/// Which of the periodic messages is next.
#pragma once

#include <array>
#include <cstddef>

#include "Time.h"

namespace strix {

/// The one that is due for longest goes first. One that is late keeps its place until it is sent,
/// so that none starves when there is room for less than all.
template <std::size_t Count>
class Schedule {
 public:
  static constexpr std::size_t kNone = Count;

  /// @param period  us; zero: only when it is asked for
  void set(std::size_t index, Micros period, Micros first) {
    entries_[index].period = period;
    entries_[index].due = first;
  }

  /// Once, as soon as there is room.
  void ask(std::size_t index) { entries_[index].asked = true; }

  [[nodiscard]] Micros period(std::size_t index) const { return entries_[index].period; }

  [[nodiscard]] std::size_t next(Micros now) const {
    std::size_t found = kNone;
    std::int32_t longest = -1;
    for (std::size_t i = 0; i < Count; ++i) {
      const Entry& entry = entries_[i];
      if (entry.asked) return i;
      const auto late = static_cast<std::int32_t>(now - entry.due);
      if (entry.period == 0 || late <= longest) continue;
      found = i;
      longest = late;
    }
    return found;
  }

  /// Keeps its phase; a whole period late, it starts a new one.
  void done(std::size_t index, Micros now) {
    Entry& entry = entries_[index];
    if (entry.asked) {
      entry.asked = false;
      return;
    }
    entry.due += entry.period;
    if (static_cast<std::int32_t>(now - entry.due) >= 0) entry.due = now + entry.period;
  }

 private:
  struct Entry {
    Micros period = 0;
    Micros due = 0;
    bool asked = false;
  };
  std::array<Entry, Count> entries_{};
};

}  // namespace strix
