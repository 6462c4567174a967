/// Everything that is chosen for one aircraft, in one value. include/FlightConfig.h makes it.
#pragma once

#include "Controller.h"
#include "Detectors.h"
#include "Guidance.h"
#include "GyroFilter.h"
#include "Motors.h"
#include "NavigationConfig.h"
#include "Parameters.h"
#include "Sensors.h"
#include "StartCalibration.h"
#include "Vehicle.h"

namespace strix {

struct FlightSoftwareConfig {
  const Vehicle& vehicle;
  const Gains& gains;
  Mission mission;
  Parameters parameters{};  ///< where the board has none stored
  SensorConfig sensors{};
  StartCalibrationConfig startCalibration{};
  NavigationConfig navigation{};
  float gpsSmoothing = 0.7F;      ///< s, in which GPS's corrections reach guidance and control
  GyroFilterConfig gyroFilter{};  ///< of the rates that the controller gets
  GuidanceConfig guidance{};
  MotorConfig motors{};
  ControlConfig control{};
  TouchDownConfig touchDown{};
  HoverConfig hover{};
  std::uint8_t design = 0;           ///< which of the airframe's designs `gains` is, for the log
  std::uint32_t originFixes = 50;    ///< GPS fixes averaged before arming is allowed
  Micros armedTimeout = 30'000'000;  ///< armed without take-off
};

}  // namespace strix
