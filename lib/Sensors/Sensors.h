/// Rates, staleness and processing of the four sensors.
///
/// xUpdate(now) asks the board for a new reading when its period is up, getXMeas() is that reading
/// as it came, processXMeas() turns it into what the filter uses: body axes, SI, bias removed.
#pragma once

#include "Calibration.h"
#include "Geodesy.h"
#include "RawSamples.h"

namespace strix {

struct SensorConfig {
  Micros imuPeriod = periodFromHz(1000);
  Micros magPeriod = periodFromHz(100);
  Micros altPeriod = periodFromHz(50);
  Micros gpsPeriod = periodFromHz(10);

  // Longest silence before a sensor counts as lost.
  Micros imuTimeout = 20'000;
  Micros magTimeout = 500'000;
  Micros altTimeout = 500'000;
  Micros gpsTimeout = 1'000'000;

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

/// When one sensor is due and when it was last heard.
class SensorTiming {
 public:
  SensorTiming(Micros period, Micros timeout) : task_(period), timeout_(timeout) {}

  void start(Micros now) {
    task_.start(now);
    heard_ = now;
  }
  [[nodiscard]] bool due(Micros now) const { return task_.due(now); }
  void received(Micros now) {
    if (first_) {
      task_.postpone(now);  // a device has its own phase: the wait for its first word is no overrun
      first_ = false;
    } else {
      task_.done(now);
    }
    heard_ = now;
    lost_ = false;
  }
  /// Due, but the device gave nothing. Remembers a loss, so that a device long dead does not look
  /// fresh when the clock shows the hour of its last reading again, 71.6 min later.
  void missed(Micros now) { lost_ = lost_ || elapsed(now, heard_) > timeout_; }
  [[nodiscard]] bool fresh(Micros now) const { return !lost_ && elapsed(now, heard_) <= timeout_; }
  [[nodiscard]] std::uint32_t overruns() const { return task_.overruns(); }

 private:
  PeriodicTask task_;
  Micros timeout_;
  Micros heard_ = 0;
  bool first_ = true;
  bool lost_ = true;  ///< never heard, or silent for too long since
};

template <class Board>
class Sensors {
 public:
  Sensors(Board& board, const SensorConfig& config)
      : board_(board),
        config_(config),
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
  // with NaN or infinity is none: it is counted, and a device that gives no other is lost in time.
  [[nodiscard]] bool imuUpdate(Micros now) {
    return update(imuTiming_, now, [this] {
      return board_.readImu(imuRaw_) && sound(isFinite(imuRaw_.accel) && isFinite(imuRaw_.gyro));
    });
  }
  [[nodiscard]] bool magUpdate(Micros now) {
    return update(magTiming_, now,
                  [this] { return board_.readMag(magRaw_) && sound(isFinite(magRaw_.field)); });
  }
  [[nodiscard]] bool altUpdate(Micros now) {
    return update(altTiming_, now,
                  [this] { return board_.readAlt(altRaw_) && sound(isFinite(altRaw_.pressure)); });
  }
  [[nodiscard]] bool gpsUpdate(Micros now) {
    return update(gpsTiming_, now, [this] {
      return board_.readGps(gpsRaw_) &&
             sound(isFinite(gpsRaw_.speedKnots) && isFinite(gpsRaw_.courseDeg));
    });
  }

  [[nodiscard]] const ImuRaw& getIMUMeas() const { return imuRaw_; }
  [[nodiscard]] const MagRaw& getMagMeas() const { return magRaw_; }
  [[nodiscard]] const AltRaw& getAltMeas() const { return altRaw_; }
  [[nodiscard]] const GpsRaw& getGPSMeas() const { return gpsRaw_; }

  [[nodiscard]] ImuSample processIMUMeas(const ImuRaw& raw) const {
    return {raw.sampled, config_.imu.sensorToBody * (raw.accel - config_.imu.accelBias),
            config_.imu.sensorToBody * raw.gyro - gyroBias_};
  }

  /// @return field in body axes, uT
  [[nodiscard]] Vector3f processMagMeas(const MagRaw& raw) const {
    return config_.mag.sensorToBody * (config_.mag.softIron * (raw.field - config_.mag.hardIron));
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

  [[nodiscard]] static GeoPoint geoPoint(const GpsRaw& raw) {
    return {raw.latitude, raw.longitude, raw.altitude};
  }

  /// @param gyroBias  rad/s, body    @param groundPressure  Pa
  void setStartCalibration(const Vector3f& gyroBias, float groundPressure) {
    gyroBias_ = gyroBias;
    groundPressure_ = groundPressure;
  }
  void setOrigin(const GeoPoint& origin) { frame_ = LocalFrame(origin); }

  [[nodiscard]] const GeoPoint& origin() const { return frame_.origin(); }
  [[nodiscard]] bool imuFresh(Micros now) const { return imuTiming_.fresh(now); }
  [[nodiscard]] bool magFresh(Micros now) const { return magTiming_.fresh(now); }
  [[nodiscard]] bool altFresh(Micros now) const { return altTiming_.fresh(now); }
  [[nodiscard]] bool gpsFresh(Micros now) const { return gpsTiming_.fresh(now); }
  [[nodiscard]] std::uint32_t overruns() const {
    return imuTiming_.overruns() + magTiming_.overruns() + altTiming_.overruns() +
           gpsTiming_.overruns();
  }

  /// Readings with NaN or infinity since the start.
  [[nodiscard]] std::uint32_t invalid() const { return invalid_; }

 private:
  template <class Read>
  [[nodiscard]] static bool update(SensorTiming& timing, Micros now, Read&& read) {
    if (!timing.due(now)) return false;
    const bool isNew = read();
    isNew ? timing.received(now) : timing.missed(now);
    return isNew;
  }

  /// Counts a reading that is not.
  bool sound(bool isSound) {
    if (!isSound) ++invalid_;
    return isSound;
  }

  Board& board_;
  SensorConfig config_;
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
};

}  // namespace strix
