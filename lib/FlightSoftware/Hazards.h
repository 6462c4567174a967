/// What ends a flight: each sign believed after a while, and given up with a hysteresis.
#pragma once

#include <array>

#include "Conditions.h"
#include "Detectors.h"
#include "Mathpk.h"
#include "Parameters.h"
#include "Sensors.h"
#include "States.h"

namespace strix {

/// What the hazards are read from, once a control tick.
struct HazardSigns {
  FlightState state = FlightState::Boot;
  bool motorsOn = false;
  float cosTilt = 1.0F;        ///< of the estimate: 1 level, 0 on its side
  float north = 0.0F;          ///< m from the start
  float east = 0.0F;           ///< m
  float height = 0.0F;         ///< m above the start
  float specificForce = 9.8F;  ///< m/s^2, length of the last IMU sample
  bool imuFresh = true;
  bool magFresh = true;
  bool altFresh = true;
  bool gpsUsed = false;  ///< a usable fix has come since the last tick
  bool estimatorLost = false;
  bool radioKnown = false;  ///< a transmitter was heard since power-up
  bool radioLost = false;
  bool linkFlies = false;  ///< the ground station armed the aircraft, or flies it
  bool linkHeard = false;  ///< its heartbeat has come since the last tick
  bool logFailed = false;
  std::uint32_t imuClipped = 0;  ///< samples at an end of a range, since power-up
  std::uint32_t overruns = 0;    ///< control periods missed, since power-up
  float cellVoltage = 0.0F;      ///< V; 0: not known
  float lowestMotor = 0.5F;      ///< of the slowest: 0 its lowest command of flight, 1 its cap
  float highestMotor = 0.5F;     ///< of the fastest
};

/// A sign that has to last before it counts, and to be gone for a while before it does not.
class Sign {
 public:
  Sign() = default;
  Sign(Micros rise, Micros fall) : rise_(rise), fall_(fall) {}

  void setTimes(Micros rise, Micros fall) {
    rise_ = rise;
    fall_ = fall;
  }

  bool update(Micros now, bool present) {
    if (present == raised_) {
      since_ = now;
    } else if (elapsed(now, since_) >= (present ? rise_ : fall_)) {
      raised_ = present;
      since_ = now;
    }
    return raised_;
  }
  void reset(Micros now) {
    since_ = now;
    raised_ = false;
  }
  [[nodiscard]] bool raised() const { return raised_; }

 private:
  Micros rise_ = 0;
  Micros fall_ = 0;
  Micros since_ = 0;  ///< the sign has been as it counts until then
  bool raised_ = false;
};

/// How often a counter grows: raised by so many in one second, given up by a second without.
class Bursts {
 public:
  explicit Bursts(std::uint32_t most) : most_(most) {}

  bool update(Micros now, std::uint32_t count) {
    if (elapsed(now, began_) < kWindow) return raised_;
    const std::uint32_t grown = count - last_;
    raised_ = raised_ ? grown > 0 : grown > most_;
    last_ = count;
    began_ = now;
    return raised_;
  }

 private:
  static constexpr Micros kWindow = 1'000'000;
  std::uint32_t most_;
  std::uint32_t last_ = 0;
  Micros began_ = 0;
  bool raised_ = false;
};

/// Those that cannot wait are looked at in every tick, the others 50 times a second: a part of them
/// in every other tick, so that no tick bears them all.
class Hazards {
 public:
  void configure(const Parameters& p) {
    fenceRadius_ = p.fenceRadius;
    fenceHeight_ = p.fenceHeight;
    fenceMargin_ = p.fenceMargin;
    cosTiltLimit_ = cosine(p.tiltLimit * kDegToRad);
    cosTipped_ = cosine((p.armTilt + kTipped) * kDegToRad);
    batteryLow_ = p.batteryLow;
    batteryCritical_ = p.batteryCritical;
    tilt_.setTimes(toMicros(p.tiltTime), 0);
    mag_.setTimes(rest(p.magTimeout, SensorConfig{}.magTimeout), kRegained);
    alt_.setTimes(rest(p.altTimeout, SensorConfig{}.altTimeout), kRegained);
    gpsTimeout_ = toMicros(p.gpsTimeout);
    linkTimeout_ = toMicros(p.linkTimeout);
    low_.setTimes(toMicros(p.batteryTime), toMicros(p.batteryTime));
    critical_.setTimes(toMicros(p.batteryTime), toMicros(p.batteryTime));
    motors_.setTimes(toMicros(p.saturationTime), kRegained);
  }

