// The motor test: each of its guards, and that nothing else ever moves a motor.
#include "CheckoutBench.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kRunning = 3.5F;  // s after the command: past the countdown, before the end

/// A bench with motor 2 turning.
void turnMotor2(CheckoutBench& bench) {
  bench.begin();
  bench.say("props off");
  assertHas(bench.say("motor 2", kRunning), "any key stops it");
  TEST_ASSERT_FALSE(bench.allOff());
}

void expectRefusal(const char* reason, const std::function<void(CheckoutBench&)>& spoil) {
  CheckoutBench bench;
  bench.begin();
  bench.say("props off");
  spoil(bench);
  bench.run(0.1F);
  const std::string text = bench.say("motor 2", 6.0F);
  assertHas(text, "refused: ");
  assertHas(text, reason);
  TEST_ASSERT_EQUAL_FLOAT(bench.vehicle.commandOff, bench.highest);
}

void test_one_motor_turns_slowly_for_2_s_after_a_countdown_of_3_s() {
  for (const Airframe& airframe : kAirframes) {
    for (std::size_t motor = 0; motor < kMotorCount; ++motor) {
      CheckoutBench bench(0, benchConfig(airframe));
      bench.begin();
      bench.say("props off");
      const std::string text = bench.say("motor " + std::to_string(motor + 1), 2.98F);
      TEST_ASSERT_EQUAL_FLOAT(bench.vehicle.commandOff, bench.highest);
      assertHas(text, "in 3 s\nin 2 s\nin 1 s\n");
      bench.run(0.03F);
      const Motors motors(bench.vehicle);
      const float idle = motors.command(bench.vehicle.speedFlightMin);
      const float hover = motors.command(
          squareRoot(bench.vehicle.mass * kGravity / (4.0F * bench.vehicle.thrustConstant)));
      for (std::size_t i = 0; i < kMotorCount; ++i) {
        if (i != motor) TEST_ASSERT_EQUAL_FLOAT(bench.vehicle.commandOff, bench.commands[i]);
      }
      TEST_ASSERT_TRUE(bench.commands[motor] >= idle);
      TEST_ASSERT_TRUE(bench.commands[motor] < 0.5F * (idle + hover));  // far from lifting anything
      bench.run(1.97F);
      TEST_ASSERT_FALSE(bench.allOff());
      bench.run(0.03F);
      TEST_ASSERT_TRUE(bench.allOff());
      assertHas(bench.output, "stopped after 2 s");
    }
  }
}

void test_each_motor_is_named_by_its_place_and_turn() {
  CheckoutBench bench;
  bench.begin();
  bench.say("props off");
  assertHas(bench.say("motor 1"), "M1, front left, turns clockwise seen from above");
  assertHas(bench.say("motor 2"), "M2, front right, turns counter-clockwise");
  assertHas(bench.say("motor 3"), "M3, rear right, turns clockwise");
  assertHas(bench.say("motor 4"), "M4, rear left, turns counter-clockwise");
  CheckoutBench ugglan(0, benchConfig(*findAirframe("UgglanQ450")));
  ugglan.begin();
  ugglan.say("props off");
  assertHas(ugglan.say("motor 1"), "M1, front right, turns clockwise");
}

void test_no_motor_turns_without_the_words_props_off() {
  CheckoutBench bench;
  bench.begin();
  assertHas(bench.say("motor 1", 6.0F), "refused: take the propellers off");
  assertHas(bench.say("props on", 0.1F), "no such command");
  assertHas(bench.say("motor 1", 6.0F), "refused: take the propellers off");
  TEST_ASSERT_EQUAL_FLOAT(bench.vehicle.commandOff, bench.highest);
}

