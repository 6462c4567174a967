#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runStreamTests();
  runCommandTests();
  runParameterTests();
  runMissionTests();
  runSigningTests();
  runBadBytesTests();
  runHeapTests();
  return UNITY_END();
}
