/// What the bus does when nothing is wrong.
#include <unity.h>

#include "BoardRig.h"
#include "suites.h"

namespace {

using strix::BoardRig;
using strix::I2cBus;
using strix::PlainChip;

void test_a_burst_of_14_bytes_takes_0_40_ms() {
  BoardRig rig;
  bool good = false;
  const std::uint32_t took = rig.duration([&] { good = rig.readPlain(14); });
  TEST_ASSERT_TRUE(good);
  // 17 bytes of nine bits at 2.5 us are 382 us; start, repeated start and stop are some bits more.
  TEST_ASSERT_UINT32_WITHIN(12, 395, took);
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(I2cBus::transferBound(17), took);
}

void test_every_length_arrives_whole_and_in_time() {
  BoardRig rig;
  for (std::size_t count = 1; count <= 256; count += 5) {
    bool good = false;
    const std::uint32_t took = rig.duration([&] { good = rig.readPlain(count); });
    TEST_ASSERT_TRUE(good);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(I2cBus::transferBound(3 + count), took);
  }
  TEST_ASSERT_EQUAL_UINT32(0, rig.teensy.lpi2c1.master.overruns());
}

void test_a_length_that_no_command_has_is_refused() {
  BoardRig rig;
  std::uint8_t data[300] = {};
  TEST_ASSERT_FALSE(rig.imuBus.read(PlainChip::kAddress, 0, data, 0));
  TEST_ASSERT_FALSE(rig.imuBus.read(PlainChip::kAddress, 0, data, 257));
  TEST_ASSERT_FALSE(rig.imuBus.write(PlainChip::kAddress, 0, data, I2cBus::kMaxWrite + 1));
  TEST_ASSERT_EQUAL_UINT32(0, rig.teensy.lpi2c1.master.bits());
}

void test_what_is_written_is_in_the_register() {
  BoardRig rig;
  const std::uint8_t data[I2cBus::kMaxWrite] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 0xFF};
  bool good = false;
  const std::uint32_t took = rig.duration(
      [&] { good = rig.imuBus.write(PlainChip::kAddress, 0x40, data, I2cBus::kMaxWrite); });
  TEST_ASSERT_TRUE(good);
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(I2cBus::transferBound(2 + I2cBus::kMaxWrite), took);
  TEST_ASSERT_EQUAL_HEX8_ARRAY(data, &rig.plainChip.registers[0x40], I2cBus::kMaxWrite);
}

// An interrupt may keep the loop from its polling: the master then holds the clock, and waits.
void test_an_interrupt_in_the_middle_does_no_harm() {
  for (std::uint32_t at = 0; at < 400; at += 7) {
    BoardRig rig;
    auto& clock = rig.teensy.clock;
    clock.after(strix::nanosFromMicros(at), [&] { clock.advance(strix::nanosFromMicros(60)); });
    TEST_ASSERT_TRUE(rig.readPlain());
    TEST_ASSERT_EQUAL_UINT32(0, rig.imuBus.faults().late);
  }
}

void test_the_clock_may_wrap_during_a_transfer() {
  // Cycles wrap after 7.158 s, microseconds after 71.6 min.
  for (const std::uint32_t start : {7'158'000U, 4'294'966'900U}) {
    BoardRig rig(start);
    for (int i = 0; i < 10; ++i) TEST_ASSERT_TRUE(rig.readPlain());
  }
}

void test_the_bus_is_fast_again_after_an_adafruit_driver() {
  BoardRig rig;
  rig.slowBus.wire().begin();  // as each of them does: 100 kHz
  rig.slowBus.begin();
  std::uint8_t identity = 0;
  const std::uint32_t took = rig.duration(
      [&] { TEST_ASSERT_TRUE(rig.slowBus.read(strix::FakeBmp390::kAddress, 0, &identity, 1)); });
  TEST_ASSERT_EQUAL_HEX8(0x60, identity);
  TEST_ASSERT_LESS_THAN_UINT32(110, took);
}

}  // namespace

void runI2cBusTests() {
  RUN_TEST(test_a_burst_of_14_bytes_takes_0_40_ms);
  RUN_TEST(test_every_length_arrives_whole_and_in_time);
  RUN_TEST(test_a_length_that_no_command_has_is_refused);
  RUN_TEST(test_what_is_written_is_in_the_register);
  RUN_TEST(test_an_interrupt_in_the_middle_does_no_harm);
  RUN_TEST(test_the_clock_may_wrap_during_a_transfer);
  RUN_TEST(test_the_bus_is_fast_again_after_an_adafruit_driver);
}
