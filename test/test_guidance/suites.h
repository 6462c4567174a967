#pragma once

void runGuidanceTests();
void runStandTests();
void runStickTests();
void runSetpointTests();
void runMissionTextTests();
