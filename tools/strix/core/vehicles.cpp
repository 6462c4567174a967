/// Python's view of the numbers that stand in include/: airframes, missions, states.
#include "bind.h"

#include <Conditions.h>
#include <Controller.h>
#include <States.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "missions/FirstFlight.h"
#include "vehicles/Vehicles.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

nb::dict toDict(const strix::BrysonWeights& b) {
  nb::dict d;
  d["position_horizontal"] = b.positionHorizontal;
  d["position_vertical"] = b.positionVertical;
  d["velocity_horizontal"] = b.velocityHorizontal;
  d["velocity_vertical"] = b.velocityVertical;
  d["tilt"] = b.tilt;
  d["yaw"] = b.yaw;
  d["rate"] = b.rate;
  d["yaw_rate"] = b.yawRate;
  d["thrust"] = b.thrust;
  d["torque"] = b.torque;
  d["yaw_torque"] = b.yawTorque;
  d["integral_horizontal"] = b.integralHorizontal;
  d["integral_vertical"] = b.integralVertical;
  d["integral_yaw"] = b.integralYaw;
  return d;
}

nb::dict toDict(const strix::Vehicle& v) {
  nb::dict d;
  d["name"] = v.name;
  d["mass"] = v.mass;
  d["inertia"] = nb::make_tuple(v.inertia[0], v.inertia[1], v.inertia[2]);
  nb::list rotors;
  for (const strix::Rotor& rotor : v.rotors) {
    nb::dict r;
    r["x"] = rotor.x;
    r["y"] = rotor.y;
    r["spin"] = static_cast<int>(rotor.spin);
    rotors.append(r);
  }
  d["rotors"] = rotors;
  d["speed_unit"] = v.speedUnit;
  d["thrust_constant"] = v.thrustConstant;
  d["torque_constant"] = v.torqueConstant;
  d["motor_time_constant"] = v.motorTimeConstant;
  nb::dict command;
  command["offset"] = v.command.offset;
  command["linear"] = v.command.linear;
  command["quadratic"] = v.command.quadratic;
  d["command"] = command;
  d["command_unit"] = v.commandUnit;
  d["command_off"] = v.commandOff;
  d["command_max"] = v.commandMax;
  d["command_flight_max"] = v.commandFlightMax;
  d["speed_flight_min"] = v.speedFlightMin;
  d["curve_voltage"] = v.curveVoltage;
  d["battery_cells"] = static_cast<int>(v.batteryCells);
  d["bryson"] = toDict(v.bryson);
  d["bryson_no_lag"] = toDict(v.brysonNoLag);
  return d;
}

using Dict = nb::typed<nb::dict, nb::str, nb::any>;

Dict vehicle(const std::string& name) {
  const strix::Airframe* airframe = strix::findAirframe(name);
  if (airframe == nullptr) throw nb::key_error(name.c_str());
  return Dict(toDict(airframe->vehicle));
}

std::vector<std::string> vehicleNames() {
  std::vector<std::string> names;
  names.reserve(strix::kAirframes.size());
  for (const strix::Airframe& airframe : strix::kAirframes) {
    names.emplace_back(airframe.vehicle.name);
  }
  return names;
}

nb::dict mission(const strix::Mission& m) {
  nb::dict d;
  d["name"] = m.name;
  d["takeoff_height_m"] = m.takeoffHeight;
  d["takeoff_hold_s"] = static_cast<double>(m.takeoffHoldTime) * 1e-6;
  nb::list legs;
  for (std::size_t i = 0; i < m.legCount; ++i) {
    const strix::Leg& leg = m.legs[i];
    legs.append(nb::make_tuple(leg.north, leg.east, leg.height, leg.turn,
                               static_cast<double>(leg.holdTime) * 1e-6));
  }
  d["legs"] = legs;
  return d;
}

std::vector<Dict> missions() { return {Dict(mission(strix::kFirstFlight))}; }

std::vector<std::string> stateNames() {
  std::vector<std::string> names;
  names.reserve(strix::kStates.size());
  for (const strix::StateProperties& state : strix::kStates) names.emplace_back(state.name);
  return names;
}

}  // namespace

void bindVehicles(nb::module_& m) {
  m.def("vehicle", &vehicle, "name"_a,
        "Numbers of an airframe; KeyError when there is none of that name");
  m.def("vehicle_names", &vehicleNames);
  m.def("missions", &missions,
        "Missions that are part of the flight code; legs are (north m, east m, height m, turn rad, "
        "hold s)");
  m.def("state_names", &stateNames, "Names of the flight states, by their number in the log");
  m.attr("CONTROL_RATE_HZ") = strix::Controller::kRateHz;
}
