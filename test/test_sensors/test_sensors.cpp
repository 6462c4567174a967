#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runRateTests();
  runProcessingTests();
  runGeodesyTests();
  runStartCalibrationTests();
  UNITY_END();
  return 0;
}
