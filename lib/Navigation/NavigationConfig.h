/// Tuning of the filter and of what decides when it listens to which sensor. One value per number,
/// with unit and reason; FlightConfig.h may change it. docs/navigation.md shows what each buys.
#pragma once

#include "ComplementaryFilter.h"
#include "FieldTracker.h"
#include "Mathpk.h"
#include "StandstillDetector.h"

namespace strix {

/// Noise of a measurement: variance = sigma^2 + density^2 / dt, dt the time since the last one.
/// sigma is the sensor's white noise. density stands for errors that outlast a sample (manoeuvre
/// accelerations seen as gravity, a bent field): with them information grows with time, not with
/// the number of samples, and one tuning serves a sensor read at 2 Hz or at 1 kHz.
struct MeasurementNoise {
  float sigma;    ///< unit of the measurement
  float density;  ///< unit of the measurement / sqrt(Hz)

  [[nodiscard]] float variance(float dt) const {
    return sigma * sigma + (density == 0.0F ? 0.0F : density * density / dt);
  }
};

/// What the accelerometer may say about gravity's direction.
enum class TiltFusion : std::uint8_t {
  Off,
  Gated,      ///< while | |a| - g | < tiltGate, as published
  Vibration,  ///< always, with noise that grows with the measured vibration
};

/// What a magnetometer may correct.
enum class MagFusion : std::uint8_t {
  ThreeAxis,    ///< the whole attitude and the magnetometer's bias, as published
  HeadingOnly,  ///< heading: a bent field cannot tilt the attitude
};

/// When a sensor that running motors disturb is used.
enum class WithMotors : std::uint8_t {
  On,         ///< always, as if they did not run
  Inflated,   ///< with disturbedFactor on its variance, except in hover
  HoverOnly,  ///< with the motors off, and in hover
  Off,        ///< with the motors off
};

struct NavigationConfig {
  float gravity = kGravity;  ///< m/s^2; start-up calibration may refine it

  // Process noise. What vibration, scale errors and slow samples add is more than the sensors' own
  // noise; what nothing aids shows it more: its errors last.
  float accelNoise = 0.2F;          ///< m/s^2 / sqrt(Hz), while GPS aids the velocity
  float gyroNoise = 0.0015F;        ///< rad/s / sqrt(Hz)
  float gyroScaleNoise = 0.005F;    ///< sqrt(s): 0.5 % of the rate, for 1 s, adds to gyroNoise
  float accelNoiseUnaided = 0.07F;  ///< else
  float gyroNoiseUnaided = 0.004F;
  // Random walks of the biases, 18 states only.
  float accelBiasWalk = 3e-4F;  ///< m/s^2 / sqrt(s)
  float gyroBiasWalk = 1e-4F;   ///< rad/s / sqrt(s)
  float magBiasWalk = 0.0F;     ///< uT / sqrt(s)

  TiltFusion tiltFusion = TiltFusion::Off;
  MeasurementNoise tilt{0.05F, 0.25F};  ///< m/s^2
  float tiltGate = 0.5F;                ///< m/s^2
  float tiltVibration = 1.0F;           ///< s^(1/2): noise density for each m/s^2 of vibration

  MagFusion magFusion = MagFusion::HeadingOnly;
  MeasurementNoise mag{0.5F, 1.25F};       ///< uT, each axis
  MeasurementNoise heading{0.0F, 0.106F};  ///< rad
  float headingRate = 3.0F;                ///< rad/s, at which heading's variance is doubled
  bool trackField = true;                  ///< leave out a field of another length or dip
  FieldTrackerConfig field;

  MeasurementNoise alt{0.3F, 0.0F};  ///< m
  Micros altDelay = 0;               ///< age of a height when it arrives
  float gpsPositionSigma = 0.5F;     ///< m, north and east
  float gpsVelocitySigma = 0.3F;     ///< m/s, north and east
  Micros gpsDelay = 0;               ///< age of a fix when it arrives

  // Motors: see WithMotors. A hover calibration is what the field changes by while hovering.
  WithMotors tiltWithMotors = WithMotors::On;
  WithMotors magWithMotors = WithMotors::On;
  float disturbedFactor = 25.0F;               ///< on the variance
  Vector3f magHoverOffset = Vector3f::Zero();  ///< uT, body

  // Standstill: only where the motors are known to stand, or nobody knows about motors.
  bool standstillAid = true;
  StandstillConfig standstill;
  float standstillSigma = 0.02F;       ///< m/s, of v = 0
  float standstillRateSigma = 0.003F;  ///< rad/s, of the mean rate as gyro bias

  // Bounded motion: what moves near a place, and has nothing to say so, is there, at rest, give or
  // take. Off, velocity errors grow without end when nothing aids.
  bool boundedMotion = true;
  float boundedPositionSigma = 2.0F;  ///< m, of p = 0, 20 times a second
  float boundedVelocitySigma = 1.0F;  ///< m/s, of v = 0
  // After GPS: what moved at that speed goes on doing so; only its square is remembered.
  float outageVelocitySigma = 1.0F;   ///< m/s, of v = 0 once a second, beside
  float outageVelocityFactor = 5.0F;  ///< on the RMS of each axis over the last 10 s of GPS
  Micros gpsAidTime = 30'000'000;     ///< so long after a fix the position is not bounded

  float nisGate = 6.635F;           ///< chi-square, 1 dof, 99 %
  Micros readmitAfter = 1'000'000;  ///< a sensor rejected for longer is taken in again; 0: never
  /// rad/s, what is uncertain of it when a velocity is; with more a GPS that is late tips it.
  float readmitGyroBias = 0.004F;

  // Health.
  Micros gpsTimeout = 5'000'000;   ///< without a fix used
  Micros altTimeout = 2'000'000;   ///< without a height used
  Micros magTimeout = 30'000'000;  ///< without a field used
  float disagreement = 0.35F;      ///< rad of tilt between the filters
  Micros disagreementTime = 5'000'000;
  ComplementaryConfig complementary;

  // One-sigma uncertainty at alignment.
  float positionSigma0 = 0.5F;    ///< m
  float velocitySigma0 = 0.1F;    ///< m/s
  float tiltSigma0 = 0.03F;       ///< rad
  float headingSigma0 = 0.10F;    ///< rad
  float accelBiasSigma0 = 0.02F;  ///< m/s^2
  float gyroBiasSigma0 = 0.003F;  ///< rad/s: what the start-up calibration leaves
  float magBiasSigma0 = 0.0F;     ///< uT
};

}  // namespace strix
