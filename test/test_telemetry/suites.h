/// The parts of this suite; test_telemetry.cpp runs them.
#pragma once

void runStreamTests();
void runCommandTests();
void runParameterTests();
void runMissionTests();
void runSigningTests();
void runBadBytesTests();
void runHeapTests();
