/// Does the aircraft stand still, and which way is up?
#pragma once

#include "Mathpk.h"
#include "StartCalibration.h"

namespace strix {

/// Smoothed accelerometer and gyro, and for how long nothing has moved.
class MotionWatch {
 public:
  static constexpr Micros kSilence = 50'000;  ///< an IMU is dead after fifty missing samples
  static constexpr Micros kStillTime = 1'000'000;
  static constexpr float kTurning = 0.5F;  ///< rad/s: no motor without a propeller does that

  /// @param limits  what counts as movement, as at start-up
  explicit MotionWatch(const StartCalibrationConfig& limits) : limits_(limits) {}

  /// @param accel  m/s^2, body    @param gyro  rad/s, body, bias and all
  void add(Micros now, const Vector3f& accel, const Vector3f& gyro) {
    const Micros gap = elapsed(now, heard_);
    if (!alive_ || gap > kSilence) {
      accel_ = accel;
      gyro_ = gyro;
      stillSince_ = now;
    } else {
      const float dt = toSeconds(gap);
      accel_ += dt / (dt + kSmoothing) * (accel - accel_);
      gyro_ += dt / (dt + kSmoothing) * (gyro - gyro_);
    }
    alive_ = true;
    heard_ = now;
    const bool moves = (gyro - gyro_).norm() > limits_.gyroMotion ||
                       (accel - accel_).norm() > limits_.accelMotion ||
                       gyro_.norm() > limits_.gyroBiasLimit;
    if (moves || !isFinite(accel) || !isFinite(gyro)) stillSince_ = now;
    if (!isFinite(accel) || !isFinite(gyro)) alive_ = false;  // starts the smoothing anew
    still_ = alive_ && elapsed(now, stillSince_) >= kStillTime;
  }

  /// To be called each pass: remembers a silence, which the clock's wrap would hide.
  void update(Micros now) {
    if (elapsed(now, heard_) <= kSilence) return;
    alive_ = still_ = false;
    heard_ = now - kSilence - 1;
  }

  [[nodiscard]] bool alive() const { return alive_; }
  [[nodiscard]] bool still() const { return still_; }
  [[nodiscard]] bool turning() const { return !(gyro_.norm() <= kTurning); }

  /// Tilt less than this; false also when the accelerometer does not measure about g.
  [[nodiscard]] bool level(float cosLimit) const {
    const float size = accel_.norm();
    return size > 0.8F * kGravity && size < 1.2F * kGravity && -accel_.z() >= cosLimit * size;
  }

  [[nodiscard]] const Vector3f& accel() const { return accel_; }  ///< m/s^2, body
  [[nodiscard]] const Vector3f& gyro() const { return gyro_; }    ///< rad/s, body

 private:
  static constexpr float kSmoothing =
      0.1F;  ///< s: a hundred samples, and still quicker than a hand

  StartCalibrationConfig limits_;
  Vector3f accel_ = Vector3f::Zero();
  Vector3f gyro_ = Vector3f::Zero();
  Micros heard_ = 0;
  Micros stillSince_ = 0;
  bool alive_ = false;
  bool still_ = false;
};

}  // namespace strix
