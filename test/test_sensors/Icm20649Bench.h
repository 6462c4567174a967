/// An ICM20649 on a bench: the register model, the driver on it, and time that passes.
#pragma once

#include <unity.h>

#include <cstddef>

#include "FakeIcm20649.h"
#include "ICM20649.h"

namespace strix {

struct Icm20649Bench {
  explicit Icm20649Bench(const icm20649::Config& config = {}) : driver(chip, config) {}

  FakeIcm20649 chip;
  ICM20649<FakeIcm20649> driver;
  ImuRaw raw;

  icm20649::Setup begin() {
    return driver.begin([this](Micros us) { chip.advance(us); });
  }
  void start() { TEST_ASSERT_TRUE(begin() == icm20649::Setup::Ready); }
  icm20649::SelfTest selfTest() {
    return driver.selfTest([this](Micros us) { chip.advance(us); });
  }
  /// Waits for the next data-ready edge and reads.
  icm20649::Reading next() {
    const std::uint32_t before = chip.edges;
    for (int i = 0; i < 300'000 && chip.edges == before; i += 10) chip.advance(10.0);
    return driver.read(raw);
  }
  template <class F>
  void eachOf(int count, F&& f) {
    for (int i = 0; i < count; ++i) f(next());
  }
  std::size_t readFifo(ImuRaw* out, std::size_t most) {
    return driver.readFifo([this] { return icm20649::DataReady{chip.edges, chip.edgeTime}; }, out,
                           most);
  }
};

[[nodiscard]] inline icm20649::Config withFifo() {
  icm20649::Config config;
  config.fifo = true;
  return config;
}

}  // namespace strix
