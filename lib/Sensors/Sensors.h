/// Rates, staleness and processing of the four sensors.
///
/// xUpdate(now) asks the board for a new reading from half its period on, getXMeas() is that
/// reading as it came, processXMeas() turns it into what the filter uses: body axes, SI, bias
/// removed.
#pragma once

#include <cmath>

#include "Geodesy.h"
#include "RawSamples.h"
#include "SensorCalibration.h"

namespace strix {

struct SensorConfig {
  // Of the devices. One that is slower, or faster by up to half, loses no reading by it.
  static constexpr Micros kMagPeriod = periodFromHz(100);
  static constexpr Micros kAltPeriod = periodFromHz(50);
  static constexpr Micros kGpsPeriod = periodFromHz(10);
  Micros imuPeriod = periodFromHz(1000);
  Micros magPeriod = kMagPeriod;
  Micros altPeriod = kAltPeriod;
  Micros gpsPeriod = kGpsPeriod;

  // Longest silence before a sensor counts as lost.
  Micros imuTimeout = 20'000;
  Micros magTimeout = 500'000;
  Micros altTimeout = 500'000;
  Micros gpsTimeout = 1'000'000;

  // Beyond what the sensor can measure a reading is none: it was garbled on its way.
  float accelRange = 32.0F * kGravity;      ///< m/s^2: 32767 counts of an ICM20649 at +-30 g
  float accelFullScale = 30.0F * kGravity;  ///< beyond it the data sheet promises nothing
  float gyroRange = 2000.0F * kDegToRad;    ///< rad/s
  // Nor can it be measured that a rigid body turns or is pushed otherwise from one sample to the
  // next: a bit was flipped on the bus. Ours: 3000 rad/s^2 is ten times what the rotors can.
  float gyroStep = 3.0F;               ///< rad/s
  float accelStep = 15.0F * kGravity;  ///< m/s^2
  float magRange = 5000.0F;            ///< uT: an LIS2MDL has +-4915
  float lowestPressure = 30'000.0F;    ///< Pa: a BMP390 has 300 to 1250 hPa
  float highestPressure = 125'000.0F;  ///< Pa

  ImuCalibration imu;
  MagCalibration mag;
  std::uint8_t gpsMinSatellites = 6;
  float gpsMaxHdop = 2.5F;
};

struct ImuSample {
  Micros sampled = 0;
  Vector3f accel = Vector3f::Zero();  ///< specific force, m/s^2, body
  Vector3f gyro = Vector3f::Zero();   ///< rad/s, body, start-up bias removed
};

struct GpsSample {
  Vector3f positionNed = Vector3f::Zero();  ///< m from the origin
  Vector3f velocityNed = Vector3f::Zero();  ///< m/s; down is 0, NMEA does not carry it
};

constexpr float kKnot = 0.514444F;  ///< m/s

/// When one sensor is due and when it was last heard. A sensor has a clock of its own: it is asked
/// from half a period after its last reading on, so that none waits for a task's
/// phase.
class SensorTiming {
 public:
  SensorTiming(Micros period, Micros timeout) : period_(period), timeout_(timeout) {}

  void start(Micros now) { heard_ = now; }
  [[nodiscard]] bool due(Micros now) const { return first_ || elapsed(now, heard_) >= period_ / 2; }
  /// @param sampled  when the sensor measured it
  void received(Micros now, Micros sampled) {
    const Micros gap = elapsed(sampled, sampled_);
    if (!first_ && gap > period_ + period_ / 2) missed_ += (gap + period_ / 2) / period_ - 1;
    first_ = lost_ = false;
    sampled_ = sampled;
    heard_ = now;
  }
  /// Due, but the device gave nothing. Remembers a loss, so that a device long dead does not look
  /// fresh when the clock shows the hour of its last reading again, 71.6 min later.
  void silent(Micros now) { lost_ = lost_ || elapsed(now, heard_) > timeout_; }
  [[nodiscard]] bool fresh(Micros now) const { return !lost_ && elapsed(now, heard_) <= timeout_; }
  /// Readings between two that were taken.
  [[nodiscard]] std::uint32_t missed() const { return missed_; }

