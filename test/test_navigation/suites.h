/// The parts of this suite; test_main.cpp runs them.
#pragma once

/// A test of both filters.
#define RUN_BOTH(test) \
  RUN_TEST(test<9>);   \
  RUN_TEST(test<18>)

void runAlignmentTests();
void runCorrectionSmootherTests();
void runPropagationTests();
void runUpdateTests();
void runHeadingTests();
void runReadmissionTests();
void runTrapTests();
void runConvergenceTests();
void runEnduranceTests();
void runVectorTests();
void runStandstillTests();
void runFieldTrackerTests();
void runVibrationTests();
void runComplementaryTests();
void runMotionHistoryTests();
void runHealthTests();
void runDelayTests();
void runPolicyTests();
void runRecoveryTests();
void runBlindTests();
