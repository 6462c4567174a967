/// The parts of this suite; test_main.cpp runs them.
#pragma once

void runRingBufferTests();
void runSectorStreamTests();
void runULogTests();
void runCardTests();
void runStallTests();
void runPowerCutTests();
void runRingTableTests();
