/// Five seconds of standstill, and what they tell of each sensor, line by line.
#pragma once

#include "Board.h"
#include "CheckoutConfig.h"
#include "Geodesy.h"
#include "SensorFaults.h"
#include "Statistics.h"
#include "TextOut.h"

namespace strix {

/// What the sensors gave while they were measured.
struct SensorRecord {
  explicit SensorRecord(float accelRange, float gyroRange, float magRange)
      : accel(accelRange), gyro(gyroRange), mag(magRange), alt(1e6F) {}

  SensorSet found;
  bool moved = false;
  float seconds = 0.0F;
  Statistics accel;                       ///< m/s^2, as it came: sensor axes
  Statistics gyro;                        ///< rad/s
  Statistics mag;                         ///< uT
  Statistics alt;                         ///< Pa, in x
  Vector3f accelBody = Vector3f::Zero();  ///< the means, calibrated
  Vector3f fieldBody = Vector3f::Zero();
  std::uint32_t gpsFixes = 0;
  GpsRaw gps;                ///< the last one
  SensorFaultCounts before;  ///< the board's, at the start
  SensorFaultCounts after;

  [[nodiscard]] std::uint32_t grew(SensorFault fault) const {
    const auto i = static_cast<std::size_t>(fault);
    return after.all()[i] - before.all()[i];
  }
};

/// Prints the table. Every line ends in PASS or FAIL; a FAIL is followed by what to do.
class SensorTable {
 public:
  SensorTable(TextOut& out, const CheckoutPins& pins, const CheckoutRates& rates,
              const CheckoutLimits& limits)
      : out_(out), pins_(pins), rates_(rates), limits_(limits) {}

  void print(const SensorRecord& record) {
    passed_ = failed_ = 0;
    line("aircraft", "stood still");
    verdict(!record.moved, "let it stand on its feet, touch nothing, and measure again");
    imu(record);
    mag(record);
    alt(record);
    gps(record);
    line("card", "log file");
    verdict(record.found.card, "check that a card is in, formatted FAT32 or exFAT, not locked");
    out_ << passed_ << " PASS, " << failed_ << " FAIL\n";
  }

 private:
  static constexpr std::size_t kWhatColumn = 14;
  static constexpr std::size_t kValueColumn = 28;
  static constexpr std::size_t kVerdictColumn = 76;

  void imu(const SensorRecord& r) {
    line("IMU", "identity");
    if (!identity(r.found.imu, pins_.imuSda, pins_.imuScl, pins_.imuSelect != 0 ? nullptr : "0x68"))
      return;
    const std::uint32_t late = r.grew(SensorFault::ImuLate);
    if (rate("IMU", r.accel.count(), r.seconds, rates_.imu, late == 0)) {
      pass();
    } else if (late != 0) {
      fail() << late << " samples came without a data-ready edge: check the wire from INT to pin "
             << number(pins_.imuDataReady) << "\n";
    } else {
      silent("IMU", r.grew(SensorFault::ImuSilent), r.grew(SensorFault::ImuBusHeld), pins_.imuSda,
             pins_.imuScl);
    }
    noise("IMU", "accel noise", r.accel, limits_.accelNoise, 3, "m/s^2");
    noise("IMU", "gyro noise", r.gyro, limits_.gyroNoise, 4, "rad/s");
    const float gravity = r.accelBody.norm();
    line("IMU", "mean accel") << Fixed{gravity, 3} << " m/s^2, g within "
                              << Fixed{limits_.gravity * 100.0F, 0} << " %";
    verdict(
        within(gravity, kGravity * (1.0F - limits_.gravity), kGravity * (1.0F + limits_.gravity)),
        "calibrate the accelerometer (strix calibrate accel); if it stays, another sensor");
    const float bias = r.gyro.mean().norm();
    line("IMU", "gyro bias") << Fixed{bias, 4} << " rad/s, at most " << Fixed{limits_.gyroBias, 1};
    verdict(within(bias, 0.0F, limits_.gyroBias),
            "let it stand still and cool, measure again; if it stays, another sensor");
    const std::uint32_t stuck = r.grew(SensorFault::ImuStuck);
    readings("IMU", r.accel.unsound() + r.gyro.unsound(), r.accel.clipped() + r.gyro.clipped(),
             larger(stuck, larger(r.accel.longestRun(), r.gyro.longestRun())),
             r.grew(SensorFault::ImuSilent));
  }

