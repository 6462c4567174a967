#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runArmingTests();
  runMotorsOffTests();
  runHazardTests();
  runPilotTests();
  runCommandTests();
  runLoopTests();
  runBadInputTests();
  runMissionTests();
  runNavigationUseTests();
  runCardStallTests();
  runPowerTests();
  runStandTests();
  runHeapTests();
  UNITY_END();
  return 0;
}
