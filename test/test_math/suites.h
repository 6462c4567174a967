/// The parts of this suite; test_math.cpp runs them.
#pragma once

void runDeterministicTests();
void runQuaternionTests();
void runRotationTests();
void runSymmetricMatrixTests();
void runTimeTests();