  void start(Micros now) {
    for (Sign* sign : {&tilt_, &outside_, &farOutside_, &mag_, &alt_, &gps_, &low_, &critical_,
                       &motors_, &freeFall_, &knock_}) {
      sign->reset(now);
    }
    slow_.start(now);
    linkHeard_ = now;
  }

  /// @return the hazards that are there now
  ConditionSet update(const HazardSigns& s, Micros now) {
    ConditionSet set = condition::kNone;
    const auto setIf = [&set](bool present, ConditionSet bit) {
      set |= present ? bit : condition::kNone;
    };
    const bool flying = (in(s.state) & kFlying) != 0;
    setIf(!(s.cosTilt > 0.0F), condition::kUpset);  // also when it is no number
    setIf(!s.imuFresh, condition::kImuLost);
    setIf(s.estimatorLost, condition::kEstimatorUnhealthy);
    // In the very tick in which the sticks are none any more: that is no handing over.
    setIf(s.radioKnown && s.radioLost, condition::kRadioLost);
    const bool feels = flying && s.imuFresh;
    setIf(
        freeFall_.update(now, feels && s.specificForce < kWeightless && s.highestMotor > kCarries),
        condition::kFreeFall);
    if (knock_.update(now, feels && s.specificForce > kKnock)) {
      knocked_ = true;
      knockedAt_ = now;
    }
    knocked_ = knocked_ && elapsed(now, knockedAt_) <= kTumbleTime;
    setIf(knocked_ && !(s.cosTilt > kCosTumbling), condition::kCrash);
    if (s.gpsUsed) {
      gpsHeard_ = now;
      gpsKnown_ = true;
    }
    if (s.linkHeard) linkHeard_ = now;
    if (slow_.run(now)) {
      part_ = part_ + 1U < kParts.size() ? part_ + 1U : 0U;
      slowSet_ = (slowSet_ & ~kParts[part_]) | look(s, now, flying);
    }
    return set | slowSet_;
  }

 private:
  // ours, each with its reason:
  static constexpr float kTipped =
      10.0F;  ///< deg beyond ARM_TILT: on the ground it has tipped over
  /// m/s^2, and for 0.3 s (0.45 m of free fall): as PX4's LNDMC_FFALL_THR and LNDMC_FFALL_TTRI
  /// had it. Planned descents leave more than half the weight.
  static constexpr float kWeightless = 2.0F;
  static constexpr Micros kFallTime = 300'000;
  /// A motor's share with which four of them carry a quarter of the weight, Quad5in as UgglanQ450:
  /// 2.5 m/s^2 would be felt. With less the fall was asked for, by a stick pulled down.
  static constexpr float kCarries = 0.15F;
  /// m/s^2, 12 g. A touch-down at 3 m/s on a stiff leg stops in 5 cm: 9 g. The IMU has 30 g.
  static constexpr float kKnock = 118.0F;
  static constexpr Micros kKnockTime = 4'000;  ///< not one sample that was garbled
  /// A knock alone is no crash: garbled samples come in bursts, and who still flies can land. It
  /// is one when the aircraft tumbles, 45 deg, before it could have turned by itself.
  static constexpr float kCosTumbling = 0.70710678F;
  static constexpr Micros kTumbleTime = 500'000;
  static constexpr float kFenceBand = 0.5F;       ///< m inside the fence before it is inside
  static constexpr Micros kFenceTime = 200'000;   ///< a fix moves the estimate, then the next one
  static constexpr float kBatteryBand = 0.1F;     ///< V a cell: what it recovers with less load
  static constexpr Micros kRegained = 1'000'000;  ///< of good readings
  static constexpr std::uint32_t kOverruns = 25;  ///< of 500 ticks a second: one in twenty
  static constexpr std::uint32_t kClipped = 50;   ///< of 1000 samples a second
  static constexpr float kAtEnd = 0.005F;         ///< of a motor's range

  /// What each part of look() finds.
  static constexpr std::array<ConditionSet, 5> kParts{
      condition::kTiltLimit | condition::kMotorsSaturated,
      condition::kOutsideFence | condition::kFarOutsideFence,
      condition::kMagLost | condition::kAltLost | condition::kGpsLost,
      condition::kBatteryLow | condition::kBatteryCritical,
      condition::kLinkLost | condition::kOverrun | condition::kImuSaturated |
          condition::kLogFailed};

