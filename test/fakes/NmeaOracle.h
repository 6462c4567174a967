/// What must hold for any bytes at all that come in from a GPS receiver. The fuzz program
/// (test/fuzz/fuzz_nmea.cpp) and its short form in test_sensors ask the same questions.
///
/// The sentences are found and read a second time, the slow and obvious way: whole strings and
/// double precision.
#pragma once

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "NmeaFixes.h"

namespace strix {

class NmeaOracle {
 public:
  /// Feeds one byte. @return what is wrong, or nullptr
  const char* push(std::uint8_t byte) {
    const bool lineEnds = byte == '\r' || byte == '\n';
    if (byte == '$') {
      line_ = "$";
    } else if (!lineEnds) {
      line_ += static_cast<char>(byte);
    }
    const bool sound = lines.push(byte, ++now_);
    if (lineEnds) {
      const bool expected = isSound(line_);
      if (sound != expected) return "a line is taken without being sound, or the other way round";
      if (sound) remember(line_);
      line_.clear();
    } else if (sound) {
      return "a line is taken before it ended";
    }
    GpsRaw fix;
    if (!sound || !fixes.take(lines.sentence(), lines.started(), fix)) return nullptr;
    ++handedOut;
    if (fix.fix != 0) ++withPosition;
    return check(fix);
  }

  NmeaLines lines;
  NmeaFixes fixes;
  std::uint32_t handedOut = 0;
  std::uint32_t withPosition = 0;

 private:
  using Fields = std::vector<std::string>;

  static bool isSound(const std::string& line) {
    if (line.size() < 5 || line.size() > 1 + NmeaLines::kLongest || line[0] != '$') return false;
    const std::size_t star = line.find('*');
    if (star != line.size() - 3) return false;
    unsigned sum = 0;
    for (std::size_t i = 1; i < star; ++i) {
      if (line[i] < ' ' || line[i] > '~') return false;
      sum ^= static_cast<unsigned char>(line[i]);
    }
    constexpr const char* kHex = "0123456789ABCDEF";
    return line.substr(star + 1) == std::string{kHex[sum / 16U], kHex[sum % 16U]};
  }

  void remember(const std::string& line) {
    Fields fields(1);
    for (std::size_t i = 1; i < line.size() - 3; ++i) {
      if (line[i] == ',') {
        fields.emplace_back();
      } else {
        fields.back() += line[i];
      }
    }
    const std::string talker = fields[0].substr(0, 2);
    const bool named =
        fields[0].size() == 5 &&
        std::string(" GP GN GL GA GB BD GQ QZ GI ").find(" " + talker + " ") != std::string::npos;
    if (named && fields[0].substr(2) == "GGA") gga_ = fields;
    if (named && fields[0].substr(2) == "RMC") rmc_ = fields;
  }

  const char* check(const GpsRaw& fix) const {
    if (gga_.size() != 15 || rmc_.size() < 12) return "a fix without both its sentences";
    if (std::atof(gga_[1].c_str()) != std::atof(rmc_[1].c_str())) {
      // Written with other digits, or the same to the millisecond.
      if (std::fabs(std::atof(gga_[1].c_str()) - std::atof(rmc_[1].c_str())) > 0.001) {
        return "a fix of two moments";
      }
    }
    if (fix.fix > 3 || fix.satellites > 99) return "a fix out of range";
    if (!std::isfinite(fix.speedKnots) || !(fix.speedKnots >= 0.0F)) return "no speed";
    if (!(fix.courseDeg >= 0.0F && fix.courseDeg <= 360.0F)) return "no course";
    if (!std::isfinite(fix.hdop)) return "no dilution";
    if (fix.fix == 0) return nullptr;
    if (rmc_[2] != "A") return "a fix that the receiver calls void";
    if (!isNear(fix.latitude, gga_[2], gga_[3] == "S", 90)) return "another latitude";
    if (!isNear(fix.longitude, gga_[4], gga_[5] == "W", 180)) return "another longitude";
    if (std::fabs(static_cast<double>(fix.altitude) - std::atof(gga_[9].c_str()) * 1e3) > 1.0) {
      return "another altitude";
    }
    return nullptr;
  }

  /// @param angle  1e-7 deg    @param text  (d)ddmm.mmmm
  static bool isNear(std::int32_t angle, const std::string& text, bool negative, double limit) {
    const double number = std::atof(text.c_str());
    const double degrees = std::floor(number / 100.0);
    const double expected = degrees + (number - 100.0 * degrees) / 60.0;
    const double got = angle * (negative ? -1e-7 : 1e-7);
    return std::fabs(got) <= limit && std::fabs(got - expected) < 0.51e-7;  // half a unit: rounded
  }

  std::string line_;
  Fields gga_;
  Fields rmc_;
  Micros now_ = 0;
};

}  // namespace strix
