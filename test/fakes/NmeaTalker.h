/// A MediaTek MT3333 as its serial line shows it: sentences of the position it is given, at its own
/// rate and speed, and the PMTK commands that set both.
///
/// Form and order of the sentences are those of an Adafruit Ultimate GPS (gpsd, mt3339.log); the
/// answers are those of a Quectel L70 with the same chip family (gpsd, quectel-L70.log). The
/// commands are PMTK 251, 300, 314 and 220 of the "PMTK command packet" manual.
#pragma once

#include <cstdint>
#include <cstdio>
#include <deque>
#include <string>

namespace strix {

/// '$', the text, its checksum and the end of the line.
inline std::string nmeaLine(const std::string& text) {
  unsigned sum = 0;
  for (const char c : text) sum ^= static_cast<unsigned char>(c);
  char tail[8];
  std::snprintf(tail, sizeof(tail), "*%02X\r\n", sum & 0xFFU);
  return "$" + text + tail;
}

/// An angle as "ddmm.mmmm,N", made of integers alone.
/// @param minutes  in units of 10^-decimals minutes    @param degreeDigits  2 or 3
inline std::string nmeaAngleText(std::int64_t minutes, int decimals, int degreeDigits,
                                 const char* positive, const char* negative) {
  std::int64_t unit = 1;
  for (int i = 0; i < decimals; ++i) unit *= 10;
  // long long, not PRId64: newlib has that only behind headers that clang-format puts last.
  const long long size = minutes < 0 ? -minutes : minutes;
  char text[48];
  std::snprintf(text, sizeof(text), "%0*lld%02lld.%0*lld,%s", degreeDigits, size / (60 * unit),
                size / unit % 60, decimals, size % unit, minutes < 0 ? negative : positive);
  return text;
}

/// What a receiver says of one moment.
struct NmeaMoment {
  unsigned time = 43'200'000;          ///< UTC, ms of the day
  std::int64_t latitude = 34'452'000;  ///< 1e-4 min, north: 57 deg 25.2 min
  std::int64_t longitude = 7'182'000;  ///< 1e-4 min, east: 11 deg 58.2 min
  int altitude = 400;                  ///< dm
  unsigned speed = 0;                  ///< hundredths of a knot
  unsigned course = 0;                 ///< hundredths of a degree
  int satellites = 11;
  int dimensions = 3;  ///< 1 is no fix

  [[nodiscard]] std::string place() const {
    return nmeaAngleText(latitude, 4, 2, "N", "S") + "," + nmeaAngleText(longitude, 4, 3, "E", "W");
  }
  [[nodiscard]] std::string clock() const {
    char text[24];
    std::snprintf(text, sizeof(text), "%02u%02u%02u.%03u", time / 3'600'000U, time / 60'000U % 60U,
                  time / 1000U % 60U, time % 1000U);
    return text;
  }
  [[nodiscard]] std::string gga() const {
    char tail[80];
    std::snprintf(tail, sizeof(tail), "%s,%d,%s%d.%d,M,39.5,M,,", dimensions > 1 ? "1" : "0",
                  satellites, dimensions > 1 ? "0.98," : ",", altitude / 10, altitude % 10);
    return nmeaLine("GNGGA," + clock() + "," + place() + "," + tail);
  }
  [[nodiscard]] std::string gsa() const {
    char text[64];
    std::snprintf(text, sizeof(text), "GPGSA,A,%d,20,16,09,03,07,10,,,,,,,1.64,0.98,1.31",
                  dimensions);
    return nmeaLine(text);
  }
  [[nodiscard]] std::string rmc() const {
    char tail[64];
    std::snprintf(tail, sizeof(tail), ",%u.%02u,%u.%02u,130415,,,%s", speed / 100U, speed % 100U,
                  course / 100U, course % 100U, dimensions > 1 ? "A" : "N");
    return nmeaLine("GNRMC," + clock() + (dimensions > 1 ? ",A," : ",V,") + place() + tail);
  }
};

class NmeaTalker {
 public:
  // Set by the test.
  NmeaMoment moment;
  bool silent = false;            ///< unplugged, or no supply
  bool babbling = false;          ///< random bytes instead of sentences
  bool deaf = false;              ///< its receive line is broken: it hears no command
  bool refusing = false;          ///< answers each command with `failed`
  int ignoring = -1;              ///< this command is acknowledged but changes nothing
  int lostAfterNewSpeed = 0;      ///< commands it misses after each change of speed
  std::uint32_t garbleEvery = 0;  ///< flips one bit of every so many bytes
  std::uint64_t nextEpoch = 0;    ///< us, when it speaks next

