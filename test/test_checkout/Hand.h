/// The hand that turns the aircraft for the command `axes`.
#pragma once

#include <string>

#include "CheckoutBench.h"

namespace strix {

/// Turns the bench's aircraft from pose to pose with the gyro that goes with it.
class Hand {
 public:
  explicit Hand(CheckoutBench& bench) : bench_(bench) {}

  void turnTo(const Quaternion& target) {
    constexpr int kSteps = 3000;
    const Vector3f turn = quaternionLog(conjugate(attitude_) * target);
    const float seconds = toSeconds(bench_.stepTime) * kSteps;
    const Quaternion from = attitude_;
    for (int i = 1; i <= kSteps; ++i) {
      attitude_ = from * quaternionExp(turn * (static_cast<float>(i) / kSteps));
      bench_.hold(attitude_, turn / seconds);
      bench_.step();
    }
    bench_.hold(attitude_);
    bench_.run(1.5F);
  }

 private:
  CheckoutBench& bench_;
  Quaternion attitude_;
};

[[nodiscard]] inline Quaternion pose(float roll, float pitch, float yaw) {
  return eulerToQuaternion({roll * kDegToRad, pitch * kDegToRad, yaw * kDegToRad});
}

/// All five poses of `axes`, by a hand that is up to 15 deg off; what was printed.
[[nodiscard]] inline std::string fivePoses(CheckoutBench& bench) {
  Hand hand(bench);
  hand.turnTo(pose(2.0F, 3.0F, 40.0F));
  std::string text = bench.say("axes");
  text += bench.say("");
  hand.turnTo(pose(10.0F, -80.0F, 50.0F));
  text += bench.say("");
  hand.turnTo(pose(-85.0F, 12.0F, 70.0F));
  text += bench.say("");
  hand.turnTo(pose(-3.0F, 5.0F, 14.0F));
  text += bench.say("");
  hand.turnTo(pose(4.0F, -2.0F, 84.0F));
  return text + bench.say("");
}

}  // namespace strix
