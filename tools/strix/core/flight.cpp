/// Python's view of a flight: the whole flight software on a board that Python feeds.
#include "bind.h"

#include <Console.h>
#include <FlightConfig.h>
#include <FlightSoftware.h>
#include <GroundLink.h>
#include <MissionText.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <vector>

#include "FolderLogs.h"
#include "MemoryPort.h"
#include "SimulatedBoard.h"
#include "vehicles/Vehicles.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Array3 = std::array<float, 3>;
using Array4 = std::array<float, 4>;

strix::Vector3f toVector(const Array3& v) { return {v[0], v[1], v[2]}; }

const strix::Airframe& airframe(const std::string& name) {
  const strix::Airframe* found = strix::findAirframe(name);
  if (found == nullptr) throw std::invalid_argument("unknown vehicle '" + name + "'");
  return *found;
}

/// @param name  lives as long as the mission
strix::Mission readMission(const std::string& name, const std::string& text) {
  const strix::ParsedMission parsed = strix::parseMission(name.c_str(), text);
  if (!parsed.valid()) {
    throw std::invalid_argument(name + ": " + strix::MissionErrorText(parsed.error).text());
  }
  return parsed.mission;
}

/// What a flight may have other than the aircraft's own configuration has.
struct FlightOptions {
  explicit FlightOptions(const std::string& vehicle)
      : FlightOptions(strix::flightConfig(airframe(vehicle).vehicle, airframe(vehicle).gains,
                                          strix::kFirstFlight, 0.0F)) {}
  explicit FlightOptions(const strix::FlightSoftwareConfig& config)
      : navigation(config.navigation),
        control(config.control),
        guidance(config.guidance),
        parameters(config.parameters),
        gpsSmoothing(config.gpsSmoothing) {}

  strix::NavigationConfig navigation;
  strix::ControlConfig control;
  strix::GuidanceConfig guidance;
  strix::Parameters parameters;
  float gpsSmoothing;
  std::size_t design = 0;        ///< of Airframe::designs
  bool reducedObserver = false;  ///< attitude by Ugglan's law
  bool motorsWereOn = false;     ///< it is no power-up, but a restart in flight

  void setParameter(const std::string& name, float value) {
    const std::size_t index = strix::findParameter(name);
    if (const char* wrong = strix::checkParameter(index, value, false)) {
      throw std::invalid_argument("--param " + name + ": " + wrong);
    }
    parameters.*strix::kParameterTable[index].member = value;
  }
};

strix::FlightSoftwareConfig configured(const std::string& vehicle, const strix::Mission& mission,
                                       float declination, const FlightOptions* options) {
  const strix::Airframe& frame = airframe(vehicle);
  if (options == nullptr) {
    return strix::flightConfig(frame.vehicle, frame.gains, mission, declination);
  }
  if (options->design >= frame.designs.size()) throw std::invalid_argument("no such design");
  strix::FlightSoftwareConfig config =
      strix::flightConfig(frame.vehicle, *frame.designs[options->design], mission, declination);
  config.design = static_cast<std::uint8_t>(options->design);
  config.navigation = options->navigation;
  config.control = options->control;
  config.guidance = options->guidance;
  config.gpsSmoothing = options->gpsSmoothing;
  const float degrees = config.parameters.declination;
  config.parameters = options->parameters;
  config.parameters.declination = degrees;  // the surroundings'
  if (options->reducedObserver) {
    if (frame.observer == nullptr) {
      throw std::invalid_argument(vehicle + " has no gains of the reduced observer");
    }
    config.control.reducedObserver = frame.observer;
  }
  return config;
}

