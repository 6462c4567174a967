/// Tuning of the filter. One value per number, with unit and reason; FlightConfig.h may change it.
#pragma once

#include "Mathpk.h"

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

struct NavigationConfig {
  float gravity = kGravity;  ///< m/s^2; start-up calibration may refine it

  // Process noise. The 9-state filter has no bias states: what the start-up calibration leaves and
  // what drifts later must be covered here, so both are well above the sensors' own noise.
  // gyroNoise against the two densities below sets how fast gravity and field pull the attitude
  // back: in 6 s (tilt) and 12 s (heading in a horizontal field of 25 uT). Chosen on the recordings
  // of tools/tests/test_estimate.py, all with this one set; half and double gyroNoise change roll
  // and pitch of a real flight by less than 0.4 deg RMS, its heading by less than 1 deg.
  float accelNoise = 0.05F;  ///< m/s^2 / sqrt(Hz)
  float gyroNoise = 0.004F;  ///< rad/s / sqrt(Hz)

  MeasurementNoise tilt{0.05F, 0.25F};  ///< m/s^2
  float tiltGate = 0.5F;                ///< m/s^2: tilt is used when | |a| - g | is below it
  MeasurementNoise mag{0.5F, 1.25F};    ///< uT
  MeasurementNoise alt{0.3F, 0.0F};     ///< m
  float gpsPositionSigma = 3.0F;        ///< m, north and east
  float gpsVelocitySigma = 0.3F;        ///< m/s, north and east
  float standstillSigma = 0.05F;        ///< m/s, of v = 0 while the aircraft stands on the ground
  Micros gpsDelay = 0;                  ///< age of a fix when it arrives

  float nisGate = 6.635F;  ///< chi-square, 1 dof, 99 %

  // One-sigma uncertainty at alignment.
  float positionSigma0 = 0.5F;  ///< m
  float velocitySigma0 = 0.1F;  ///< m/s
  float tiltSigma0 = 0.03F;     ///< rad
  float headingSigma0 = 0.10F;  ///< rad
};

}  // namespace strix
