/// What goes wrong on the way to the sensors, by name: counted, said and logged.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "Time.h"

namespace strix {

/// Rows of sensor_faults.counts and bits of its flags.
enum class SensorFault : std::uint8_t {
  ImuSilent,       ///< transfers that failed
  ImuLate,         ///< samples read by the clock, without a data-ready edge
  ImuStuck,        ///< samples with the same bits as the one before
  ImuClipped,      ///< samples at the end of the range
  MagSilent,       ///< transfers that failed
  MagImplausible,  ///< readings at the end of the range
  MagStuck,        ///< readings with the same bits for long
  AltSilent,       ///< transfers that failed
  AltImplausible,  ///< pressures out of the sensor's range
  AltStuck,        ///< readings with the same bits for long
  GpsRejected,     ///< lines that are no sound sentence
  GpsLost,         ///< times that characters came faster than they were taken
  ImuBusHeld,      ///< transfers given up because of the lines
  ImuBusFreed,     ///< times the lines were clocked free
  SlowBusHeld,
  SlowBusFreed,
  Invalid,  ///< readings left out: NaN, or beyond the sensor's range
};

constexpr std::size_t kSensorFaultCount = 17;

/// What to tell the pilot, in the same order.
constexpr std::array<const char*, kSensorFaultCount> kSensorFaultTexts{
    "IMU does not answer: check its power and bus",
    "IMU's data-ready wire is silent: it is read by the clock",
    "IMU repeats one reading: it has stopped measuring",
    "IMU at the end of its range: vibration or a blow",
    "magnetometer does not answer: check its power and bus",
    "magnetometer gives a field out of its range",
    "magnetometer repeats one reading: it has stopped measuring",
    "altimeter does not answer: check its power and bus",
    "altimeter gives a pressure out of its range",
    "altimeter repeats one reading: it has stopped measuring",
    "GPS sends lines that are no sentences",
    "GPS characters lost: they came faster than they were taken",
    "IMU's bus is held low",
    "IMU's bus was held and is clocked free",
    "bus of magnetometer and altimeter is held low",
    "bus of magnetometer and altimeter was held and is clocked free",
    "a sensor gives what no sensor can: the reading is left out",
};

/// Counts since power-up.
class SensorFaultCounts {
 public:
  using Counts = std::array<std::uint32_t, kSensorFaultCount>;

  [[nodiscard]] std::uint32_t& operator[](SensorFault fault) {
    return counts_[static_cast<std::size_t>(fault)];
  }
  [[nodiscard]] const Counts& all() const { return counts_; }

 private:
  Counts counts_{};
};

/// Tells which faults are there: those whose count grew within the last second.
class SensorFaultWatch {
 public:
  static constexpr Micros kMemory = 1'000'000;

  /// To be called more often than once a second.
  /// @return bits of the faults that have just begun
  std::uint32_t update(Micros now, const SensorFaultCounts& counts) {
    const std::uint32_t before = flags_;
    for (std::size_t i = 0; i < kSensorFaultCount; ++i) {
      const std::uint32_t bit = 1U << i;
      if (counts.all()[i] != last_[i]) {
        last_[i] = counts.all()[i];
        grew_[i] = now;
        flags_ |= bit;
      } else if (elapsed(now, grew_[i]) > kMemory) {
        flags_ &= ~bit;
      }
    }
    return flags_ & ~before;
  }

  [[nodiscard]] std::uint32_t flags() const { return flags_; }

 private:
  SensorFaultCounts::Counts last_{};
  std::array<Micros, kSensorFaultCount> grew_{};
  std::uint32_t flags_ = 0;
};

}  // namespace strix
