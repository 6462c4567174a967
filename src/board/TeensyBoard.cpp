#include "TeensyBoard.h"

namespace strix {

SensorSet TeensyBoard::begin() {
  esc_.begin();
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

PilotSwitches TeensyBoard::readPilot() {
  const Micros now = ::micros();
  PilotSwitches switches;
  switches.arm = arm_.read(now);
  switches.kill = kill_.read(now);
  switches.start = start_.read(now);
  return switches;
}

}  // namespace strix
