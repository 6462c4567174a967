/// The parts of this suite; test_finite_state_machine.cpp runs them.
#pragma once

void runMachineTests();
void runTableTests();
void runInvariantTests();
void runPolicyTests();
void runPreArmTests();
