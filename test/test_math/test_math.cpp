#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runDeterministicTests();
  runQuaternionTests();
  runRotationTests();
  runSymmetricMatrixTests();
  runTimeTests();
  UNITY_END();
  return 0;
}
