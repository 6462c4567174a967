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
  runBatteryTests();
  runBiquadTests();
  runNmeaTests();
  runNmeaFixTests();
  runIcm20649Tests();
  runIcm20649FaultTests();
  UNITY_END();
  return 0;
}
