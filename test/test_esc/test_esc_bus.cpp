/// EscI2c: four ESCs on a bus that is modelled down to the wires.
#include <unity.h>

#include <algorithm>
#include <cstdint>

#include "../../src/board/EscI2c.h"
#include "FakeAfroEsc.h"
#include "FakeI2cWire.h"
#include "suites.h"

namespace {

using namespace strix;

struct EscRig {
  explicit EscRig(std::uint32_t start_us = 300'000) : teensy(powerUpTeensy(start_us)) {
    bus.begin();
  }

  FakeTeensy& teensy;
  std::array<FakeAfroEsc, 4> chips{FakeAfroEsc{teensy.clock}, FakeAfroEsc{teensy.clock},
                                   FakeAfroEsc{teensy.clock}, FakeAfroEsc{teensy.clock}};
  std::array<I2cTarget, 4> plugs{
      I2cTarget{wire(), chips[0], 0x29}, I2cTarget{wire(), chips[1], 0x2A},
      I2cTarget{wire(), chips[2], 0x2B}, I2cTarget{wire(), chips[3], 0x2C}};
  I2cBus bus{Wire1, IMXRT_LPI2C3_ADDRESS, pins::kSlowBus};
  EscI2c escs{bus, 7};

  [[nodiscard]] FakeI2cWire& wire() { return teensy.lpi2c3.wire; }

  void holdSda(bool held) {
    wire().sdaShorted = held;
    wire().update();
  }

  template <class Call>
  [[nodiscard]] std::uint32_t duration(Call call) {
    const FakeClock::Nanos start = teensy.clock.now();
    call();
    return static_cast<std::uint32_t>((teensy.clock.now() - start + 999) / 1000);
  }

