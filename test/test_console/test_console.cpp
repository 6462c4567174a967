#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runLineTests();
  runCommandTests();
  runLogTests();
  runHeapTests();
  UNITY_END();
  return 0;
}
