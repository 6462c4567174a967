// The battery's voltage on its way from the board to the motors.
#include "AssertNear.h"
#include "FakeFlight.h"
#include "suites.h"

using namespace strix;

namespace {

/// Armed and idling, 3 s after the battery shows this voltage; 0: nothing measures it.
EscCommands idleAt(float voltage) {
  FakeFlight f;
  f.getReady();
  f.board.battery.dead = voltage == 0.0F;
  f.board.battery.reading.voltage = voltage;
  TEST_ASSERT_TRUE(f.arm());
  f.run(3.0F);  // the smoothing has forgotten its start
  return f.board.esc();
}

void test_a_low_battery_gets_longer_pulses_for_the_same_speed() {
  const Motors motors(kQuad5in);
  const EscCommands unknown = idleAt(0.0F);
  const EscCommands low = idleAt(0.9F * kQuad5in.curveVoltage);
  TEST_ASSERT_EQUAL_FLOAT(motors.command(kQuad5in.speedFlightMin), unknown[0]);
  // The curve is made for curveVoltage: at 0.9 of it the same speed needs the command of n / 0.9.
  TEST_ASSERT_FLOAT_WITHIN(0.05F, motors.command(kQuad5in.speedFlightMin / 0.9F), low[0]);
}

void test_a_reading_that_no_battery_gives_changes_nothing() {
  for (const float wrong : {1.0F, 60.0F, -22.0F, kNaN}) {
    TEST_ASSERT_EQUAL_FLOAT(idleAt(0.0F)[0], idleAt(wrong)[0]);
  }
}

void test_escs_that_answer_serve_as_voltmeter() {
  FakeFlight f;
  f.getReady();
  f.board.escs.dead = false;
  f.board.escs.reading.voltage.fill(0.9F * kQuad5in.curveVoltage);
  TEST_ASSERT_TRUE(f.arm());
  f.run(3.0F);
  const Motors motors(kQuad5in);
  TEST_ASSERT_FLOAT_WITHIN(0.05F, motors.command(kQuad5in.speedFlightMin / 0.9F), f.board.esc()[0]);
}

void test_the_current_is_told_where_the_board_measures_it_and_is_no_wild_one() {
  FakeFlight f;
  f.board.battery.dead = false;
  f.board.battery.reading.voltage = 23.0F;
  f.getReady();
  TEST_ASSERT_EQUAL_FLOAT(0.0F, f.software.status().current);
  f.board.battery.reading.current = 12.5F;
  f.run(3.0F);
  for (const float wrong : {-5.0F, 1e9F, kNaN}) {
    f.board.battery.reading.current = wrong;
    f.run(1.0F);
    TEST_ASSERT_FLOAT_WITHIN(0.01F, 12.5F, f.software.status().current);
  }
}

void test_every_reading_of_battery_and_escs_is_taken_once() {
  FakeFlight f;
  f.board.battery.dead = f.board.escs.dead = false;
  f.board.battery.reading.voltage = 23.0F;
  f.getReady();
  f.run(1.0F);
  TEST_ASSERT_EQUAL_UINT32(0, f.software.logger().dropped());
  // 10 and 5 a second, and none twice.
  TEST_ASSERT_UINT32_WITHIN(1, static_cast<std::uint32_t>(f.board.time() / 100'000),
                            f.board.battery.taken);
  TEST_ASSERT_UINT32_WITHIN(1, static_cast<std::uint32_t>(f.board.time() / 200'000),
                            f.board.escs.taken);
}

}  // namespace

void runPowerTests() {
  RUN_TEST(test_a_low_battery_gets_longer_pulses_for_the_same_speed);
  RUN_TEST(test_a_reading_that_no_battery_gives_changes_nothing);
  RUN_TEST(test_escs_that_answer_serve_as_voltmeter);
  RUN_TEST(test_the_current_is_told_where_the_board_measures_it_and_is_no_wild_one);
  RUN_TEST(test_every_reading_of_battery_and_escs_is_taken_once);
}
