/// The snapshot that telemetry and console show (FlightStatus.h), from the flight software's parts.
#pragma once

#include "Conditions.h"
#include "FlightStatus.h"
#include "Sensors.h"
#include "States.h"

namespace strix {

/// @tparam Software  FlightSoftware
template <class Software>
[[nodiscard]] FlightStatus statusOf(const Software& software, Micros now) {
  const auto& fsm = software.stateMachine();
  const auto& sensors = software.sensors();
  const auto& motors = software.motors();
  const auto& navigation = software.navigation();
  const ConditionSet conditions = software.conditions();
  FlightStatus s;
  s.time = software.time();
  s.state = static_cast<std::uint8_t>(fsm.state());
  s.stateName = fsm.name();
  s.preArm = software.preArm();
  s.refusal = s.preArm == 0 ? "" : firstRefusal(s.preArm);
  s.motorsOn = motors.armed();
  s.flying = (in(fsm.state()) & kFlying) != 0 && (conditions & condition::kOnGround) == 0;
  s.critical = fsm.getCriticalErrorFlag();
  s.failsafe = fsm.getFailsafeFlag();
  s.conditions = conditions;

  s.estimate = navigation.state();
  s.positionValid = (conditions & condition::kGpsLost) == 0;
  s.estimatorHealthy = navigation.healthy();
  const GeoPoint& origin = sensors.origin();
  s.originLatitude = origin.latitude;
  s.originLongitude = origin.longitude;
  s.originAltitude = origin.altitude;

  const GpsRaw& gps = sensors.getGPSMeas();
  s.latitude = gps.latitude;
  s.longitude = gps.longitude;
  s.altitude = gps.altitude;
  s.speed = gps.speedKnots * kKnot;
  s.course = gps.courseDeg * kDegToRad;
  s.hdop = gps.hdop;
  s.fix = gps.fix;
  s.satellites = gps.satellites;
  s.gpsFresh = sensors.gpsFresh(now);

  const ImuRaw& imu = sensors.getIMUMeas();
  s.accel = {imu.accel.x(), imu.accel.y(), imu.accel.z()};
  s.gyro = {imu.gyro.x(), imu.gyro.y(), imu.gyro.z()};
  s.temperature = imu.temperature;
  s.imuFresh = sensors.imuFresh(now);
  const Vector3f& field = sensors.getMagMeas().field;
  s.field = {field.x(), field.y(), field.z()};
  s.magFresh = sensors.magFresh(now);
  s.pressure = sensors.getAltMeas().pressure;
  s.altFresh = sensors.altFresh(now);

  s.commands = motors.commands();
  for (std::size_t i = 0; i < s.motors.size(); ++i) s.motors[i] = motors.shareOf(i);
  s.voltage = software.battery().voltage();
  s.current = software.battery().current();
  s.cells = software.battery().cells();
  s.radioHeard = !software.pilot().radioLost();
  s.overruns = software.overruns();
  s.longestPass = software.longestPass();
  const auto& log = software.logger();
  s.logGood = !log.failed();
  s.logDropped = log.dropped();
  s.legs = software.mission().legCount;
  s.leg = software.guidance().leg();
  return s;
}

}  // namespace strix
