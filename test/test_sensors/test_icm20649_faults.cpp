// The ICM20649's driver when things go wrong: no fault of the chip or the bus passes for a sample.
// And its FIFO, where each sample has its own time.
#include <unity.h>

#include <cmath>
#include <cstdint>

#include "AssertNear.h"
#include "Icm20649Bench.h"
#include "suites.h"

using namespace strix;
using icm20649::AccelRange;
using icm20649::Config;
using icm20649::Reading;
using Bench = Icm20649Bench;

namespace {

// ---- Faults -------------------------------------------------------------------------------------

void test_a_sample_at_the_end_of_its_range_is_counted_and_still_given() {
  struct Case {
    AccelRange range;
    double g;  // at its end
  };
  for (const Case& c : {Case{AccelRange::G4, 4.0}, Case{AccelRange::G8, 8.0},
                        Case{AccelRange::G16, 16.0}, Case{AccelRange::G30, 30.0}}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Config config;
      config.accelRange = c.range;
      Bench bench(config);
      bench.start();
      bench.chip.accel = {};
      bench.chip.accel[axis] = -0.97 * c.g * 9.80665;
      bench.eachOf(5, [](Reading reading) { TEST_ASSERT_TRUE(reading == Reading::New); });
      TEST_ASSERT_EQUAL_UINT32(0, bench.driver.faults().accelClipped);
      bench.chip.accel[axis] = -0.99 * c.g * 9.80665;
      bench.eachOf(5, [](Reading reading) { TEST_ASSERT_TRUE(reading == Reading::New); });
      TEST_ASSERT_EQUAL_UINT32(5, bench.driver.faults().accelClipped);
      bench.chip.accel = {};
      bench.chip.gyro[axis] = 2100.0 * 3.14159265358979 / 180.0;  // of 2000
      bench.eachOf(5, [](Reading reading) { TEST_ASSERT_TRUE(reading == Reading::New); });
      TEST_ASSERT_EQUAL_UINT32(5, bench.driver.faults().accelClipped);
      TEST_ASSERT_EQUAL_UINT32(5, bench.driver.faults().gyroClipped);
    }
  }
}

void test_a_stuck_sensor_is_believed_for_no_more_than_ten_samples() {
  Bench bench;
  bench.start();
  bench.eachOf(100, [](Reading reading) { TEST_ASSERT_TRUE(reading == Reading::New); });
  bench.chip.stuck = true;
  int believed = 0;
  bench.eachOf(100, [&](Reading reading) { believed += reading != Reading::Stuck ? 1 : 0; });
  TEST_ASSERT_TRUE(1 + believed <= 10);  // the one before that it repeats, too
  TEST_ASSERT_TRUE(bench.driver.stuck());
  TEST_ASSERT_EQUAL_UINT32(100 - believed, bench.driver.faults().stuck);
  bench.chip.stuck = false;
  TEST_ASSERT_TRUE(bench.next() == Reading::New);
  TEST_ASSERT_FALSE(bench.driver.stuck());
}

void test_a_sample_that_repeats_by_chance_is_told_apart_and_kept() {
  Bench bench;
  bench.start();
  (void)bench.next();
  bench.chip.stuck = true;
  bench.raw = {};
  TEST_ASSERT_TRUE(bench.next() == Reading::Repeated);
  TEST_ASSERT_FLOAT_WITHIN(0.05F, -9.807F, bench.raw.accel.z());
  TEST_ASSERT_FALSE(bench.driver.stuck());
}

void test_garbage_on_the_bus_hardly_ever_passes_for_a_sample() {
  Bench bench;
  bench.start();
  (void)bench.next();
  bench.chip.garbage = true;
  int believed = 0;
  bench.eachOf(2000, [&](Reading reading) { believed += reading == Reading::New ? 1 : 0; });
  // The temperature is a random number: within 400 counts of the last one time in 82, which is 24
  // of 2000, give or take 5.
  TEST_ASSERT_TRUE(believed < 24 + 4 * 5);
  TEST_ASSERT_EQUAL_UINT32(2000 - believed, bench.driver.faults().implausible);
  bench.chip.garbage = false;
  (void)bench.next();  // measured against the last garbage
  TEST_ASSERT_TRUE(bench.next() == Reading::New);
}

void test_no_temperature_outside_the_chips_own_is_believed() {
  Bench bench;
  bench.start();
  bench.chip.temperature = 118.0;
  bench.eachOf(10, [](Reading reading) { TEST_ASSERT_TRUE(reading == Reading::Implausible); });
  bench.chip.temperature = -45.0;
  bench.eachOf(10, [](Reading reading) { TEST_ASSERT_TRUE(reading == Reading::Implausible); });
}

