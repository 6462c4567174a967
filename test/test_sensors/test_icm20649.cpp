// The ICM20649's driver against a register model: that it starts the right chip with the right
// settings and no other, what it measures, what that costs on the wire, and the self-test.
#include <unity.h>

#include <cmath>
#include <cstdint>

#include "AssertNear.h"
#include "Icm20649Bench.h"
#include "suites.h"

using namespace strix;
using icm20649::AccelFilter;
using icm20649::AccelRange;
using icm20649::Config;
using icm20649::GyroFilter;
using icm20649::GyroRange;
using icm20649::Reading;
using icm20649::Setup;
using Bench = Icm20649Bench;

namespace {

constexpr double kMostSetUp = 360'000.0;  // us; the driver states 0.35 s, and transfers

// ---- Set-up -------------------------------------------------------------------------------------

void test_another_chip_at_the_address_is_refused_and_left_as_it_is() {
  Bench bench;
  bench.chip.identity = 0xEA;  // the ICM20948: same registers, half the ranges
  TEST_ASSERT_TRUE(bench.begin() == Setup::WrongIdentity);
  for (const auto& transfer : bench.chip.transfers) {
    TEST_ASSERT_TRUE(!transfer.write || transfer.reg == 0x7F);
  }
}

void test_a_missing_chip_is_told_from_a_wrong_one_on_both_buses() {
  Bench i2c;
  i2c.chip.absent = true;
  TEST_ASSERT_TRUE(i2c.begin() == Setup::NoAnswer);
  Bench spi;
  spi.chip.undriven = true;
  TEST_ASSERT_TRUE(spi.begin() == Setup::NoAnswer);
  TEST_ASSERT_TRUE(i2c.chip.now() < kMostSetUp && spi.chip.now() < kMostSetUp);
}

void test_a_chip_that_needs_its_whole_power_up_time_is_found() {
  Bench bench;
  bench.chip.absent = true;
  const auto setup = bench.driver.begin([&](Micros us) {
    bench.chip.advance(us);
    bench.chip.absent = bench.chip.now() < 95'000.0;
  });
  TEST_ASSERT_TRUE(setup == Setup::Ready);
}

void test_a_reset_without_end_does_not_hold_up_the_start() {
  Bench bench;
  bench.chip.resetNeverEnds = true;
  TEST_ASSERT_TRUE(bench.begin() == Setup::ResetUnfinished);
  TEST_ASSERT_TRUE(bench.chip.now() < kMostSetUp);
}

void test_any_register_that_does_not_take_its_value_fails_the_start() {
  // Those whose value differs from the chip's own after reset, as the others cannot be told.
  Config config = withFifo();
  config.divider = 4;
  config.spi = true;
  const std::pair<unsigned, unsigned> registers[] = {
      {0, 0x03}, {0, 0x06}, {0, 0x11}, {2, 0x00}, {2, 0x01}, {2, 0x11}, {2, 0x14},
  };
  for (const auto& reg : registers) {
    Bench bench(config);
    bench.chip.refuses = reg;
    TEST_ASSERT_TRUE(bench.begin() != Setup::Ready);
  }
}

void test_a_start_cut_off_at_any_transfer_fails_and_the_next_one_succeeds() {
  Bench whole;
  whole.start();
  for (std::size_t i = 0; i < whole.chip.transfers.size(); ++i) {
    Bench bench;
    bench.chip.cut = {i, SIZE_MAX};
    TEST_ASSERT_TRUE(bench.begin() != Setup::Ready);
    TEST_ASSERT_TRUE(bench.chip.now() < kMostSetUp);
    bench.chip.cut = {};
    bench.start();
    TEST_ASSERT_TRUE(bench.next() == Reading::New);
    TEST_ASSERT_FLOAT_WITHIN(0.05F, -9.807F, bench.raw.accel.z());
  }
}

void test_each_filter_sets_the_bits_of_the_data_sheet() {
  // DLPFCFG in bits 5:3, the range in 2:1, bit 0 switches the filter on.
  const std::pair<GyroFilter, unsigned> gyro[] = {
      {GyroFilter::Hz197, 0}, {GyroFilter::Hz152, 1}, {GyroFilter::Hz120, 2},
      {GyroFilter::Hz51, 3},  {GyroFilter::Hz24, 4},  {GyroFilter::Hz12, 5},
      {GyroFilter::Hz6, 6},   {GyroFilter::Hz361, 7},
  };
  for (const auto& [filter, code] : gyro) {
    Config config;
    config.gyroFilter = filter;
    Bench bench(config);
    bench.start();
    TEST_ASSERT_EQUAL_HEX8(code << 3U | 2U << 1U | 1U, bench.chip.registerValue(2, 0x01));
  }
  const std::pair<AccelFilter, unsigned> accel[] = {
      {AccelFilter::Hz246, 1}, {AccelFilter::Hz111, 2}, {AccelFilter::Hz50, 3},
      {AccelFilter::Hz24, 4},  {AccelFilter::Hz12, 5},  {AccelFilter::Hz6, 6},
      {AccelFilter::Hz473, 7},
  };
  for (const auto& [filter, code] : accel) {
    Config config;
    config.accelFilter = filter;
    Bench bench(config);
    bench.start();
    TEST_ASSERT_EQUAL_HEX8(code << 3U | 3U << 1U | 1U, bench.chip.registerValue(2, 0x14));
  }
}

void test_the_i2c_slave_is_off_on_spi_and_only_there() {
  Config config;
  config.spi = true;
  Bench spi(config);
  spi.start();
  TEST_ASSERT_EQUAL_HEX8(0x10, spi.chip.registerValue(0, 0x03));
  Bench i2c;
  i2c.start();
  TEST_ASSERT_EQUAL_HEX8(0x00, i2c.chip.registerValue(0, 0x03));
}

// ---- Samples ------------------------------------------------------------------------------------

void test_in_every_range_force_and_rate_come_out_as_they_went_in() {
  const std::pair<AccelRange, double> accelRanges[] = {{AccelRange::G4, 4.0},
                                                       {AccelRange::G8, 8.0},
                                                       {AccelRange::G16, 16.0},
                                                       {AccelRange::G30, 30.0}};
  const std::pair<GyroRange, double> gyroRanges[] = {{GyroRange::Dps500, 500.0},
                                                     {GyroRange::Dps1000, 1000.0},
                                                     {GyroRange::Dps2000, 2000.0},
                                                     {GyroRange::Dps4000, 4000.0}};
  for (const auto& [accelRange, g] : accelRanges) {
    for (const auto& [gyroRange, dps] : gyroRanges) {
      Config config;
      config.accelRange = accelRange;
      config.gyroRange = gyroRange;
      Bench bench(config);
      bench.chip.noise = 0.0;
      const double force = g * 9.80665;
      const double rate = dps * 3.14159265358979 / 180.0;
      bench.chip.accel = {0.9 * force, -0.5 * force, 0.1 * force};
      bench.chip.gyro = {-0.9 * rate, 0.5 * rate, 0.1 * rate};
      bench.chip.temperature = 38.5;
      bench.start();
      TEST_ASSERT_TRUE(bench.next() == Reading::New);
      // Half a count, of 32768/(range) counts, and a float's rounding.
      assertNear(static_cast<float>(force / 55'000.0),
                 Eigen::Vector3d(0.9 * force, -0.5 * force, 0.1 * force).cast<float>(),
                 bench.raw.accel);
      assertNear(static_cast<float>(rate / 55'000.0),
                 Eigen::Vector3d(-0.9 * rate, 0.5 * rate, 0.1 * rate).cast<float>(),
                 bench.raw.gyro);
      TEST_ASSERT_FLOAT_WITHIN(0.002F, 38.5F, bench.raw.temperature);  // half of 1/334 degC
      TEST_ASSERT_EQUAL_UINT32(0, bench.driver.faults().accelClipped);
      TEST_ASSERT_EQUAL_UINT32(0, bench.driver.faults().gyroClipped);
    }
  }
}

void test_the_stated_period_is_the_chips_and_leaves_no_sample_out() {
  static_assert(Config{}.period() == 888);  // 1125 Hz is 888.9 us
  for (const int divider : {0, 1, 4, 10, 255}) {
    Config config;
    config.divider = static_cast<std::uint8_t>(divider);
    Bench bench(config);
    bench.start();
    const std::uint64_t before = bench.chip.samples;
    bench.chip.advance(100.0 * 888.889 * (1 + divider) + 1.0);
    TEST_ASSERT_EQUAL_UINT32(100, bench.chip.samples - before);
    const double real = 1e6 / 1125.0 * (1 + divider);
    TEST_ASSERT_TRUE(config.period() <= real && config.period() > real - 1.0);
  }
}

void test_a_sample_is_one_transfer_of_14_bytes_within_its_time_on_the_wire() {
  Bench bench;
  bench.start();
  bench.chip.transfers.clear();
  bench.eachOf(1000, [](Reading reading) { TEST_ASSERT_TRUE(reading == Reading::New); });
  TEST_ASSERT_EQUAL_UINT32(1000, bench.chip.transfers.size());
  for (const auto& transfer : bench.chip.transfers) {
    TEST_ASSERT_FALSE(transfer.write);
    TEST_ASSERT_EQUAL_UINT32(0, transfer.bank);
    TEST_ASSERT_EQUAL_HEX32(0x2D, transfer.reg);
    TEST_ASSERT_EQUAL_UINT32(14, transfer.count);
  }
  // Address, register, address again and data, nine bits each, with start, repeated start and stop;
  // on SPI the register and the data, eight bits each.
  const double i2c = ((3 + 14) * 9 + 3) / 0.4;
  const double spi = (1 + 14) * 8 / 7.0;
  TEST_ASSERT_TRUE(i2c < 450.0 && spi < 25.0);
  TEST_ASSERT_DOUBLE_WITHIN(0.5, i2c, icm20649::i2cTime(14));
  TEST_ASSERT_DOUBLE_WITHIN(1.0, spi, icm20649::spiTime(14));
}

void test_the_start_switches_banks_no_more_than_four_times() {
  Bench bench;
  bench.start();
  int switches = 0;
  for (const auto& transfer : bench.chip.transfers) switches += transfer.reg == 0x7F ? 1 : 0;
  // To be sure of bank 0, again after the reset, to bank 2 and back.
  TEST_ASSERT_EQUAL_INT(4, switches);
  TEST_ASSERT_EQUAL_UINT32(0, bench.chip.bank());
}

// ---- Self-test ----------------------------------------------------------------------------------

void test_a_sound_chip_passes_its_self_test_and_has_its_settings_again() {
  Bench bench;
  bench.start();
  const double before = bench.chip.now();
  const auto result = bench.selfTest();
  TEST_ASSERT_TRUE(result.passed());
  for (std::size_t i = 0; i < 3; ++i) {
    // The mean of 200 counts that jump by 1.5, of 3200 and more.
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, 1.0F, result.gyro[i]);
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, 1.0F, result.accel[i]);
  }
  TEST_ASSERT_TRUE(bench.chip.now() - before < 500'000.0);
  TEST_ASSERT_EQUAL_HEX8(0x00, bench.chip.registerValue(2, 0x02));
  TEST_ASSERT_EQUAL_HEX8(0x00, bench.chip.registerValue(2, 0x15));
  TEST_ASSERT_TRUE(bench.next() == Reading::New);
  TEST_ASSERT_FLOAT_WITHIN(0.05F, -9.807F, bench.raw.accel.z());
}

void test_one_weak_axis_fails_the_self_test() {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Bench gyro;
    gyro.start();
    gyro.chip.gyroSelfTest[axis] = 0.45;
    TEST_ASSERT_FALSE(gyro.selfTest().passed());
    gyro.chip.gyroSelfTest[axis] = 1.8;  // no upper limit for a gyro
    TEST_ASSERT_TRUE(gyro.selfTest().passed());
    Bench accel;
    accel.start();
    for (const double ratio : {0.0, 0.45, 1.55, -1.0}) {
      accel.chip.accelSelfTest[axis] = ratio;
      TEST_ASSERT_FALSE(accel.selfTest().passed());
    }
    accel.chip.accelSelfTest[axis] = 1.45;
    TEST_ASSERT_TRUE(accel.selfTest().passed());
  }
}

void test_without_a_factory_value_nothing_is_passed() {
  Bench bench;
  bench.chip.gyroCodes[1] = 0;
  bench.start();
  TEST_ASSERT_FALSE(bench.selfTest().passed());
}

void test_a_chip_lost_in_the_self_test_has_not_completed_it() {
  Bench bench;
  bench.start();
  bench.chip.diesAt = bench.chip.now() + 300'000.0;
  const auto result = bench.selfTest();
  TEST_ASSERT_FALSE(result.completed);
  TEST_ASSERT_FALSE(result.passed());
}

void test_one_failed_transfer_in_the_self_test_confuses_no_bank() {
  constexpr std::size_t kSettingsAgain = 13 * 2 + 3;  // its end: written, read, and bank switches
  Bench whole;
  whole.start();
  const std::size_t start = whole.chip.transfers.size();
  (void)whole.selfTest();
  const std::size_t end = whole.chip.transfers.size() - kSettingsAgain;
  for (std::size_t i = 2 * start; i < 2 * end; ++i) {
    Bench bench;
    bench.start();
    bench.chip.cut = {i / 2, i / 2 + 1};
    bench.chip.cutLate = i % 2 != 0;
    TEST_ASSERT_FALSE(bench.selfTest().completed);
    // The failure is followed by the settings of the flight, bank by bank.
    for (unsigned bank = 0; bank < 4; ++bank) {
      for (unsigned reg = 0; reg < 128; ++reg) {
        if (bank == 0 && reg >= 0x2D && reg <= 0x3A) continue;  // the sample
        TEST_ASSERT_EQUAL_HEX8(whole.chip.registerValue(bank, reg),
                               bench.chip.registerValue(bank, reg));
      }
    }
    TEST_ASSERT_TRUE(bench.next() == Reading::New);
    TEST_ASSERT_EQUAL_UINT32(0, bench.chip.bank());
  }
}

}  // namespace

