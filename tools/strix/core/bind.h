/// The parts of the module strix._core, one a file.
#pragma once

#include <nanobind/nanobind.h>

void bindConsistency(nanobind::module_& m);
void bindEstimator(nanobind::module_& m);
void bindFilters(nanobind::module_& m);
void bindFlight(nanobind::module_& m);
void bindMissions(nanobind::module_& m);
void bindMotors(nanobind::module_& m);
void bindParameters(nanobind::module_& m);
void bindReplay(nanobind::module_& m);
void bindStates(nanobind::module_& m);
void bindUgglanFlight(nanobind::module_& m);
void bindVehicles(nanobind::module_& m);
