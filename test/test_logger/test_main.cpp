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
  UNITY_END();
  return 0;
}
