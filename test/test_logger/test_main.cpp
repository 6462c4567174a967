#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runRingBufferTests();
  runSectorStreamTests();
  runULogTests();
  runCardTests();
  runStallTests();
  runPowerCutTests();
  runRingTableTests();
  UNITY_END();
  return 0;
}