  void mag(const SensorRecord& r) {
    line("magnetometer", "identity");
    if (!identity(r.found.mag, pins_.slowSda, pins_.slowScl, "0x1E")) return;
    const std::uint32_t misses = r.grew(SensorFault::MagSilent);
    if (rate("magnetometer", r.mag.count(), r.seconds, rates_.mag, true)) {
      pass();
    } else {
      silent("magnetometer", misses, r.grew(SensorFault::SlowBusHeld), pins_.slowSda,
             pins_.slowScl);
    }
    noise("magnetometer", "noise", r.mag, limits_.magNoise, 2, "uT");
    const float field = r.fieldBody.norm();
    line("magnetometer", "field") << Fixed{field, 1} << " uT, " << Fixed{limits_.lowestField, 0}
                                  << " to " << Fixed{limits_.highestField, 0};
    verdict(within(field, limits_.lowestField, limits_.highestField),
            "go away from iron, motors and speakers; then strix calibrate mag");
    readings("magnetometer", r.mag.unsound(), r.mag.clipped(), r.mag.longestRun(), misses);
  }

  void alt(const SensorRecord& r) {
    line("altimeter", "identity");
    if (!identity(r.found.alt, pins_.slowSda, pins_.slowScl, "0x77")) return;
    const std::uint32_t misses = r.grew(SensorFault::AltSilent);
    if (rate("altimeter", r.alt.count(), r.seconds, rates_.alt, true)) {
      pass();
    } else {
      silent("altimeter", misses, r.grew(SensorFault::SlowBusHeld), pins_.slowSda, pins_.slowScl);
    }
    const float deviation = r.alt.deviation().x();
    line("altimeter", "noise") << Fixed{deviation, 2} << " Pa, at most "
                               << Fixed{limits_.pressureNoise, 1};
    verdict(r.alt.count() > 1 && within(deviation, 0.0F, limits_.pressureNoise),
            "keep wind and light off the sensor: open-cell foam on its hole; shut the door");
    const float pressure = r.alt.mean().x();
    const bool sound = within(pressure, limits_.lowestPressure, limits_.highestPressure);
    line("altimeter", "pressure") << Fixed{pressure * 0.01F, 2} << " hPa, "
                                  << Fixed{limits_.lowestPressure * 0.01F, 0} << " to "
                                  << Fixed{limits_.highestPressure * 0.01F, 0};
    verdict(sound, "the sensor or its bus is broken: another sensor, then other wires");
    if (sound) height(r, heightFromPressure(pressure, kStandardPressure));
    readings("altimeter", r.alt.unsound() + r.grew(SensorFault::AltImplausible), 0,
             r.alt.longestRun(), misses);
  }

  void height(const SensorRecord& r, float standard) {
    line("altimeter", "height") << Fixed{standard, 0} << " m in the standard atmosphere";
    bool plausible = within(standard, limits_.lowestHeight, limits_.highestHeight);
    if (r.gps.fix >= 3) {
      const float byGps = static_cast<float>(r.gps.altitude) * 1e-3F;
      out_ << ", " << Fixed{byGps, 0} << " m by GPS";
      plausible =
          within(standard, byGps - limits_.heightDifference, byGps + limits_.heightDifference);
    }
    verdict(plausible, "the height is not that of any weather: another sensor");
  }

  void gps(const SensorRecord& r) {
    line("GPS", "identity") << (r.found.gps ? "acknowledged its settings" : "no acknowledgement");
    if (r.found.gps) {
      pass();
    } else {
      fail() << "check the power of the GPS, its TX to pin " << number(pins_.gpsRx)
             << ", its RX to pin " << number(pins_.gpsTx) << "\n";
    }
    const std::uint32_t rejected = r.grew(SensorFault::GpsRejected);
    if (rate("GPS", r.gpsFixes, r.seconds, rates_.gps, true)) {
      pass();
    } else if (rejected > limits_.gpsRejected) {
      fail() << "it talks, but no sentences: check the baud rate (57600) and the ground wire\n";
    } else {
      fail() << "check the wire from its TX to pin " << number(pins_.gpsRx)
             << ", and that it has 3.3 V\n";
    }
    line("GPS", "sentences") << rejected << " rejected, at most " << limits_.gpsRejected;
    verdict(rejected <= limits_.gpsRejected,
            "keep its wires short and away from the ESCs; check the ground wire");
    line("GPS", "fix") << (r.gps.fix >= 3 ? "3D, " : "none, ") << number(r.gps.satellites)
                       << " satellites, at least " << number(limits_.satellites);
    verdict(r.gps.fix >= 3 && r.gps.satellites >= limits_.satellites,
            "go under open sky, aerial up, and wait a minute; the first fix may take longer");
    line("GPS", "HDOP") << Fixed{r.gps.hdop, 1} << ", at most " << Fixed{limits_.hdop, 1};
    verdict(within(r.gps.hdop, 0.0F, limits_.hdop), "wait, or go where more of the sky is seen");
  }

