/// Register driver of the ICM20649 over any bus, I2C or SPI.
///
/// A Device is one chip on one bus, its transfers bounded by the bus:
///   bool read(uint8_t reg, uint8_t* data, size_t count);   false: nothing is known about data
///   bool write(uint8_t reg, uint8_t value);
/// The registers lie in four banks; the driver remembers which one is chosen and stays in bank 0
/// once it is set up, so a sample is one transfer of 14 bytes: 390 us on I2C, 18 us on SPI.
#pragma once

#include <array>

#include "ICM20649Samples.h"

namespace strix {

namespace icm20649 {

/// How begin() ended.
enum class Setup : std::uint8_t {
  Ready,
  NoAnswer,
  WrongIdentity,
  ResetUnfinished,
  SettingRefused,  ///< a register does not hold what was written to it
};

/// Response to self-test over the factory's, by axis; 0 where the factory left no value.
struct SelfTest {
  bool completed = false;  ///< the sensor answered to the end and has its settings again
  std::array<float, 3> gyro{};
  std::array<float, 3> accel{};

  /// InvenSense's criterion: gyro above 0.5, accelerometer 0.5 to 1.5.
  [[nodiscard]] bool passed() const {
    bool good = completed;
    for (const float ratio : gyro) good = good && ratio > 0.5F;
    for (const float ratio : accel) good = good && ratio > 0.5F && ratio < 1.5F;
    return good;
  }
};

/// Counts of the factory's self-test at 500 deg/s or 4 g: 1310 * 1.01^(code - 1). The sister with
/// half these ranges has 2620; InvenSense's driver for the ICM20649 has 1310.
[[nodiscard]] constexpr float selfTestCounts(std::uint8_t code) {
  float counts = 1310.0F;
  for (unsigned i = 1; i < code; ++i) counts *= 1.01F;
  return counts;
}

}  // namespace icm20649

template <class Device>
class ICM20649 {
 public:
  using Config = icm20649::Config;
  using Setup = icm20649::Setup;
  using Reading = icm20649::Reading;

  static constexpr std::size_t kFifoBatch = 8;  ///< most samples of one readFifo: 2.6 ms on I2C

  explicit constexpr ICM20649(Device& device, const Config& config = {})
      : device_(device), config_(config), samples_(config), clock_(config.periodBy256()) {}

  /// Identity, reset, settings; every setting is read back. Set-up only: it waits up to 0.35 s.
  /// @param wait  wait(us) returns when so much time has passed
  template <class Wait>
  [[nodiscard]] Setup begin(Wait&& wait) {
    bank_ = kUnknownBank;
    if (const Setup found = identify(wait); found != Setup::Ready) return found;
    if (!write(icm20649::kPowerManagement1, icm20649::kDeviceReset)) return Setup::NoAnswer;
    bank_ = kUnknownBank;
    if (!waitForReset(wait)) return Setup::ResetUnfinished;
    if (!apply({icm20649::kPowerManagement1, icm20649::kAwakeBestClock})) {
      return Setup::SettingRefused;
    }
    wait(kGyroStart);
    return configure(config_) ? Setup::Ready : Setup::SettingRefused;
  }

  /// One sample, if the sensor is not in FIFO mode. `out` is written if it is New or Repeated,
  /// all but its time stamp. One transfer of 14 bytes, no waiting.
  [[nodiscard]] Reading read(ImuRaw& out) {
    std::array<std::uint8_t, icm20649::kBurst> burst{};
    if (!read(icm20649::kAccelX, burst.data(), burst.size())) {
      ++samples_.faults.silent;
      return Reading::Silent;
    }
    return samples_.take(burst.data(), out);
  }

  /// The oldest samples of the FIFO, at most kFifoBatch, each with its time: that of the newest
  /// edge, less the sensor's own periods in between. To be called when the pin has told of a sample
  /// or has been silent too long. What goes wrong empties the FIFO (0.3 ms on I2C) and is counted.
  /// @param newestEdge  returns the DataReady of now; of a silent pin, with the time of now
  /// @return samples written to `out`
  template <class NewestEdge>
  [[nodiscard]] std::size_t readFifo(NewestEdge&& newestEdge, ImuRaw* out, std::size_t most) {
    if (!fifoRuns_ && !restartFifo()) return 0;
    icm20649::DataReady edge = newestEdge();
    std::size_t bytes = 0;
    if (!readFifoCount(bytes)) return 0;
    if (const icm20649::DataReady later = newestEdge(); later.count != edge.count) {
      // A sample came in between, before or after the count was taken. The next is far away.
      edge = later;
      if (!readFifoCount(bytes)) return 0;
    }
    clock_.update(edge);
    if (!fifoIsWhole(bytes)) return 0;
    const std::size_t available = bytes / icm20649::kBurst;
    const std::size_t count = smallest(available, most, kFifoBatch);
    std::array<std::uint8_t, kFifoBatch * icm20649::kBurst> data;
    if (count == 0) return 0;
    if (!read(icm20649::kFifoData, data.data(), count * icm20649::kBurst)) {
      ++samples_.faults.silent;
      fifoRuns_ = false;  // how much of a sample has left the FIFO is not known
      return 0;
    }
    std::size_t written = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Reading reading = samples_.take(&data[i * icm20649::kBurst], out[written]);
      if (reading == Reading::New || reading == Reading::Repeated) {
        out[written++].sampled = edge.time - clock_.span(available - 1 - i);
      } else if (reading != Reading::Stuck) {
        (void)restartFifo();
        break;
      }
    }
    return written;
  }

