#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runControllerTests();
  runReferenceRampTests();
  runGainVectorTests();
  UNITY_END();
  return 0;
}
