#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runGuidanceTests();
  runStandTests();
  runStickTests();
  runSetpointTests();
  runMissionTextTests();
  UNITY_END();
  return 0;
}
