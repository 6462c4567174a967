/// Python's view of a flight with Ugglan's own pipeline: a pilot's sticks on a simulated board.
#include "bind.h"

#include <FlightConfig.h>
#include <Transmitter.h>
#include <UgglanFlight.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "SimulatedBoard.h"
#include "gains/UgglanQ450Observer.h"
#include "vehicles/UgglanQ450.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Array3 = std::array<float, 3>;
using Array4 = std::array<float, 4>;

strix::Vector3f toVector(const Array3& v) { return {v[0], v[1], v[2]}; }

strix::UgglanFlightConfig makeConfig(float declination) {
  strix::UgglanFlightConfig config{strix::kUgglanQ450, strix::kUgglanQ450ObserverGains};
  config.declination = declination;
  config.sensors.mag.sensorToBody = strix::magSensorToBody();
  return config;
}

/// One power-up of UgglanQ450, from setup() to power-off.
class UgglanFlight {
 public:
  UgglanFlight(float declination, const std::string& logPath, std::uint32_t bootId,
               strix::Micros startTime)
      : board_(logPath, bootId), software_(board_, makeConfig(declination)) {
    if (!board_.card().open()) {
      throw std::invalid_argument(logPath + ": cannot be written: " + std::strerror(errno));
    }
    board_.setTime(startTime);
    software_.setup();
  }

  void setSwitches(bool arm, bool kill) { board_.setPilot({arm, kill, false}); }
  void setSticks(float roll, float pitch, float yaw, float throttle, bool valid) {
    sticks_.roll = roll;
    sticks_.pitch = pitch;
    sticks_.yaw = yaw;
    sticks_.throttle = throttle;
    sticks_.valid = valid;
  }
  void putImu(strix::Micros sampled, const Array3& accel, const Array3& gyro, float temperature) {
    board_.put(strix::ImuRaw{sampled, toVector(accel), toVector(gyro), temperature});
  }
  void putMag(strix::Micros sampled, const Array3& field) {
    board_.put(strix::MagRaw{sampled, toVector(field)});
  }
  void putAlt(strix::Micros sampled, float pressure, float temperature) {
    board_.put(strix::AltRaw{sampled, pressure, temperature});
  }
  void putEscStatus(strix::Micros sampled, const Array4& revolutions, const Array4& voltage,
                    const Array4& temperature, const Array4& current) {
    board_.put(strix::EscRaw{sampled, revolutions, voltage, temperature, current});
  }

  /// One pass of the loop at `now`.
  /// @return the commands the ESCs have after it
  Array4 loop(strix::Micros now) {
    board_.setTime(now);
    if (radioFrame_.run(now)) board_.put(strix::frameOf(sticks_));
    software_.loop();
    return board_.esc();
  }

  /// Empties the log's rings onto the disk.
  bool close() {
    strix::Micros clock = board_.micros();
    return software_.logger().forceWriteAndFlush([&clock] { return clock++; }, 10'000'000);
  }

  [[nodiscard]] bool calibrated() const { return software_.calibrated(); }
  [[nodiscard]] bool motorsOn() const { return software_.motors().armed(); }
  [[nodiscard]] bool controlling() const { return software_.controlling(); }
  [[nodiscard]] float height() const { return software_.height(); }
  [[nodiscard]] float voltage() const { return software_.voltage(); }
  [[nodiscard]] Array4 attitude() const { return strix::toArray(software_.attitude()); }

 private:
  strix::PilotInput sticks_;
  strix::PeriodicTask radioFrame_{7000};  // us, as iBUS sends them
  strix::SimulatedBoard<> board_;
  strix::UgglanFlight<strix::SimulatedBoard<>> software_;
};

}  // namespace

void bindUgglanFlight(nb::module_& m) {
  nb::class_<UgglanFlight>(m, "UgglanFlight",
                           "Ugglan's own pipeline on a simulated board: a pilot flies by sticks.")
      .def(nb::init<float, const std::string&, std::uint32_t, strix::Micros>(), "declination_rad"_a,
           "log_path"_a, "boot_id"_a, "start_time_us"_a)
      .def("set_switches", &UgglanFlight::setSwitches, "arm"_a, "kill"_a)
      .def("set_sticks", &UgglanFlight::setSticks, "roll"_a, "pitch"_a, "yaw"_a, "throttle"_a,
           "valid"_a, "Roll, pitch, yaw -1 to 1, right and back positive; throttle 0 to 1")
      .def("put_imu", &UgglanFlight::putImu, "sampled_us"_a, "accel_m_s2"_a, "gyro_rad_s"_a,
           "temperature_degc"_a)
      .def("put_mag", &UgglanFlight::putMag, "sampled_us"_a, "field_ut"_a)
      .def("put_alt", &UgglanFlight::putAlt, "sampled_us"_a, "pressure_pa"_a, "temperature_degc"_a)
      .def("put_esc_status", &UgglanFlight::putEscStatus, "sampled_us"_a, "revolutions_per_s"_a,
           "voltage_v"_a, "temperature_degc"_a, "current_a"_a, "Of M1..M4; NaN where not told")
      .def("loop", &UgglanFlight::loop, "now_us"_a,
           "One pass; returns the ESC commands M1..M4 after it")
      .def("close", &UgglanFlight::close,
           "Writes the rest of the log; true when all of it is on the disk")
      .def_prop_ro("calibrated", &UgglanFlight::calibrated)
      .def_prop_ro("motors_on", &UgglanFlight::motorsOn)
      .def_prop_ro("controlling", &UgglanFlight::controlling,
                   "The law acts: since take-off, until the throttle was low for a while")
      .def_prop_ro("height_m", &UgglanFlight::height, "From the last pressure")
      .def_prop_ro("voltage_v", &UgglanFlight::voltage, "Of the battery; 0 while not known")
      .def_prop_ro("attitude", &UgglanFlight::attitude, "Estimate, [w x y z], body to NED");
}
