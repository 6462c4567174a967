/// The ICM20649's registers, its ranges and filters, and what a count means.
///
/// Datasheets: ICM-20649 (TDK DS-000192) and its sister's, ICM-20948 (DS-000189), which has the
/// same map and half the ranges. Only parts of the second were at hand; each address, bit, scale
/// and bandwidth was compared with the drivers of InvenSense, PX4, ArduPilot and Adafruit for the
/// ICM20649, or with SparkFun's for the sister.
#pragma once

#include "Mathpk.h"

namespace strix::icm20649 {

struct Register {
  std::uint8_t bank;
  std::uint8_t address;
};

constexpr std::uint8_t kBankSelect = 0x7F;  ///< in every bank; the bank stands in bits 5:4

constexpr Register kWhoAmI{0, 0x00};
constexpr Register kUserControl{0, 0x03};
constexpr Register kPowerManagement1{0, 0x06};
constexpr Register kPowerManagement2{0, 0x07};
constexpr Register kInterruptPin{0, 0x0F};
constexpr Register kInterruptEnable1{0, 0x11};
constexpr Register kAccelX{0, 0x2D};  ///< accelerometer, gyro, temperature: 14 bytes, high first
constexpr Register kFifoEnable2{0, 0x67};
constexpr Register kFifoReset{0, 0x68};
constexpr Register kFifoMode{0, 0x69};
constexpr Register kFifoCount{0, 0x70};  ///< bytes, two registers, high first
constexpr Register kFifoData{0, 0x72};
constexpr Register kSelfTestGyro{1, 0x02};   ///< factory codes of x, y, z
constexpr Register kSelfTestAccel{1, 0x0E};  ///< factory codes of x, y, z
constexpr Register kGyroDivider{2, 0x00};
constexpr Register kGyroConfig1{2, 0x01};
constexpr Register kGyroConfig2{2, 0x02};
constexpr Register kAccelDivider1{2, 0x10};  ///< high 4 bits of 12
constexpr Register kAccelDivider2{2, 0x11};
constexpr Register kAccelConfig{2, 0x14};
constexpr Register kAccelConfig2{2, 0x15};

constexpr std::uint8_t kIdentity = 0xE1;

constexpr std::uint8_t kDeviceReset = 0x80;      ///< in power management 1; clears itself
constexpr std::uint8_t kAfterReset = 0x41;       ///< power management 1: asleep, best clock
constexpr std::uint8_t kAwakeBestClock = 0x01;   ///< the gyro's PLL when it runs
constexpr std::uint8_t kFifoOn = 0x40;           ///< in user control
constexpr std::uint8_t kI2cOff = 0x10;           ///< in user control: noise on SPI is no start bit
constexpr std::uint8_t kDataReadyOnInt1 = 0x01;  ///< in interrupt enable 1
constexpr std::uint8_t kFifoAll = 0x1F;          ///< in FIFO enable 2, and all of FIFO reset
constexpr std::uint8_t kGyroSelfTest = 0x38;     ///< in gyro config 2, all axes
constexpr std::uint8_t kAccelSelfTest = 0x1C;    ///< in accelerometer config 2, all axes

constexpr std::size_t kBurst = 14;  ///< bytes of a sample, in its registers and in the FIFO

enum class AccelRange : std::uint8_t { G4, G8, G16, G30 };
enum class GyroRange : std::uint8_t { Dps500, Dps1000, Dps2000, Dps4000 };

/// Low-pass filters by their 3 dB bandwidth. In the comments: 3 dB and noise bandwidth, Hz.
/// The value 0 of the accelerometer is Hz246 again. Without a filter the data come at 9 and 4.5 kHz
/// whatever the divider: no setting for this loop.
enum class AccelFilter : std::uint8_t {
  Hz246 = 1,  ///< 246.0, 265.0
  Hz111 = 2,  ///< 111.4, 136.0
  Hz50 = 3,   ///< 50.4, 68.8
  Hz24 = 4,   ///< 23.9, 34.4
  Hz12 = 5,   ///< 11.5, 17.0
  Hz6 = 6,    ///< 5.7, 8.3
  Hz473 = 7,  ///< 473, 499
};
enum class GyroFilter : std::uint8_t {
  Hz197 = 0,  ///< 196.6, 229.8
  Hz152 = 1,  ///< 151.8, 187.6
  Hz120 = 2,  ///< 119.5, 154.3
  Hz51 = 3,   ///< 51.2, 73.3
  Hz24 = 4,   ///< 23.9, 35.9
  Hz12 = 5,   ///< 11.6, 17.8
  Hz6 = 6,    ///< 5.7, 8.9
  Hz361 = 7,  ///< 361.4, 376.5
};

/// Counts a g. The widest range is 32 g by its scale and specified to 30 g, 30720 counts.
[[nodiscard]] constexpr float countsPerG(AccelRange range) {
  return 8192.0F / static_cast<float>(1U << static_cast<unsigned>(range));
}

/// Counts a deg/s: the datasheet's, in place of 32768/500 = 65.54 and so on.
[[nodiscard]] constexpr float countsPerDps(GyroRange range) {
  constexpr float kCounts[] = {65.5F, 32.8F, 16.4F, 8.2F};
  return kCounts[static_cast<unsigned>(range)];
}

/// Range and filter in one configuration register; bit 0 puts the filter in the path.
template <class Filter, class Range>
[[nodiscard]] constexpr std::uint8_t filtered(Filter filter, Range range) {
  return static_cast<std::uint8_t>(static_cast<unsigned>(filter) << 3U |
                                   static_cast<unsigned>(range) << 1U | 1U);
}

/// What is chosen for a sensor. The defaults are the aircraft's: 30 g so that a racing frame's
/// vibration does not clip (one count is 0.0096 m/s^2, a third of the noise), 2000 deg/s (one count
/// is 0.0011 rad/s), and the bandwidths that DESIGN.md states the noise for.
struct Config {
  AccelRange accelRange = AccelRange::G30;
  GyroRange gyroRange = GyroRange::Dps2000;
  AccelFilter accelFilter = AccelFilter::Hz111;
  GyroFilter gyroFilter = GyroFilter::Hz120;
  std::uint8_t divider = 0;  ///< 1125 / (1 + divider) samples a second, of both sensors
  bool spi = false;          ///< wired to SPI: the I2C slave is switched off
  bool fifo = false;         ///< samples are read with readFifo, not with read

