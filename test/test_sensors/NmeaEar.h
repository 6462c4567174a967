/// The flight code's end of a GPS receiver's line, and one epoch that a real receiver sent.
#pragma once

#include <string>

#include "NmeaFixes.h"

namespace strix {

/// A receiver's line with the flight code's end of it.
struct Ear {
  NmeaLines lines;
  NmeaFixes fixes;
  GpsRaw fix;
  int handedOut = 0;
  Micros now = 0;

  Ear& hear(const std::string& text) {
    for (const char c : text) {
      now += 174;  // 10 bits at 57600 baud
      if (lines.push(static_cast<std::uint8_t>(c), now) &&
          fixes.take(lines.sentence(), lines.started(), fix)) {
        ++handedOut;
      }
    }
    return *this;
  }
};

// gpsd, mt3339.log: Adafruit Ultimate GPS HAT, the MT3333's sister for GPS alone.
inline constexpr const char* kGga =
    "$GPGGA,202640.000,4404.1306,N,12118.8515,W,2,10,0.98,1127.7,M,-19.6,M,0000,0000*6C\r\n";
inline constexpr const char* kGsa =
    "$GPGSA,A,3,20,16,09,03,07,10,23,19,27,30,,,1.64,0.98,1.31*05\r\n";
inline constexpr const char* kRmc =
    "$GPRMC,202640.000,A,4404.1306,N,12118.8515,W,0.03,225.97,130415,,,D*73\r\n";

inline std::string realEpoch() { return std::string(kGga) + kGsa + kRmc; }

}  // namespace strix
