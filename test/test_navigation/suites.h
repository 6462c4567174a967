/// The parts of this suite; test_main.cpp runs them.
#pragma once

void runAlignmentTests();
void runPropagationTests();
void runUpdateTests();
void runConvergenceTests();
void runEnduranceTests();