void runIcm20649Tests() {
  RUN_TEST(test_another_chip_at_the_address_is_refused_and_left_as_it_is);
  RUN_TEST(test_a_missing_chip_is_told_from_a_wrong_one_on_both_buses);
  RUN_TEST(test_a_chip_that_needs_its_whole_power_up_time_is_found);
  RUN_TEST(test_a_reset_without_end_does_not_hold_up_the_start);
  RUN_TEST(test_any_register_that_does_not_take_its_value_fails_the_start);
  RUN_TEST(test_a_start_cut_off_at_any_transfer_fails_and_the_next_one_succeeds);
  RUN_TEST(test_each_filter_sets_the_bits_of_the_data_sheet);
  RUN_TEST(test_the_i2c_slave_is_off_on_spi_and_only_there);
  RUN_TEST(test_in_every_range_force_and_rate_come_out_as_they_went_in);
  RUN_TEST(test_the_stated_period_is_the_chips_and_leaves_no_sample_out);
  RUN_TEST(test_a_sample_is_one_transfer_of_14_bytes_within_its_time_on_the_wire);
  RUN_TEST(test_the_start_switches_banks_no_more_than_four_times);
  RUN_TEST(test_a_sound_chip_passes_its_self_test_and_has_its_settings_again);
  RUN_TEST(test_one_weak_axis_fails_the_self_test);
  RUN_TEST(test_without_a_factory_value_nothing_is_passed);
  RUN_TEST(test_a_chip_lost_in_the_self_test_has_not_completed_it);
  RUN_TEST(test_one_failed_transfer_in_the_self_test_confuses_no_bank);
}
