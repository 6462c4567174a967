/// The parts of this suite; test_flight_software.cpp runs them.
#pragma once

void runArmingTests();
void runMotorsOffTests();
void runHazardTests();
void runPilotTests();
void runCommandTests();
void runLoopTests();
void runBadInputTests();
void runMissionTests();
void runNavigationUseTests();
void runCardStallTests();
void runPowerTests();
void runStandTests();
void runHeapTests();
