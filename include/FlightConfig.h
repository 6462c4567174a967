/// The aircraft that this repository flies, and everything chosen for it.
#pragma once

#include "FlightSoftwareConfig.h"
#include "missions/FirstFlight.h"
#include "vehicles/Vehicles.h"

namespace strix {

/// The airframe src/main.cpp flies.
constexpr Airframe kFlown{kQuad5in, kQuad5inGains};

/// Magnetic declination where you fly, east positive: look it up for your field.
constexpr float kDeclination = 4.0F * kDegToRad;

/// Age of an MTK3333's fix when its sentence has arrived; ArduPilot assumes the same of a receiver
/// it does not know.
constexpr Micros kGpsDelay = 100'000;

/// How the LIS2MDL sits in the body: its x and z axes as the body's, its y axis to the left. As its
/// axes are left-handed this is a reflection, whatever the mounting; another mounting moves the
/// sign.
[[nodiscard]] inline Matrix3f magSensorToBody() { return Vector3f{1.0F, -1.0F, 1.0F}.asDiagonal(); }

/// Configuration of one airframe with the defaults of every library.
[[nodiscard]] inline FlightSoftwareConfig flightConfig(const Vehicle& vehicle, const Gains& gains,
                                                       const Mission& mission, float declination) {
  FlightSoftwareConfig config{vehicle, gains, mission};
  config.declination = declination;
  config.sensors.mag.sensorToBody = magSensorToBody();
  config.navigation.gpsDelay = kGpsDelay;
  config.navigation.gpsPositionSigma = 3.0F;  // m and m/s, an MTK3333 under open sky
  config.navigation.gpsVelocitySigma = 0.3F;
  config.navigation.accelNoise = 0.05F;
  return config;
}

/// What src/main.cpp flies.
[[nodiscard]] inline FlightSoftwareConfig flightConfig() {
  return flightConfig(kFlown.vehicle, kFlown.gains, kFirstFlight, kDeclination);
}

}  // namespace strix