  /// Between two samples, in 1/256 us: 888.89 us and its multiples.
  [[nodiscard]] constexpr std::uint32_t periodBy256() const {
    return (1U + divider) * 2'048'000U / 9U;
  }
  /// Between two samples, us, rounded down: a task with this period leaves no sample out.
  [[nodiscard]] constexpr Micros period() const { return periodBy256() / 256U; }
  /// m/s^2 a count
  [[nodiscard]] constexpr float accelScale() const { return kGravity / countsPerG(accelRange); }
  /// rad/s a count
  [[nodiscard]] constexpr float gyroScale() const { return kDegToRad / countsPerDps(gyroRange); }
  /// Counts from which on an axis has hit its range: 98 % of it, as the range's end differs a
  /// little from part to part (ArduPilot: 29.5 of 30 g).
  [[nodiscard]] constexpr std::int32_t accelClip() const {
    return accelRange == AccelRange::G30 ? 30'105 : kFullScaleClip;
  }
  [[nodiscard]] static constexpr std::int32_t gyroClip() { return kFullScaleClip; }

 private:
  static constexpr std::int32_t kFullScaleClip = 32'112;  // 98 % of 32768
};

constexpr float kTemperatureScale = 1.0F / 333.87F;  ///< degC a count
constexpr float kTemperatureZero = 21.0F;            ///< degC at count 0

/// Time of `count` registers read at once on the wire, us: 400 kHz, nine bits a byte; two
/// addresses, the register, and start, repeated start and stop.
[[nodiscard]] constexpr Micros i2cTime(std::size_t count) {
  return static_cast<Micros>((count + 3) * 9 + 3) * 5U / 2U;
}
/// The same at 7 MHz on SPI: eight bits a byte, one for the register. Rounded up.
[[nodiscard]] constexpr Micros spiTime(std::size_t count) {
  return (static_cast<Micros>(count + 1) * 8U + 6U) / 7U;
}
static_assert(i2cTime(kBurst) == 390 && spiTime(kBurst) == 18, "issue 6: 450 us and 25 us");

}  // namespace strix::icm20649