void test_a_line_that_nobody_drives_is_silence() {
  Bench bench;
  bench.start();
  (void)bench.next();
  bench.chip.undriven = true;  // all ones would read as 21 degC and next to no force
  bench.eachOf(10, [](Reading reading) { TEST_ASSERT_TRUE(reading == Reading::Silent); });
  TEST_ASSERT_EQUAL_UINT32(10, bench.driver.faults().silent);
}

void test_a_chip_unplugged_in_flight_and_plugged_in_again_costs_its_samples_only() {
  Bench bench;
  bench.start();
  (void)bench.next();
  bench.chip.absent = true;
  bench.raw = {};
  bench.eachOf(50, [](Reading reading) { TEST_ASSERT_TRUE(reading == Reading::Silent); });
  TEST_ASSERT_EQUAL_UINT32(50, bench.driver.faults().silent);
  TEST_ASSERT_EQUAL_FLOAT(0.0F, bench.raw.accel.z());
  bench.chip.absent = false;
  TEST_ASSERT_TRUE(bench.next() == Reading::New);
}

// ---- FIFO ---------------------------------------------------------------------------------------

/// Empties the FIFO after up to twice `pause` us and compares each sample's time with the chip's
/// own, from 1.5 s on: before, the period is not yet measured.
void assertTimesAreTheChips(Bench& bench, double pause, double seconds, double tolerance) {
  std::array<ImuRaw, 32> out;
  std::size_t taken = 0;
  bool first = true;
  Random random(12);
  while (bench.chip.now() < seconds * 1e6) {
    bench.chip.advance(pause * static_cast<double>(random.uniform(0.0F, 2.0F)));
    for (std::size_t got = 1; got != 0;) {
      got = bench.readFifo(out.data(), out.size());
      for (std::size_t i = 0; i < got; ++i) {
        if (first) {  // samples from between the reset of the FIFO and the first reading
          first = false;
          while (taken < bench.chip.sampleTimes.size() &&
                 std::abs(bench.chip.sampleTimes[taken] - out[i].sampled) > 440.0) {
            ++taken;
          }
        }
        const double real = bench.chip.sampleTimes[taken++];
        if (bench.chip.now() > 1.5e6) {
          TEST_ASSERT_DOUBLE_WITHIN(tolerance, real, out[i].sampled);
        }
      }
    }
  }
  TEST_ASSERT_TRUE(static_cast<double>(taken) > 1100.0 * (seconds - 0.4));
  TEST_ASSERT_EQUAL_UINT32(0, bench.driver.faults().fifoOverflows);
  TEST_ASSERT_EQUAL_UINT32(0, bench.driver.faults().fifoTorn);
}

