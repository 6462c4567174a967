#include "ImuIcm20649.h"

#include <Adafruit_ICM20649.h>

namespace strix {

namespace {

// Registers that Adafruit's header leaves out.
constexpr std::uint8_t kPowerManagement2 = 0x07;

constexpr std::uint8_t kReset = 0x80;
constexpr std::uint8_t kAwakeBestClock = 0x01;

/// Range and low-pass filter in one configuration register; bit 0 puts the filter in the path.
constexpr std::uint8_t filtered(unsigned cutoff, unsigned range) {
  return static_cast<std::uint8_t>(cutoff << 3U | range << 1U | 1U);
}

struct Setting {
  std::uint8_t bank;
  std::uint8_t reg;
  std::uint8_t value;
};

// 30 g so that a racing frame's vibration does not clip; one count is 0.0096 m/s^2, a third of the
// noise. 2000 deg/s, one count 0.0011 rad/s. The filters give the bandwidth that DESIGN.md states
// the noise for. Data-ready comes last: from there on the pin talks.
constexpr Setting kSettings[] = {
    {0, ICM20X_B0_PWR_MGMT_1, kAwakeBestClock},
    {0, kPowerManagement2, 0x00},       // all six axes on
    {2, ICM20X_B2_GYRO_SMPLRT_DIV, 0},  // 1125 Hz / (1 + 0)
    {2, ICM20X_B2_GYRO_CONFIG_1, filtered(ICM20X_GYRO_FREQ_119_5_HZ, ICM20649_GYRO_RANGE_2000_DPS)},
    {2, ICM20X_B2_ACCEL_SMPLRT_DIV_1, 0},
    {2, ICM20X_B2_ACCEL_SMPLRT_DIV_2, 0},
    {2, ICM20X_B2_ACCEL_CONFIG_1, filtered(ICM20X_ACCEL_FREQ_111_4_HZ, ICM20649_ACCEL_RANGE_30_G)},
    {0, ICM20X_B0_REG_INT_PIN_CFG, 0x00},   // active high, push-pull, 50 us pulse
    {0, ICM20X_B0_REG_INT_ENABLE_1, 0x01},  // data ready on INT1
};

constexpr float kAccelScale = kGravity / 1024.0F;    // m/s^2 a count, at 30 g
constexpr float kGyroScale = kDegToRad / 16.4F;      // rad/s a count, at 2000 deg/s
constexpr float kTemperatureScale = 1.0F / 333.87F;  // degC a count
constexpr float kTemperatureZero = 21.0F;            // degC

constexpr float bigEndian(const std::uint8_t* bytes) {
  return static_cast<float>(static_cast<std::int16_t>(bytes[0] << 8 | bytes[1]));
}

}  // namespace

void ImuIcm20649::dataReady() {
  edgeTime = ::micros();
  edges = edges + 1;
}

bool ImuIcm20649::begin() {
  pinMode(pins::kImuDataReady, INPUT_PULLDOWN);
  if (!configure()) return false;
  seenEdges_ = edges;
  lastEdge_ = ::micros();
  attachInterrupt(pins::kImuDataReady, dataReady, RISING);
  return true;
}

bool ImuIcm20649::configure() {
  constexpr std::uint8_t kBank = ICM20X_B0_REG_BANK_SEL;
  if (!device_.write(kBank, 0) || !device_.holds(ICM20X_B0_WHOAMI, ICM20649_CHIP_ID)) return false;
  if (!device_.write(ICM20X_B0_PWR_MGMT_1, kReset)) return false;
  delay(100);  // the datasheet's start-up time
  if (!device_.holds(ICM20X_B0_PWR_MGMT_1, 0, kReset)) return false;
  for (const auto& [bank, reg, value] : kSettings) {
    const auto bankBits = static_cast<std::uint8_t>(bank << 4U);
    if (!device_.write(kBank, bankBits) || !device_.write(reg, value)) return false;
    if (reg == ICM20X_B0_PWR_MGMT_1 && bank == 0) delay(50);  // gyro start-up takes 35 ms
    if (!device_.holds(reg, value)) return false;
  }
  return device_.holds(kBank, 0);
}

bool ImuIcm20649::read(ImuRaw& out) {
  // An interrupt between the two reads would pair a count with the next sample's time.
  std::uint32_t count = 0;
  Micros sampled = 0;
  do {
    count = edges;
    sampled = edgeTime;
  } while (count != edges);

  const Micros now = ::micros();
  const bool edge = count != seenEdges_;
  if (edge) {
    seenEdges_ = count;
    lastEdge_ = now;
  } else if (elapsed(now, lastEdge_) >= kSilence && elapsed(now, lastPoll_) >= kPollPeriod) {
    lastPoll_ = now;
    sampled = now;
  } else {
    return false;
  }

  Burst burst{};
  if (!device_.read(ICM20X_B0_ACCEL_XOUT_H, burst.data(), burst.size())) return false;
  // Seven noisy numbers never repeat: the same bytes are the same sample, or a stuck sensor.
  if (burst == last_) return false;
  last_ = burst;
  if (!edge) ++polled_;

  out.sampled = sampled;
  out.accel =
      kAccelScale * Vector3f(bigEndian(&burst[0]), bigEndian(&burst[2]), bigEndian(&burst[4]));
  out.gyro =
      kGyroScale * Vector3f(bigEndian(&burst[6]), bigEndian(&burst[8]), bigEndian(&burst[10]));
  out.temperature = bigEndian(&burst[12]) * kTemperatureScale + kTemperatureZero;
  return true;
}

}  // namespace strix
