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
  runTrajectoryTests();
  runControlLimitsTests();
  runIntegralActionTests();
  runReferenceFilterTests();
  UNITY_END();
  return 0;
}
