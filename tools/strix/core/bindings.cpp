/// strix._core: the flight code, bound to Python.
#include "bind.h"

NB_MODULE(_core, m) {
  m.doc() = "The Strix flight code, compiled for this machine";
  bindEstimator(m);
  bindConsistency(m);  // of whose types it speaks
  bindFilters(m);
  bindFlight(m);
  bindMissions(m);
  bindMotors(m);
  bindParameters(m);
  bindReplay(m);
  bindStates(m);
  bindUgglanFlight(m);
  bindVehicles(m);
}
