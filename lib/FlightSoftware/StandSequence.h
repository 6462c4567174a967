/// What the attitude stand asks for, second by second: idle, hold level, then steps about each
/// axis.
#pragma once

#include "Mathpk.h"

namespace strix {

/// Idle 5 s, level 10 s, then +A and -A about roll, pitch and yaw for 4 s each, level for 4 s
/// between two of them; then it is done.
namespace stand {

constexpr Micros kIdle = 5'000'000;
constexpr Micros kLevel = 10'000'000;
constexpr Micros kStep = 4'000'000;
constexpr Micros kSteps = 11;  ///< six steps and the five pauses between them
constexpr Micros kEnd = kIdle + kLevel + kSteps * kStep;

/// Number of the part that runs at `t` us from the start: 0 idle, 1 level, then steps and pauses.
[[nodiscard]] constexpr Micros partAt(Micros t) {
  if (t < kIdle) return 0;
  if (t < kIdle + kLevel) return 1;
  const Micros part = (t - kIdle - kLevel) / kStep;
  return 2 + (part < kSteps ? part : kSteps - 1);
}

/// Attitude wanted in that part; yaw to the right of the heading at the start.
/// @param angle  rad
[[nodiscard]] constexpr EulerAngles attitudeIn(Micros part, float angle) {
  if (part < 2 || part % 2 == 1) return {};
  const Micros step = (part - 2) / 2;
  const float signedAngle = step % 2 == 0 ? angle : -angle;
  if (step < 2) return {signedAngle, 0.0F, 0.0F};
  if (step < 4) return {0.0F, signedAngle, 0.0F};
  return {0.0F, 0.0F, signedAngle};
}

}  // namespace stand
}  // namespace strix
