/// The parts of this suite; test_board.cpp runs them.
#pragma once

void runI2cBusTests();
void runI2cFaultTests();
void runImuTests();
void runMagTests();
void runBaroTests();
void runSensorFaultTests();
void runGpsTests();
void runEscPwmTests();
void runWatchdogTests();
void runResetTests();
void runRadioReceiverTests();
void runPortTests();
void runStorageTests();