  /// Moves the sensor's masses electrically and compares with the factory's values. On the ground,
  /// at rest, motors off; takes 0.45 s and ends with the settings of begin().
  template <class Wait>
  [[nodiscard]] icm20649::SelfTest selfTest(Wait&& wait) {
    Config tested;
    tested.accelRange = icm20649::AccelRange::G4;
    tested.gyroRange = icm20649::GyroRange::Dps500;
    tested.accelFilter = icm20649::AccelFilter::Hz473;
    tested.gyroFilter = icm20649::GyroFilter::Hz197;
    tested.spi = config_.spi;
    std::array<std::uint8_t, 3> gyroCodes{};
    std::array<std::uint8_t, 3> accelCodes{};
    Means still{};
    Means moved{};
    icm20649::SelfTest result;
    const bool measured =
        read(icm20649::kSelfTestGyro, gyroCodes.data(), gyroCodes.size()) &&
        read(icm20649::kSelfTestAccel, accelCodes.data(), accelCodes.size()) && configure(tested) &&
        average(wait, still) && apply({icm20649::kGyroConfig2, icm20649::kGyroSelfTest}) &&
        apply({icm20649::kAccelConfig2, icm20649::kAccelSelfTest}) && average(wait, moved);
    result.completed = configure(config_) && measured;
    wait(kSettle);
    if (!measured) return result;
    for (std::size_t i = 0; i < 3; ++i) {
      result.accel[i] = ratio(moved[i] - still[i], accelCodes[i]);
      result.gyro[i] = ratio(moved[i + 3] - still[i + 3], gyroCodes[i]);
    }
    return result;
  }

  /// The same bytes for so long that no sample is believed.
  [[nodiscard]] bool stuck() const { return samples_.stuck(); }
  [[nodiscard]] const icm20649::Faults& faults() const { return samples_.faults; }
  [[nodiscard]] const Config& config() const { return config_; }

 private:
  struct Setting {
    icm20649::Register reg;
    std::uint8_t value;
  };
  using Means = std::array<float, 6>;  // accelerometer, gyro; counts

  static constexpr std::uint8_t kUnknownBank = 0xFF;
  static constexpr Micros kPowerUp = 100'000;     // until registers can be read, at most
  static constexpr Micros kResetPause = 100'000;  // InvenSense's drivers wait as long
  static constexpr Micros kResetLimit = 200'000;
  static constexpr Micros kLook = 10'000;
  static constexpr Micros kGyroStart = 50'000;  // 35 ms from sleep
  static constexpr Micros kSettle = 20'000;     // after a change of range, InvenSense's
  static constexpr int kSelfTestSamples = 200;  // InvenSense's
  static constexpr Micros kSelfTestPause = 1000;

  // ArduPilot found samples corrupt when more than 32 wait. Full is 512 bytes.
  static constexpr std::size_t kFifoMost = 32 * icm20649::kBurst;
  static constexpr std::uint32_t kTornLimit = 3;

  [[nodiscard]] static constexpr std::size_t smallest(std::size_t a, std::size_t b, std::size_t c) {
    const std::size_t least = a < b ? a : b;
    return least < c ? least : c;
  }
  [[nodiscard]] static constexpr float ratio(float response, std::uint8_t code) {
    return code == 0 ? 0.0F : response / icm20649::selfTestCounts(code);
  }

  [[nodiscard]] bool select(std::uint8_t bank) {
    if (bank == bank_) return true;
    bank_ = kUnknownBank;
    if (!device_.write(icm20649::kBankSelect, static_cast<std::uint8_t>(bank << 4U))) return false;
    bank_ = bank;
    return true;
  }
  [[nodiscard]] bool read(icm20649::Register reg, std::uint8_t* data, std::size_t count) {
    return select(reg.bank) && device_.read(reg.address, data, count);
  }
  [[nodiscard]] bool write(icm20649::Register reg, std::uint8_t value) {
    return select(reg.bank) && device_.write(reg.address, value);
  }
  /// Writes a setting and reads it back.
  [[nodiscard]] bool apply(const Setting& setting) {
    std::uint8_t found = 0;
    return write(setting.reg, setting.value) && read(setting.reg, &found, 1) &&
           found == setting.value;
  }

