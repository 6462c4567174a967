#pragma once

void runControllerTests();
void runReferenceRampTests();
void runGainVectorTests();