 private:
  Micros period_;
  Micros timeout_;
  Micros heard_ = 0;
  Micros sampled_ = 0;
  std::uint32_t missed_ = 0;
  bool first_ = true;
  bool lost_ = true;  ///< never heard, or silent for too long since
};

template <class Board>
class Sensors {
 public:
  Sensors(Board& board, const SensorConfig& config)
      : board_(board),
        config_(config),
        accelToBody_(config.imu.sensorToBody * config.imu.accelScale),
        magToBody_(config.mag.sensorToBody * config.mag.softIron),
        imuTiming_(config.imuPeriod, config.imuTimeout),
        magTiming_(config.magPeriod, config.magTimeout),
        altTiming_(config.altPeriod, config.altTimeout),
        gpsTiming_(config.gpsPeriod, config.gpsTimeout) {}

  /// Aligns all phases with `now`.
  void start(Micros now) {
    imuTiming_.start(now);
    magTiming_.start(now);
    altTiming_.start(now);
    gpsTiming_.start(now);
  }

  /// True when the mounting matrices turn vectors and do nothing else.
  [[nodiscard]] bool mountingValid() const {
    return isMounting(config_.imu.sensorToBody, false) &&
           isMounting(config_.mag.sensorToBody, true);
  }

  // Each is true when a new reading was taken. A late device is asked again every pass. A reading
  // with NaN, infinity or more than the sensor's range is none: it is counted, and a device that
  // gives no other is lost in time.
  [[nodiscard]] bool imuUpdate(Micros now) {
    const bool isNew = update(imuTiming_, imuRaw_, now, [this] {
      ImuRaw raw;
      if (!board_.readImu(raw) || !sound(within(raw.accel, config_.accelRange) &&
                                         within(raw.gyro, config_.gyroRange) && follows(raw))) {
        return false;
      }
      imuRaw_ = raw;
      return true;
    });
    constexpr float kEnd = 0.999F;
    if (isNew && !(within(imuRaw_.accel, kEnd * config_.accelFullScale) &&
                   within(imuRaw_.gyro, kEnd * config_.gyroRange))) {
      ++clipped_;
    }
    return isNew;
  }
  [[nodiscard]] bool magUpdate(Micros now) {
    return update(magTiming_, magRaw_, now, [this] {
      return board_.readMag(magRaw_) && sound(within(magRaw_.field, config_.magRange));
    });
  }
  [[nodiscard]] bool altUpdate(Micros now) {
    return update(altTiming_, altRaw_, now, [this] {
      return board_.readAlt(altRaw_) && sound(altRaw_.pressure >= config_.lowestPressure &&
                                              altRaw_.pressure <= config_.highestPressure);
    });
  }
  [[nodiscard]] bool gpsUpdate(Micros now) {
    const GpsRaw last = gpsRaw_;
    const bool isNew = update(gpsTiming_, gpsRaw_, now, [this] {
      return board_.readGps(gpsRaw_) &&
             sound(isFinite(gpsRaw_.speedKnots) && isFinite(gpsRaw_.courseDeg));
    });
    if (isNew) gpsRepeats_ = saysTheSame(gpsRaw_, last) ? gpsRepeats_ + 1 : 0;
    return isNew;
  }

  [[nodiscard]] const ImuRaw& getIMUMeas() const { return imuRaw_; }
  [[nodiscard]] const MagRaw& getMagMeas() const { return magRaw_; }
  [[nodiscard]] const AltRaw& getAltMeas() const { return altRaw_; }
  [[nodiscard]] const GpsRaw& getGPSMeas() const { return gpsRaw_; }

  [[nodiscard]] ImuSample processIMUMeas(const ImuRaw& raw) const {
    return {raw.sampled, accelToBody_ * (raw.accel - config_.imu.accelBias),
            config_.imu.sensorToBody * raw.gyro - gyroBias_};
  }

  /// @param throttle  mean of the motors' commands, 0 to 1 (Motors::throttle)
  /// @return field in body axes, uT
  [[nodiscard]] Vector3f processMagMeas(const MagRaw& raw, float throttle) const {
    return magToBody_ * (raw.field - config_.mag.hardIron - throttle * config_.mag.perThrottle);
  }

  /// @return height above the ground of the start-up calibration, m
  [[nodiscard]] float processAltMeas(const AltRaw& raw) const {
    return heightFromPressure(raw.pressure, groundPressure_);
  }

  /// Course and speed to velocity; knots to m/s.
  [[nodiscard]] GpsSample processGPSMeas(const GpsRaw& raw) const {
    const SinCos course = sinCos(raw.courseDeg * kDegToRad);
    const float speed = raw.speedKnots * kKnot;
    return {frame_.toNed(geoPoint(raw)), {speed * course.cos, speed * course.sin, 0.0F}};
  }

