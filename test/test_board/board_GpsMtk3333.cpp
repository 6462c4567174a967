// The adapter itself, as it goes onto the Teensy.
#include "../../src/board/GpsMtk3333.cpp"
