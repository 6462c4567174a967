#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runTableTests();
  runStoreTests();
  UNITY_END();
  return 0;
}
