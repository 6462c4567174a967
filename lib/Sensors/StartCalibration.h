/// Start-up calibration: what a still aircraft on the ground tells about its sensors.
///
/// It runs inside the loop, in state BOOT, not before it: nothing blocks, the samples it used are
/// in the log like all others, and a replay repeats it.
#pragma once

#include "Geodesy.h"

namespace strix {

/// Mean of vectors, updated sample by sample so that no large sum loses digits.
class RunningMean {
 public:
  void add(const Vector3f& value) {
    ++count_;
    mean_ += (value - mean_) / static_cast<float>(count_);
  }
  void clear() { *this = RunningMean{}; }
  [[nodiscard]] const Vector3f& mean() const { return mean_; }
  [[nodiscard]] std::uint32_t count() const { return count_; }

 private:
  Vector3f mean_ = Vector3f::Zero();
  std::uint32_t count_ = 0;
};

struct StartCalibrationConfig {
  Micros duration = 2'000'000;     ///< of standstill that is averaged
  float gyroMotion = 0.06F;        ///< rad/s from the mean that means "moved"
  float accelMotion = 0.6F;        ///< m/s^2 from the mean that means "moved"
  float gyroBiasLimit = 0.2F;      ///< rad/s: a larger mean is a turn, not a bias
  std::uint32_t imuSamples = 200;  ///< required in `duration`
  std::uint32_t magSamples = 20;
  std::uint32_t altSamples = 20;
};

/// Averages while the aircraft stands still; any movement starts it over.
class StartCalibration {
 public:
  explicit StartCalibration(const StartCalibrationConfig& config) : config_(config) {}

  /// @param accel  m/s^2, body    @param gyro  rad/s, body, without bias correction
  void addImu(Micros now, const Vector3f& accel, const Vector3f& gyro) {
    if (done_) return;
    if (accel_.count() == 0) started_ = now;
    if (moved(accel, gyro)) {
      restart();
      return;
    }
    accel_.add(accel);
    gyro_.add(gyro);
    done_ = elapsed(now, started_) >= config_.duration && accel_.count() >= config_.imuSamples &&
            mag_.count() >= config_.magSamples && pressure_.count() >= config_.altSamples;
  }

  /// @param field  uT, body
  void addMag(const Vector3f& field) {
    if (!done_ && isFinite(field)) mag_.add(field);
  }

  /// @param pressure  Pa
  void addPressure(float pressure) {
    if (!done_ && pressure > 0.0F && isFinite(pressure)) pressure_.add({pressure, 0.0F, 0.0F});
  }

  /// Once more, from the next samples on.
  void begin() {
    restart();
    done_ = false;
  }

  [[nodiscard]] bool done() const { return done_; }
  [[nodiscard]] std::uint32_t restarts() const { return restarts_; }
  [[nodiscard]] const Vector3f& accel() const { return accel_.mean(); }
  [[nodiscard]] const Vector3f& gyroBias() const { return gyro_.mean(); }
  [[nodiscard]] const Vector3f& mag() const { return mag_.mean(); }
  [[nodiscard]] float groundPressure() const { return pressure_.mean().x(); }

 private:
  [[nodiscard]] bool moved(const Vector3f& accel, const Vector3f& gyro) const {
    if (!isFinite(accel) || !isFinite(gyro)) return true;
    if (gyro_.count() == 0) return false;
    return (gyro - gyro_.mean()).norm() > config_.gyroMotion ||
           (accel - accel_.mean()).norm() > config_.accelMotion ||
           gyro_.mean().norm() > config_.gyroBiasLimit;
  }

  void restart() {
    accel_.clear();
    gyro_.clear();
    mag_.clear();
    pressure_.clear();
    ++restarts_;
  }

  StartCalibrationConfig config_;
  RunningMean accel_;
  RunningMean gyro_;
  RunningMean mag_;
  RunningMean pressure_;  // x only
  Micros started_ = 0;
  std::uint32_t restarts_ = 0;
  bool done_ = false;
};

/// The GPS origin: the mean of all good fixes taken on the ground. A single fix is 3 m off, the
/// mean of a minute 0.15 m.
class OriginAverage {
 public:
  void add(const GeoPoint& fix) {
    if (offset_.count() == 0) first_ = fix;
    offset_.add({static_cast<float>(fix.latitude - first_.latitude),
                 static_cast<float>(longitudeStep(fix.longitude, first_.longitude)),
                 static_cast<float>(fix.altitude - first_.altitude)});
  }
  [[nodiscard]] std::uint32_t count() const { return offset_.count(); }
  [[nodiscard]] GeoPoint origin() const {
    const Vector3f& mean = offset_.mean();
    const std::int64_t longitude = std::int64_t{first_.longitude} + rounded(mean.y());
    return {first_.latitude + rounded(mean.x()),
            static_cast<std::int32_t>(longitudeStep(longitude, 0)),
            first_.altitude + rounded(mean.z())};
  }

 private:
  [[nodiscard]] static std::int32_t rounded(float x) {
    return static_cast<std::int32_t>(x < 0.0F ? x - 0.5F : x + 0.5F);
  }

  GeoPoint first_;
  RunningMean offset_;
};

}  // namespace strix
