#include <unity.h>

#include "ESKF.h"
#include "suites.h"

template class strix::ESKF<9>;  // Dense.h declares them to the other files
template class strix::ESKF<18>;

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runAlignmentTests();
  runCorrectionSmootherTests();
  runPropagationTests();
  runUpdateTests();
  runHeadingTests();
  runReadmissionTests();
  runTrapTests();
  runConvergenceTests();
  runEnduranceTests();
  runVectorTests();
  runStandstillTests();
  runFieldTrackerTests();
  runVibrationTests();
  runComplementaryTests();
  runMotionHistoryTests();
  runHealthTests();
  runDelayTests();
  runPolicyTests();
  runRecoveryTests();
  runBlindTests();
  UNITY_END();
  return 0;
}
