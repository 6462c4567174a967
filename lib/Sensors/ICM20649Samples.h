/// What the ICM20649's bytes mean and whether they can be believed; and when samples were taken.
#pragma once

#include <array>
#include <cstring>

#include "ICM20649Registers.h"
#include "RawSamples.h"

namespace strix::icm20649 {

/// What one reading was.
enum class Reading : std::uint8_t {
  New,
  Repeated,  ///< the same 14 bytes as before: the same sample if nothing said that it is a new one
  Stuck,     ///< repeated so often that seven noisy numbers cannot have been measured
  Silent,    ///< the bus failed, or nobody drove it
  Implausible,  ///< no temperature this chip can have: the bytes are not a sample
};

/// Readings since the start, by what was wrong with them. Clipped ones are used all the same.
struct Faults {
  std::uint32_t silent = 0;
  std::uint32_t implausible = 0;
  std::uint32_t stuck = 0;
  std::uint32_t accelClipped = 0;
  std::uint32_t gyroClipped = 0;
  std::uint32_t fifoOverflows = 0;  ///< read too late: more than 32 samples were thrown away
  std::uint32_t fifoTorn = 0;       ///< no whole number of samples in it, three times running
};

/// Two's complement, high byte first.
[[nodiscard]] constexpr std::int16_t bigEndian(const std::uint8_t* bytes) {
  return static_cast<std::int16_t>(bytes[0] << 8 | bytes[1]);
}

/// Judges samples one after the other and converts them.
class SampleReader {
 public:
  explicit constexpr SampleReader(const Config& config) : config_(config) {}

  /// The next reading has none before it.
  void forget() {
    last_ = {};
    repeats_ = 0;
    temperatureKnown_ = false;
  }

  /// Judges and converts 14 bytes.
  [[nodiscard]] Reading take(const std::uint8_t* bytes, ImuRaw& out) {
    if (!isDriven(bytes)) {
      ++faults.silent;
      return Reading::Silent;
    }
    const std::int16_t temperature = bigEndian(bytes + 12);
    if (!temperatureIsPlausible(temperature)) {
      ++faults.implausible;
      return Reading::Implausible;
    }
    const bool same = std::memcmp(bytes, last_.data(), last_.size()) == 0;
    repeats_ = same ? repeats_ + 1 : 0;
    if (stuck()) {
      ++faults.stuck;
      return Reading::Stuck;
    }
    std::memcpy(last_.data(), bytes, last_.size());
    out.accel = config_.accelScale() * axes(bytes);
    out.gyro = config_.gyroScale() * axes(bytes + 6);
    out.temperature = static_cast<float>(temperature) * kTemperatureScale + kTemperatureZero;
    if (reaches(bytes, config_.accelClip())) ++faults.accelClipped;
    if (reaches(bytes + 6, Config::gyroClip())) ++faults.gyroClipped;
    return same ? Reading::Repeated : Reading::New;
  }

  /// The same bytes for so long that no sample is believed.
  [[nodiscard]] bool stuck() const { return repeats_ >= kStuckAfter; }

  Faults faults;

 private:
  // At rest one reading in a million repeats by chance with the widest filters; with the narrowest
  // the noise is below a count. Ten in a row are 9 ms.
  static constexpr std::uint32_t kStuckAfter = 10;

  // The range the chip survives; and the largest step from one reading to the next, 1.2 degC, by
  // which ArduPilot too knows bytes that are no sample: a random number passes once in 82 times.
  static constexpr float kLeastTemperature = -40.0F;
  static constexpr float kMostTemperature = 105.0F;
  static constexpr std::int32_t kTemperatureStep = 400;

  /// False for the bytes of a line that nobody drives: all ones, or all zeros.
  [[nodiscard]] static bool isDriven(const std::uint8_t* bytes) {
    if (bytes[0] != 0x00 && bytes[0] != 0xFF) return true;
    return std::memcmp(bytes, bytes + 1, kBurst - 1) != 0;
  }

  /// A step is taken once for a fault, then for the truth.
  [[nodiscard]] bool temperatureIsPlausible(std::int16_t counts) {
    const std::int32_t step = std::int32_t{counts} - temperature_;
    const bool near = !temperatureKnown_ || (step < kTemperatureStep && step > -kTemperatureStep);
    temperature_ = counts;
    temperatureKnown_ = true;
    const float degrees = static_cast<float>(counts) * kTemperatureScale + kTemperatureZero;
    return near && degrees >= kLeastTemperature && degrees <= kMostTemperature;
  }

  [[nodiscard]] static Vector3f axes(const std::uint8_t* bytes) {
    return {static_cast<float>(bigEndian(bytes)), static_cast<float>(bigEndian(bytes + 2)),
            static_cast<float>(bigEndian(bytes + 4))};
  }
  [[nodiscard]] static bool reaches(const std::uint8_t* bytes, std::int32_t limit) {
    const auto beyond = [limit](std::int32_t counts) {
      return counts >= limit || counts <= -limit;
    };
    return beyond(bigEndian(bytes)) || beyond(bigEndian(bytes + 2)) || beyond(bigEndian(bytes + 4));
  }

  Config config_;
  std::array<std::uint8_t, kBurst> last_{};
  std::uint32_t repeats_ = 0;
  std::int16_t temperature_ = 0;
  bool temperatureKnown_ = false;
};

/// What the data-ready pin has told.
struct DataReady {
  std::uint32_t count = 0;  ///< edges since the start
  Micros time = 0;          ///< of the newest
};

/// The sensor's own sample period, which is up to 1 % off, measured between its data-ready edges.
class SampleClock {
 public:
  explicit constexpr SampleClock(std::uint32_t nominalBy256)
      : nominal_(nominalBy256), period_(nominalBy256) {}

  void update(const DataReady& newest) {
    const std::uint32_t edges = newest.count - from_.count;
    if (!started_) {
      from_ = newest;
      started_ = true;
    } else if (edges >= kEdges) {
      const auto measured = static_cast<std::uint32_t>(
          std::uint64_t{elapsed(newest.time, from_.time)} * 256U / edges);
      // Further off, edges were lost in between.
      if (measured > nominal_ - nominal_ / 20 && measured < nominal_ + nominal_ / 20) {
        period_ = measured;
      }
      from_ = newest;
    }
  }

  /// So many sample periods, us, rounded.
  [[nodiscard]] constexpr Micros span(std::size_t samples) const {
    return static_cast<Micros>((std::uint64_t{period_} * samples + 128U) / 256U);
  }

 private:
  static constexpr std::uint32_t kEdges = 512;  // an edge's jitter of 5 us is 0.01 us of the period

  std::uint32_t nominal_;
  std::uint32_t period_;  // us/256
  DataReady from_;
  bool started_ = false;
};

}  // namespace strix::icm20649
