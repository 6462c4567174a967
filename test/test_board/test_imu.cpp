/// ImuIcm20649 on an ICM20649 of registers, over I2C with its data-ready wire, and the same driver
/// over SPI. What the driver itself does stands in test_sensors/test_icm20649.cpp.
#include <unity.h>

#include "../../src/board/ImuIcm20649.h"
#include "BoardRig.h"
#include "FakeIcm20649.h"
#include "SPI.h"
#include "suites.h"

namespace {

using strix::BoardRig;
using strix::FakeClock;
using strix::FakeIcm20649;
using strix::I2cBus;
using strix::ImuIcm20649;
using strix::ImuRaw;
using strix::nanosFromMicros;

/// The sensor on the machine's clock, and a byte at a time on either wire.
class ImuChip final : public strix::I2cChip, public strix::SpiPeer {
 public:
  ImuChip(strix::FakeTeensy& teensy, std::uint8_t dataReadyPin)
      : teensy_(teensy), pin_(dataReadyPin), started_(teensy.clock.now()) {
    watch();
  }

  FakeIcm20649 sensor;
  bool wireBroken = false;  ///< data-ready

  void powerUp() override {}
  std::uint8_t readRegister(std::uint8_t reg) override {
    run();
    std::uint8_t value = 0xFF;
    (void)sensor.read(reg, &value, 1);
    return value;
  }
  void writeRegister(std::uint8_t reg, std::uint8_t value) override {
    run();
    (void)sensor.write(reg, value);
  }

  void select() override { addressed_ = false; }
  std::uint8_t exchange(std::uint8_t sent) override {
    if (!addressed_) {
      addressed_ = true;
      register_ = sent;
      return 0xFF;
    }
    const std::uint8_t reg = register_ & 0x7FU;
    const bool reading = (register_ & 0x80U) != 0;
    ++register_;
    if (reading) return readRegister(reg);
    writeRegister(reg, sent);
    return 0xFF;
  }

 private:
  void run() {
    sensor.advance(static_cast<double>(teensy_.clock.now() - started_) / 1000.0 - sensor.now());
  }

  /// Looks for edges of data-ready each 10 us.
  void watch() {
    run();
    if (sensor.edges != seen_ && !wireBroken) teensy_.pulse(pin_);
    seen_ = sensor.edges;
    teensy_.clock.after(nanosFromMicros(10), [this] { watch(); });
  }

  strix::FakeTeensy& teensy_;
  std::uint8_t pin_;
  FakeClock::Nanos started_;
  std::uint32_t seen_ = 0;
  bool addressed_ = false;
  std::uint8_t register_ = 0;
};

struct ImuRig : BoardRig {
  ImuRig() {
    plainPlug.unplug();
    SPI = SPIClass();
  }

  ImuChip chip{teensy, strix::pins::kImuDataReady};
  strix::I2cTarget plug{imuWire(), chip, ImuIcm20649::kAddress};
  ImuIcm20649 imu{imuBus};

