#pragma once

void runGuidanceTests();
void runStandTests();
void runMissionTextTests();