void test_props_off_counts_for_60_s_and_does_not_come_back_when_the_clock_wraps() {
  CheckoutBench bench;
  bench.begin();
  bench.say("props off");
  bench.run(59.5F);
  assertHas(bench.say("motor 1"), "M1, front left");
  bench.say("stop");
  bench.run(1.0F);
  assertHas(bench.say("motor 1"), "refused: take the propellers off");
  bench.say("props off");
  // The same 32 bits of clock, one wrap later, with passes of 20 ms.
  const Micros promised = bench.board.now();
  bench.stepTime = 20'000;
  bench.run(4294.5F);
  bench.stepTime = 300;
  bench.run(3.0F);
  TEST_ASSERT_TRUE(elapsed(bench.board.now(), promised) < 50'000'000);
  assertHas(bench.say("motor 1"), "refused: take the propellers off");
}

void test_each_guard_refuses() {
  expectRefusal("kill is on", [](CheckoutBench& b) { b.board.pilot.kill = true; });
  expectRefusal("no data", [](CheckoutBench& b) { b.board.imu.dead = true; });
  expectRefusal("not level", [](CheckoutBench& b) {
    b.hold(eulerToQuaternion({0.0F, 25.0F * kDegToRad, 0.0F}));
    b.run(2.0F);
  });
  expectRefusal("moves", [](CheckoutBench& b) { b.hold(Quaternion{}, {0.0F, 0.0F, 0.15F}); });
  for (const char* motor : {"motor 0", "motor 5", "motor x", "motor -"}) {
    CheckoutBench bench;
    bench.begin();
    bench.say("props off");
    assertHas(bench.say(motor, 6.0F), "there are motors 1 to 4");
    TEST_ASSERT_EQUAL_FLOAT(bench.vehicle.commandOff, bench.highest);
  }
}

void test_a_guard_that_fails_in_the_countdown_ends_it() {
  const std::vector<std::function<void(CheckoutBench&)>> spoils{
      [](CheckoutBench& b) { b.board.pilot.kill = true; },
      [](CheckoutBench& b) { b.board.imu.dead = true; },
      [](CheckoutBench& b) { b.hold(eulerToQuaternion({0.4F, 0.0F, 0.0F})); },
      [](CheckoutBench& b) { b.hold(Quaternion{}, {0.0F, 0.1F, 0.0F}); },
      [](CheckoutBench& b) { b.input += "\r"; },
  };
  for (const auto& spoil : spoils) {
    CheckoutBench bench;
    bench.begin();
    bench.say("props off");
    bench.say("motor 3", 1.5F);
    spoil(bench);
    bench.run(6.0F);
    TEST_ASSERT_EQUAL_FLOAT(bench.vehicle.commandOff, bench.highest);
  }
}

void test_kill_and_any_character_stop_a_motor_in_the_same_step() {
  CheckoutBench killed;
  turnMotor2(killed);
  killed.board.pilot.kill = true;
  killed.step();
  TEST_ASSERT_TRUE(killed.allOff());
  assertHas(killed.output, "kill is on");
  for (int c = 0; c < 256; ++c) {
    CheckoutBench bench;
    turnMotor2(bench);
    bench.input += static_cast<char>(c);
    bench.step();
    TEST_ASSERT_TRUE(bench.allOff());
  }
}

void test_a_motor_stops_when_the_aircraft_turns_tips_over_or_its_imu_dies() {
  CheckoutBench turns;
  turnMotor2(turns);
  turns.hold(Quaternion{}, {0.0F, 0.0F, 2.0F});
  turns.run(0.1F);
  TEST_ASSERT_TRUE(turns.allOff());
  assertHas(turns.output, "are the propellers off?");
  CheckoutBench tips;
  turnMotor2(tips);
  tips.hold(eulerToQuaternion({0.6F, 0.0F, 0.0F}));
  tips.run(0.2F);
  TEST_ASSERT_TRUE(tips.allOff());
  CheckoutBench dies;
  turnMotor2(dies);
  dies.board.imu.dead = true;
  dies.run(0.06F);
  TEST_ASSERT_TRUE(dies.allOff());
}

