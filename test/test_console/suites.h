/// The parts of this suite; test_console.cpp runs them.
#pragma once

void runLineTests();
void runCommandTests();
void runLogTests();
void runHeapTests();
