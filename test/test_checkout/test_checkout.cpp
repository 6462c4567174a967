#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runTextTests();
  runSensorTests();
  runMotorTests();
  runAxisTests();
  runManualTests();
  runHeapTests();
  UNITY_END();
  return 0;
}
