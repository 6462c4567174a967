/// ESCs that answer, from the registers to the wires, and the battery's pin.
#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runAfroTests();
  runEscBusTests();
  runBatteryPinTests();
  UNITY_END();
  return 0;
}
