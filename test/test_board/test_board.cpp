/// The adapters of src/board, unchanged, on a Teensy that is modelled in test/arduino.
#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runI2cBusTests();
  runI2cFaultTests();
  runImuTests();
  runMagTests();
  runBaroTests();
  runSensorFaultTests();
  runGpsTests();
  runEscPwmTests();
  runWatchdogTests();
  runResetTests();
  runRadioReceiverTests();
  runPortTests();
  runStorageTests();
  UNITY_END();
  return 0;
}
