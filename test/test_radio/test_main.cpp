#include <unity.h>

#include "suites.h"

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  runReceiverTests();
  runRadioLinkTests();
  runChannelMapTests();
  UNITY_END();
  return 0;
}