  // Read by the test.
  std::uint32_t speed = 9600;      ///< baud
  std::uint32_t period = 1000;     ///< ms from one epoch to the next
  std::uint32_t fixPeriod = 1000;  ///< ms
  std::string outputs = "GLL RMC VTG GGA GSA GSV";

  /// A byte sent to it. @param baud  at which it was sent: another than its own is noise
  void hear(char byte, std::uint32_t baud, std::uint64_t now) {
    if (deaf || silent || baud != speed) {
      heard_.clear();
      return;
    }
    if (byte == '$') heard_.clear();
    if (byte != '\r' && byte != '\n') {
      heard_ += byte;
    } else if (!heard_.empty()) {
      const std::string line = heard_;
      heard_.clear();
      if (nmeaLine(line.substr(1, line.find('*') - 1)) == line + "\r\n") obey(line, now);
    }
  }

  /// Lets time pass. @param now  us, never less than before
  void run(std::uint64_t now) {
    while (nextEpoch <= now) {
      if (!silent) speak(nextEpoch);
      nextEpoch += 1000U * std::uint64_t{period};
    }
  }

  struct Byte {
    std::uint64_t arrives;  ///< us, the end of its stop bit
    std::uint8_t value;
    std::uint32_t baud;
  };
  std::deque<Byte> line;  ///< on its way

  /// Puts any text on the line, from `now` on.
  void say(const std::string& text, std::uint64_t now) {
    std::uint64_t time = line.empty() || line.back().arrives < now ? now : line.back().arrives;
    for (const char c : text) {
      time += 10'000'000U / speed;  // 10 bits
      auto value = static_cast<std::uint8_t>(c);
      if (garbleEvery != 0 && ++said_ % garbleEvery == 0) {
        value = static_cast<std::uint8_t>(value ^ (1U << (said_ / garbleEvery % 8U)));
      }
      line.push_back({time, value, speed});
    }
  }

 private:
  void obey(const std::string& text, std::uint64_t now) {
    if (skip_ > 0) {
      --skip_;
      return;
    }
    int command = 0;
    unsigned value = 0;
    if (std::sscanf(text.c_str(), "$PMTK%d,%u", &command, &value) != 2) return;
    if (command == 251) {  // not acknowledged: the speed is another already
      if (ignoring != command && value != speed) {
        speed = value;
        skip_ = lostAfterNewSpeed;
      }
      return;
    }
    if (command != 314 && command != 220 && command != 300) return;
    if (!refusing && ignoring != command) {
      if (command == 220) period = value;
      if (command == 300) fixPeriod = value;
      if (command == 314) {
        constexpr const char* kKinds[] = {"GLL", "RMC", "VTG", "GGA", "GSA", "GSV"};
        outputs.clear();
        for (int i = 0; i < 6; ++i) {
          if (text[static_cast<std::size_t>(9 + 2 * i)] != '0') outputs += kKinds[i];
        }
      }
    }
    char answer[32];
    std::snprintf(answer, sizeof(answer), "PMTK001,%d,%d", command, refusing ? 2 : 3);
    say(nmeaLine(answer), now);
  }

  void speak(std::uint64_t now) {
    if (babbling) {
      std::string noise;
      for (int i = 0; i < 200; ++i) {
        random_ = random_ * 1664525U + 1013904223U;
        noise += static_cast<char>(random_ >> 24U);
      }
      say(noise, now);
      return;
    }
    const auto wants = [this](const char* kind) { return outputs.find(kind) != std::string::npos; };
    if (wants("GGA")) say(moment.gga(), now);
    if (wants("GSA")) say(moment.gsa(), now);
    if (wants("GSV")) say(nmeaLine("GPGSV,1,1,01,09,88,089,31"), now);
    if (wants("RMC")) say(moment.rmc(), now);
    if (wants("VTG")) say(nmeaLine("GPVTG,0.00,T,,M,0.00,N,0.00,K,A"), now);
    // Asked more often than it measures, it says the same again (Adafruit_PMTK.h).
    sinceFix_ += period;
    if (sinceFix_ < fixPeriod) return;
    moment.time = (moment.time + sinceFix_) % 86'400'000U;
    sinceFix_ = 0;
  }

  std::uint32_t sinceFix_ = 0;  ///< ms
  std::string heard_;
  std::uint32_t said_ = 0;
  std::uint32_t random_ = 1;
  int skip_ = 0;
};

}  // namespace strix
