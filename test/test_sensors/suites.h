/// The parts of this suite; test_sensors.cpp runs them.
#pragma once

void runRateTests();
void runProcessingTests();
void runGeodesyTests();
void runStartCalibrationTests();
