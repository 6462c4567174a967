#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runTextTests();
  runSensorTests();
  runMotorTests();
  runEscCalibrationTests();
  runAxisTests();
  runManualTests();
  runHeapTests();
  UNITY_END();
  return 0;
}
