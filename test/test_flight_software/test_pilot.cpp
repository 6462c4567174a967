// Who may arm, kill and steer: the aircraft's switches, the radio and commands, made one.
#include <unity.h>

#include "Pilot.h"
#include "Transmitter.h"
#include "suites.h"

using namespace strix;

namespace {

/// A pilot's desk, 500 times a second, with a transmitter that sends each 7 ms when it is on.
class Desk {
 public:
  Pilot pilot;
  PilotSwitches wired;
  PilotInput sticks;
  bool transmits = false;
  bool motorsOn = false;

  Desk() {
    sticks.valid = true;
    pilot.configure(Parameters{});
  }

  /// One control tick.
  ConditionSet tick() {
    now_ += 2000;
    if (transmits && now_ - sent_ >= 7000) {
      sent_ = now_;
      pilot.add(frameOf(sticks, channelMap(Parameters{})), now_);
    }
    return pilot.update(now_, wired, motorsOn);
  }

  /// All that was there in so many seconds.
  ConditionSet run(float seconds) {
    ConditionSet any = condition::kNone;
    for (int i = 0; i < static_cast<int>(seconds * 500.0F); ++i) any |= tick();
    return any;
  }

 private:
  Micros now_ = 0xFFFF0000U;  // soon wraps
  Micros sent_ = 0;
};

bool has(ConditionSet set, ConditionSet bit) { return (set & bit) != 0; }

void test_a_wired_switch_arms_by_its_edge_and_disarms_by_being_off() {
  Desk desk;
  desk.wired.arm = true;
  TEST_ASSERT_FALSE(has(desk.run(1.0F), condition::kArmEdge));  // held through power-up
  desk.wired.arm = false;
  TEST_ASSERT_TRUE(has(desk.tick(), condition::kDisarm));
  desk.wired.arm = true;
  TEST_ASSERT_TRUE(has(desk.tick(), condition::kArmEdge));
  TEST_ASSERT_FALSE(has(desk.run(1.0F), condition::kArmEdge | condition::kDisarm));
  desk.wired.arm = false;
  desk.tick();
  TEST_ASSERT_TRUE(has(desk.tick(), condition::kDisarm));  // as long as it is off
}

void test_the_radio_arms_by_an_edge_that_was_heard_and_by_nothing_else() {
  Desk desk;
  desk.sticks.arm = true;
  desk.transmits = true;
  TEST_ASSERT_FALSE(has(desk.run(1.0F), condition::kArmEdge));  // switched on with arm on
  desk.sticks.arm = false;
  desk.run(0.1F);
  desk.transmits = false;
  desk.run(1.0F);
  TEST_ASSERT_TRUE(desk.pilot.radioLost());
  desk.sticks.arm = true;  // moved while nobody heard it
  desk.transmits = true;
  TEST_ASSERT_FALSE(has(desk.run(1.0F), condition::kArmEdge));
  TEST_ASSERT_FALSE(desk.pilot.radioLost());
  desk.sticks.arm = false;
  desk.run(0.1F);
  desk.sticks.arm = true;
  TEST_ASSERT_TRUE(has(desk.run(0.1F), condition::kArmEdge));
}

void test_who_has_armed_holds_the_motors_and_another_switch_that_is_off_does_not_stop_them() {
  Desk desk;
  desk.transmits = true;
  desk.run(0.5F);
  desk.pilot.askArm(CommandSource::Link);
  TEST_ASSERT_TRUE(has(desk.tick(), condition::kArmEdge));
  TEST_ASSERT_TRUE(desk.pilot.linkArmed());
  desk.motorsOn = true;
  TEST_ASSERT_FALSE(has(desk.run(1.0F), condition::kDisarm | condition::kArmEdge));
  desk.sticks.arm = true;  // but one that is moved to off does
  desk.run(0.1F);
  desk.sticks.arm = false;
  TEST_ASSERT_TRUE(has(desk.run(0.1F), condition::kDisarm));
}

void test_a_radio_that_is_lost_disarms_nothing_and_neither_does_its_return() {
  Desk desk;
  desk.transmits = true;
  desk.run(0.5F);
  desk.sticks.arm = true;
  TEST_ASSERT_TRUE(has(desk.run(0.1F), condition::kArmEdge));
  desk.motorsOn = true;
  desk.transmits = false;
  TEST_ASSERT_FALSE(has(desk.run(2.0F), condition::kDisarm));
  desk.transmits = true;
  TEST_ASSERT_FALSE(has(desk.run(1.0F), condition::kDisarm | condition::kArmEdge));
}

void test_a_kill_counts_by_whomever_and_stays_until_who_killed_takes_it_back() {
  Desk desk;
  desk.transmits = true;
  desk.run(0.5F);
  TEST_ASSERT_FALSE(has(desk.run(0.1F), condition::kKill));
  desk.wired.kill = true;
  TEST_ASSERT_TRUE(has(desk.tick(), condition::kKill));  // in the same tick
  desk.wired.kill = false;
  TEST_ASSERT_FALSE(has(desk.tick(), condition::kKill));
  desk.sticks.kill = true;
  TEST_ASSERT_TRUE(has(desk.run(0.01F), condition::kKill));
  desk.transmits = false;  // lost with the kill on: it stays on
  desk.run(1.0F);
  TEST_ASSERT_TRUE(has(desk.tick(), condition::kKill));
  desk.sticks.kill = false;
  desk.transmits = true;
  desk.run(0.5F);
  TEST_ASSERT_FALSE(has(desk.tick(), condition::kKill));
  desk.pilot.askKill(true);
  TEST_ASSERT_TRUE(has(desk.tick(), condition::kKill));
  desk.run(1.0F);
  TEST_ASSERT_TRUE(has(desk.tick(), condition::kKill));
  desk.pilot.askKill(false);
  TEST_ASSERT_FALSE(has(desk.tick(), condition::kKill));
}

void test_the_sticks_take_over_by_moving_the_mode_switch_not_by_coming_back() {
  Desk desk;
  desk.transmits = true;
  desk.sticks.mode = PilotMode::Mission;
  TEST_ASSERT_FALSE(has(desk.run(1.0F), condition::kSticks | condition::kSticksEdge));
  desk.sticks.mode = PilotMode::PositionHold;
  const ConditionSet moved = desk.run(0.1F);
  TEST_ASSERT_TRUE(has(moved, condition::kSticks));
  TEST_ASSERT_TRUE(has(moved, condition::kSticksEdge));
  TEST_ASSERT_FALSE(has(desk.run(1.0F), condition::kSticksEdge));  // once
  desk.transmits = false;
  desk.run(1.0F);
  TEST_ASSERT_FALSE(has(desk.tick(), condition::kSticks));
  desk.transmits = true;
  const ConditionSet back = desk.run(1.0F);
  TEST_ASSERT_TRUE(has(back, condition::kSticks));
  TEST_ASSERT_FALSE(has(back, condition::kSticksEdge));
}

void test_a_wish_lasts_until_it_is_done_the_last_one_counts_and_none_outlives_the_flight() {
  Desk desk;
  desk.motorsOn = true;
  desk.tick();
  desk.pilot.ask(condition::kReturn);
  desk.pilot.ask(condition::kLandAsked);
  TEST_ASSERT_TRUE(has(desk.run(1.0F), condition::kLandAsked));
  TEST_ASSERT_FALSE(has(desk.tick(), condition::kReturn));
  desk.pilot.done(condition::kLandAsked);
  TEST_ASSERT_FALSE(has(desk.tick(), condition::kLandAsked));
  desk.pilot.ask(condition::kHoldAsked);
  desk.pilot.askStart();
  desk.tick();
  desk.motorsOn = false;
  desk.tick();
  desk.motorsOn = true;
  TEST_ASSERT_FALSE(has(desk.run(0.1F), condition::kHoldAsked | condition::kStart));
}

void test_the_throttle_takes_off_only_from_where_the_mode_has_it() {
  Desk desk;
  desk.transmits = true;
  const auto up = [&desk](PilotMode mode, float throttle) {
    desk.sticks.mode = mode;
    desk.sticks.throttle = throttle;
    desk.run(0.1F);
    return has(desk.tick(), condition::kThrottleUp);
  };
  desk.run(0.5F);
  TEST_ASSERT_FALSE(up(PilotMode::Attitude, 0.1F));
  TEST_ASSERT_TRUE(up(PilotMode::Attitude, 0.3F));
  TEST_ASSERT_FALSE(up(PilotMode::PositionHold, 0.5F));  // the middle holds the height
  TEST_ASSERT_TRUE(up(PilotMode::PositionHold, 0.7F));
  TEST_ASSERT_FALSE(up(PilotMode::Mission, 1.0F));  // flies by itself
  TEST_ASSERT_FALSE(desk.pilot.throttleLow());
  desk.sticks.throttle = 0.0F;
  desk.run(0.1F);
  TEST_ASSERT_TRUE(desk.pilot.throttleLow());
}

}  // namespace

void runPilotTests() {
  RUN_TEST(test_a_wired_switch_arms_by_its_edge_and_disarms_by_being_off);
  RUN_TEST(test_the_radio_arms_by_an_edge_that_was_heard_and_by_nothing_else);
  RUN_TEST(test_who_has_armed_holds_the_motors_and_another_switch_that_is_off_does_not_stop_them);
  RUN_TEST(test_a_radio_that_is_lost_disarms_nothing_and_neither_does_its_return);
  RUN_TEST(test_a_kill_counts_by_whomever_and_stays_until_who_killed_takes_it_back);
  RUN_TEST(test_the_sticks_take_over_by_moving_the_mode_switch_not_by_coming_back);
  RUN_TEST(test_a_wish_lasts_until_it_is_done_the_last_one_counts_and_none_outlives_the_flight);
  RUN_TEST(test_the_throttle_takes_off_only_from_where_the_mode_has_it);
}
