#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runMachineTests();
  runTableTests();
  runInvariantTests();
  runPolicyTests();
  runPreArmTests();
  UNITY_END();
  return 0;
}
