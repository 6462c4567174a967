/// Flight types to log records. What is logged is chosen in FlightSoftware.h; how it looks in the
/// file is Logger/Topics.def.
#pragma once

#include "Board.h"
#include "Controller.h"
#include "DataTypes.h"
#include "FlightSoftwareConfig.h"
#include "Mission.h"
#include "Motors.h"
#include "Navigation.h"
#include "PilotInput.h"
#include "RadioChannels.h"
#include "Sensors.h"
#include "VehicleCommand.h"

namespace strix {

[[nodiscard]] inline topic::SensorCombined toRecord(LogTime time, LogTime sampled,
                                                    const ImuRaw& raw) {
  return {time, sampled, toArray(raw.accel), toArray(raw.gyro), raw.temperature};
}

[[nodiscard]] inline topic::SensorMag toRecord(LogTime time, LogTime sampled, const MagRaw& raw) {
  return {time, sampled, toArray(raw.field)};
}

[[nodiscard]] inline topic::SensorBaro toRecord(LogTime time, LogTime sampled, const AltRaw& raw) {
  return {time, sampled, raw.pressure, raw.temperature};
}

[[nodiscard]] inline topic::VehicleGpsPosition toRecord(LogTime time, LogTime sampled,
                                                        const GpsRaw& raw) {
  return {time,           sampled,       raw.latitude, raw.longitude, raw.altitude,
          raw.speedKnots, raw.courseDeg, raw.hdop,     raw.fix,       raw.satellites};
}

[[nodiscard]] inline topic::BatteryStatus toRecord(LogTime time, LogTime sampled,
                                                   const BatteryRaw& raw) {
  return {time, sampled, raw.voltage, raw.current};
}

[[nodiscard]] inline topic::EscStatus toRecord(LogTime time, LogTime sampled, const EscRaw& raw) {
  return {time, sampled, raw.revolutions, raw.voltage, raw.temperature, raw.current};
}

[[nodiscard]] inline topic::ManualControlSwitches toRecord(LogTime time,
                                                           const PilotSwitches& pilot) {
  return {time, switchPosition(pilot.arm), switchPosition(pilot.kill), switchPosition(pilot.start)};
}

[[nodiscard]] inline topic::InputRc toRecord(LogTime time, const RadioChannels& channels) {
  return {time, channels.pulse, channels.count, static_cast<std::uint8_t>(channels.failsafe),
          static_cast<std::uint8_t>(channels.frameLost)};
}

[[nodiscard]] inline topic::VehicleCommand toRecord(LogTime time, const VehicleCommand& command,
                                                    bool accepted) {
  return {time,
          command.values,
          command.time,
          command.index,
          static_cast<std::uint8_t>(command.kind),
          static_cast<std::uint8_t>(command.source),
          command.detail,
          static_cast<std::uint8_t>(accepted)};
}

[[nodiscard]] inline topic::ManualControlSetpoint toRecord(LogTime time, const PilotInput& input,
                                                           PilotMode effective) {
  return {time,
          input.roll,
          input.pitch,
          input.yaw,
          input.throttle,
          static_cast<std::uint8_t>(input.mode),
          static_cast<std::uint8_t>(effective),
          switchPosition(input.arm),
          switchPosition(input.kill),
          switchPosition(input.start),
          static_cast<std::uint8_t>(input.valid)};
}

[[nodiscard]] inline topic::FlightConfig toRecord(LogTime time, const FlightSoftwareConfig& config,
                                                  const SensorSet& found) {
  const std::array<bool, 5> devices{found.imu, found.mag, found.alt, found.gps, found.card};
  unsigned answered = 0;
  for (std::size_t i = 0; i < devices.size(); ++i) answered |= devices[i] ? 1U << i : 0U;
  const Mission& mission = config.mission;
  const bool reducedObserver = config.control.reducedObserver != nullptr;
  return {time,
          config.parameters.declination * kDegToRad,
          mission.takeoffHeight,
          mission.takeoffHoldTime,
          mission.standAngle,
          mission.legCount,
          static_cast<std::uint8_t>(mission.end),
          config.design,
          static_cast<std::uint8_t>(reducedObserver ? 1 : 0),
          static_cast<std::uint8_t>(answered),
          0,
          0,
          0};
}

[[nodiscard]] inline topic::MissionLeg toRecord(LogTime time, const Leg& leg) {
  return {time,
          leg.north,
          leg.east,
          leg.height,
          leg.turn,
          leg.radius,
          leg.speed,
          leg.roll,
          leg.pitch,
          leg.holdTime,
          static_cast<std::uint8_t>(leg.kind)};
}

[[nodiscard]] inline topic::EstimatorAidSource toRecord(LogTime time,
                                                        const Innovation& innovation) {
  return {time,           innovation.value, innovation.variance,
          innovation.nis, innovation.count, innovation.rejected};
}

template <int States>
[[nodiscard]] topic::EstimatorStd toStdRecord(LogTime time, const ESKF<States>& filter) {
  topic::EstimatorStd record{time, {}};
  for (int i = 0; i < States; ++i) {
    record.std_dev[static_cast<std::size_t>(i)] = squareRoot(filter.packedCovariance()(i, i));
  }
  return record;
}

template <int States>
[[nodiscard]] topic::EstimatorSensorBias toBiasRecord(LogTime time, const ESKF<States>& filter) {
  return {time, toArray(filter.gyroBias()), toArray(filter.accelBias()), toArray(filter.magBias())};
}

template <int States>
[[nodiscard]] topic::EstimatorHealth toRecord(LogTime time, const Navigation<States>& navigation) {
  return {time, navigation.health(), navigation.restarts(), navigation.readmissions(),
          navigation.vibration()};
}

[[nodiscard]] inline topic::ControllerStatus toRecord(LogTime time, const Controller& controller,
                                                      const Motors& motors) {
  const IntegralAction& integral = controller.integral();
  const Vector2f& horizontal = integral.horizontalNed();
  return {time,
          {horizontal.x(), horizontal.y(), integral.down(), integral.yaw()},
          controller.wrenchEstimate().now(),
          motors.supply()};
}

[[nodiscard]] inline GncRecords toRecords(LogTime time, const VehicleState& estimate,
                                          const Reference& reference, const Controller& controller,
                                          const Motors& motors, const topic::ControlTick& tick) {
  const Vector3f& p = estimate.positionNed;
  const Vector3f& v = estimate.velocityNed;
  const Wrench& wanted = controller.getControl();
  const Wrench& achieved = motors.achieved();
  return {{time, toArray(estimate.attitude)},
          {time, toArray(estimate.rateBody)},
          {time, p.x(), p.y(), p.z(), v.x(), v.y(), v.z(), yawOf(estimate.attitude)},
          {time, toArray(reference.positionNed), toArray(reference.velocityNed),
           toArray(reference.accelerationNed), reference.yaw, reference.yawRate},
          {time, toArray(controller.attitudeReference())},
          {time, wanted.thrust, toArray(wanted.torque)},
          {time, achieved.thrust, toArray(achieved.torque)},
          {time, kMotorCount, motors.commands()},
          tick};
}

}  // namespace strix
