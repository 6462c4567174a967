#include "MagLis2mdl.h"

namespace strix {

namespace {

constexpr std::uint8_t kIdentity = 0x40;
constexpr std::uint8_t kConfigA = 0x8C;  // temperature compensation, 100 Hz, continuous
constexpr std::uint8_t kBlockDataUpdate = 0x10;
constexpr std::uint8_t kNewData = 0x08;  // all three axes
constexpr float kScale = 0.15F;          // uT a count

/// uT on one axis: 15 times the Earth's field, a fifth of the sensor's range. Noise on the bus, all
/// 48 bits of it, passes this once in a hundred times; the estimator's own test comes behind it.
constexpr float kHighestField = 1000.0F;

constexpr float littleEndian(const std::uint8_t* bytes) {
  return static_cast<float>(static_cast<std::int16_t>(bytes[1] << 8 | bytes[0]));
}

Vector3f fieldOf(const std::array<std::uint8_t, 7>& burst) {
  return kScale *
         Vector3f(littleEndian(&burst[1]), littleEndian(&burst[3]), littleEndian(&burst[5]));
}

}  // namespace

bool MagLis2mdl::begin() {
  begun_ = false;
  if (!device_.holds(LIS2MDL_WHO_AM_I, kIdentity)) return false;
  const bool set = driver_.begin(kAddress, &device_.bus().wire());
  device_.bus().begin();
  lastReading_ = ::micros();
  begun_ = set && device_.holds(LIS2MDL_CFG_REG_A, kConfigA) &&
           device_.holds(LIS2MDL_CFG_REG_C, kBlockDataUpdate, kBlockDataUpdate);
  return begun_;
}

void MagLis2mdl::restart() {
  if (device_.write(LIS2MDL_CFG_REG_C, kBlockDataUpdate) &&
      device_.write(LIS2MDL_CFG_REG_A, kConfigA)) {
    ++restarts_;
  }
}

bool MagLis2mdl::due(Micros now) const {
  return arrived_ ||
         (elapsed(now, lastReading_) >= kPause && elapsed(now, lastPoll_) >= kPollPeriod);
}

bool MagLis2mdl::read(MagRaw& out) {
  const Micros now = ::micros();
  if (!begun_ || !due(now)) return false;
  lastPoll_ = now;
  if (silent_) {
    silent_ = false;
    lastReading_ = now;
    restart();
    return false;
  }
  Burst burst{};
  const bool read = device_.read(LIS2MDL_STATUS_REG, burst.data(), burst.size());
  const bool isNew = read && (arrived_ || (burst[0] & kNewData) != 0);
  burst[0] = 0;  // the status is no part of the reading
  // A measurement that ends behind the status byte is in these registers, perhaps not on all axes
  // yet, and its flag is gone with this reading: it is taken in the next pass.
  arrived_ = read && !isNew && burst != last_;
  if (!read || arrived_) return false;
  if (!isNew) {
    silent_ = elapsed(now, lastReading_) >= kSilence;
    return false;
  }
  lastReading_ = now;
  if (!isGood(burst)) return false;
  out.sampled = now;
  out.field = fieldOf(burst);
  return true;
}

bool MagLis2mdl::isGood(const Burst& burst) {
  repeated_ = burst == last_ ? repeated_ + 1 : 0;
  last_ = burst;
  if (repeated_ >= kStuckAfter) {
    ++stuck_;
    return false;
  }
  if (fieldOf(burst).cwiseAbs().maxCoeff() > kHighestField) {
    ++implausible_;
    return false;
  }
  return true;
}

}  // namespace strix
