#include "GpsMtk3333.h"

#include <cctype>
#include <cstring>

namespace strix {

namespace {

// Adafruit's header stops at 5 Hz; a fix each 100 ms needs both this and PMTK220.
constexpr const char* kFixEach100Ms = "$PMTK300,100,0,0,0,0*2C";

struct Sentence {
  const char* kind;
  int commas;  // that the parser steps over, or more
};
constexpr Sentence kSentences[] = {{"RMC", 11}, {"GGA", 14}, {"GSA", 17}};

constexpr std::size_t kKindAt = 3;  // "$GPRMC,"
constexpr std::size_t kFirstComma = 6;

bool startsWith(const char* line, const char* prefix) {
  return std::strncmp(line, prefix, std::strlen(prefix)) == 0;
}

bool isHex(char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; }

/// Metres to millimetres; what is not a height on Earth becomes 0.
std::int32_t millimetres(double metres) {
  if (!(metres > -1000.0 && metres < 100'000.0)) return 0;
  return static_cast<std::int32_t>(metres * 1000.0 + (metres < 0.0 ? -0.5 : 0.5));
}

}  // namespace

static_assert(sizeof(nmea_float_t) == 8,
              "build with -DNMEA_FLOAT_T=double: a float coordinate is 1 m coarse");

bool GpsMtk3333::begin() {
  port_.addMemoryForRead(received_.data(), received_.size());
  // After a power-up it listens at 9600 baud, after a restart of the Teensy alone at 57600: then
  // this line is noise to it.
  parser_.begin(kBaudAtPowerUp);
  parser_.sendCommand(PMTK_SET_BAUD_57600);
  port_.flush();  // 20 ms
  delay(20);
  parser_.begin(kBaud);
  // The first commands after the change of speed are sometimes lost.
  bool heard = false;
  for (int i = 0; i < 3 && !heard; ++i) {
    heard = command(PMTK_SET_NMEA_OUTPUT_RMCGGAGSA, "$PMTK001,314,3");
  }
  return heard && command(kFixEach100Ms, "$PMTK001,300,3") &&
         command(PMTK_SET_NMEA_UPDATE_10HZ, "$PMTK001,220,3");
}

bool GpsMtk3333::command(const char* sentence, const char* acknowledgement) {
  parser_.sendCommand(sentence);
  return waitForLine(acknowledgement);
}

bool GpsMtk3333::waitForLine(const char* wanted) {
  const std::uint32_t start = millis();
  while (millis() - start < kAckTimeout) {
    (void)parser_.read();
    if (parser_.newNMEAreceived() && startsWith(parser_.lastNMEA(), wanted)) return true;
  }
  return false;
}

bool GpsMtk3333::read(GpsRaw& out) {
  for (int i = 0; i < kCharactersACall && port_.available() > 0; ++i) {
    if (parser_.read() == '$') lineStart_ = ::micros();
    if (parser_.newNMEAreceived()) return take(parser_.lastNMEA(), out);
  }
  return false;
}

bool GpsMtk3333::take(const char* line, GpsRaw& out) {
  // parse() takes a char* it does not write to.
  if (!isParseable(line) || !parser_.parse(const_cast<char*>(line))) {
    ++rejected_;
    return false;
  }
  const char* kind = line + kKindAt;
  if (startsWith(kind, "GGA")) {  // the first of its epoch
    ggaSeen_ = true;
    ggaTime_ = timeOfDay();
    epochStart_ = lineStart_;
    return false;
  }
  if (!startsWith(kind, "RMC")) return false;
  const bool wholeEpoch = ggaSeen_ && ggaTime_ == timeOfDay();
  ggaSeen_ = false;
  if (!wholeEpoch) return false;

  out.sampled = epochStart_;
  out.latitude = parser_.latitude_fixed;
  out.longitude = parser_.longitude_fixed;
  out.altitude = millimetres(parser_.altitude);
  out.speedKnots = static_cast<float>(parser_.speed);
  out.courseDeg = static_cast<float>(parser_.angle);
  out.hdop = static_cast<float>(parser_.HDOP);
  // GSA's mode is 1 for none, 2 and 3 for the number of dimensions.
  const bool fixed = parser_.fix && parser_.fixquality > 0 && parser_.fixquality_3d >= 2;
  out.fix = fixed ? parser_.fixquality_3d : std::uint8_t{0};
  out.satellites = parser_.satellites;
  return true;
}

std::uint32_t GpsMtk3333::timeOfDay() const {
  return ((parser_.hour * 60U + parser_.minute) * 60U + parser_.seconds) * 1000U +
         parser_.milliseconds;
}

bool GpsMtk3333::isParseable(const char* line) {
  if (!startsWith(line, "$GP") && !startsWith(line, "$GN")) return false;
  const char* star = std::strchr(line, '*');
  if (star == nullptr || !isHex(star[1]) || !isHex(star[2])) return false;
  if (star[3] != '\0' && star[3] != '\r' && star[3] != '\n') return false;
  int commas = 0;
  for (const char* c = line; c < star; ++c) {
    if (*c == ',') ++commas;
  }
  for (const auto& [kind, needed] : kSentences) {
    if (std::strncmp(line + kKindAt, kind, 3) == 0) {
      return commas >= needed && line[kFirstComma] == ',';
    }
  }
  return false;
}

}  // namespace strix
