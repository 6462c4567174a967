#pragma once

void runControllerTests();
void runReferenceRampTests();
void runGainVectorTests();
void runReducedObserverTests();
void runTrajectoryTests();
void runControlLimitsTests();
void runIntegralActionTests();
void runReferenceFilterTests();
