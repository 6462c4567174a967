// When a hazard is believed, and when it is given up: each raised after its time and not before,
// passed over when it is a blip, and right across the wrap of the clock.
#include <unity.h>

#include <limits>

#include "Hazards.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr Micros kTick = 2'000;
constexpr Micros kSlow = 20'000;  ///< what is looked at 50 times a second comes so much later
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Hazards that see the same signs in every tick, and a clock that wraps soon after the start.
struct Bench {
  Hazards hazards;
  HazardSigns signs;
  Parameters parameters;
  Micros now = 0U - 400'000U;
  ConditionSet set = condition::kNone;
  Micros ticks = 0;
  std::uint32_t missedPerTick = 0;
  std::uint32_t clippedPerTick = 0;
  bool gps = true;
  bool link = true;

  Bench() {
    signs.state = FlightState::Hold;
    signs.motorsOn = true;
    hazards.configure(parameters);
    hazards.start(now);
    run(2'500'000);  // past the first fixes and the first second of counts
    TEST_ASSERT_TRUE(set == condition::kNone);
  }

  void tick() {
    now += kTick;
    ++ticks;
    signs.gpsUsed = gps && ticks % 50 == 0;      // 10 Hz
    signs.linkHeard = link && ticks % 500 == 0;  // 1 Hz
    signs.overruns += missedPerTick;
    signs.imuClipped += clippedPerTick;
    set = hazards.update(signs, now);
  }
  void run(Micros duration) {
    for (Micros t = 0; t < duration; t += kTick) tick();
  }
  /// For so long this condition does not come.
  void never(ConditionSet bit, Micros duration) {
    for (Micros t = 0; t < duration; t += kTick) {
      tick();
      TEST_ASSERT_FALSE(has(bit));
    }
  }
  [[nodiscard]] bool has(ConditionSet bit) const { return (set & bit) != 0; }

  /// Time until this condition comes or goes; us.
  Micros until(ConditionSet bit, bool there) {
    Micros waited = 0;
    while (has(bit) != there) {
      tick();
      waited += kTick;
      TEST_ASSERT_TRUE_MESSAGE(waited < 60'000'000, "never");
    }
    return waited;
  }
};

/// Between the time and what the look 50 times a second adds to it.
void expectAfter(Micros expected, Micros waited) {
  TEST_ASSERT_TRUE_MESSAGE(waited >= expected, "too early");
  TEST_ASSERT_TRUE_MESSAGE(waited <= expected + kSlow + kTick, "too late");
}

void test_tilt_past_90_deg_counts_at_once_and_no_number_is_past_it_too() {
  for (const float tilt : {-0.01F, -1.0F, kNaN}) {
    Bench b;
    b.signs.cosTilt = tilt;
    b.tick();
    TEST_ASSERT_TRUE(b.has(condition::kUpset));
    b.signs.cosTilt = 0.01F;  // 89.4 deg
    b.tick();
    TEST_ASSERT_FALSE(b.has(condition::kUpset));
  }
}

void test_imu_estimator_and_radio_count_at_once() {
  Bench b;
  b.signs.imuFresh = false;
  b.signs.estimatorLost = true;
  b.signs.radioLost = true;
  b.tick();
  TEST_ASSERT_TRUE(b.set == (condition::kImuLost | condition::kEstimatorUnhealthy));
  b.signs.radioKnown = true;  // a radio that never was there is not lost
  b.tick();
  TEST_ASSERT_TRUE(b.has(condition::kRadioLost));
}

void test_the_tilt_limit_is_that_of_the_state_and_takes_its_time() {
  struct Case {
    FlightState state;
    float limitDeg;
  };
  const Parameters p;
  for (const Case c : {Case{FlightState::Hold, p.tiltLimit}, Case{FlightState::Manual, p.tiltLimit},
                       Case{FlightState::AttitudeStand, p.tiltLimit},
                       Case{FlightState::Armed, p.armTilt + 10.0F}}) {
    Bench b;
    b.signs.state = c.state;
    b.signs.cosTilt = cosine((c.limitDeg - 1.0F) * kDegToRad);
    b.run(5'000'000);
    TEST_ASSERT_FALSE(b.has(condition::kTiltLimit));
    b.signs.cosTilt = cosine((c.limitDeg + 1.0F) * kDegToRad);
    expectAfter(toMicros(p.tiltTime) - kSlow, b.until(condition::kTiltLimit, true));
  }
}

