#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runGuidanceTests();
  runStandTests();
  runMissionTextTests();
  UNITY_END();
  return 0;
}
