/// The parts of this suite; test_esc.cpp runs them.
#pragma once

void runAfroTests();
void runEscBusTests();
void runBatteryPinTests();