  /// @param address  on I2C; nullptr for the IMU on SPI
  /// @return found: the lines that follow say something
  bool identity(bool found, std::uint8_t sda, std::uint8_t scl, const char* address) {
    out_ << (found ? "answers" : "not found");
    if (address != nullptr) out_ << " at " << address;
    out_ << (found ? ", settings read back" : ", or its settings did not hold");
    if (found) {
      pass();
    } else {
      fail() << "check its 3.3 V and ground, SDA to pin " << number(sda) << ", SCL to pin "
             << number(scl);
      if (address == nullptr) {
        out_ << ", CS to pin " << number(pins_.imuSelect) << ", SDO to pin "
             << number(pins_.imuMiso);
      }
      out_ << "\n";
    }
    return found;
  }

  /// Prints the line; the verdict is left to the caller.
  [[nodiscard]] bool rate(const char* device, std::uint32_t count, float seconds, float expected,
                          bool onTime) {
    const float found = seconds > 0.0F ? static_cast<float>(count) / seconds : 0.0F;
    line(device, "rate") << Fixed{found, found < 100.0F ? 1 : 0} << " Hz, " << Fixed{expected, 0}
                         << " within " << Fixed{limits_.rate * 100.0F, 0} << " %";
    return onTime &&
           within(found, expected * (1.0F - limits_.rate), expected * (1.0F + limits_.rate));
  }

  void silent(const char* device, std::uint32_t misses, std::uint32_t held, std::uint8_t sda,
              std::uint8_t scl) {
    TextOut& out = fail();
    if (held != 0) {
      out << "the bus is held low: look for a short at SDA, pin " << number(sda)
          << ", and SCL, pin " << number(scl) << "\n";
    } else if (misses != 0) {
      out << "the " << device << " stopped answering: check the plugs of SDA, pin " << number(sda)
          << ", SCL, pin " << number(scl) << ", and 3.3 V\n";
    } else {
      out << "the " << device << " answers but measures at another rate: power it off and on\n";
    }
  }

  void noise(const char* device, const char* what, const Statistics& s, float most, int decimals,
             const char* unit) {
    const Vector3f deviation = s.deviation();
    line(device, what) << Fixed3{deviation, decimals} << " " << unit << ", at most "
                       << Fixed{most, decimals};
    verdict(s.count() > 1 && deviation.maxCoeff() <= most,
            "something shakes or disturbs it: another table, fans and chargers off, measure again");
  }

  void readings(const char* device, std::uint32_t unsound, std::uint32_t clipped, std::uint32_t run,
                std::uint32_t misses) {
    line(device, "readings") << unsound << " bad, " << clipped << " clipped, " << misses
                             << " missed, " << run << " equal in a row";
    const bool stuck = run >= limits_.repeats;
    verdict(unsound == 0 && clipped == 0 && misses == 0 && !stuck,
            stuck ? "it repeats itself: power it off and on; if it stays, another sensor"
                  : "check its plugs and the length of its wires (docs/wiring.md)");
  }

  TextOut& line(const char* device, const char* what) {
    return out_ << device << Column{kWhatColumn} << what << Column{kValueColumn};
  }

  void verdict(bool good, const char* advice) {
    if (good) {
      pass();
    } else {
      fail() << advice << "\n";
    }
  }

  void pass() {
    ++passed_;
    out_ << Column{kVerdictColumn} << "PASS\n";
  }
  /// What to do comes next.
  TextOut& fail() {
    ++failed_;
    out_ << Column{kVerdictColumn} << "FAIL\n";
    return out_ << "    -> ";
  }

  [[nodiscard]] static std::uint32_t number(std::uint8_t n) { return n; }
  [[nodiscard]] static std::uint32_t larger(std::uint32_t a, std::uint32_t b) {
    return a > b ? a : b;
  }
  /// False for NaN.
  [[nodiscard]] static bool within(float value, float low, float high) {
    return value >= low && value <= high;
  }

  static constexpr float kStandardPressure = 101'325.0F;  // Pa, at sea level

  TextOut& out_;
  CheckoutPins pins_;
  CheckoutRates rates_;
  CheckoutLimits limits_;
  std::uint32_t passed_ = 0;
  std::uint32_t failed_ = 0;
};

}  // namespace strix
