#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runControllerTests();
  runReferenceRampTests();
  runGainVectorTests();
  runReducedObserverTests();
  runStickMappingTests();
  runTrajectoryTests();
  runControlLimitsTests();
  runIntegralActionTests();
  runReferenceFilterTests();
  UNITY_END();
  return 0;
}