/// One power-up of the aircraft, from setup() to power-off.
class Flight {
 public:
  Flight(const std::string& vehicle, const std::string& missionName, const std::string& missionText,
         float declination, const std::string& logPath, std::uint32_t bootId,
         strix::Micros startTime, const FlightOptions* options, bool console, bool telemetry,
         const nb::bytes& storage)
      : missionName_(missionName),
        board_(logPath, bootId),
        software_(board_, configured(vehicle, readMission(missionName_, missionText), declination,
                                     options)) {
    if (!board_.card().open()) {
      throw std::invalid_argument(logPath + ": cannot be written: " + std::strerror(errno));
    }
    board_.setTime(startTime);
    if (options != nullptr && options->motorsWereOn) {
      board_.setReset({strix::reset::kWatchdog, true});
    }
    if (storage.size() != 0) {
      if (storage.size() != board_.storage().size()) {
        throw std::invalid_argument("storage: not as long as the board's");
      }
      std::memcpy(board_.storage().data(), storage.c_str(), storage.size());
    }
    software_.setup();
    if (telemetry) link_.emplace(software_, linkPort_, strix::PortTrust::Radio);
    if (console) {
      logs_.emplace(std::filesystem::path(logPath).parent_path());
      console_.emplace(software_, consolePort_, *logs_);
    }
  }

  /// What the board keeps without power, for another Flight.
  [[nodiscard]] nb::bytes storage() {
    return nb::bytes(board_.storage().data(), board_.storage().size());
  }
  void putTelemetry(const nb::bytes& heard) { linkPort_.put(heard.c_str(), heard.size()); }
  [[nodiscard]] nb::bytes takeTelemetry() {
    const std::string sent = linkPort_.take();
    return nb::bytes(sent.data(), sent.size());
  }
  void putConsole(const nb::bytes& typed) { consolePort_.put(typed.c_str(), typed.size()); }
  [[nodiscard]] nb::bytes takeConsole() {
    const std::string said = consolePort_.take();
    return nb::bytes(said.data(), said.size());
  }
  [[nodiscard]] bool rebootAsked() const {
    return (console_ && console_->rebootAsked()) || (link_ && link_->rebootAsked());
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

  /// A frame of a receiver: pulses in us.
  void putRadio(const std::vector<std::uint16_t>& pulses, bool failsafe, bool frameLost) {
    strix::RadioChannels frame;
    frame.count = static_cast<std::uint8_t>(std::min(pulses.size(), frame.pulse.size()));
    std::copy_n(pulses.begin(), frame.count, frame.pulse.begin());
    frame.failsafe = failsafe;
    frame.frameLost = frameLost;
    board_.put(frame);
  }

  /// @return the refusal; empty: accepted
  std::string command(strix::CommandKind kind, const std::array<float, 8>& values,
                      std::uint16_t index, std::uint8_t detail, std::uint32_t time) {
    const char* refusal =
        software_.command({kind, strix::CommandSource::Link, detail, index, time, values});
    return refusal == nullptr ? "" : refusal;
  }

  void setCard(bool stalled, bool dead) {
    board_.card().setStalled(stalled);
    board_.card().setDead(dead);
  }

  /// One pass of the loop at `now`.
  /// @return the commands the ESCs have after it
  Array4 loop(strix::Micros now) {
    board_.setTime(now);
    software_.loop();
    if (link_ && !software_.ticked()) link_->step(now);
    if (console_ && !software_.ticked()) console_->step(now);
    return board_.esc();
  }

  /// What the flight software has said since this was asked last.
  std::vector<std::string> texts() {
    std::vector<std::string> said;
    while (const strix::TextHistory::Text* text = software_.texts().next(textsRead_)) {
      said.emplace_back(text->text());
    }
    return said;
  }

  /// Empties the log's rings onto the disk.
  bool close() {
    strix::Micros clock = board_.micros();
    return software_.logger().forceWriteAndFlush([&clock] { return clock++; }, 10'000'000);
  }

  [[nodiscard]] std::string stateName() const { return software_.stateMachine().name(); }
  [[nodiscard]] bool motorsOn() const { return software_.motors().armed(); }
  [[nodiscard]] std::string refusal() const { return software_.status().refusal; }
  [[nodiscard]] Array4 attitude() const { return strix::toArray(state().attitude); }
  [[nodiscard]] Array3 position() const { return strix::toArray(state().positionNed); }
  [[nodiscard]] Array3 velocity() const { return strix::toArray(state().velocityNed); }

 private:
  [[nodiscard]] const strix::VehicleState& state() const { return software_.estimator().state(); }

  std::uint32_t textsRead_ = 0;
  std::string missionName_;  // the mission keeps a pointer to it
  strix::SimulatedBoard<> board_;
  using Software = strix::FlightSoftware<strix::SimulatedBoard<>>;
  Software software_;
  strix::MemoryPort linkPort_;
  std::optional<strix::GroundLink<Software, strix::MemoryPort>> link_;
  strix::MemoryPort consolePort_;
  std::optional<strix::FolderLogs> logs_;
  std::optional<strix::Console<Software, strix::MemoryPort, strix::FolderLogs>> console_;
};

}  // namespace

