// The adapter itself, as it goes onto the Teensy.
#include "../../src/board/BaroBmp390.cpp"
