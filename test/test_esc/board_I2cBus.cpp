// The adapter itself, as it goes onto the Teensy.
#include "../../src/board/I2cBus.cpp"