void bindOptions(nb::module_& m) {
  using strix::ControlConfig;
  using strix::GuidanceConfig;
  using strix::ReferenceFilterConfig;
  using strix::TrajectoryLimits;

  nb::class_<ReferenceFilterConfig>(m, "ReferenceFilterConfig", "Time constants in s, 0: off")
      .def_rw("position", &ReferenceFilterConfig::position)
      .def_rw("yaw", &ReferenceFilterConfig::yaw)
      .def_rw("tilt", &ReferenceFilterConfig::tilt);
  nb::class_<ControlConfig>(m, "ControlConfig", "Limits of the controller and its filters")
      .def_rw("referenceFilter", &ControlConfig::referenceFilter)
      .def_rw("positionHorizontal", &ControlConfig::positionHorizontal)
      .def_rw("positionVertical", &ControlConfig::positionVertical)
      .def_rw("velocityHorizontal", &ControlConfig::velocityHorizontal)
      .def_rw("velocityVertical", &ControlConfig::velocityVertical)
      .def_rw("acceleration", &ControlConfig::acceleration)
      .def_rw("yaw", &ControlConfig::yaw)
      .def_rw("tilt", &ControlConfig::tilt)
      .def_rw("attitudeTilt", &ControlConfig::attitudeTilt)
      .def_rw("rollPitchRate", &ControlConfig::rollPitchRate)
      .def_rw("yawRate", &ControlConfig::yawRate)
      .def_rw("integralTilt", &ControlConfig::integralTilt)
      .def_rw("integralThrust", &ControlConfig::integralThrust)
      .def_rw("integralYaw", &ControlConfig::integralYaw);
  nb::class_<TrajectoryLimits>(m, "TrajectoryLimits", "Of the way from place to place")
      .def_rw("acceleration", &TrajectoryLimits::acceleration)
      .def_rw("jerk", &TrajectoryLimits::jerk)
      .def_rw("yawRate", &TrajectoryLimits::yawRate)
      .def_rw("yawAcceleration", &TrajectoryLimits::yawAcceleration)
      .def_rw("yawJerk", &TrajectoryLimits::yawJerk);
  nb::class_<GuidanceConfig>(m, "GuidanceConfig", "How the aircraft gets to its references")
      .def_rw("trajectory", &GuidanceConfig::trajectory)
      .def_rw("arrivalRadius", &GuidanceConfig::arrivalRadius)
      .def_rw("arrivalSpeed", &GuidanceConfig::arrivalSpeed)
      .def_rw("arrivalYaw", &GuidanceConfig::arrivalYaw)
      .def_rw("standThrust", &GuidanceConfig::standThrust);
  nb::class_<FlightOptions>(m, "FlightOptions",
                            "Another tuning of one flight; starts as the vehicle flies")
      .def(nb::init<const std::string&>(), "vehicle"_a)
      .def_rw("navigation", &FlightOptions::navigation)
      .def_rw("control", &FlightOptions::control)
      .def_rw("guidance", &FlightOptions::guidance)
      .def("set_parameter", &FlightOptions::setParameter, "name"_a, "value"_a)
      .def_rw("motors_were_on", &FlightOptions::motorsWereOn,
              "It is no power-up: the processor restarted in flight")
      .def_rw("gps_smoothing", &FlightOptions::gpsSmoothing, "s")
      .def_rw("design", &FlightOptions::design,
              "Of the gains: 0 integral and lag, 1 no integral, 2 no lag, 3 neither")
      .def_rw("reduced_observer", &FlightOptions::reducedObserver,
              "Attitude by Ugglan's law, where the vehicle has its gains");
}

