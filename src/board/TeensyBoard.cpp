#include "TeensyBoard.h"

#include "Faults.h"

namespace strix {

SensorSet TeensyBoard::begin() {
  catchFaults();
  esc_.begin();
  reset_ = takeResetStatus();
  battery_.begin();
  arm_.begin();
  kill_.begin();
  start_.begin();
  imuBus_.begin();
  slowBus_.begin();

  SensorSet found;
  found.imu = imu_.begin();
  found.mag = mag_.begin();
  found.alt = baro_.begin();
  found.gps = gps_.begin();
  found.card = card_.begin();

  // The devices' answers take another number of processor cycles each time.
  bootId_ = (card_.logNumber() << 18U) ^ ARM_DWT_CYCCNT;
  return found;
}

void TeensyBoard::countFaults(SensorFaultCounts& out) const {
  const auto held = [](const I2cBus& bus) {
    return bus.faults().held + bus.faults().late + bus.faults().lost;
  };
  out[SensorFault::ImuSilent] = imu_.faults().silent;
  out[SensorFault::ImuLate] = imu_.polled();
  out[SensorFault::ImuStuck] = imu_.faults().stuck;
  out[SensorFault::MagSilent] = mag_.misses();
  out[SensorFault::MagImplausible] = mag_.implausible();
  out[SensorFault::MagStuck] = mag_.stuck();
  out[SensorFault::AltSilent] = baro_.misses();
  out[SensorFault::AltImplausible] = baro_.implausible();
  out[SensorFault::AltStuck] = baro_.stuck();
  out[SensorFault::GpsRejected] = gps_.rejected();
  out[SensorFault::GpsLost] = gps_.overflows();
  out[SensorFault::ImuBusHeld] = held(imuBus_);
  out[SensorFault::ImuBusFreed] = imuBus_.faults().freed;
  out[SensorFault::SlowBusHeld] = held(slowBus_);
  out[SensorFault::SlowBusFreed] = slowBus_.faults().freed;
}

void TeensyBoard::rememberMotors(bool on) {
  armed_ = on;
  RetainedMotors::remember(on);
  watchdog_.run(motorsOn());
  if (on) card_.endReading();
}

PilotSwitches TeensyBoard::readPilot() {
  const Micros now = ::micros();
  PilotSwitches switches;
  switches.arm = arm_.read(now);
  switches.kill = kill_.read(now);
  switches.start = start_.read(now);
  return switches;
}

}  // namespace strix