  /// A fix good enough to navigate by.
  [[nodiscard]] bool gpsUsable(const GpsRaw& raw) const {
    return raw.fix >= 3 && raw.satellites >= config_.gpsMinSatellites &&
           raw.hdop <= config_.gpsMaxHdop && isOnEarth(geoPoint(raw));
  }

  /// A second of equal fixes: in the air nothing stands so still.
  [[nodiscard]] bool gpsStuck() const { return gpsRepeats_ >= kStuckFixes; }

  [[nodiscard]] static GeoPoint geoPoint(const GpsRaw& raw) {
    return {raw.latitude, raw.longitude, raw.altitude};
  }

  /// @param gyroBias  rad/s, body    @param groundPressure  Pa
  void setStartCalibration(const Vector3f& gyroBias, float groundPressure) {
    gyroBias_ = gyroBias;
    groundPressure_ = groundPressure;
  }
  [[nodiscard]] float groundPressure() const { return groundPressure_; }  ///< Pa
  void setOrigin(const GeoPoint& origin) { frame_ = LocalFrame(origin); }

  [[nodiscard]] const GeoPoint& origin() const { return frame_.origin(); }
  [[nodiscard]] bool imuFresh(Micros now) const { return imuTiming_.fresh(now); }
  [[nodiscard]] bool magFresh(Micros now) const { return magTiming_.fresh(now); }
  [[nodiscard]] bool altFresh(Micros now) const { return altTiming_.fresh(now); }
  [[nodiscard]] bool gpsFresh(Micros now) const { return gpsTiming_.fresh(now); }
  /// Readings of all sensors that were not taken.
  [[nodiscard]] std::uint32_t missed() const {
    return imuTiming_.missed() + magTiming_.missed() + altTiming_.missed() + gpsTiming_.missed();
  }

  /// IMU samples at the end of the range since the start: the truth was beyond.
  [[nodiscard]] std::uint32_t clipped() const { return clipped_; }
  /// Readings with NaN, infinity or more than the sensor's range since the start.
  [[nodiscard]] std::uint32_t invalid() const { return invalid_; }

 private:
  template <class Raw, class Read>
  [[nodiscard]] static bool update(SensorTiming& timing, const Raw& raw, Micros now, Read&& read) {
    if (!timing.due(now)) return false;
    const bool isNew = read();
    isNew ? timing.received(now, raw.sampled) : timing.silent(now);
    return isNew;
  }

  /// False also for NaN.
  [[nodiscard]] static bool within(const Vector3f& v, float range) {
    const auto inside = [range](float x) { return std::fabs(x) <= range; };
    return inside(v.x()) && inside(v.y()) && inside(v.z());
  }

  /// The motion goes on from the last sample, or that is too long ago: whoever differs for three
  /// samples in a row is right.
  [[nodiscard]] bool follows(const ImuRaw& raw) const {
    return (within(raw.gyro - imuRaw_.gyro, config_.gyroStep) &&
            within(raw.accel - imuRaw_.accel, config_.accelStep)) ||
           elapsed(raw.sampled, imuRaw_.sampled) > 3 * config_.imuPeriod + config_.imuPeriod / 2;
  }

  [[nodiscard]] static bool saysTheSame(const GpsRaw& a, const GpsRaw& b) {
    return a.latitude == b.latitude && a.longitude == b.longitude && a.altitude == b.altitude &&
           a.speedKnots == b.speedKnots && a.courseDeg == b.courseDeg;
  }

  /// Counts a reading that is not.
  bool sound(bool isSound) {
    if (!isSound) ++invalid_;
    return isSound;
  }

  static constexpr unsigned kStuckFixes = 10;

  Board& board_;
  SensorConfig config_;
  Matrix3f accelToBody_;
  Matrix3f magToBody_;
  SensorTiming imuTiming_;
  SensorTiming magTiming_;
  SensorTiming altTiming_;
  SensorTiming gpsTiming_;
  ImuRaw imuRaw_;
  MagRaw magRaw_;
  AltRaw altRaw_;
  GpsRaw gpsRaw_;
  Vector3f gyroBias_ = Vector3f::Zero();
  float groundPressure_ = 101325.0F;
  LocalFrame frame_;
  std::uint32_t invalid_ = 0;
  std::uint32_t clipped_ = 0;
  unsigned gpsRepeats_ = 0;
};

}  // namespace strix
