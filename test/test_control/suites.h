#pragma once

void runControllerTests();
void runReferenceRampTests();
