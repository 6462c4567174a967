/// Battery and ESCs, where they answer.
#pragma once

#include "BatteryMonitor.h"
#include "FlightLog.h"

namespace strix {

/// What came since the last call goes into the monitor and the log.
template <class Board, class Log>
void readPower(Board& board, const LogClock& clock, LogTime now, BatteryMonitor& monitor,
               Log& logger) {
  BatteryRaw battery;
  if (board.readBattery(battery)) {
    monitor.add(battery);
    logger.log(toRecord(now, clock.at(battery.sampled), battery));
  }
  EscRaw escs;
  if (board.readEscStatus(escs)) {
    monitor.add(escs);
    logger.log(toRecord(now, clock.at(escs.sampled), escs));
  }
}

}  // namespace strix
