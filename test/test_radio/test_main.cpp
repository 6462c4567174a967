#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runReceiverTests();
  runRadioLinkTests();
  UNITY_END();
  return 0;
}
