/// The parts of this suite; test_parameters.cpp runs them.
#pragma once

void runTableTests();
void runStoreTests();
