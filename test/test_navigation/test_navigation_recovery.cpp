/// What is said when the estimate is wrong, and what happens when it is lost.
#include "NavigationRig.h"
#include "suites.h"

using namespace strix;

namespace {

// ---- health ----

constexpr float kCheck = 0.101F;  // s: the checks' period, and one pass

/// Feeds every sensor, as from an aircraft that stays where it is.
template <int States>
void feedAll(Rig<States>& rig) {
  rig.navigation.updateGPSMeas(Vector3f::Zero(), Vector3f::Zero(), rig.now);
  rig.navigation.updateAltMeas(0.0F, rig.now);
  rig.navigation.updateMagMeas(rig.field(), rig.now);
}

template <int States>
void test_a_silent_sensor_is_named_in_time_and_forgiven_at_once() {
  struct Silence {
    NavigationHealth bit;
    Micros timeout;
  };
  const NavigationConfig config = bare();
  const Silence silences[] = {{health::kNoAltimeter, config.altTimeout},
                              {health::kNoGps, config.gpsTimeout},
                              {health::kNoMagnetometer, config.magTimeout}};
  // The wrap: none, before, in and after the silences.
  for (const Micros start :
       {Micros{0}, Micros{0} - 500'000, Micros{0} - 4'000'000, Micros{0} - 31'050'000}) {
    Rig<States> rig(config, start);
    for (int i = 0; i < 10; ++i) {
      rig.run(0.1F);
      feedAll(rig);
    }
    rig.pass();
    TEST_ASSERT_EQUAL_HEX32(health::kNone, rig.navigation.health());
    const Micros begin = rig.now;
    for (const Silence& silence : silences) {
      rig.runUntil(silence.bit, true);
      TEST_ASSERT_FLOAT_WITHIN(kCheck, toSeconds(silence.timeout) + 0.05F,
                               toSeconds(elapsed(rig.now, begin)));
    }
    TEST_ASSERT_TRUE(rig.navigation.healthy());  // it flies on
    feedAll(rig);
    rig.run(kCheck);
    TEST_ASSERT_EQUAL_HEX32(health::kNone, rig.navigation.health());
  }
}

/// A sensor that never comes stays named, also when the 32-bit clock has gone round once.
template <int States>
void test_a_sensor_that_never_comes_stays_missing_when_the_clock_comes_round() {
  Rig<States> rig(bare());
  const Micros step = 190'000;
  const auto missing = health::kNoGps | health::kNoAltimeter | health::kNoMagnetometer;
  rig.run(31.0F, step);
  for (std::uint64_t time = 0; time < 4'400'000'000; time += step) {  // 73 min
    rig.pass(step);
    TEST_ASSERT_EQUAL_HEX32(missing, rig.navigation.health() & missing);
  }
}

/// A fix that fails its gate every time is heard, but not used.
template <int States>
void test_a_sensor_whose_every_value_is_refused_is_not_used_and_named() {
  NavigationConfig config = bare();
  config.readmitAfter = 0;
  Rig<States> rig(config);
  for (int i = 0; i < 350; ++i) {
    rig.run(0.1F);
    rig.navigation.updateGPSMeas(Vector3f::Constant(kNaN), Vector3f::Constant(kNaN), rig.now);
    rig.navigation.updateAltMeas(kNaN, rig.now);
    rig.navigation.updateMagMeas(100.0F * rig.field(), rig.now);
  }
  TEST_ASSERT_TRUE(rig.filter().gpsInnovation().accepted == 0);
  TEST_ASSERT_TRUE(rig.filter().altInnovation().accepted == 0);
  TEST_ASSERT_TRUE(rig.filter().magInnovation().accepted == 0);
  TEST_ASSERT_TRUE(rig.has(health::kNoGps));
  TEST_ASSERT_TRUE(rig.has(health::kNoAltimeter));
  TEST_ASSERT_TRUE(rig.has(health::kNoMagnetometer));
}

/// A field left out for its shape, or for what the motors do, is not used either.
template <int States>
void test_a_field_that_is_left_out_is_named_as_missing() {
  NavigationConfig config = bare();
  config.magWithMotors = WithMotors::Off;
  Rig<States> rig(config);
  rig.navigation.setMotors(MotorState::Hover);
  for (int i = 0; i < 310; ++i) {
    rig.run(0.1F);
    rig.navigation.updateMagMeas(rig.field(), rig.now);
  }
  TEST_ASSERT_TRUE(rig.has(health::kNoMagnetometer));
}

template <int States>
bool tiltIsBelow(const Rig<States>& rig, float limit) {
  const Vector3f a = downInBody(rig.filter().state().attitude);
  return a.cross(downInBody(rig.navigation.complementary().attitude())).norm() < limit;
}

template <int States>
void test_filters_whose_tilts_differ_are_named_after_a_while() {
  for (const Micros start : {Micros{0}, Micros{0} - 3'000'000, Micros{0} - 8'000'000}) {
    NavigationConfig config = bare();
    config.complementary.biasTime = 1e9F;
    Rig<States> rig(config, start, Quaternion{});
    rig.run(1.0F);
    // Gravity 0.6 rad from what the filter holds on to: the complementary filter goes there.
    rig.attitude = eulerToQuaternion({0.6F, 0.0F, 0.0F});
    // It is 0.35 rad away when tan((0.6 - 0.35)/2) = tan(0.3) e^(-t/6), after 5.4 s; sin 0.358 is
    // 0.35: 0.2 s more.
    const float crossing = 5.4F;
    TEST_ASSERT_FLOAT_WITHIN(0.4F, crossing + toSeconds(config.disagreementTime),
                             rig.runUntil(health::kAttitudesDisagree, true));
    TEST_ASSERT_TRUE(rig.navigation.healthy());
    rig.attitude = Quaternion{};
    // Back below 0.35 rad within seconds; then the bit goes with the next check.
    rig.runUntil(health::kAttitudesDisagree, false);
    TEST_ASSERT_TRUE(tiltIsBelow(rig, config.disagreement));
    rig.pass();
    TEST_ASSERT_EQUAL_HEX32(0, rig.navigation.health() & health::kNoArming);
  }
}

/// Upside down the two downs are parallel once more, but not the same.
template <int States>
void test_a_filter_upside_down_disagrees_too() {
  Rig<States> rig(bare(), 0, Quaternion{});
  rig.run(1.0F);
  rig.attitude = eulerToQuaternion({3.0F, 0.0F, 0.0F});
  rig.run(120.0F, 5'000);  // the complementary filter is there after some 60 s
  TEST_ASSERT_TRUE(cosTilt(rig.navigation.complementary().attitude()) < -0.9F);
  TEST_ASSERT_TRUE(cosTilt(rig.filter().state().attitude) > 0.9F);
  TEST_ASSERT_TRUE(rig.has(health::kAttitudesDisagree));
}

// ---- lost, and begun anew ----

/// One sample so strong that the filter's velocity overflows; the gyro is sound, so the
/// complementary filter lives. Yawed by 45 deg, north becomes 4.2e38: infinite in float.
template <int States>
void overflow(Rig<States>& rig) {
  rig.now += kStep;
  rig.navigation.predict({3e38F, -3e38F, 0.0F}, Vector3f::Zero(), rig.now);
  TEST_ASSERT_FALSE(rig.filter().finite());
  rig.navigation.finishPass(rig.now);
}

const Quaternion kNorthEast = eulerToQuaternion({0.0F, 0.0F, kPi / 4.0F});

template <int States>
void test_a_filter_that_is_lost_begins_anew_from_the_fallback() {
  for (const Micros start : {Micros{0}, Micros{0} - 1'000'000}) {
    Rig<States> rig(bare(), start, kNorthEast);
    rig.accelerationNed = {0.5F, 0.2F, -0.1F};
    rig.run(1.0F);
    const VehicleState before = rig.navigation.state();
    overflow(rig);
    TEST_ASSERT_TRUE(rig.navigation.healthy());
    TEST_ASSERT_EQUAL(1, rig.navigation.restarts());
    TEST_ASSERT_TRUE(rig.has(health::kRestarted));
    // Where it was at the last check, at most 0.1 s ago at 0.55 m/s; attitude: the other filter's.
    const VehicleState after = rig.navigation.state();
    assertNear(0.06F, before.positionNed, after.positionNed);
    assertNear(0.06F, before.velocityNed, after.velocityNed);
    assertSameRotation(1e-6F, rig.navigation.complementary().attitude(), after.attitude);
    TEST_ASSERT_TRUE(isPositiveDefinite(rig.filter().packedCovariance()));
    rig.run(20.0F);
    TEST_ASSERT_TRUE(rig.has(health::kRestarted));  // until it is initialised: no flight begins
    TEST_ASSERT_EQUAL(1, rig.navigation.restarts());
  }
}

/// Begun anew it listens to every sensor, delayed ones too.
template <int States>
void test_after_a_new_start_the_sensors_are_used_as_before() {
  NavigationConfig config = bare();
  config.gpsDelay = 137'000;
  config.altDelay = 60'000;
  config.readmitAfter = 0;  // at once, not when patience ends
  Rig<States> rig(config, 0, kNorthEast);
  rig.run(1.0F);
  overflow(rig);
  for (int i = 0; i < 50; ++i) {
    rig.run(0.1F);
    rig.navigation.updateGPSMeas({2.0F, -1.0F, 0.0F}, Vector3f::Zero(), rig.now);
    rig.navigation.updateAltMeas(1.5F, rig.now);
    rig.navigation.finishPass(rig.now);
  }
  TEST_ASSERT_EQUAL(0, rig.filter().gpsInnovation().rejections);
  TEST_ASSERT_EQUAL(0, rig.filter().altInnovation().rejections);
  // 50 fixes of 0.5 m and heights of 0.3 m against a sigma of 10 m, then no error at all.
  assertNear(0.05F, Vector3f(2.0F, -1.0F, -1.5F), rig.navigation.state().positionNed);
}

template <int States>
void test_lost_again_within_10_s_it_stays_lost() {
  struct Again {
    Micros start;
    float pause;  // s
  };
  // The clock wraps not at all, or after the second loss but before 10 s are over.
  for (const Again& again : {Again{0, 9.0F}, Again{Micros{0} - 6'000'000, 4.0F}}) {
    Rig<States> rig(bare(), again.start, kNorthEast);
    rig.run(1.0F);
    overflow(rig);
    rig.run(again.pause);
    const VehicleState before = rig.navigation.state();
    overflow(rig);
    TEST_ASSERT_FALSE(rig.navigation.healthy());
    TEST_ASSERT_TRUE(rig.has(health::kNotFinite));
    TEST_ASSERT_EQUAL(1, rig.navigation.restarts());
    // Lost, it gives its last position and the other filter's attitude, which goes on turning.
    rig.navigation.predict(rig.accel(), {0.0F, 0.0F, 1.0F}, rig.now += 100'000);
    rig.navigation.finishPass(rig.now);
    const VehicleState lost = rig.navigation.state();
    assertNear(0.0F, rig.navigation.complementary().attitude(), lost.attitude);
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, kPi / 4.0F + 0.1F, yawOf(lost.attitude));
    assertNear(0.01F, before.positionNed, lost.positionNed);
    assertNear(0.01F, before.velocityNed, lost.velocityNed);
    assertNear(1e-6F, Vector3f(0.0F, 0.0F, 1.0F), lost.rateBody);
    rig.run(30.0F);
    TEST_ASSERT_FALSE(rig.navigation.healthy());
    TEST_ASSERT_EQUAL(1, rig.navigation.restarts());
  }
}

template <int States>
void test_lost_again_after_10_s_it_begins_anew_again() {
  Rig<States> rig(bare(), Micros{0} - 6'000'000, kNorthEast);
  rig.run(1.0F);
  overflow(rig);
  rig.run(10.1F);
  overflow(rig);
  TEST_ASSERT_TRUE(rig.navigation.healthy());
  TEST_ASSERT_EQUAL(2, rig.navigation.restarts());
}

/// With the gyro insane both filters are lost: nothing is left to begin from.
template <int States>
void test_without_a_fallback_there_is_no_new_start() {
  // 2e8 rad/s turn so far in a step that no angle is left, but overflow nothing else.
  for (const float rate : {1e30F, 2e8F, -2e8F}) {
    Rig<States> rig(bare());
    rig.run(1.0F);
    rig.navigation.predict(rig.accel(), {rate, 0.0F, 0.0F}, rig.now += kStep);
    rig.navigation.finishPass(rig.now);
    TEST_ASSERT_FALSE(rig.navigation.healthy());
    rig.run(20.0F);
    TEST_ASSERT_FALSE(rig.navigation.healthy());
    TEST_ASSERT_EQUAL(0, rig.navigation.restarts());
    TEST_ASSERT_FALSE(isFinite(rig.navigation.state().attitude.w));  // nobody takes it for level
  }
}

/// Accelerates until a health check finds a covariance that is none; false: it found none, or what
/// is not finite. The check looks at a copy, one row a pass, so the present one may be sound again.
/// Tilt's error times 1e8 m/s^2 is velocity's: correlated to the last bit, then rounded.
template <int States>
bool spoilCovariance(Rig<States>& rig) {
  const NavigationHealth before = rig.navigation.health();
  const std::uint32_t restarts = rig.navigation.restarts();
  bool indefinite = false;
  for (int i = 0; i < 500; ++i) {
    rig.navigation.predict({1e8F, -2e7F, 3e7F}, {1.3F, 0.2F, 1.1F}, rig.now += kStep);
    const bool finite = rig.filter().finite() && rig.filter().healthy();
    indefinite = indefinite || !isPositiveDefinite(rig.filter().packedCovariance());
    rig.navigation.finishPass(rig.now);
    if (rig.navigation.restarts() != restarts || rig.navigation.health() != before) {
      return finite && indefinite;
    }
  }
  return false;
}

template <int States>
void test_a_covariance_that_is_none_is_found_and_left() {
  Rig<States> rig(bare(), 0, kNorthEast);
  rig.run(1.0F);
  TEST_ASSERT_TRUE(spoilCovariance(rig));
  TEST_ASSERT_TRUE(rig.navigation.healthy());
  TEST_ASSERT_EQUAL(1, rig.navigation.restarts());
  TEST_ASSERT_TRUE(isPositiveDefinite(rig.filter().packedCovariance()));
  rig.run(1.0F);
  TEST_ASSERT_TRUE(spoilCovariance(rig));
  TEST_ASSERT_FALSE(rig.navigation.healthy());
  TEST_ASSERT_TRUE(rig.has(health::kNotPositiveDefinite));
  TEST_ASSERT_FALSE(rig.has(health::kNotFinite));
}

}  // namespace

void runRecoveryTests() {
  Unity.TestFile = __FILE__;
  RUN_BOTH(test_a_silent_sensor_is_named_in_time_and_forgiven_at_once);
  RUN_BOTH(test_a_sensor_that_never_comes_stays_missing_when_the_clock_comes_round);
  RUN_BOTH(test_a_sensor_whose_every_value_is_refused_is_not_used_and_named);
  RUN_BOTH(test_a_field_that_is_left_out_is_named_as_missing);
  RUN_BOTH(test_filters_whose_tilts_differ_are_named_after_a_while);
  RUN_BOTH(test_a_filter_upside_down_disagrees_too);
  RUN_BOTH(test_a_filter_that_is_lost_begins_anew_from_the_fallback);
  RUN_BOTH(test_after_a_new_start_the_sensors_are_used_as_before);
  RUN_BOTH(test_lost_again_within_10_s_it_stays_lost);
  RUN_BOTH(test_lost_again_after_10_s_it_begins_anew_again);
  RUN_BOTH(test_without_a_fallback_there_is_no_new_start);
  RUN_BOTH(test_a_covariance_that_is_none_is_found_and_left);
}
