/// The parts of this suite; test_sensors.cpp runs them.
#pragma once

void runRateTests();
void runProcessingTests();
void runGeodesyTests();
void runStartCalibrationTests();
void runNmeaTests();
void runNmeaFixTests();
void runBatteryTests();
void runBiquadTests();
void runIcm20649Tests();
void runIcm20649FaultTests();
