#pragma once

void runControllerTests();
void runReferenceRampTests();
void runGainVectorTests();
void runReducedObserverTests();
void runStickMappingTests();
void runTrajectoryTests();
void runControlLimitsTests();
void runIntegralActionTests();
void runReferenceFilterTests();
