/// From sentences to fixes: GGA and RMC of the same moment, with the GSA beside them.
#pragma once

#include "Nmea.h"
#include "RawSamples.h"

namespace strix {

/// Joins the sentences of one epoch, in whichever order the receiver sends them. Half an epoch is
/// none: a position without its velocity, or with another moment's, is not handed out.
class NmeaFixes {
 public:
  /// Since the start; they wrap.
  struct Counts {
    std::uint32_t fixes = 0;      ///< handed out, those that say `no fix` included
    std::uint32_t unknown = 0;    ///< sound sentences that are not ours to read
    std::uint32_t malformed = 0;  ///< the right checksum around fields that cannot be
    std::uint32_t unpaired = 0;   ///< GGA or RMC without its other half, or without a time
    std::uint32_t unlike = 0;     ///< GGA and RMC of one moment that tell two positions
    std::uint32_t repeated = 0;   ///< the same moment once more: the receiver's clock stands still
  };

  /// True when this sentence completes an epoch, which `out` then holds.
  /// @param sentence  what stands between '$' and '*', its checksum found right
  /// @param started  when its '$' arrived
  [[nodiscard]] bool take(std::string_view sentence, Micros started, GpsRaw& out) {
    const NmeaFields fields(sentence);
    if (!isReceiver(fields[0])) return none(counts_.unknown);
    const std::string_view kind = nmeaPart(fields[0], 2);
    if (kind == "GGA") {
      if (gga_) ++counts_.unpaired;
      gga_ = parseGga(fields);
      if (!gga_) return none(counts_.malformed);
      return join(gga_->time, started, out);
    }
    if (kind == "RMC") {
      if (rmc_) ++counts_.unpaired;
      rmc_ = parseRmc(fields);
      if (!rmc_) return none(counts_.malformed);
      return join(rmc_->time, started, out);
    }
    if (kind == "GSA") {
      const auto dimensions = parseGsa(fields);
      if (!dimensions) return none(counts_.malformed);
      // One sentence for each satellite system, and a system without satellites may say 1.
      if (*dimensions > dimensions_) dimensions_ = *dimensions;
      return false;
    }
    return none(counts_.unknown);
  }

  /// UTC from one epoch to the next, ms; 0 before the second. What the receiver's rate really is.
  [[nodiscard]] std::uint32_t interval() const { return interval_; }
  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  // MT3333 writes each digit as often in GGA as in RMC; Ashtech cuts one off (gpsd, ac12.log).
  static constexpr std::int32_t kSamePlace = 17;  // 1e-4 min in 1e-7 deg, rounded up
  // u-blox leaves the course empty at standstill: up to 0.43 knots in gpsd's logs.
  static constexpr std::int32_t kStandstill = 1000;  // thousandths of a knot
  static constexpr std::uint32_t kDay = 86'400'000;  // ms

  /// Talker and kind of a satellite receiver: GPS, several systems, GLONASS, Galileo, BeiDou, QZSS,
  /// NavIC.
  [[nodiscard]] static bool isReceiver(std::string_view name) {
    constexpr std::array<std::string_view, 9> kTalkers{"GP", "GN", "GL", "GA", "GB",
                                                       "BD", "GQ", "QZ", "GI"};
    if (name.size() != 5) return false;
    for (const std::string_view talker : kTalkers) {
      if (nmeaPart(name, 0, 2) == talker) return true;
    }
    return false;
  }

  static bool none(std::uint32_t& counter) {
    ++counter;
    return false;
  }

  /// After GGA or RMC has come in with this time.
  bool join(const std::optional<std::uint32_t>& time, Micros started, GpsRaw& out) {
    if (!time) {
      (gga_ && !gga_->time) ? gga_.reset() : rmc_.reset();
      return none(counts_.unpaired);
    }
    if (!gga_ || !rmc_) {
      started_ = started;
      return false;
    }
    if (gga_->time != rmc_->time) {  // the older one waited in vain
      gga_->time == time ? rmc_.reset() : gga_.reset();
      started_ = started;
      return none(counts_.unpaired);
    }
    const bool isNew = time != lastTime_;
    if (lastTime_ && isNew) interval_ = (*time + kDay - *lastTime_) % kDay;
    lastTime_ = time;
    const bool isFix = isNew ? fill(out) : none(counts_.repeated);
    gga_.reset();
    rmc_.reset();
    dimensionsBefore_ = dimensions_;
    dimensions_ = 0;
    if (isFix) ++counts_.fixes;
    return isFix;
  }

  [[nodiscard]] bool fill(GpsRaw& out) {
    out = GpsRaw{};
    out.sampled = started_;
    if (gga_->satellites) out.satellites = *gga_->satellites;
    if (gga_->hdop) out.hdop = thousandths(*gga_->hdop);
    if (!gga_->position || !rmc_->position || !rmc_->speed) return true;
    if (!alike(*gga_->position, *rmc_->position)) return none(counts_.unlike);
    if (rmc_->course) {
      out.speedKnots = thousandths(*rmc_->speed);
      out.courseDeg = thousandths(*rmc_->course);
    } else if (*rmc_->speed > kStandstill) {
      return true;  // it moves, but not known where to
    }  // else 0: a speed without its course would point north
    out.latitude = gga_->position->latitude;
    out.longitude = gga_->position->longitude;
    // Some receivers send GSA after GGA and RMC: then the one before counts.
    const std::uint8_t dimensions = dimensions_ != 0 ? dimensions_ : dimensionsBefore_;
    if (dimensions == 1) return true;
    out.fix = 2;
    if (!gga_->altitude) return true;
    out.altitude = *gga_->altitude;
    if (dimensions == 3) out.fix = 3;
    return true;
  }

  [[nodiscard]] static bool alike(const NmeaPosition& a, const NmeaPosition& b) {
    const std::int64_t north = static_cast<std::int64_t>(a.latitude) - b.latitude;
    const std::int64_t east = static_cast<std::int64_t>(a.longitude) - b.longitude;
    return north <= kSamePlace && north >= -kSamePlace && east <= kSamePlace && east >= -kSamePlace;
  }

  [[nodiscard]] static float thousandths(std::int32_t value) {
    return static_cast<float>(value) / 1000.0F;
  }

  std::optional<NmeaGga> gga_;  ///< of the epoch under way
  std::optional<NmeaRmc> rmc_;
  Micros started_ = 0;                     ///< the first of the two
  std::uint8_t dimensions_ = 0;            ///< most that a GSA told since the last epoch; 0 silence
  std::uint8_t dimensionsBefore_ = 0;      ///< the same, of the last epoch
  std::optional<std::uint32_t> lastTime_;  ///< ms of the day
  std::uint32_t interval_ = 0;
  Counts counts_;
};

}  // namespace strix