  /// What a timeout leaves after the sensor's own, after which it is not fresh.
  [[nodiscard]] static Micros rest(float timeout, Micros own) {
    const Micros whole = toMicros(timeout);
    return whole > own ? whole - own : 0;
  }

  /// The hazards of this part that are there.
  [[nodiscard]] ConditionSet look(const HazardSigns& s, Micros now, bool flying) {
    ConditionSet set = condition::kNone;
    const auto setIf = [&set](bool present, ConditionSet bit) {
      set |= present ? bit : condition::kNone;
    };
    switch (part_) {
      case 0: {
        const float limit = s.state == FlightState::Armed ? cosTipped_ : cosTiltLimit_;
        setIf(tilt_.update(now, s.motorsOn && !(s.cosTilt > limit)), condition::kTiltLimit);
        const bool atEnd = s.lowestMotor < kAtEnd || s.highestMotor > 1.0F - kAtEnd;
        setIf(motors_.update(now, flying && atEnd), condition::kMotorsSaturated);
        break;
      }
      case 1: {
        const float band = outside_.raised() ? -kFenceBand : 0.0F;
        setIf(outside_.update(now, beyondFence(s, band)), condition::kOutsideFence);
        setIf(farOutside_.update(now, beyondFence(s, fenceMargin_)), condition::kFarOutsideFence);
        break;
      }
      case 2: {
        setIf(mag_.update(now, !s.magFresh), condition::kMagLost);
        setIf(alt_.update(now, !s.altFresh), condition::kAltLost);
        const bool noGps = !gpsKnown_ || elapsed(now, gpsHeard_) >= gpsTimeout_;
        if (noGps) gpsKnown_ = false;  // or the clock comes round to the last fix again
        setIf(gps_.update(now, noGps), condition::kGpsLost);
        break;
      }
      case 3: {
        // 0 V: not known.
        const auto below = [&s](const Sign& sign, float volts) {
          return s.cellVoltage > 0.0F &&
                 s.cellVoltage < volts + (sign.raised() ? kBatteryBand : 0.0F);
        };
        setIf(low_.update(now, below(low_, batteryLow_)), condition::kBatteryLow);
        setIf(critical_.update(now, below(critical_, batteryCritical_)),
              condition::kBatteryCritical);
        break;
      }
      default:
        if (!s.linkFlies) linkHeard_ = now;  // its time begins with the flight
        setIf(elapsed(now, linkHeard_) >= linkTimeout_, condition::kLinkLost);
        setIf(overruns_.update(now, s.overruns), condition::kOverrun);
        setIf(clipping_.update(now, s.imuClipped), condition::kImuSaturated);
        setIf(s.logFailed, condition::kLogFailed);
    }
    return set;
  }

  /// @param margin  m beyond it
  [[nodiscard]] bool beyondFence(const HazardSigns& s, float margin) const {
    const float radius = fenceRadius_ + margin;
    const bool inside =
        s.north * s.north + s.east * s.east <= radius * radius && s.height <= fenceHeight_ + margin;
    return !inside;  // also when a number is none
  }

  float fenceRadius_ = 0.0F;      ///< m
  float fenceHeight_ = 0.0F;      ///< m
  float fenceMargin_ = 0.0F;      ///< m
  float cosTiltLimit_ = 0.0F;     ///< in flight
  float cosTipped_ = 0.0F;        ///< on the ground
  float batteryLow_ = 0.0F;       ///< V a cell
  float batteryCritical_ = 0.0F;  ///< V a cell
  Micros gpsTimeout_ = 0;
  Micros linkTimeout_ = 0;
  Micros gpsHeard_ = 0;
  Micros linkHeard_ = 0;
  Micros knockedAt_ = 0;
  bool gpsKnown_ = false;
  bool knocked_ = false;
  Sign tilt_;
  Sign outside_{kFenceTime, kFenceTime};
  Sign farOutside_{kFenceTime, kFenceTime};
  Sign mag_;
  Sign alt_;
  Sign gps_{0, kRegained};
  Sign low_;
  Sign critical_;
  Sign motors_;
  Sign freeFall_{kFallTime, kFallTime};
  Sign knock_{kKnockTime, 0};
  Bursts overruns_{kOverruns};
  Bursts clipping_{kClipped};
  PeriodicTask slow_{periodFromHz(50 * kParts.size())};
  std::size_t part_ = 0;
  ConditionSet slowSet_ = condition::kNone;  ///< of the last look
};

}  // namespace strix
