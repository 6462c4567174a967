/// What the console prints of the aircraft: 80 columns, every number with its unit.
#pragma once

#include <array>

#include "Conditions.h"
#include "ConsoleText.h"
#include "FlightStatus.h"
#include "Parameters.h"
#include "Rotation.h"

namespace strix {

/// What each pre-arm check looks at, in the order of its bits.
constexpr std::array<const char*, 24> kPreArmSubjects{
    "calibration", "IMU",     "magnetometer", "altimeter",   "GPS",    "GPS origin",
    "estimator",   "tilt",    "standstill",   "kill",        "start",  "log card",
    "mounting",    "mission", "fence",        "gyro filter", "rotors", "radio",
    "throttle",    "battery", "restart",      "parameters",  "loop",   "kill command",
};
static_assert(kPreArmSubjects.size() == kPreArmChecks.size());

constexpr std::size_t kSubjectColumn = 14;

inline void printStatus(TextOut& out, const FlightStatus& s) {
  const auto row = [&out](const char* subject) -> TextOut& {
    return out << subject << Column{kSubjectColumn};
  };
  row("state") << s.stateName << ", motors " << (s.motorsOn ? "ON" : "off")
               << (s.failsafe ? ", failsafe" : "") << (s.critical ? ", cut off" : "") << "\n";
  row("arming") << (*s.refusal == '\0' ? "every check passes" : s.refusal) << "\n";
  const Vector3f& p = s.estimate.positionNed;
  const Vector3f& v = s.estimate.velocityNed;
  row("position") << Fixed{p.x(), 2} << " m north, " << Fixed{p.y(), 2} << " m east, "
                  << Fixed{-p.z(), 2} << " m up" << (s.positionValid ? "" : " (without GPS)")
                  << "\n";
  row("velocity") << Fixed{v.x(), 2} << " m/s north, " << Fixed{v.y(), 2} << " m/s east, "
                  << Fixed{-v.z(), 2} << " m/s up\n";
  const EulerAngles e = quaternionToEuler(s.estimate.attitude);
  row("attitude") << "roll " << Fixed{e.roll * kRadToDeg, 1} << ", pitch "
                  << Fixed{e.pitch * kRadToDeg, 1} << ", yaw " << Fixed{e.yaw * kRadToDeg, 1}
                  << " deg" << (s.estimatorHealthy ? "" : " (estimator not healthy)") << "\n";
  row("motors");
  for (const float motor : s.motors) out << Fixed{motor * 100.0F, 0} << " ";
  out << "%\n";
  row("battery");
  if (s.voltage > 0.0F) {
    out << Fixed{s.voltage, 2} << " V, " << std::uint32_t{s.cells} << " cells, "
        << Fixed{s.current, 1} << " A\n";
  } else {
    out << "not measured\n";
  }
  row("radio") << (s.radioHeard ? "heard" : "not heard") << "\n";
  row("mission") << std::uint32_t{s.legs} << " legs";
  if (s.leg != 0) out << ", flying number " << std::uint32_t{s.leg};
  out << "\n";
  row("log") << (s.logGood ? "good" : "NO LOG") << ", " << s.logDropped << " records lost\n";
  row("loop") << s.overruns << " periods missed, longest pass " << s.longestPass << " us\n";
}

inline void printSensors(TextOut& out, const FlightStatus& s) {
  const auto row = [&out](const char* sensor, bool fresh) -> TextOut& {
    return out << sensor << Column{kSubjectColumn} << (fresh ? "good" : "LOST") << Column{20};
  };
  const auto vector = [](const std::array<float, 3>& v) { return Vector3f(v[0], v[1], v[2]); };
  row("IMU", s.imuFresh) << Fixed3{vector(s.accel), 2} << " m/s^2, " << Fixed3{vector(s.gyro), 3}
                         << " rad/s\n"
                         << Column{20} << Fixed{s.temperature, 1} << " degC\n";
  row("magnetometer", s.magFresh) << Fixed3{vector(s.field), 1} << " uT, "
                                  << Fixed{vector(s.field).norm(), 1} << " uT in all\n";
  row("altimeter", s.altFresh) << Fixed{s.pressure * 0.01F, 2} << " hPa\n";
  row("GPS", s.gpsFresh) << (s.fix >= 3 ? "3D fix, " : "no fix, ") << std::uint32_t{s.satellites}
                         << " satellites, HDOP " << Fixed{s.hdop, 1} << "\n"
                         << Column{20} << Degrees{s.latitude} << " N " << Degrees{s.longitude}
                         << " E, " << Fixed{static_cast<float>(s.altitude) * 1e-3F, 1} << " m\n"
                         << "axes are the body's: forward, right, down\n";
}

/// In lines of 80 columns from the column `at` on, broken between words.
inline void printWrapped(TextOut& out, std::string_view text, std::size_t at) {
  constexpr std::size_t kWidth = 80;
  while (at + text.size() > kWidth) {
    const std::size_t end = text.rfind(' ', kWidth - at);
    if (end == std::string_view::npos) break;
    out << text.substr(0, end) << "\n" << Column{at};
    text.remove_prefix(end + 1);
  }
  out << text << "\n";
}

/// Every check, in the order in which arming looks at them.
inline void printChecks(TextOut& out, PreArmSet failures) {
  for (const PreArmCheck& check : kPreArmChecks) {
    std::size_t place = 0;
    while ((check.bit >> place) != 1) ++place;
    out << kPreArmSubjects[place] << Column{kSubjectColumn};
    if ((failures & check.bit) == 0) {
      out << "ok\n";
    } else {
      out << "NO" << Column{kSubjectColumn + 4};
      printWrapped(out, check.refusal, kSubjectColumn + 4);
    }
  }
}

[[nodiscard]] constexpr const char* lockText(ParameterLock lock) {
  if (lock == ParameterLock::Air) return "any time";
  return lock == ParameterLock::Ground ? "motors off" : "next start";
}

inline TextOut& printUnit(TextOut& out, const ParameterInfo& info) {
  if (info.whole()) return out;
  return out << " " << info.unit;
}

/// The rows whose name has `pattern` in it; a star marks values that are not the default.
/// @return how many
inline std::size_t printParameters(TextOut& out, const Parameters& parameters,
                                   std::string_view pattern) {
  std::size_t printed = 0;
  for (const ParameterInfo& info : kParameterTable) {
    if (!contains(info.name, pattern)) continue;
    if (printed++ == 0) {
      out << "NAME" << Column{18} << "VALUE" << Column{34} << "DEFAULT" << Column{44} << "RANGE"
          << Column{66} << "CHANGED\n";
    }
    const float value = parameters.*info.member;
    out << info.name << Column{18} << Plain{value};
    printUnit(out, info) << (value == info.standard ? "" : " *") << Column{34}
                         << Plain{info.standard} << Column{44} << Plain{info.lowest} << " to "
                         << Plain{info.highest} << Column{66} << lockText(info.lock) << "\n";
  }
  return printed;
}

inline void printParameter(TextOut& out, const Parameters& parameters, const ParameterInfo& info) {
  out << info.name << " = " << Plain{parameters.*info.member};
  printUnit(out, info) << "\n  " << info.help << "\n  default " << Plain{info.standard} << ", "
                       << Plain{info.lowest} << " to " << Plain{info.highest}
                       << (info.whole() ? ", whole numbers" : "");
  out << "; changed: " << lockText(info.lock) << "\n";
}

}  // namespace strix
