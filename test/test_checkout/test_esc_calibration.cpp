// Teaching the ESCs: full for nobody who did not take propellers and battery off, and always an
// end.
#include "CheckoutBench.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kTeaching = 3.5F;  // s after the command: past the countdown

bool allFull(const CheckoutBench& bench) {
  return std::all_of(bench.commands.begin(), bench.commands.end(),
                     [&bench](float command) { return command == bench.vehicle.commandMax; });
}

void promise(CheckoutBench& bench) {
  bench.begin();
  bench.say("props off");
  bench.say("battery off");
}

/// A bench that sends full.
void teach(CheckoutBench& bench) {
  promise(bench);
  assertHas(bench.say("teach escs", kTeaching), "full: plug the battery in");
  TEST_ASSERT_TRUE(allFull(bench));
}

void assertNeverOn(const CheckoutBench& bench) {
  TEST_ASSERT_EQUAL_FLOAT(bench.vehicle.commandOff, bench.highest);
}

void test_full_comes_after_a_countdown_of_3_s_and_off_with_the_next_key() {
  CheckoutBench bench;
  promise(bench);
  bench.say("teach escs", 2.98F);
  assertNeverOn(bench);
  bench.run(0.03F);
  TEST_ASSERT_TRUE(allFull(bench));
  bench.run(10.0F);
  TEST_ASSERT_TRUE(allFull(bench));
  bench.output.clear();
  bench.input += " ";
  bench.step();
  TEST_ASSERT_TRUE(bench.allOff());
  bench.run(0.1F);
  assertHas(bench.output, "off: wait for the beeps again");
  bench.run(60.0F);
  TEST_ASSERT_TRUE(bench.allOff());
}

void test_full_ends_by_itself_after_30_s() {
  CheckoutBench bench;
  promise(bench);
  bench.say("teach escs", 32.98F);
  TEST_ASSERT_TRUE(allFull(bench));
  bench.output.clear();
  bench.run(0.04F);
  TEST_ASSERT_TRUE(bench.allOff());
  assertHas(bench.output, "off: wait for the beeps again");
  CheckoutBench late;  // and a pass that comes late does not lengthen it
  teach(late);
  late.board.advance(30'000'000);
  late.step();
  TEST_ASSERT_TRUE(late.allOff());
}

void test_it_wants_both_words_within_60_s_and_the_battery_s_each_time() {
  CheckoutBench bench;
  bench.begin();
  assertHas(bench.say("teach escs", 6.0F), "refused: take the propellers off");
  bench.say("battery off");
  assertHas(bench.say("teach escs", 6.0F), "refused: take the propellers off");
  bench.say("props off");
  bench.run(59.0F);
  bench.say("props off");  // renewed, the battery's is not
  assertHas(bench.say("teach escs", 6.0F), "refused: unplug the battery");
  assertNeverOn(bench);

  // Now it has power: its word must not count a second time.
  CheckoutBench again;
  teach(again);
  again.say("");
  again.highest = again.vehicle.commandOff;
  assertHas(again.say("teach escs", 6.0F), "refused: unplug the battery");
  assertNeverOn(again);

  // Nor when 32 bits of clock come round, with passes of 20 ms.
  CheckoutBench wrapped;
  promise(wrapped);
  wrapped.stepTime = 20'000;
  wrapped.run(4294.5F);
  wrapped.stepTime = 300;
  wrapped.run(3.0F);
  assertHas(wrapped.say("teach escs", 6.0F), "refused: take the propellers off");
  assertNeverOn(wrapped);
}

const std::vector<std::function<void(CheckoutBench&)>> kSpoils{
    [](CheckoutBench& b) { b.board.pilot.kill = true; },
    [](CheckoutBench& b) { b.board.imu.dead = true; },
    [](CheckoutBench& b) { b.hold(eulerToQuaternion({0.6F, 0.0F, 0.0F})); },
    [](CheckoutBench& b) { b.hold(Quaternion{}, {0.0F, 0.0F, 2.0F}); },
    [](CheckoutBench& b) { b.input += "\x1b"; },
};

