// The adapter itself, as it goes onto the Teensy.
#include "../../src/board/ImuIcm20649.cpp"
