/// The bounded-bus contract: with every fault on the wires a transfer ends within
/// transferBound + kFailureBound, and the bus works again once the fault has gone.
#include <unity.h>

#include "BoardRig.h"
#include "suites.h"

namespace {

using strix::BoardRig;
using strix::I2cBus;
using strix::I2cDevice;
using strix::PlainChip;

constexpr std::uint32_t kBound = I2cBus::transferBound(17) + I2cBus::kFailureBound;

/// us that a reading takes which must fail.
std::uint32_t failingRead(BoardRig& rig) {
  bool good = true;
  const std::uint32_t took = rig.duration([&] { good = rig.readPlain(); });
  TEST_ASSERT_FALSE(good);
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(kBound, took);
  return took;
}

void pass(BoardRig& rig, std::uint32_t ms) {
  rig.teensy.clock.advance(strix::nanosFromMicros(1000ULL * ms));
}

void test_an_absent_device_costs_an_address_and_no_recovery() {
  BoardRig rig;
  rig.plainPlug.unplug();
  TEST_ASSERT_LESS_THAN_UINT32(40, failingRead(rig));  // nine bits, 22.5 us, and a reset
  TEST_ASSERT_EQUAL_UINT32(1, rig.imuBus.faults().unacknowledged);
  TEST_ASSERT_EQUAL_UINT32(0, rig.imuBus.faults().recoveries);
  rig.plainPlug.plug();
  TEST_ASSERT_TRUE(rig.readPlain());
}

void test_a_device_unplugged_in_the_middle_of_a_byte_fails_in_time() {
  for (std::uint32_t at = 0; at < 400; ++at) {
    BoardRig rig;
    rig.teensy.clock.after(strix::nanosFromMicros(at), [&] { rig.plainPlug.unplug(); });
    bool good = false;
    const std::uint32_t took = rig.duration([&] { good = rig.readPlain(); });
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(kBound, took);
    pass(rig, 1);
    rig.plainPlug.plug();
    TEST_ASSERT_TRUE(rig.readPlain());
  }
}

void test_sda_shorted_is_told_as_a_held_bus() {
  BoardRig rig;
  rig.shortSda(rig.imuWire(), true);
  (void)failingRead(rig);
  TEST_ASSERT_EQUAL_UINT32(1, rig.imuBus.faults().held);
  TEST_ASSERT_EQUAL_UINT32(1, rig.imuBus.faults().recoveries);
  TEST_ASSERT_EQUAL_UINT32(0, rig.imuBus.faults().freed);
  rig.shortSda(rig.imuWire(), false);
  TEST_ASSERT_TRUE(rig.readPlain());
}

void test_scl_shorted_is_told_as_a_held_bus() {
  BoardRig rig;
  rig.shortScl(rig.imuWire(), true);
  (void)failingRead(rig);
  TEST_ASSERT_EQUAL_UINT32(1, rig.imuBus.faults().held);
  TEST_ASSERT_EQUAL_UINT32(0, rig.imuBus.faults().freed);
  rig.shortScl(rig.imuWire(), false);
  TEST_ASSERT_TRUE(rig.readPlain());
}

void test_a_short_at_any_moment_of_a_transfer_ends_in_time() {
  for (const bool sda : {true, false}) {
    for (std::uint32_t at = 0; at < 400; ++at) {
      BoardRig rig;
      rig.teensy.clock.after(strix::nanosFromMicros(at), [&] {
        sda ? rig.shortSda(rig.imuWire(), true) : rig.shortScl(rig.imuWire(), true);
      });
      const std::uint32_t took = rig.duration([&] { (void)rig.readPlain(); });
      TEST_ASSERT_LESS_OR_EQUAL_UINT32(kBound, took);
      (void)failingRead(rig);
      rig.shortSda(rig.imuWire(), false);
      rig.shortScl(rig.imuWire(), false);
      // The device may have been left in the middle of a byte, and the lines were just clocked.
      pass(rig, 50);
      if (!rig.readPlain()) TEST_ASSERT_TRUE(rig.readPlain());
    }
  }
}

void test_the_lines_are_clocked_at_most_every_50_ms() {
  BoardRig rig;
  rig.shortSda(rig.imuWire(), true);
  for (int i = 0; i < 1000; ++i) {
    (void)failingRead(rig);
    rig.teensy.clock.advance(strix::nanosFromMicros(400));
  }
  // 1000 tries of 0.97 ms, each with the whole bound, are 0.97 s: a recovery at its start and
  // nineteen more.
  TEST_ASSERT_EQUAL_UINT32(1000, rig.imuBus.faults().held);
  TEST_ASSERT_UINT32_WITHIN(1, 19, rig.imuBus.faults().recoveries);
}

// As it happens when the Teensy is restarted while it reads: the device waits with a zero on SDA
// for clocks that do not come.
void test_a_device_stopped_at_any_bit_is_clocked_free() {
  std::uint32_t held = 0;
  for (std::uint32_t bits = 1; bits < 17 * 9; ++bits) {
    BoardRig rig;
    auto& registers = lpi2c1Registers;
    rig.plainChip.registers.fill(bits % 2 == 0 ? 0x00 : 0x12);
    const std::uint32_t before = rig.teensy.lpi2c1.master.bits();
    const std::uint32_t commands[] = {
        LPI2C_MTDR_CMD_START | PlainChip::kAddress << 1U, LPI2C_MTDR_CMD_TRANSMIT,
        LPI2C_MTDR_CMD_START | PlainChip::kAddress << 1U | 1U, LPI2C_MTDR_CMD_RECEIVE | 13U};
    for (const std::uint32_t command : commands) registers.MTDR = command;
    while (rig.teensy.lpi2c1.master.bits() - before < bits) {
      if ((registers.MFSR >> 16U) != 0) (void)static_cast<std::uint32_t>(registers.MRDR);
    }
    rig.imuBus.begin();  // the start after the restart

    const bool stuck = !rig.imuWire().levels().sda;
    if (stuck) {
      ++held;
      (void)failingRead(rig);
      TEST_ASSERT_EQUAL_UINT32(1, rig.imuBus.faults().recoveries);
      TEST_ASSERT_EQUAL_UINT32(1, rig.imuBus.faults().freed);
    }
    TEST_ASSERT_TRUE(rig.readPlain());
  }
  TEST_ASSERT_GREATER_THAN_UINT32(50, held);  // or nothing was tried
}

void test_a_device_that_holds_the_clock_is_given_up_in_time() {
  BoardRig rig;
  rig.plainPlug.holdsClock = true;
  (void)failingRead(rig);
  TEST_ASSERT_EQUAL_UINT32(1, rig.imuBus.faults().late);
  (void)failingRead(rig);
  TEST_ASSERT_EQUAL_UINT32(1, rig.imuBus.faults().held);
  rig.plainPlug.holdsClock = false;
  rig.plainPlug.unplug();
  rig.plainPlug.plug();
  TEST_ASSERT_TRUE(rig.readPlain());
}

void test_a_line_pulled_against_us_is_told_as_lost() {
  BoardRig rig;
  // Within the device's address, 0x68 << 1: its second bit is a one.
  rig.teensy.clock.after(strix::nanosFromMicros(5), [&] { rig.shortSda(rig.imuWire(), true); });
  rig.teensy.clock.after(strix::nanosFromMicros(9), [&] { rig.shortSda(rig.imuWire(), false); });
  (void)failingRead(rig);
  TEST_ASSERT_EQUAL_UINT32(1, rig.imuBus.faults().lost);
  TEST_ASSERT_TRUE(rig.readPlain());
}

void test_a_held_bus_leaves_the_other_alone() {
  BoardRig rig;
  rig.shortSda(rig.slowWire(), true);
  rig.shortScl(rig.slowWire(), true);
  std::uint8_t identity = 0;
  for (int i = 0; i < 20; ++i) {
    TEST_ASSERT_FALSE(rig.slowBus.read(strix::FakeBmp390::kAddress, 0, &identity, 1));
    TEST_ASSERT_TRUE(rig.readPlain());
  }
  TEST_ASSERT_EQUAL_UINT32(20, rig.slowBus.faults().held);
  TEST_ASSERT_EQUAL_UINT32(0, rig.imuBus.faults().held + rig.imuBus.faults().late);
}

void test_a_dead_device_is_tried_after_1_2_4_and_up_to_128_ms() {
  BoardRig rig;
  I2cDevice device(rig.imuBus, PlainChip::kAddress);
  rig.plainPlug.unplug();
  std::uint8_t data = 0;
  const std::uint32_t expected_ms[] = {1, 2, 4, 8, 16, 32, 64, 128, 128, 128};
  TEST_ASSERT_FALSE(device.read(0, &data, 1));
  std::uint32_t last = micros();
  for (const std::uint32_t rest_ms : expected_ms) {
    const std::uint32_t misses = device.misses();
    while (device.misses() == misses) {
      TEST_ASSERT_FALSE(device.read(0, &data, 1));
      rig.teensy.clock.advance(10'000);
    }
    const std::uint32_t tried = micros();
    TEST_ASSERT_UINT32_WITHIN(50, rest_ms * 1000, tried - last);  // 30 us are the try itself
    last = tried;
  }
  rig.plainPlug.plug();
  pass(rig, 128);
  TEST_ASSERT_TRUE(device.read(0, &data, 1));
  TEST_ASSERT_TRUE(device.read(0, &data, 1));
  // The first success ends it: another miss costs 1 ms again.
  rig.plainPlug.unplug();
  TEST_ASSERT_FALSE(device.read(0, &data, 1));
  rig.plainPlug.plug();
  pass(rig, 1);
  TEST_ASSERT_TRUE(device.read(0, &data, 1));
}

}  // namespace

void runI2cFaultTests() {
  RUN_TEST(test_an_absent_device_costs_an_address_and_no_recovery);
  RUN_TEST(test_a_device_unplugged_in_the_middle_of_a_byte_fails_in_time);
  RUN_TEST(test_sda_shorted_is_told_as_a_held_bus);
  RUN_TEST(test_scl_shorted_is_told_as_a_held_bus);
  RUN_TEST(test_a_short_at_any_moment_of_a_transfer_ends_in_time);
  RUN_TEST(test_the_lines_are_clocked_at_most_every_50_ms);
  RUN_TEST(test_a_device_stopped_at_any_bit_is_clocked_free);
  RUN_TEST(test_a_device_that_holds_the_clock_is_given_up_in_time);
  RUN_TEST(test_a_line_pulled_against_us_is_told_as_lost);
  RUN_TEST(test_a_held_bus_leaves_the_other_alone);
  RUN_TEST(test_a_dead_device_is_tried_after_1_2_4_and_up_to_128_ms);
}