  struct Flight {
    std::uint32_t samples = 0;
    std::uint32_t longest = 0;  ///< us, of one call
    std::uint32_t oldest = 0;   ///< us, from the stamp to the reading
    ImuRaw last;
  };
  [[nodiscard]] Flight flyImu(std::uint32_t duration_ms, std::uint32_t pass_us = 100) {
    Flight flight;
    const strix::Nanos end = teensy.clock.now() + nanosFromMicros(1000ULL * duration_ms);
    while (teensy.clock.now() < end) {
      bool isNew = false;
      const std::uint32_t took = duration([&] { isNew = imu.read(flight.last); });
      flight.longest = std::max(flight.longest, took);
      if (isNew) {
        ++flight.samples;
        flight.oldest = std::max(flight.oldest, micros() - flight.last.sampled);
      }
      teensy.clock.advance(nanosFromMicros(pass_us));
    }
    return flight;
  }
};

void test_every_sample_is_read_once_and_stamped_by_its_interrupt() {
  ImuRig rig;
  TEST_ASSERT_TRUE(rig.imu.begin());
  (void)rig.flyImu(20);
  const std::uint64_t before = rig.chip.sensor.samples;
  const ImuRig::Flight flight = rig.flyImu(1000);
  TEST_ASSERT_UINT32_WITHIN(2, static_cast<std::uint32_t>(rig.chip.sensor.samples - before),
                            flight.samples);
  TEST_ASSERT_EQUAL_UINT32(0, rig.imu.polled());
  // A pass of 0.1 ms and the burst itself; the fake's edges are seen within 10 us.
  TEST_ASSERT_LESS_THAN_UINT32(520, flight.oldest);
  TEST_ASSERT_FLOAT_WITHIN(0.03F, -9.80665F, flight.last.accel.z());
}

void test_a_call_stays_within_its_stated_bound() {
  ImuRig rig;
  TEST_ASSERT_TRUE(rig.imu.begin());
  const ImuRig::Flight flight = rig.flyImu(100);
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(I2cBus::transferBound(17), flight.longest);
}

void test_with_its_data_ready_wire_broken_it_is_read_by_the_clock() {
  ImuRig rig;
  TEST_ASSERT_TRUE(rig.imu.begin());
  rig.chip.wireBroken = true;
  (void)rig.flyImu(20);
  const ImuRig::Flight flight = rig.flyImu(1000);
  TEST_ASSERT_GREATER_THAN_UINT32(900, flight.samples);
  TEST_ASSERT_GREATER_THAN_UINT32(900, rig.imu.polled());
}

void test_a_dead_imu_and_a_held_bus_cost_no_more_than_stated() {
  for (const bool held : {false, true}) {
    ImuRig rig;
    TEST_ASSERT_TRUE(rig.imu.begin());
    held ? rig.shortSda(rig.imuWire(), true) : rig.plug.unplug();
    const ImuRig::Flight flight = rig.flyImu(1000);
    TEST_ASSERT_EQUAL_UINT32(0, flight.samples);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(I2cBus::transferBound(17) + I2cBus::kFailureBound,
                                     flight.longest);
    rig.shortSda(rig.imuWire(), false);
    rig.plug.plug();
    (void)rig.flyImu(150);
    TEST_ASSERT_GREATER_THAN_UINT32(1000, rig.flyImu(1000).samples);
  }
}

void test_the_other_bus_held_costs_the_imu_nothing() {
  ImuRig rig;
  TEST_ASSERT_TRUE(rig.imu.begin());
  TEST_ASSERT_TRUE(rig.mag.begin());
  TEST_ASSERT_TRUE(rig.baro.begin());
  rig.shortSda(rig.slowWire(), true);
  (void)rig.fly(100);
  TEST_ASSERT_UINT32_WITHIN(3, 1125, rig.flyImu(1000).samples);
  TEST_ASSERT_EQUAL_UINT32(0, rig.imuBus.faults().held + rig.imuBus.faults().late);
}

// The stated bound of ImuIcm20649::begin.
void test_begin_ends_in_time_whenever_the_device_dies() {
  for (std::uint32_t after = 0; after < 120; ++after) {
    ImuRig rig;
    rig.plug.diesAfter = after;
    bool begun = true;
    const std::uint32_t took = rig.duration([&] { begun = rig.imu.begin(); });
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(370'000, took);
    if (begun) {
      TEST_ASSERT_GREATER_THAN_UINT32(20, after);
      return;
    }
  }
  TEST_FAIL_MESSAGE("never began");
}

void test_over_spi_a_burst_of_14_bytes_takes_less_than_25_us() {
  ImuRig rig;
  SPI.peer = &rig.chip;
  strix::SpiDevice device;
  device.begin();
  std::uint8_t identity = 0;
  TEST_ASSERT_TRUE(device.read(0, &identity, 1));
  TEST_ASSERT_EQUAL_HEX8(0xE1, identity);
  std::uint8_t burst[14] = {};
  TEST_ASSERT_LESS_THAN_UINT32(25, rig.duration([&] { (void)device.read(0x2D, burst, 14); }));
}

void test_the_driver_runs_over_spi() {
  ImuRig rig;
  SPI.peer = &rig.chip;
  strix::SpiDevice device;
  device.begin();
  strix::icm20649::Config config;
  config.spi = true;
  strix::ICM20649<strix::SpiDevice> driver(device, config);
  const auto wait = [](strix::Micros us) { delayMicroseconds(us); };
  TEST_ASSERT_TRUE(driver.begin(wait) == strix::icm20649::Setup::Ready);
  rig.teensy.clock.advance(nanosFromMicros(5000));
  ImuRaw out;
  TEST_ASSERT_TRUE(driver.read(out) == strix::icm20649::Reading::New);
  TEST_ASSERT_FLOAT_WITHIN(0.03F, -9.80665F, out.accel.z());

  SPI.peer = nullptr;  // unplugged: all ones, which no sensor measures
  TEST_ASSERT_FALSE(driver.read(out) == strix::icm20649::Reading::New);
}

}  // namespace

void runImuTests() {
  RUN_TEST(test_every_sample_is_read_once_and_stamped_by_its_interrupt);
  RUN_TEST(test_a_call_stays_within_its_stated_bound);
  RUN_TEST(test_with_its_data_ready_wire_broken_it_is_read_by_the_clock);
  RUN_TEST(test_a_dead_imu_and_a_held_bus_cost_no_more_than_stated);
  RUN_TEST(test_the_other_bus_held_costs_the_imu_nothing);
  RUN_TEST(test_begin_ends_in_time_whenever_the_device_dies);
  RUN_TEST(test_over_spi_a_burst_of_14_bytes_takes_less_than_25_us);
  RUN_TEST(test_the_driver_runs_over_spi);
}