void test_the_fifo_gives_every_sample_its_own_time_with_a_clock_that_is_off() {
  for (const double error : {-0.01, 0.0, 0.01}) {
    Bench bench(withFifo());
    bench.chip.clockError = error;
    bench.start();
    // 1 us each for the edge's stamp and the rounding, and 1/256 us of the period times 6.
    assertTimesAreTheChips(bench, 5000.0, 4.0, 2.5);
    // Up to 27 samples wait: four readings. 1/256 us of the period times 27.
    assertTimesAreTheChips(bench, 12'000.0, 6.0, 2.5);
  }
}

void test_a_sample_that_comes_while_the_fifo_is_read_shifts_no_time() {
  // With the bus's own time in the model, every phase between reading and sampling occurs.
  Bench bench(withFifo());
  bench.chip.clocked = true;
  bench.chip.slowFifo = true;
  bench.start();
  assertTimesAreTheChips(bench, 1237.0, 6.0, 2.5);
}

void test_a_fifo_read_too_late_is_emptied_and_counted() {
  Bench bench(withFifo());
  bench.start();
  std::array<ImuRaw, 8> out;
  bench.chip.advance(5000.0);
  TEST_ASSERT_TRUE(bench.readFifo(out.data(), out.size()) > 0);
  bench.chip.advance(100'000.0);  // 112 samples, of 36 that find room
  TEST_ASSERT_EQUAL_UINT32(0, bench.readFifo(out.data(), out.size()));
  TEST_ASSERT_EQUAL_UINT32(1, bench.driver.faults().fifoOverflows);
  bench.chip.advance(3000.0);  // three samples, or four
  TEST_ASSERT_TRUE(bench.readFifo(out.data(), out.size()) >= 3);
  TEST_ASSERT_FLOAT_WITHIN(0.05F, -9.807F, out[0].accel.z());
}

void test_no_sample_is_made_of_two_halves_when_the_fifo_lost_a_byte() {
  Bench bench(withFifo());
  // One byte on, the temperature's low byte and the force's high byte look like the temperature.
  bench.chip.temperature = 21.0 + 0x0303 / 333.87;
  bench.chip.accel = {0x0380 * 9.80665 / 1024.0, -20.0, -9.80665};
  const Vector3f force{8.581F, -20.0F, -9.807F};
  bench.start();
  std::array<ImuRaw, 8> out;
  int good = 0;
  for (int i = 0; i < 50; ++i) {
    bench.chip.tearsFifo = i == 10;
    bench.chip.advance(2000.0);
    const std::size_t got = bench.readFifo(out.data(), out.size());
    for (std::size_t k = 0; k < got; ++k) {
      assertNear(0.1F, force, out[k].accel);
      ++good;
    }
  }
  TEST_ASSERT_TRUE(good > 100);  // of 112
  TEST_ASSERT_EQUAL_UINT32(1, bench.driver.faults().fifoTorn);
}

void test_behind_a_sample_that_is_none_the_fifo_is_not_believed() {
  Bench bench(withFifo());
  bench.start();
  std::array<ImuRaw, 8> out;
  bench.chip.advance(5000.0);
  (void)bench.readFifo(out.data(), out.size());
  bench.chip.temperature = 118.0;
  bench.chip.advance(5000.0);
  bench.chip.temperature = 25.0;
  bench.chip.advance(10'000.0);
  for (int i = 0; i < 4; ++i) {
    TEST_ASSERT_EQUAL_UINT32(0, bench.readFifo(out.data(), out.size()));
  }
  TEST_ASSERT_TRUE(bench.driver.faults().implausible > 0);
  for (int i = 0; i < 2; ++i) {
    bench.chip.advance(3000.0);
    (void)bench.readFifo(out.data(), out.size());
  }
  bench.chip.advance(3000.0);
  TEST_ASSERT_TRUE(bench.readFifo(out.data(), out.size()) >= 3);
}

void test_a_fifo_transfer_that_breaks_off_costs_the_samples_that_waited() {
  for (std::size_t later = 0; later < 6; ++later) {  // in the count, in the data, or after
    Bench bench(withFifo());
    bench.start();
    std::array<ImuRaw, 8> out;
    bench.chip.cutLate = true;
    bench.chip.cut = {bench.chip.transfers.size() + later, bench.chip.transfers.size() + later + 1};
    std::size_t got = 0;
    for (int i = 0; i < 10; ++i) {
      bench.chip.advance(3000.0);
      const std::size_t count = bench.readFifo(out.data(), out.size());
      for (std::size_t k = 0; k < count; ++k) {
        assertNear(0.05F, Vector3f{0.0F, 0.0F, -9.807F}, out[k].accel);
      }
      got += count;
    }
    TEST_ASSERT_EQUAL_UINT32(1, bench.driver.faults().silent);
    TEST_ASSERT_EQUAL_UINT32(0, bench.driver.faults().fifoTorn);
    TEST_ASSERT_TRUE(got >= 33 - 8);
  }
}

void test_a_fifo_that_cannot_be_restarted_is_restarted_later() {
  Bench bench(withFifo());
  bench.start();
  std::array<ImuRaw, 8> out;
  bench.chip.advance(100'000.0);
  const std::size_t restart = bench.chip.transfers.size() + 1;
  bench.chip.cut = {restart, restart + 2};  // two attempts
  for (int i = 0; i < 4; ++i) {
    TEST_ASSERT_EQUAL_UINT32(0, bench.readFifo(out.data(), out.size()));
  }
  TEST_ASSERT_EQUAL_UINT32(2, bench.driver.faults().silent);
  bench.chip.advance(3000.0);
  TEST_ASSERT_TRUE(bench.readFifo(out.data(), out.size()) >= 3);
}

}  // namespace

void runIcm20649FaultTests() {
  RUN_TEST(test_a_sample_at_the_end_of_its_range_is_counted_and_still_given);
  RUN_TEST(test_a_stuck_sensor_is_believed_for_no_more_than_ten_samples);
  RUN_TEST(test_a_sample_that_repeats_by_chance_is_told_apart_and_kept);
  RUN_TEST(test_garbage_on_the_bus_hardly_ever_passes_for_a_sample);
  RUN_TEST(test_no_temperature_outside_the_chips_own_is_believed);
  RUN_TEST(test_a_line_that_nobody_drives_is_silence);
  RUN_TEST(test_a_chip_unplugged_in_flight_and_plugged_in_again_costs_its_samples_only);
  RUN_TEST(test_the_fifo_gives_every_sample_its_own_time_with_a_clock_that_is_off);
  RUN_TEST(test_a_sample_that_comes_while_the_fifo_is_read_shifts_no_time);
  RUN_TEST(test_a_fifo_read_too_late_is_emptied_and_counted);
  RUN_TEST(test_no_sample_is_made_of_two_halves_when_the_fifo_lost_a_byte);
  RUN_TEST(test_behind_a_sample_that_is_none_the_fifo_is_not_believed);
  RUN_TEST(test_a_fifo_transfer_that_breaks_off_costs_the_samples_that_waited);
  RUN_TEST(test_a_fifo_that_cannot_be_restarted_is_restarted_later);
}