void test_a_motor_vibrates_without_ending_its_own_test() {
  CheckoutBench bench;
  turnMotor2(bench);
  bench.disturb = [random = Random(8)](CheckoutBench& b) mutable {
    b.board.imu.reading.gyro += random.vector(1.0F);
    b.board.imu.reading.accel += random.vector(5.0F);
  };
  bench.run(1.0F);
  TEST_ASSERT_FALSE(bench.allOff());
}

void test_a_pass_that_comes_late_does_not_lengthen_a_run() {
  CheckoutBench bench;
  turnMotor2(bench);
  bench.board.advance(2'000'000);
  bench.step();
  TEST_ASSERT_TRUE(bench.allOff());
}

/// Lines made of the checkout's own words and of noise, with the guards open and shut.
void test_only_a_whole_motor_command_ever_moves_a_motor() {
  constexpr const char* kWords[] = {"motor", "props", "off",     "1",   "2",    "4",
                                    "stop",  "axes",  "imu",     "gps", "help", "9",
                                    "baro",  "pilot", "sensors", ""};
  Random random(11);
  CheckoutBench bench;
  bench.stepTime = 2000;
  bench.begin();
  std::uint32_t lines = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string line;
    for (std::uint32_t word = random.below(4); word > 0; --word) {
      line += std::string(kWords[random.below(16)]) + (random.chance(0.8F) ? " " : "");
    }
    if (random.chance(0.3F)) line += static_cast<char>(random.below(256));
    if (line.find("props off") != std::string::npos) continue;  // the key
    bench.board.pilot.kill = random.chance(0.1F);
    bench.say(line, random.uniform(0.0F, 0.2F));
    ++lines;
  }
  bench.run(6.0F);
  TEST_ASSERT_TRUE(lines > 2500);
  TEST_ASSERT_EQUAL_FLOAT(bench.vehicle.commandOff, bench.highest);
  TEST_ASSERT_FALSE(bench.checkout.rebootAsked());

  // With the key: one motor at most, never more than the test's command.
  const float limit = 1229.0F;  // us: 1212 at 60 rev/s, 3 % of 550 more
  for (int i = 0; i < 300; ++i) {
    bench.say("props off");
    bench.say("motor " + std::to_string(random.below(6)), random.uniform(0.0F, 6.0F));
    std::size_t turning = 0;
    for (const float command : bench.commands) turning += command > bench.vehicle.commandOff;
    TEST_ASSERT_TRUE(turning <= 1);
    bench.say(kWords[random.below(16)], random.uniform(0.0F, 1.0F));
    TEST_ASSERT_TRUE(bench.allOff());
  }
  TEST_ASSERT_TRUE(bench.highest > bench.vehicle.commandOff);
  TEST_ASSERT_TRUE(bench.highest < limit);
}

void test_reboot_is_asked_for_with_motors_off() {
  CheckoutBench bench;
  turnMotor2(bench);
  bench.say("reboot");
  TEST_ASSERT_TRUE(bench.checkout.rebootAsked());
  TEST_ASSERT_TRUE(bench.allOff());
}

}  // namespace

void runMotorTests() {
  RUN_TEST(test_one_motor_turns_slowly_for_2_s_after_a_countdown_of_3_s);
  RUN_TEST(test_each_motor_is_named_by_its_place_and_turn);
  RUN_TEST(test_no_motor_turns_without_the_words_props_off);
  RUN_TEST(test_props_off_counts_for_60_s_and_does_not_come_back_when_the_clock_wraps);
  RUN_TEST(test_each_guard_refuses);
  RUN_TEST(test_a_guard_that_fails_in_the_countdown_ends_it);
  RUN_TEST(test_kill_and_any_character_stop_a_motor_in_the_same_step);
  RUN_TEST(test_a_motor_stops_when_the_aircraft_turns_tips_over_or_its_imu_dies);
  RUN_TEST(test_a_motor_vibrates_without_ending_its_own_test);
  RUN_TEST(test_a_pass_that_comes_late_does_not_lengthen_a_run);
  RUN_TEST(test_only_a_whole_motor_command_ever_moves_a_motor);
  RUN_TEST(test_reboot_is_asked_for_with_motors_off);
}