  template <class Wait>
  [[nodiscard]] Setup identify(Wait&& wait) {
    for (Micros waited = 0;; waited += kLook) {
      std::uint8_t identity = 0;
      const bool answered = read(icm20649::kWhoAmI, &identity, 1);
      if (answered && identity == icm20649::kIdentity) return Setup::Ready;
      if (waited >= kPowerUp) {
        const bool driven = answered && identity != 0x00 && identity != 0xFF;
        return driven ? Setup::WrongIdentity : Setup::NoAnswer;
      }
      wait(kLook);
    }
  }

  template <class Wait>
  [[nodiscard]] bool waitForReset(Wait&& wait) {
    wait(kResetPause);
    for (Micros waited = kResetPause;; waited += kLook) {
      std::uint8_t found = 0;
      const bool answered = read(icm20649::kPowerManagement1, &found, 1);
      if (answered && found == icm20649::kAfterReset) return true;
      if (waited >= kResetLimit) return false;
      wait(kLook);
    }
  }

  /// All settings but the clock; ends in bank 0. Data-ready comes last: from there on the pin
  /// talks.
  [[nodiscard]] bool configure(const Config& config) {
    using namespace icm20649;  // NOLINT(google-build-using-namespace): the table reads better
    const auto control = static_cast<std::uint8_t>((config.fifo ? kFifoOn : 0U) |  //
                                                   (config.spi ? kI2cOff : 0U));
    const Setting settings[] = {
        {kUserControl, control},
        {kPowerManagement2, 0x00},  // all six axes on
        {kFifoEnable2, 0x00},
        {kFifoMode, 0x00},      // the oldest sample gives way
        {kInterruptPin, 0x00},  // active high, push-pull, 50 us pulse
        {kGyroDivider, config.divider},
        {kGyroConfig1, filtered(config.gyroFilter, config.gyroRange)},
        {kGyroConfig2, 0x00},  // no self-test, no averaging
        {kAccelDivider1, 0x00},
        {kAccelDivider2, config.divider},
        {kAccelConfig, filtered(config.accelFilter, config.accelRange)},
        {kAccelConfig2, 0x00},
        {kInterruptEnable1, kDataReadyOnInt1},
    };
    samples_.forget();
    for (const Setting& setting : settings) {
      if (!apply(setting)) return false;
    }
    return !config.fifo || restartFifo();
  }

  template <class Wait>
  [[nodiscard]] bool average(Wait&& wait, Means& means) {
    wait(kSettle);
    std::array<std::int32_t, 6> sums{};
    for (int i = 0; i < kSelfTestSamples; ++i) {
      wait(kSelfTestPause);
      std::array<std::uint8_t, 12> burst{};
      if (!read(icm20649::kAccelX, burst.data(), burst.size())) return false;
      for (std::size_t axis = 0; axis < 6; ++axis) {
        sums[axis] += icm20649::bigEndian(&burst[2 * axis]);
      }
    }
    for (std::size_t axis = 0; axis < 6; ++axis) {
      means[axis] = static_cast<float>(sums[axis]) / static_cast<float>(kSelfTestSamples);
    }
    return true;
  }

  [[nodiscard]] bool readFifoCount(std::size_t& bytes) {
    std::array<std::uint8_t, 2> count{};
    if (!read(icm20649::kFifoCount, count.data(), count.size())) {
      ++samples_.faults.silent;
      return false;
    }
    bytes = static_cast<std::size_t>(count[0] << 8 | count[1]);
    return true;
  }

  /// False, for this time, with a part of a sample in it: the sensor may be about to write the
  /// rest. Three times running the part is what a loss left. Then, or with too many, it starts
  /// anew.
  [[nodiscard]] bool fifoIsWhole(std::size_t bytes) {
    torn_ = bytes % icm20649::kBurst != 0 ? torn_ + 1 : 0;
    if (bytes > kFifoMost) {
      ++samples_.faults.fifoOverflows;
    } else if (torn_ == kTornLimit) {
      ++samples_.faults.fifoTorn;
    } else {
      return torn_ == 0;
    }
    (void)restartFifo();
    return false;
  }

  /// Empties the FIFO between two samples: sources off, reset, sources on.
  [[nodiscard]] bool restartFifo() {
    torn_ = 0;
    fifoRuns_ =
        write(icm20649::kFifoEnable2, 0x00) && write(icm20649::kFifoReset, icm20649::kFifoAll) &&
        write(icm20649::kFifoReset, 0x00) && write(icm20649::kFifoEnable2, icm20649::kFifoAll);
    if (!fifoRuns_) ++samples_.faults.silent;
    return fifoRuns_;
  }

  Device& device_;
  Config config_;
  icm20649::SampleReader samples_;
  icm20649::SampleClock clock_;
  std::uint8_t bank_ = kUnknownBank;
  bool fifoRuns_ = false;
  std::uint32_t torn_ = 0;  // looks in a row
};

}  // namespace strix