void test_a_tilt_that_ends_in_time_is_a_gust() {
  Bench b;
  for (int i = 0; i < 10; ++i) {
    b.signs.cosTilt = 0.3F;
    b.run(440'000);
    TEST_ASSERT_FALSE(b.has(condition::kTiltLimit));
    b.signs.cosTilt = 1.0F;
    b.run(40'000);
  }
}

void test_with_the_motors_off_an_aircraft_may_be_carried_at_any_tilt() {
  Bench b;
  b.signs.state = FlightState::Idle;
  b.signs.motorsOn = false;
  b.signs.cosTilt = 0.1F;
  b.run(5'000'000);
  TEST_ASSERT_FALSE(b.has(condition::kTiltLimit));
}

void test_the_fence_is_a_circle_and_a_ceiling_and_is_left_and_entered_with_a_band() {
  const Parameters p;
  struct Place {
    float north;
    float east;
    float height;
  };
  const float diagonal = p.fenceRadius * 0.70710678F;
  for (const Place out : {Place{p.fenceRadius, 0.0F, 0.0F}, Place{-diagonal, diagonal, 2.0F},
                          Place{0.0F, 0.0F, p.fenceHeight}}) {
    Bench b;
    const auto at = [&b, &out](float share) {
      b.signs.north = out.north * share;
      b.signs.east = out.east * share;
      b.signs.height = out.height * share;
    };
    at(0.995F);
    b.run(2'000'000);
    TEST_ASSERT_FALSE(b.has(condition::kOutsideFence));
    at(1.005F);
    expectAfter(200'000 - kSlow, b.until(condition::kOutsideFence, true));
    TEST_ASSERT_FALSE(b.has(condition::kFarOutsideFence));
    at(0.995F);  // within, but not by half a metre
    b.run(2'000'000);
    TEST_ASSERT_TRUE(b.has(condition::kOutsideFence));
    at(0.96F);  // by 0.6 m of 15
    expectAfter(200'000 - kSlow, b.until(condition::kOutsideFence, false));
  }
}

void test_far_outside_is_the_margin_further_and_no_number_is_far_outside() {
  Bench b;
  b.signs.north = b.parameters.fenceRadius + b.parameters.fenceMargin - 0.1F;
  b.run(1'000'000);
  TEST_ASSERT_FALSE(b.has(condition::kFarOutsideFence));
  b.signs.north += 0.2F;
  expectAfter(200'000 - kSlow, b.until(condition::kFarOutsideFence, true));
  Bench lost;
  lost.signs.height = kNaN;
  lost.run(300'000);
  TEST_ASSERT_TRUE(lost.has(condition::kFarOutsideFence));
}

void test_one_fix_that_jumps_is_not_outside_the_fence() {
  Bench b;
  b.signs.north = 100.0F;
  b.run(150'000);  // until the next fix but one
  b.signs.north = 0.0F;
  b.run(1'000'000);
  TEST_ASSERT_TRUE(b.set == condition::kNone);
}

void test_magnetometer_and_altimeter_are_lost_after_their_times_and_back_after_a_second() {
  const Parameters p;
  struct Case {
    bool HazardSigns::* fresh;
    ConditionSet bit;
    float timeout;
    Micros own;  ///< for so long a reading was fresh
  };
  for (const Case c :
       {Case{&HazardSigns::magFresh, condition::kMagLost, p.magTimeout, SensorConfig{}.magTimeout},
        Case{&HazardSigns::altFresh, condition::kAltLost, p.altTimeout,
             SensorConfig{}.altTimeout}}) {
    Bench b;
    b.signs.*c.fresh = false;
    expectAfter(toMicros(c.timeout) - c.own - kSlow, b.until(c.bit, true));
    b.signs.*c.fresh = true;
    b.run(900'000);
    b.signs.*c.fresh = false;  // not yet
    b.run(100'000);
    b.signs.*c.fresh = true;
    TEST_ASSERT_TRUE(b.has(c.bit));
    expectAfter(1'000'000 - kSlow, b.until(c.bit, false));
  }
}

void test_a_timeout_below_the_sensors_own_is_no_timeout_of_an_hour() {
  Bench b;
  b.parameters.altTimeout = 0.2F;
  b.hazards.configure(b.parameters);
  b.signs.altFresh = false;
  expectAfter(0, b.until(condition::kAltLost, true));
}

void test_gps_is_lost_without_a_fix_for_its_time_and_back_after_a_second_of_fixes() {
  Bench b;
  b.gps = false;
  const Micros waited = b.until(condition::kGpsLost, true);
  // The last fix came up to 0.1 s before.
  TEST_ASSERT_UINT_WITHIN(100'000 + kSlow, toMicros(b.parameters.gpsTimeout), waited);
  b.run(10'000'000);
  TEST_ASSERT_TRUE(b.has(condition::kGpsLost));
  b.gps = true;
  const Micros back = b.until(condition::kGpsLost, false);
  TEST_ASSERT_UINT_WITHIN(100'000 + kSlow, 1'000'000, back);
}

void test_gps_that_has_been_lost_for_71_minutes_is_still_lost() {
  // The clock comes round to the last fix again.
  Bench b;
  b.gps = false;
  b.until(condition::kGpsLost, true);
  for (int i = 0; i < 4400; ++i) {  // 73 min in steps of 1 s
    b.now += 998'000;
    b.tick();
    TEST_ASSERT_TRUE(b.has(condition::kGpsLost));
  }
}

void test_a_battery_is_low_under_load_for_its_time_and_recovers_with_a_band() {
  struct Case {
    ConditionSet bit;
    float volts;
  };
  const Parameters p;
  for (const Case c : {Case{condition::kBatteryLow, p.batteryLow},
                       Case{condition::kBatteryCritical, p.batteryCritical}}) {
    Bench b;
    b.signs.cellVoltage = c.volts + 0.01F;
    b.run(20'000'000);
    TEST_ASSERT_FALSE(b.has(c.bit));
    b.signs.cellVoltage = c.volts - 0.01F;
    b.run(4'900'000);
    b.signs.cellVoltage = c.volts + 0.01F;  // less thrust for a moment
    b.run(100'000);
    b.signs.cellVoltage = c.volts - 0.01F;
    TEST_ASSERT_FALSE(b.has(c.bit));
    expectAfter(toMicros(p.batteryTime) - kSlow, b.until(c.bit, true));
    b.signs.cellVoltage = c.volts + 0.09F;
    b.run(20'000'000);
    TEST_ASSERT_TRUE(b.has(c.bit));
    b.signs.cellVoltage = c.volts + 0.11F;
    b.until(c.bit, false);
  }
}

void test_a_battery_that_nobody_measures_is_not_low() {
  Bench b;
  b.signs.cellVoltage = 0.0F;
  b.run(20'000'000);
  TEST_ASSERT_TRUE(b.set == condition::kNone);
}

void test_the_ground_station_is_lost_when_it_flies_and_its_heartbeat_stops() {
  Bench b;
  b.link = false;
  b.run(20'000'000);
  TEST_ASSERT_FALSE(b.has(condition::kLinkLost));  // somebody else flies
  b.signs.linkFlies = true;
  expectAfter(toMicros(b.parameters.linkTimeout) - kSlow, b.until(condition::kLinkLost, true));
  b.link = true;
  b.until(condition::kLinkLost, false);
}

void test_the_loop_is_late_when_one_tick_in_twenty_is_and_not_for_one_hiccup() {
  Bench b;
  b.signs.overruns += 20;  // a bus that hung for once
  b.never(condition::kOverrun, 5'000'000);
  for (int i = 0; i < 100; ++i) {  // 50 a second
    ++b.signs.overruns;
    b.run(20'000);
  }
  TEST_ASSERT_TRUE(b.has(condition::kOverrun));
  b.run(3'000'000);
  TEST_ASSERT_FALSE(b.has(condition::kOverrun));
}

void test_the_imu_is_saturated_by_a_share_of_its_samples_and_not_by_one_knock() {
  Bench b;
  b.signs.imuClipped += 30;
  b.never(condition::kImuSaturated, 5'000'000);
  b.clippedPerTick = 1;  // every other sample
  TEST_ASSERT_TRUE(b.until(condition::kImuSaturated, true) <= 2'000'000 + kSlow);
  b.clippedPerTick = 0;
  b.run(3'000'000);
  TEST_ASSERT_FALSE(b.has(condition::kImuSaturated));
}

void test_a_motor_at_an_end_of_its_range_for_long_counts_in_flight() {
  const Parameters p;
  for (const bool top : {true, false}) {
    Bench b;
    (top ? b.signs.highestMotor : b.signs.lowestMotor) = top ? 1.0F : 0.0F;
    b.run(toMicros(p.saturationTime) - 2 * kSlow);
    (top ? b.signs.highestMotor : b.signs.lowestMotor) = 0.5F;
    b.run(kSlow);
    TEST_ASSERT_FALSE(b.has(condition::kMotorsSaturated));
    (top ? b.signs.highestMotor : b.signs.lowestMotor) = top ? 1.0F : 0.0F;
    expectAfter(toMicros(p.saturationTime) - kSlow, b.until(condition::kMotorsSaturated, true));
    b.signs.state = FlightState::Armed;  // where all are at the low end
    b.run(2'000'000);
    TEST_ASSERT_FALSE(b.has(condition::kMotorsSaturated));
  }
}

void test_a_failed_log_counts() {
  Bench b;
  b.signs.logFailed = true;
  b.run(kSlow);
  TEST_ASSERT_TRUE(b.has(condition::kLogFailed));
}

void test_falling_with_motors_that_should_carry_is_a_free_fall() {
  Bench b;
  b.signs.specificForce = 1.5F;  // the drag of a fall at 10 m/s
  expectAfter(300'000 - kTick, b.until(condition::kFreeFall, true));
  b.signs.specificForce = 9.8F;
  b.until(condition::kFreeFall, false);
}

void test_a_fall_that_was_asked_for_is_none_and_neither_is_one_without_a_sensor() {
  Bench stick;
  stick.signs.state = FlightState::Manual;
  stick.signs.specificForce = 0.5F;
  stick.signs.highestMotor = 0.1F;  // the throttle is pulled down
  stick.run(3'000'000);
  TEST_ASSERT_FALSE(stick.has(condition::kFreeFall));
  Bench descent;
  descent.signs.specificForce = 5.0F;  // begins to sink at half a g
  descent.run(3'000'000);
  TEST_ASSERT_FALSE(descent.has(condition::kFreeFall));
  Bench hand;
  hand.signs.state = FlightState::Armed;  // it is thrown up, or falls from the table
  hand.signs.specificForce = 0.5F;
  hand.run(3'000'000);
  TEST_ASSERT_FALSE(hand.has(condition::kFreeFall));
  Bench silent;
  silent.signs.imuFresh = false;
  silent.signs.specificForce = 0.0F;
  silent.run(3'000'000);
  TEST_ASSERT_FALSE(silent.has(condition::kFreeFall));
}

void test_a_knock_after_which_it_tumbles_is_a_crash() {
  Bench b;
  b.signs.specificForce = 150.0F;
  b.run(3 * kTick);
  b.signs.specificForce = 15.0F;
  TEST_ASSERT_FALSE(b.has(condition::kCrash));  // still level
  b.run(200'000);
  b.signs.cosTilt = 0.6F;  // 53 deg
  b.tick();
  TEST_ASSERT_TRUE(b.has(condition::kCrash));
}

void test_neither_a_knock_nor_a_tilt_alone_is_a_crash() {
  Bench landing;
  landing.signs.state = FlightState::Land;
  landing.signs.specificForce = 290.0F;  // hard, on stiff legs: the end of the IMU's range
  landing.run(20'000);
  landing.signs.specificForce = 9.8F;
  landing.run(600'000);
  landing.signs.cosTilt = 0.6F;  // carried away, half a second later
  landing.tick();
  TEST_ASSERT_TRUE(landing.set == condition::kNone);
  Bench sample;
  sample.signs.specificForce = 290.0F;  // garbled
  sample.tick();
  sample.signs.specificForce = 9.8F;
  sample.signs.cosTilt = 0.6F;
  sample.run(300'000);
  TEST_ASSERT_FALSE(sample.has(condition::kCrash));
}

void test_a_parameter_that_is_set_in_flight_keeps_what_was_believed() {
  Bench b;
  b.signs.cellVoltage = 3.3F;
  b.until(condition::kBatteryLow, true);
  b.signs.cosTilt = 0.3F;  // a gust, just now
  b.parameters.returnHeight = 5.0F;
  b.hazards.configure(b.parameters);
  b.run(100'000);
  TEST_ASSERT_TRUE(b.set == condition::kBatteryLow);
}

}  // namespace

void runHazardTests() {
  RUN_TEST(test_tilt_past_90_deg_counts_at_once_and_no_number_is_past_it_too);
  RUN_TEST(test_imu_estimator_and_radio_count_at_once);
  RUN_TEST(test_the_tilt_limit_is_that_of_the_state_and_takes_its_time);
  RUN_TEST(test_a_tilt_that_ends_in_time_is_a_gust);
  RUN_TEST(test_with_the_motors_off_an_aircraft_may_be_carried_at_any_tilt);
  RUN_TEST(test_the_fence_is_a_circle_and_a_ceiling_and_is_left_and_entered_with_a_band);
  RUN_TEST(test_far_outside_is_the_margin_further_and_no_number_is_far_outside);
  RUN_TEST(test_one_fix_that_jumps_is_not_outside_the_fence);
  RUN_TEST(test_magnetometer_and_altimeter_are_lost_after_their_times_and_back_after_a_second);
  RUN_TEST(test_a_timeout_below_the_sensors_own_is_no_timeout_of_an_hour);
  RUN_TEST(test_gps_is_lost_without_a_fix_for_its_time_and_back_after_a_second_of_fixes);
  RUN_TEST(test_gps_that_has_been_lost_for_71_minutes_is_still_lost);
  RUN_TEST(test_a_battery_is_low_under_load_for_its_time_and_recovers_with_a_band);
  RUN_TEST(test_a_battery_that_nobody_measures_is_not_low);
  RUN_TEST(test_the_ground_station_is_lost_when_it_flies_and_its_heartbeat_stops);
  RUN_TEST(test_the_loop_is_late_when_one_tick_in_twenty_is_and_not_for_one_hiccup);
  RUN_TEST(test_the_imu_is_saturated_by_a_share_of_its_samples_and_not_by_one_knock);
  RUN_TEST(test_a_motor_at_an_end_of_its_range_for_long_counts_in_flight);
  RUN_TEST(test_a_failed_log_counts);
  RUN_TEST(test_falling_with_motors_that_should_carry_is_a_free_fall);
  RUN_TEST(test_a_fall_that_was_asked_for_is_none_and_neither_is_one_without_a_sensor);
  RUN_TEST(test_a_knock_after_which_it_tumbles_is_a_crash);
  RUN_TEST(test_neither_a_knock_nor_a_tilt_alone_is_a_crash);
  RUN_TEST(test_a_parameter_that_is_set_in_flight_keeps_what_was_believed);
}