void bindFlight(nb::module_& m) {
  using strix::CommandKind;
  nb::enum_<CommandKind>(m, "CommandKind", "What may be asked of a flight: VehicleCommand.h")
      .value("Arm", CommandKind::Arm)
      .value("Disarm", CommandKind::Disarm)
      .value("Kill", CommandKind::Kill)
      .value("KillOff", CommandKind::KillOff)
      .value("Start", CommandKind::Start)
      .value("Land", CommandKind::Land)
      .value("Return", CommandKind::Return)
      .value("Hold", CommandKind::Hold)
      .value("Resume", CommandKind::Resume)
      .value("Setpoint", CommandKind::Setpoint)
      .value("SetParameter", CommandKind::SetParameter)
      .value("MissionClear", CommandKind::MissionClear)
      .value("MissionLeg", CommandKind::MissionLeg)
      .value("MissionDone", CommandKind::MissionDone)
      .value("Calibrate", CommandKind::Calibrate)
      .value("MotorTest", CommandKind::MotorTest)
      .value("LinkAlive", CommandKind::LinkAlive);
  bindOptions(m);
  nb::class_<Flight>(m, "Flight",
                     "The flight software on a simulated board. Times are Micros (uint32, us).")
      .def(nb::init<const std::string&, const std::string&, const std::string&, float,
                    const std::string&, std::uint32_t, strix::Micros, const FlightOptions*, bool,
                    bool, nb::bytes>(),
           "vehicle"_a, "mission"_a, "mission_text"_a, "declination_rad"_a, "log_path"_a,
           "boot_id"_a, "start_time_us"_a, "options"_a.none() = nb::none(), "console"_a = false,
           "telemetry"_a = false, "storage"_a = nb::bytes("", 0))
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
      .def("put_radio", &Flight::putRadio, "pulses_us"_a, "failsafe"_a = false,
           "frame_lost"_a = false, "A frame of the pilot's receiver")
      .def("command", &Flight::command, "kind"_a, "values"_a = std::array<float, 8>{},
           "index"_a = 0, "detail"_a = 0, "time_us"_a = 0,
           "A command as telemetry gives it; returns why it was refused, or ''")
      .def("texts", &Flight::texts, "What was said since this was asked last")
      .def("set_card", &Flight::setCard, "stalled"_a, "dead"_a,
           "From now on the log card takes no sector (stalled), or fails all it is asked (dead)")
      .def("loop", &Flight::loop, "now_us"_a, "One pass; returns the ESC commands M1..M4 after it")
      .def("put_telemetry", &Flight::putTelemetry, "heard"_a)
      .def("take_telemetry", &Flight::takeTelemetry, "What it sends; made with telemetry=True")
      .def("put_console", &Flight::putConsole, "typed"_a)
      .def("take_console", &Flight::takeConsole, "What it says; made with console=True")
      .def("storage", &Flight::storage, "What the board keeps without power")
      .def_prop_ro("reboot_asked", &Flight::rebootAsked)
      .def("close", &Flight::close,
           "Writes the rest of the log; true when all of it is on the disk")
      .def_prop_ro("state_name", &Flight::stateName)
      .def_prop_ro("motors_on", &Flight::motorsOn)
      .def_prop_ro("refusal", &Flight::refusal, "Of the first failing pre-arm check, or ''")
      .def_prop_ro("attitude", &Flight::attitude, "Estimate, [w x y z], body to NED")
      .def_prop_ro("position_ned_m", &Flight::position)
      .def_prop_ro("velocity_ned_m_s", &Flight::velocity);
}