void test_each_guard_of_a_motor_test_guards_it_from_the_start_to_the_end() {
  for (std::size_t i = 0; i < kSpoils.size(); ++i) {
    if (i + 1 < kSpoils.size()) {  // no key can be pressed before
      CheckoutBench before;
      promise(before);
      kSpoils[i](before);
      before.run(0.5F);
      assertHas(before.say("teach escs", 6.0F), "refused: ");
      assertNeverOn(before);
    }
    CheckoutBench counting;
    promise(counting);
    counting.say("teach escs", 1.5F);
    kSpoils[i](counting);
    counting.run(6.0F);
    assertNeverOn(counting);
    CheckoutBench full;
    teach(full);
    kSpoils[i](full);
    full.run(0.5F);
    TEST_ASSERT_TRUE(full.allOff());
    full.run(5.0F);
    TEST_ASSERT_TRUE(full.allOff());
  }
}

void test_kill_and_any_character_end_it_in_the_same_step() {
  CheckoutBench killed;
  teach(killed);
  killed.board.pilot.kill = true;
  killed.step();
  TEST_ASSERT_TRUE(killed.allOff());
  for (int c = 0; c < 256; ++c) {
    CheckoutBench bench;
    teach(bench);
    bench.input += static_cast<char>(c);
    bench.step();
    TEST_ASSERT_TRUE(bench.allOff());
  }
}

void test_plugging_the_battery_in_may_shake_the_aircraft() {
  CheckoutBench bench;
  teach(bench);
  bench.disturb = [random = Random(9)](CheckoutBench& b) mutable {
    b.board.imu.reading.gyro += random.vector(1.0F);
    b.board.imu.reading.accel += random.vector(5.0F);
  };
  bench.run(1.0F);
  TEST_ASSERT_TRUE(allFull(bench));
}

void test_it_and_a_motor_test_end_each_other() {
  CheckoutBench bench;
  teach(bench);
  const std::string text = bench.say("motor 2", kTeaching);  // its first letter ended it
  assertHas(text, "off: wait for the beeps again");
  assertHas(text, "turning: any key stops it");
  std::size_t on = 0;
  for (const float command : bench.commands) on += command > bench.vehicle.commandOff;
  TEST_ASSERT_EQUAL(1, on);
  TEST_ASSERT_FALSE(allFull(bench));
  bench.say("battery off");
  bench.say("teach escs", kTeaching);
  TEST_ASSERT_TRUE(allFull(bench));
  bench.say("reboot");
  TEST_ASSERT_TRUE(bench.checkout.rebootAsked());
  TEST_ASSERT_TRUE(bench.allOff());
}

/// `pio device monitor` sends return and line feed.
void test_an_enter_of_two_characters_does_not_end_what_it_began() {
  for (const char* command : {"motor 2\r\n", "teach escs\r\n"}) {
    for (const bool apart : {false, true}) {
      CheckoutBench bench;
      promise(bench);
      bench.input += std::string(command).substr(0, std::string(command).size() - (apart ? 1 : 0));
      bench.run(0.01F);
      if (apart) bench.input += '\n';
      bench.run(kTeaching);
      TEST_ASSERT_FALSE(bench.allOff());
      bench.input += '\n';  // but the next is a key
      bench.step();
      TEST_ASSERT_TRUE(bench.allOff());
    }
  }
}

void test_escs_that_are_not_told_by_pulses_are_not_taught() {
  CheckoutBench bench(0, benchConfig(*findAirframe("UgglanQ450")));
  promise(bench);
  assertHas(bench.say("teach escs", 6.0F), "refused: these ESCs are not told by the width");
  assertNeverOn(bench);
}

}  // namespace

void runEscCalibrationTests() {
  RUN_TEST(test_full_comes_after_a_countdown_of_3_s_and_off_with_the_next_key);
  RUN_TEST(test_full_ends_by_itself_after_30_s);
  RUN_TEST(test_it_wants_both_words_within_60_s_and_the_battery_s_each_time);
  RUN_TEST(test_each_guard_of_a_motor_test_guards_it_from_the_start_to_the_end);
  RUN_TEST(test_kill_and_any_character_end_it_in_the_same_step);
  RUN_TEST(test_plugging_the_battery_in_may_shake_the_aircraft);
  RUN_TEST(test_it_and_a_motor_test_end_each_other);
  RUN_TEST(test_an_enter_of_two_characters_does_not_end_what_it_began);
  RUN_TEST(test_escs_that_are_not_told_by_pulses_are_not_taught);
}
