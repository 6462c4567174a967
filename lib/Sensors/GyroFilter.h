/// The filter between gyro and rate control: a low-pass, and a notch that follows the motors. The
/// estimator gets the unfiltered gyro. What each setting costs in phase: docs/filtering.md.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "Biquad.h"

namespace strix {

/// All off as it stands. `strix log spectrum` proposes the notch from a log.
struct GyroFilterConfig {
  float lowPass = 0.0F;   ///< Hz, -3 dB; 0: none
  float notchMin = 0.0F;  ///< Hz, where the first notch is when the motors turn slower
  float notchMax = 0.0F;  ///< Hz, where it stays when they turn faster; 0: no notch
  float notchQ = 2.5F;    ///< centre over width at -3 dB
  /// Notches at 1, 2, ... times the motors' turns; the limits hold for the first.
  std::uint8_t notchHarmonics = 1;
};

constexpr std::size_t kMostNotches = 3;

/// True when every filter asked for can be made at this sample rate and is stable.
[[nodiscard]] constexpr bool isGyroFilter(const GyroFilterConfig& config, float sampleHz) {
  if (!(config.lowPass == 0.0F || isFilterFrequency(config.lowPass, sampleHz))) return false;
  if (config.notchMin == 0.0F && config.notchMax == 0.0F) return true;
  return config.notchHarmonics >= 1 && config.notchHarmonics <= kMostNotches &&
         config.notchMin <= config.notchMax && isFilterFrequency(config.notchMin, sampleHz) &&
         isFilterFrequency(static_cast<float>(config.notchHarmonics) * config.notchMax, sampleHz) &&
         config.notchQ >= 1.0F && config.notchQ <= 20.0F;
}

/// Notches at the motors' turns. An unbalanced propeller shakes once a turn, so the centre is the
/// motors' mean speed itself: the inverse of the ESC's curve, proportional to the root of the
/// thrust.
class ThrottleNotch {
 public:
  ThrottleNotch(const GyroFilterConfig& config, float sampleHz)
      : config_(config),
        sampleHz_(sampleHz),
        count_(config.notchMax > 0.0F ? config.notchHarmonics : 0) {
    setMotorSpeed(0.0F);
  }

  /// @param motorSpeed  mean of the four, rev/s
  void setMotorSpeed(float motorSpeed) {
    centre_ = motorSpeed > config_.notchMin ? motorSpeed : config_.notchMin;
    if (centre_ > config_.notchMax) centre_ = config_.notchMax;
    for (std::size_t i = 0; i < count_; ++i) {
      const float centre = static_cast<float>(i + 1) * centre_;
      // The motors' spread grows with the harmonic, and with one Q so does the width.
      notches_[i].setCoefficients(notch(centre, config_.notchQ, sampleHz_));
    }
  }

  [[nodiscard]] Vector3f update(const Vector3f& gyro) {
    Vector3f filtered = gyro;
    for (std::size_t i = 0; i < count_; ++i) filtered = notches_[i].update(filtered);
    return filtered;
  }

  /// Hz, of the first notch.
  [[nodiscard]] float centre() const { return centre_; }

 private:
  GyroFilterConfig config_;
  float sampleHz_;
  std::size_t count_;
  float centre_ = 0.0F;
  std::array<Biquad, kMostNotches> notches_;
};

/// update() with every IMU sample, setMotorSpeed() with every control tick.
class GyroFilter {
 public:
  /// A configuration for which isGyroFilter() is false filters nothing.
  /// @param sampleHz  calls of update() a second    @param controlHz  of setMotorSpeed()
  /// @param motorTimeConstant  s, of the motors' first-order lag behind their command
  GyroFilter(const GyroFilterConfig& config, float sampleHz, float controlHz,
             float motorTimeConstant)
      : valid_(isGyroFilter(config, sampleHz)),
        active_(valid_ && (config.lowPass > 0.0F || config.notchMax > 0.0F)),
        lagGain_(1.0F / (1.0F + motorTimeConstant * controlHz)),
        throttleNotch_(valid_ ? config : GyroFilterConfig{}, sampleHz) {
    if (valid_ && config.lowPass > 0.0F)
      lowPass_.setCoefficients(lowPass(config.lowPass, sampleHz));
  }

  [[nodiscard]] bool valid() const { return valid_; }
  /// False when it passes everything on as it is.
  [[nodiscard]] bool active() const { return active_; }

  /// The motors come after their command, and so does the notch.
  /// @param commanded  mean speed the ESCs are told, rev/s
  void setMotorSpeed(float commanded) {
    if (!isFinite(commanded)) return;
    motorSpeed_ += lagGain_ * (commanded - motorSpeed_);
    throttleNotch_.setMotorSpeed(motorSpeed_);
  }

  /// A sample with NaN or infinity is left out by an active filter: the last output stays.
  /// @param gyro  rad/s, any axes    @return the same, filtered
  [[nodiscard]] Vector3f update(const Vector3f& gyro) {
    if (!active_) return gyro;
    if (isFinite(gyro)) output_ = throttleNotch_.update(lowPass_.update(gyro));
    return output_;
  }

  /// Hz, where the first notch is.
  [[nodiscard]] float notchCentre() const { return throttleNotch_.centre(); }

 private:
  bool valid_;
  bool active_;
  float lagGain_;
  float motorSpeed_ = 0.0F;
  Biquad lowPass_;
  ThrottleNotch throttleNotch_;
  Vector3f output_ = Vector3f::Zero();
};

}  // namespace strix
