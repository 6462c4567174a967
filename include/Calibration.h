/// Written by `strix calibrate ... --write`: a part at a time; the others are kept.
///
///     accelerometer  body = levelRotation * sensorToBody *
///                           accelScale * (raw - accelBias)
///     magnetometer   body = sensorToBody * softIron *
///                           (raw - hardIron - magPerThrottle * throttle)
///
/// throttle: mean motor command between its limits, 0 to 1. docs/calibration.md.
#pragma once

namespace strix {

/// Of one aircraft.
struct AircraftCalibration {
  // clang-format off
  /// m/s^2, sensor axes. From: neutral
  float accelBias[3] = {
      0.0F, 0.0F, 0.0F};
  /// row by row, symmetric: cross-axis terms, no turn. From: neutral
  float accelScale[9] = {
      1.0F, 0.0F, 0.0F,
      0.0F, 1.0F, 0.0F,
      0.0F, 0.0F, 1.0F};
  /// uT, sensor axes. From: neutral
  float hardIron[3] = {
      0.0F, 0.0F, 0.0F};
  /// row by row, symmetric. From: neutral
  float softIron[9] = {
      1.0F, 0.0F, 0.0F,
      0.0F, 1.0F, 0.0F,
      0.0F, 0.0F, 1.0F};
  /// uT at full throttle, sensor axes. From: neutral
  float magPerThrottle[3] = {
      0.0F, 0.0F, 0.0F};
  /// row by row; turns what the IMU calls body into the body. From: neutral
  float levelRotation[9] = {
      1.0F, 0.0F, 0.0F,
      0.0F, 1.0F, 0.0F,
      0.0F, 0.0F, 1.0F};
  // clang-format on
};

constexpr AircraftCalibration kCalibration{};

}  // namespace strix
