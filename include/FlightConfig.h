/// The aircraft that this repository flies, and everything chosen for it.
#pragma once

#include "Calibration.h"
#include "FlightSoftwareConfig.h"
#include "missions/FirstFlight.h"
#include "vehicles/Vehicles.h"

namespace strix {

/// The airframe src/main.cpp flies.
constexpr Airframe kFlown{kQuad5in, kQuad5inGains, kQuad5inDesigns};

/// Age of an MTK3333's fix when its sentence has arrived; ArduPilot assumes the same of a receiver
/// it does not know.
constexpr Micros kGpsDelay = 100'000;

/// The ICM20649 measures at 1125 Hz; the simulated one at 1000 Hz.
constexpr Micros kImuPeriod = 888;

/// How the LIS2MDL sits in the body: its x and z axes as the body's, its y axis to the left. As its
/// axes are left-handed this is a reflection, whatever the mounting; another mounting moves the
/// sign.
[[nodiscard]] inline Matrix3f magSensorToBody() { return Vector3f{1.0F, -1.0F, 1.0F}.asDiagonal(); }

/// Configuration of one airframe with the defaults of every library.
[[nodiscard]] inline FlightSoftwareConfig flightConfig(const Vehicle& vehicle, const Gains& gains,
                                                       const Mission& mission, float declination) {
  FlightSoftwareConfig config{vehicle, gains, mission};
  config.parameters.declination = declination / kDegToRad;
  config.sensors.mag.sensorToBody = magSensorToBody();
  config.navigation.gpsDelay = kGpsDelay;
  config.navigation.gpsPositionSigma = 3.0F;  // m and m/s, an MTK3333 under open sky
  config.navigation.gpsVelocitySigma = 0.3F;
  config.navigation.accelNoise = 0.05F;
  return config;
}

/// Makes a configuration that of the real sensors: their rate, and what `strix calibrate` found.
inline void useRealSensors(SensorConfig& sensors, const AircraftCalibration& found) {
  sensors.imuPeriod = kImuPeriod;
  const auto vector = [](const float (&v)[3]) { return Vector3f{v[0], v[1], v[2]}; };
  const auto matrix = [](const float (&rows)[9]) {
    Matrix3f m;
    m << rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], rows[7], rows[8];
    return m;
  };
  sensors.imu.accelBias = vector(found.accelBias);
  sensors.imu.accelScale = matrix(found.accelScale);
  sensors.imu.sensorToBody = matrix(found.levelRotation) * sensors.imu.sensorToBody;
  sensors.mag.hardIron = vector(found.hardIron);
  sensors.mag.softIron = matrix(found.softIron);
  sensors.mag.perThrottle = vector(found.magPerThrottle);
}

/// What src/main.cpp flies.
[[nodiscard]] inline FlightSoftwareConfig flightConfig() {
  FlightSoftwareConfig config = flightConfig(kFlown.vehicle, kFlown.gains, kFirstFlight,
                                             Parameters{}.declination * kDegToRad);
  useRealSensors(config.sensors, kCalibration);
  return config;
}

}  // namespace strix
