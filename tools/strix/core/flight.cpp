/// Python's view of a flight: the whole flight software on a board that Python feeds.
#include "bind.h"

#include <FlightConfig.h>
#include <FlightSoftware.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "SimulatedBoard.h"
#include "vehicles/Vehicles.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Array3 = std::array<float, 3>;
using Array4 = std::array<float, 4>;

strix::Vector3f toVector(const Array3& v) { return {v[0], v[1], v[2]}; }

/// north m, east m, height m, turn rad, hold s
using LegRow = std::array<float, 5>;

strix::Micros toMicros(float seconds) { return static_cast<strix::Micros>(seconds * 1e6F); }

strix::Mission makeMission(const std::string& name, float takeoffHeight, float takeoffHold,
                           const std::vector<LegRow>& legs) {
  if (legs.size() > strix::Mission::kMaxLegs) {
    throw std::invalid_argument("a mission has at most " +
                                std::to_string(strix::Mission::kMaxLegs) + " legs");
  }
  strix::Mission mission{name.c_str(),
                         takeoffHeight,
                         toMicros(takeoffHold),
                         static_cast<std::uint8_t>(legs.size()),
                         {}};
  for (std::size_t i = 0; i < legs.size(); ++i) {
    mission.legs[i] = {legs[i][0], legs[i][1], legs[i][2], legs[i][3], toMicros(legs[i][4])};
  }
  return mission;
}

const strix::Airframe& airframe(const std::string& name) {
  const strix::Airframe* found = strix::findAirframe(name);
  if (found == nullptr) throw std::invalid_argument("unknown vehicle '" + name + "'");
  return *found;
}

/// One power-up of the aircraft, from setup() to power-off.
class Flight {
 public:
  Flight(const std::string& vehicle, const std::string& missionName, float takeoffHeight,
         float takeoffHold, const std::vector<LegRow>& legs, float declination,
         const std::string& logPath, std::uint32_t bootId, strix::Micros startTime)
      : missionName_(missionName),
        board_(logPath, bootId),
        software_(board_,
                  strix::flightConfig(airframe(vehicle).vehicle, airframe(vehicle).gains,
                                      makeMission(missionName_, takeoffHeight, takeoffHold, legs),
                                      declination)) {
    if (!board_.card().open()) {
      throw std::invalid_argument(logPath + ": cannot be written: " + std::strerror(errno));
    }
    board_.setTime(startTime);
    software_.setup();
  }

  void setSwitches(bool arm, bool start, bool kill) { board_.setPilot({arm, kill, start}); }

  void putImu(strix::Micros sampled, const Array3& accel, const Array3& gyro, float temperature) {
    board_.put(strix::ImuRaw{sampled, toVector(accel), toVector(gyro), temperature});
  }
  void putMag(strix::Micros sampled, const Array3& field) {
    board_.put(strix::MagRaw{sampled, toVector(field)});
  }
  void putAlt(strix::Micros sampled, float pressure, float temperature) {
    board_.put(strix::AltRaw{sampled, pressure, temperature});
  }
  void putBattery(strix::Micros sampled, float voltage, float current) {
    board_.put(strix::BatteryRaw{sampled, voltage, current});
  }
  void putEscStatus(strix::Micros sampled, const Array4& revolutions, const Array4& voltage,
                    const Array4& temperature, const Array4& current) {
    board_.put(strix::EscRaw{sampled, revolutions, voltage, temperature, current});
  }
  void putGps(strix::Micros sampled, std::int32_t latitude, std::int32_t longitude,
              std::int32_t altitude, float speedKnots, float courseDeg, float hdop,
              std::uint8_t fix, std::uint8_t satellites) {
    board_.put(strix::GpsRaw{sampled, latitude, longitude, altitude, speedKnots, courseDeg, hdop,
                             fix, satellites});
  }

  /// One pass of the loop at `now`.
  /// @return the commands the ESCs have after it
  Array4 loop(strix::Micros now) {
    board_.setTime(now);
    software_.loop();
    return board_.esc();
  }

  /// Empties the log's rings onto the disk.
  bool close() {
    strix::Micros clock = board_.micros();
    return software_.logger().forceWriteAndFlush([&clock] { return clock++; }, 10'000'000);
  }

  [[nodiscard]] std::string stateName() const { return software_.stateMachine().name(); }
  [[nodiscard]] bool motorsOn() const { return software_.motors().armed(); }
  [[nodiscard]] Array4 attitude() const { return strix::toArray(state().attitude); }
  [[nodiscard]] Array3 position() const { return strix::toArray(state().positionNed); }
  [[nodiscard]] Array3 velocity() const { return strix::toArray(state().velocityNed); }

 private:
  [[nodiscard]] const strix::VehicleState& state() const { return software_.estimator().state(); }

  std::string missionName_;  // the mission keeps a pointer to it
  strix::SimulatedBoard<> board_;
  strix::FlightSoftware<strix::SimulatedBoard<>> software_;
};

}  // namespace

void bindFlight(nb::module_& m) {
  nb::class_<Flight>(m, "Flight",
                     "The flight software on a simulated board. Times are Micros (uint32, us).")
      .def(
          nb::init<const std::string&, const std::string&, float, float, const std::vector<LegRow>&,
                   float, const std::string&, std::uint32_t, strix::Micros>(),
          "vehicle"_a, "mission"_a, "takeoff_height_m"_a, "takeoff_hold_s"_a, "legs"_a,
          "declination_rad"_a, "log_path"_a, "boot_id"_a, "start_time_us"_a)
      .def("set_switches", &Flight::setSwitches, "arm"_a, "start"_a, "kill"_a)
      .def("put_imu", &Flight::putImu, "sampled_us"_a, "accel_m_s2"_a, "gyro_rad_s"_a,
           "temperature_degc"_a)
      .def("put_mag", &Flight::putMag, "sampled_us"_a, "field_ut"_a)
      .def("put_alt", &Flight::putAlt, "sampled_us"_a, "pressure_pa"_a, "temperature_degc"_a)
      .def("put_gps", &Flight::putGps, "sampled_us"_a, "latitude_1e7_deg"_a, "longitude_1e7_deg"_a,
           "altitude_mm"_a, "speed_knots"_a, "course_deg"_a, "hdop"_a, "fix"_a, "satellites"_a)
      .def("put_battery", &Flight::putBattery, "sampled_us"_a, "voltage_v"_a, "current_a"_a)
      .def("put_esc_status", &Flight::putEscStatus, "sampled_us"_a, "revolutions_per_s"_a,
           "voltage_v"_a, "temperature_degc"_a, "current_a"_a, "Of M1..M4; NaN where not told")
      .def("loop", &Flight::loop, "now_us"_a, "One pass; returns the ESC commands M1..M4 after it")
      .def("close", &Flight::close,
           "Writes the rest of the log; true when all of it is on the disk")
      .def_prop_ro("state_name", &Flight::stateName)
      .def_prop_ro("motors_on", &Flight::motorsOn)
      .def_prop_ro("attitude", &Flight::attitude, "Estimate, [w x y z], body to NED")
      .def_prop_ro("position_ned_m", &Flight::position)
      .def_prop_ro("velocity_ned_m_s", &Flight::velocity);
}
