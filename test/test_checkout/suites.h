/// The parts of this suite; test_checkout.cpp runs them.
#pragma once

void runTextTests();
void runSensorTests();
void runMotorTests();
void runEscCalibrationTests();
void runAxisTests();
void runManualTests();
void runHeapTests();
