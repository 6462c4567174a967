/// Stands in for Adafruit_GPS.h, as far as GpsMtk3333 uses it: Adafruit's library is not in CI
/// (PlatformIO's registry brings it). Names and commands are the library's public ones; what they
/// mean is in MediaTek's "PMTK command packet" manual.
#pragma once

#include <Arduino.h>

#include "HardwareSerial.h"

// NOLINTBEGIN(cppcoreguidelines-macro-usage)
#define PMTK_SET_BAUD_57600 "$PMTK251,57600*2C"
#define PMTK_SET_NMEA_UPDATE_10HZ "$PMTK220,100*2F"
#define PMTK_SET_NMEA_OUTPUT_RMCGGAGSA "$PMTK314,0,1,0,1,1,0,0,0,0,0,0,0,0,0,0,0,0,0,0*29"
// NOLINTEND(cppcoreguidelines-macro-usage)

class Adafruit_GPS {
 public:
  explicit Adafruit_GPS(HardwareSerialIMXRT* port) : port_(port) {}

  bool begin(std::uint32_t baud) {
    port_->begin(baud);
    delay(10);
    return true;  // whoever is there
  }
  void sendCommand(const char* text) { port_->println(text); }

 private:
  HardwareSerialIMXRT* port_;
};
