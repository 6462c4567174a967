#include "MagLis2mdl.h"

#include <array>

namespace strix {

namespace {

constexpr std::uint8_t kIdentity = 0x40;
constexpr std::uint8_t kConfigA = 0x8C;  // temperature compensation, 100 Hz, continuous
constexpr std::uint8_t kBlockDataUpdate = 0x10;
constexpr std::uint8_t kNewData = 0x08;  // all three axes
constexpr float kScale = 0.15F;          // uT a count

constexpr float littleEndian(const std::uint8_t* bytes) {
  return static_cast<float>(static_cast<std::int16_t>(bytes[1] << 8 | bytes[0]));
}

}  // namespace

bool MagLis2mdl::begin() {
  if (!device_.holds(LIS2MDL_WHO_AM_I, kIdentity)) return false;
  const bool begun = driver_.begin(kAddress, &device_.bus().wire());
  device_.bus().begin();
  return begun && device_.holds(LIS2MDL_CFG_REG_A, kConfigA) &&
         device_.holds(LIS2MDL_CFG_REG_C, kBlockDataUpdate, kBlockDataUpdate);
}

bool MagLis2mdl::read(MagRaw& out) {
  const Micros now = ::micros();
  if (elapsed(now, lastPoll_) < kPollPeriod) return false;
  lastPoll_ = now;
  std::array<std::uint8_t, 7> burst{};
  if (!device_.read(LIS2MDL_STATUS_REG, burst.data(), burst.size())) return false;
  if ((burst[0] & kNewData) == 0) return false;
  out.sampled = now;
  out.field =
      kScale * Vector3f(littleEndian(&burst[1]), littleEndian(&burst[3]), littleEndian(&burst[5]));
  return true;
}

}  // namespace strix
