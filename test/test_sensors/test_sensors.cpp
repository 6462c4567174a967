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
  runBiquadTests();
  runNmeaTests();
  runNmeaFixTests();
  runIcm20649Tests();
  runIcm20649FaultTests();
  UNITY_END();
  return 0;
}
