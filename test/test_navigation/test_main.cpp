#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runAlignmentTests();
  runPropagationTests();
  runUpdateTests();
  runConvergenceTests();
  runEnduranceTests();
  UNITY_END();
  return 0;
}