  /// Ticks of 2 ms as the loop makes them.
  struct Flight {
    std::uint32_t rounds = 0;
    std::uint32_t longestWrite = 0;  ///< us
    std::uint32_t longestRead = 0;
    EscRaw last;
  };
  Flight fly(const EscCommands& commands, std::uint32_t duration_ms) {
    Flight flight;
    for (std::uint32_t tick = 0; tick < duration_ms / 2; ++tick) {
      const FakeClock::Nanos next = teensy.clock.now() + nanosFromMicros(2000);
      flight.longestWrite = std::max(flight.longestWrite, duration([&] { escs.write(commands); }));
      flight.longestRead = std::max(flight.longestRead, duration([&] {
                                      if (escs.read(flight.last)) ++flight.rounds;
                                    }));
      if (teensy.clock.now() < next) teensy.clock.advance(next - teensy.clock.now());
    }
    return flight;
  }
};

constexpr EscCommands kHover{12000.0F, 12100.0F, 12200.0F, 12300.0F};
constexpr std::uint32_t kWriteBound = 4 * I2cBus::transferBound(4) + I2cBus::kFailureBound;
constexpr std::uint32_t kReadBound = I2cBus::transferBound(12) + I2cBus::kFailureBound;

void test_start_arms_all_four_and_moves_none() {
  EscRig rig;
  TEST_ASSERT_EQUAL_UINT8(0, rig.escs.begin());
  for (const FakeAfroEsc& chip : rig.chips) {
    TEST_ASSERT_TRUE(chip.armed());
    TEST_ASSERT_EQUAL_INT(0, chip.driven());
  }
}

void test_each_motor_gets_its_own_command_every_tick() {
  EscRig rig;
  (void)rig.escs.begin();
  const EscRig::Flight flight = rig.fly(kHover, 1000);
  for (std::size_t i = 0; i < 4; ++i) {
    TEST_ASSERT_EQUAL_INT(static_cast<int>(kHover[i]), rig.chips[i].driven());
    TEST_ASSERT_EQUAL_UINT32(501, rig.chips[i].commands());
  }
  TEST_ASSERT_UINT32_WITHIN(10, 380, flight.longestWrite);  // what the header says it takes
  TEST_ASSERT_UINT32_WITHIN(10, 280, flight.longestRead);
}

void test_all_four_are_read_five_times_a_second() {
  EscRig rig;
  (void)rig.escs.begin();
  for (std::size_t i = 0; i < 4; ++i) {
    rig.chips[i].turn(70.0 + 10.0 * static_cast<double>(i));
    rig.chips[i].batteryVoltage = 11.0 + 0.2 * static_cast<double>(i);
  }
  const EscRig::Flight flight = rig.fly(kHover, 2000);
  TEST_ASSERT_UINT32_WITHIN(1, 10, flight.rounds);
  for (std::size_t i = 0; i < 4; ++i) {
    // A turn of the field in 0.2 s, and the passes of 2 ms.
    TEST_ASSERT_FLOAT_WITHIN(0.8, 70.0 + 10.0 * static_cast<double>(i), flight.last.revolutions[i]);
    TEST_ASSERT_FLOAT_WITHIN(0.05, 11.0 + 0.2 * static_cast<double>(i), flight.last.voltage[i]);
  }
  const Micros age = micros() - flight.last.sampled;
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(202'000, age);
}

void test_start_tells_which_esc_is_missing_or_no_esc() {
  EscRig rig;
  rig.plugs[1].unplug();
  rig.chips[3].identity = 0x55;
  std::uint8_t missing = 0;
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(2900, rig.duration([&] { missing = rig.escs.begin(); }));
  TEST_ASSERT_EQUAL_HEX8(0b1010, missing);
}

void test_one_esc_pulled_out_costs_the_others_nothing() {
  EscRig rig;
  (void)rig.escs.begin();
  rig.plugs[2].unplug();
  const std::uint32_t before = rig.chips[3].commands();
  const EscRig::Flight flight = rig.fly(kHover, 1000);
  TEST_ASSERT_EQUAL_UINT32(500, rig.chips[3].commands() - before);
  TEST_ASSERT_UINT32_WITHIN(1, 5, flight.rounds);
  TEST_ASSERT_FLOAT_IS_NAN(flight.last.voltage[2]);
  TEST_ASSERT_FLOAT_IS_NOT_NAN(flight.last.voltage[3]);
  TEST_ASSERT_EQUAL_UINT32(500, rig.escs.faults(2).failedWrites);
  TEST_ASSERT_EQUAL_UINT32(0, rig.escs.givenUp());
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(kWriteBound, flight.longestWrite);
}

void test_off_reaches_an_esc_in_the_first_tick_behind_its_loose_contact() {
  EscRig rig;
  (void)rig.escs.begin();
  (void)rig.fly(kHover, 100);
  rig.holdSda(true);
  (void)rig.fly(kHover, 1000);
  rig.holdSda(false);
  (void)rig.fly(EscCommands{}, 2);  // one tick; a device that rests would be deaf for 128 ms
  for (const FakeAfroEsc& chip : rig.chips) TEST_ASSERT_EQUAL_INT(0, chip.driven());
}

void test_a_held_bus_costs_a_bounded_time_and_is_counted() {
  for (const bool sda : {true, false}) {
    EscRig rig;
    (void)rig.escs.begin();
    sda ? rig.wire().sdaShorted = true : rig.wire().sclShorted = true;
    rig.wire().update();
    const EscRig::Flight flight = rig.fly(kHover, 1000);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(kWriteBound, flight.longestWrite);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(kReadBound, flight.longestRead);
    TEST_ASSERT_EQUAL_UINT32(0, flight.rounds);
    TEST_ASSERT_EQUAL_UINT32(3 * 500, rig.escs.givenUp());
  }
}

void test_the_bus_may_be_cut_at_any_moment_of_a_tick() {
  for (std::uint32_t at = 0; at < 720; at += 7) {
    EscRig rig;
    (void)rig.escs.begin();
    (void)rig.fly(kHover, 48);  // the next tick also reads
    rig.teensy.clock.after(nanosFromMicros(at), [&] { rig.holdSda(true); });
    EscRig::Flight flight = rig.fly(kHover, 4);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(kWriteBound, flight.longestWrite);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(kReadBound, flight.longestRead);
    rig.holdSda(false);
    (void)rig.fly(kHover, 100);
    for (std::size_t i = 0; i < 4; ++i) {
      TEST_ASSERT_EQUAL_INT(static_cast<int>(kHover[i]), rig.chips[i].driven());
    }
  }
}

void test_an_esc_that_stretches_the_clock_for_ever_stays_within_the_bound() {
  EscRig rig;
  (void)rig.escs.begin();
  rig.plugs[0].holdsClock = true;
  const EscRig::Flight flight = rig.fly(kHover, 500);
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(kWriteBound, flight.longestWrite);
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(kReadBound, flight.longestRead);
  TEST_ASSERT_GREATER_THAN_UINT32(0, rig.bus.faults().late);
}

void test_noise_from_one_esc_is_seldom_taken_for_a_reading() {
  EscRig rig;
  (void)rig.escs.begin();
  rig.plugs[1].garbage = true;
  std::uint32_t told = 0;
  for (int i = 0; i < 200; ++i) {
    const EscRig::Flight flight = rig.fly(kHover, 200);
    if (flight.rounds == 0) continue;  // the first round may end a tick later
    if (isFinite(flight.last.voltage[1])) ++told;
    TEST_ASSERT_FLOAT_WITHIN(0.05, 11.4, flight.last.voltage[2]);
  }
  // The identity is 8 bits: 0.8 in 200 pass, sigma 0.9; 5 sigma.
  TEST_ASSERT_LESS_THAN_UINT32(6, told);
  TEST_ASSERT_UINT32_WITHIN(6, 200, rig.escs.faults(1).wrongIdentity);
}

void test_an_esc_plugged_in_again_turns_only_after_a_zero() {
  EscRig rig;
  (void)rig.escs.begin();
  (void)rig.fly(kHover, 100);
  rig.plugs[0].unplug();
  (void)rig.fly(kHover, 100);
  rig.plugs[0].plug();
  (void)rig.fly(kHover, 100);
  TEST_ASSERT_EQUAL_INT(0, rig.chips[0].driven());  // the ESC's own rule; no restart at hover
  (void)rig.fly(EscCommands{}, 4);
  (void)rig.fly(kHover, 4);
  TEST_ASSERT_EQUAL_INT(12000, rig.chips[0].driven());
}

}  // namespace

void runEscBusTests() {
  RUN_TEST(test_start_arms_all_four_and_moves_none);
  RUN_TEST(test_each_motor_gets_its_own_command_every_tick);
  RUN_TEST(test_all_four_are_read_five_times_a_second);
  RUN_TEST(test_start_tells_which_esc_is_missing_or_no_esc);
  RUN_TEST(test_one_esc_pulled_out_costs_the_others_nothing);
  RUN_TEST(test_off_reaches_an_esc_in_the_first_tick_behind_its_loose_contact);
  RUN_TEST(test_a_held_bus_costs_a_bounded_time_and_is_counted);
  RUN_TEST(test_the_bus_may_be_cut_at_any_moment_of_a_tick);
  RUN_TEST(test_an_esc_that_stretches_the_clock_for_ever_stays_within_the_bound);
  RUN_TEST(test_noise_from_one_esc_is_seldom_taken_for_a_reading);
  RUN_TEST(test_an_esc_plugged_in_again_turns_only_after_a_zero);
}
