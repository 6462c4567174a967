#include "GpsMtk3333.h"

namespace strix {

namespace {

// Adafruit's header stops at 5 Hz; a fix each 100 ms needs both this and PMTK220.
constexpr const char* kFixEach100Ms = "$PMTK300,100,0,0,0,0*2C";

}  // namespace

bool GpsMtk3333::begin() {
  port_.addMemoryForRead(received_.data(), received_.size());
  Adafruit_GPS module(&port_);  // for this once: 3 KB that flight has no use for
  // After a power-up it listens at 9600 baud, after a restart of the Teensy alone at 57600: then
  // this line is noise to it.
  module.begin(kBaudAtPowerUp);
  module.sendCommand(PMTK_SET_BAUD_57600);
  port_.flush();  // 22 ms
  delay(20);
  module.begin(kBaud);
  // The first commands after the change of speed are sometimes lost.
  bool heard = false;
  for (int i = 0; i < 3 && !heard; ++i) {
    heard = command(module, PMTK_SET_NMEA_OUTPUT_RMCGGAGSA, "PMTK001,314,3");
  }
  return heard && command(module, kFixEach100Ms, "PMTK001,300,3") &&
         command(module, PMTK_SET_NMEA_UPDATE_10HZ, "PMTK001,220,3") && waitForEpochs();
}

bool GpsMtk3333::command(Adafruit_GPS& module, const char* text, std::string_view answer) {
  module.sendCommand(text);
  return waitForAnswer(answer);
}

bool GpsMtk3333::waitForAnswer(std::string_view wanted) {
  const std::uint32_t start = millis();
  while (millis() - start < kAckTimeout) {
    if (port_.available() <= 0) continue;
    const auto byte = static_cast<std::uint8_t>(port_.read());
    if (lines_.push(byte, ::micros()) && lines_.sentence() == wanted) return true;
  }
  return false;
}

bool GpsMtk3333::waitForEpochs() {
  constexpr std::uint32_t kInterval = kPeriod / 1000;  // ms
  GpsRaw epoch;
  int seen = 0;  // intervals as they should be, one after the other
  const std::uint32_t start = millis();
  while (millis() - start < kEpochsTimeout) {
    if (!read(epoch)) continue;
    seen = interval() == kInterval ? seen + 1 : 0;
    if (seen == 2) return true;
  }
  return false;
}

bool GpsMtk3333::read(GpsRaw& out) {
  const Micros now = ::micros();
  int waiting = port_.available();
  if (waiting >= static_cast<int>(received_.size()) + kCoresBytes) ++overflows_;
  for (int i = 0; i < kBytesACall && waiting > 0; ++i) {
    --waiting;  // bytes that came behind this one, each taking its time on the line
    const auto byte = static_cast<std::uint8_t>(port_.read());
    const Micros arrived = now - static_cast<Micros>(waiting) * kByte;
    if (lines_.push(byte, arrived) && fixes_.take(lines_.sentence(), lines_.started(), out)) {
      return true;
    }
  }
  return false;
}

}  // namespace strix
