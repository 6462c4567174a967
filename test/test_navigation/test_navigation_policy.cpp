/// When the filter listens to which sensor.
#include "NavigationRig.h"
#include "suites.h"

using namespace strix;

namespace {

// ---- what the motors do to the sensors ----

/// Factor on the variance that each use has in each state of the motors; 0: not used.
struct Use {
  WithMotors use;
  float stopped, hover, disturbed;
};
constexpr float kFactor = 25.0F;
constexpr Use kUses[] = {{WithMotors::On, 1.0F, 1.0F, 1.0F},
                         {WithMotors::Inflated, 1.0F, 1.0F, kFactor},
                         {WithMotors::HoverOnly, 1.0F, 1.0F, 0.0F},
                         {WithMotors::Off, 1.0F, 0.0F, 0.0F}};

/// @param measure  makes one measurement after a while without any, with these motors and this use
template <class Measure>
void assertFactors(float ownVariance, const Measure& measure) {
  const Innovation usual = measure(WithMotors::On, MotorState::Stopped);
  TEST_ASSERT_TRUE(usual.count > 0);
  for (const Use& row : kUses) {
    const float factors[] = {row.stopped, row.hover, row.disturbed};
    for (int i = 0; i < 3; ++i) {
      const Innovation found = measure(row.use, kMotorStates[i]);
      if (factors[i] == 0.0F) {
        TEST_ASSERT_EQUAL(0, found.count);
        TEST_ASSERT_EQUAL(0, found.accepted + found.rejections);
        continue;
      }
      TEST_ASSERT_EQUAL(usual.count, found.count);
      // The first scalar's variance is H P H^T + factor R, with the same P: a few roundings.
      const float expected = usual.variance[0] + (factors[i] - 1.0F) * ownVariance;
      TEST_ASSERT_FLOAT_WITHIN(1e-5F * expected, expected, found.variance[0]);
    }
  }
}

template <int States>
void test_running_motors_do_to_the_tilt_what_is_configured() {
  for (const TiltFusion fusion : {TiltFusion::Gated, TiltFusion::Vibration}) {
    const float own = bare().tilt.variance(toSeconds(kStep));
    assertFactors(own, [fusion](WithMotors use, MotorState motors) {
      NavigationConfig config = bare();
      config.tiltFusion = fusion;
      config.tiltWithMotors = use;
      config.magWithMotors = WithMotors::Off;  // it is the other sensor's
      config.disturbedFactor = kFactor;
      Rig<States> rig(config);
      rig.run(0.1F);
      rig.navigation.setMotors(motors);
      rig.predict();
      rig.navigation.updateTiltMeas(rig.accel());
      return rig.filter().tiltInnovation();
    });
  }
}

template <int States>
void test_running_motors_do_to_the_magnetometer_what_is_configured() {
  for (const MagFusion fusion : {MagFusion::ThreeAxis, MagFusion::HeadingOnly}) {
    const float dt = 0.101F;
    const float own =
        fusion == MagFusion::ThreeAxis ? bare().mag.variance(dt) : bare().heading.variance(dt);
    assertFactors(own, [fusion](WithMotors use, MotorState motors) {
      NavigationConfig config = bare();
      config.magFusion = fusion;
      config.magWithMotors = use;
      config.tiltWithMotors = WithMotors::Off;
      config.disturbedFactor = kFactor;
      Rig<States> rig(config);
      rig.predict();  // the magnetometer's clock starts here
      rig.run(0.1F);
      rig.navigation.setMotors(motors);
      rig.predict();
      rig.navigation.updateMagMeas(rig.field(), rig.now);
      return rig.filter().magInnovation();
    });
  }
}

template <int States>
void test_no_tilt_is_used_where_it_is_switched_off() {
  Rig<States> rig(bare());
  rig.run(0.1F);
  rig.navigation.updateTiltMeas(rig.accel());
  TEST_ASSERT_EQUAL(0, rig.filter().tiltInnovation().count);
}

template <int States>
void test_vibration_makes_the_tilt_less_sure_instead_of_the_gate() {
  NavigationConfig config = bare();
  config.tiltFusion = TiltFusion::Vibration;
  Rig<States> rig(config);
  const auto shaken = [&rig](float amplitude) {
    rig.accelerationNed = {0.0F, 0.0F, 0.0F};
    for (int i = 0; i < 8'000; ++i) {
      rig.accelerationNed.z() = i % 2 == 0 ? amplitude : -amplitude;
      rig.pass();
    }
    rig.predict();
    const float before = rig.filter().covariance()(kAlpha, kAlpha);
    rig.navigation.updateTiltMeas(rig.accel());
    TEST_ASSERT_EQUAL(3, rig.filter().tiltInnovation().count);
    return std::pair(rig.filter().tiltInnovation().variance[0], before);
  };
  const float quiet = shaken(0.0F).first;
  const float strong = shaken(4.0F).first;  // eight times the gate of Gated
  // The rms as the navigation reports it, density tiltVibration for each m/s^2 of it; 1 % is far
  // above what alpha's variance, here some 1e-3 rad^2 g^2, adds beside 16000.
  TEST_ASSERT_FLOAT_WITHIN(0.1F, 4.0F, rig.navigation.vibration());
  const float expected =
      square(config.tiltVibration * rig.navigation.vibration()) / toSeconds(kStep);
  TEST_ASSERT_FLOAT_WITHIN(0.01F * expected, expected, strong - quiet);
}

template <int States>
void test_the_hover_calibration_is_taken_off_in_hover_only() {
  const Vector3f offset(3.0F, -4.0F, 2.0F);
  for (const MotorState motors : kMotorStates) {
    NavigationConfig config = bare();
    config.magHoverOffset = offset;
    Rig<States> rig(config);
    rig.run(0.1F);
    rig.navigation.setMotors(motors);
    const Vector3f seen =
        motors == MotorState::Hover ? Vector3f(rig.field() + offset) : rig.field();
    for (int i = 0; i < 100; ++i) {
      rig.run(0.01F);
      rig.navigation.updateMagMeas(seen, rig.now);
      rig.navigation.finishPass(rig.now);
      for (int axis = 0; axis < 3; ++axis) {
        // Rounding of 50 uT, twice rotated: nothing of the 2 uT.
        TEST_ASSERT_FLOAT_WITHIN(
            1e-4F, 0.0F, rig.filter().magInnovation().value[static_cast<std::size_t>(axis)]);
      }
    }
    assertSameRotation(1e-5F, rig.attitude, rig.navigation.complementary().attitude());
  }
}

// ---- readmission ----

template <int States>
void test_a_sensor_taken_in_again_is_counted_and_followed() {
  Rig<States> rig(bare());
  for (int i = 0; i < 100; ++i) {
    rig.run(0.02F);
    rig.navigation.updateAltMeas(0.0F, rig.now);
    rig.navigation.updateGPSMeas(Vector3f::Zero(), Vector3f::Zero(), rig.now);
    rig.navigation.finishPass(rig.now);
  }
  TEST_ASSERT_EQUAL(0, rig.navigation.readmissions());
  // A second of refusals is not enough; the next one is.
  const int patience = static_cast<int>(bare().readmitAfter / 20'000);
  for (int i = 0; i <= patience + 1; ++i) {
    TEST_ASSERT_EQUAL(0, rig.navigation.readmissions());
    rig.run(0.02F);
    rig.navigation.updateAltMeas(50.0F, rig.now);
    rig.navigation.updateGPSMeas({0.0F, 200.0F, 0.0F}, Vector3f::Zero(), rig.now);
    rig.navigation.finishPass(rig.now);
  }
  TEST_ASSERT_EQUAL(2, rig.navigation.readmissions());  // height, and one scalar of the fix
  TEST_ASSERT_FLOAT_WITHIN(1.0F, -50.0F, rig.navigation.state().positionNed.z());
  TEST_ASSERT_FLOAT_WITHIN(1.0F, 200.0F, rig.navigation.state().positionNed.y());
  TEST_ASSERT_TRUE(rig.navigation.healthy());
}

// ---- what no sensor measures ----

NavigationConfig bounded() {
  NavigationConfig config = bare();
  config.boundedMotion = true;
  config.gpsAidTime = 8'000'000;
  return config;
}

float variance(const Eigen::MatrixXf& p, int i) { return p(i, i); }

template <int States>
void test_without_gps_position_and_speed_stay_bounded_and_only_if_asked() {
  for (const bool asked : {false, true}) {
    NavigationConfig config = bounded();
    config.boundedMotion = asked;
    Rig<States> rig(config);
    // Noise of 0.1 m/s^2/sqrt(Hz) alone makes that 1.7 m/s and 300 m in 300 s.
    rig.run(300.0F, 5'000);
    for (int i = 0; i < 6; ++i) {
      const float sigma = i < 3 ? config.boundedPositionSigma : config.boundedVelocitySigma;
      TEST_ASSERT_TRUE((variance(rig.filter().covariance(), i) < square(sigma)) == asked);
    }
  }
}

template <int States>
void test_motion_is_bounded_only_so_long_after_the_last_fix() {
  const Micros starts[] = {0, Micros{0} - 5'000'000, Micros{0} - 12'000'000};
  for (const Micros start : starts) {
    Rig<States> rig(bounded(), start);
    TEST_ASSERT_FALSE(rig.navigation.gpsAids());
    for (int i = 0; i < 50; ++i) {
      rig.run(0.1F);
      rig.navigation.updateGPSMeas(Vector3f::Zero(), Vector3f::Zero(), rig.now);
    }
    TEST_ASSERT_TRUE(rig.navigation.gpsAids());
    // No height, and GPS' is not used: down grows more unsure until motion is bounded.
    const Micros last = rig.now;
    float before = rig.filter().covariance()(2, 2);
    for (int i = 0; i < 20'000; ++i) {
      rig.pass();
      const float after = rig.filter().covariance()(2, 2);
      if (after < before) break;
      before = after;
    }
    // The first turn of the 50 ms task after it.
    TEST_ASSERT_TRUE(elapsed(rig.now, last) > 8'000'000);
    TEST_ASSERT_TRUE(elapsed(rig.now, last) <= 8'051'000);
    TEST_ASSERT_FALSE(rig.navigation.gpsAids());
  }
}

template <int States>
void test_down_is_bounded_only_without_an_altimeter() {
  NavigationConfig config = bounded();
  config.positionSigma0 = 20.0F;  // so that the first height is no outlier
  config.alt = {2.0F, 0.0F};      // no surer than the bound, which 3 m do not offend
  Rig<States> rig(config);
  for (int i = 0; i < 1000; ++i) {
    rig.run(0.02F);
    rig.navigation.updateAltMeas(3.0F, rig.now);
    rig.navigation.finishPass(rig.now);
  }
  // Nothing else knows where down is; a bound used 20 times a second would take 0.9 m off.
  TEST_ASSERT_FLOAT_WITHIN(0.05F, -3.0F, rig.navigation.state().positionNed.z());
  const float sure = rig.filter().covariance()(2, 2);
  rig.run(toSeconds(config.altTimeout) - 0.1F);
  TEST_ASSERT_TRUE(rig.filter().covariance()(2, 2) > sure);
  TEST_ASSERT_FLOAT_WITHIN(0.05F, -3.0F, rig.navigation.state().positionNed.z());
  rig.run(60.0F);
  TEST_ASSERT_FLOAT_WITHIN(0.5F, 0.0F, rig.navigation.state().positionNed.z());
}

template <int States>
void test_a_standstill_is_used_only_while_the_motors_stand() {
  for (const bool asked : {false, true}) {
    for (const MotorState motors : kMotorStates) {
      NavigationConfig config = bare();
      config.standstillAid = asked;
      Rig<States> rig(config);
      rig.navigation.setMotors(motors);
      rig.run(1.4F);
      TEST_ASSERT_FALSE(rig.navigation.standsStill());
      rig.run(5.0F);
      TEST_ASSERT_TRUE(rig.navigation.standsStill());
      const bool aided = asked && motors == MotorState::Stopped;
      for (int axis = 3; axis < 6; ++axis) {
        TEST_ASSERT_TRUE(
            (variance(rig.filter().covariance(), axis) < square(config.standstillSigma)) == aided);
      }
    }
  }
}

/// One sigma of the speed north, 50 s after the last fix of a flight that went north and back in
/// turns of 2 s at up to this speed.
template <int States>
float sigmaInOutage(float speed, bool asked) {
  NavigationConfig config = bare();
  config.boundedMotion = asked;
  config.gpsAidTime = 60'000'000;
  Rig<States> rig(config);
  Vector3f position = Vector3f::Zero();
  Vector3f velocity(-speed, 0.0F, 0.0F);
  for (int i = 0; i < 600; ++i) {
    rig.accelerationNed.x() = (i / 20) % 2 == 0 ? speed : -speed;
    for (int j = 0; j < 100; ++j) {
      position += toSeconds(kStep) * velocity;
      velocity += toSeconds(kStep) * rig.accelerationNed;
      rig.pass();
    }
    rig.navigation.updateGPSMeas(position, velocity, rig.now);
  }
  rig.accelerationNed.setZero();
  rig.run(50.0F);
  return squareRoot(rig.filter().covariance()(3, 3));
}

/// How fast it was while GPS aided says how fast it may be in a gap: no more, and no less.
template <int States>
void test_in_an_outage_the_uncertainty_of_speed_is_that_of_the_flight_so_far() {
  const float slow = sigmaInOutage<States>(0.0F, true);
  const float fast = sigmaInOutage<States>(6.0F, true);
  // A hovering aircraft's: one pseudo-measurement of outageVelocitySigma each 2 s bounds it there,
  // and 2 s of noise, 0.14 m/s, add to it.
  TEST_ASSERT_TRUE(slow < 1.2F * bare().outageVelocitySigma);
  // 6 m/s up and down in a triangle have 3.5 m/s rms, in the mean of both axes 2.4 m/s.
  TEST_ASSERT_TRUE(fast > 2.4F && fast < 2.0F * 2.4F);
  TEST_ASSERT_TRUE(sigmaInOutage<States>(6.0F, false) > 1.2F * fast);
}

// ---- start ----

template <int States>
void test_before_it_is_aligned_every_call_does_nothing() {
  Navigation<States> navigation{NavigationConfig{}};
  for (int i = 1; i <= 3'000; ++i) {
    const Micros now = static_cast<Micros>(i) * kStep;
    navigation.predict({0.0F, 0.0F, -kGravity}, Vector3f::Zero(), now);
    navigation.updateTiltMeas({0.0F, 0.0F, -kGravity});
    navigation.updateMagMeas(kField, now);
    navigation.updateAltMeas(1.0F, now);
    navigation.updateGPSMeas({1.0F, 2.0F, 3.0F}, Vector3f::Zero(), now);
    navigation.finishPass(now);
  }
  TEST_ASSERT_TRUE(navigation.state().positionNed.isZero(0.0F));
  TEST_ASSERT_EQUAL_HEX32(health::kNone, navigation.health());
  TEST_ASSERT_FALSE(navigation.standsStill());
  TEST_ASSERT_FALSE(navigation.gpsAids());
}

}  // namespace

void runPolicyTests() {
  Unity.TestFile = __FILE__;
  RUN_BOTH(test_running_motors_do_to_the_tilt_what_is_configured);
  RUN_BOTH(test_running_motors_do_to_the_magnetometer_what_is_configured);
  RUN_BOTH(test_no_tilt_is_used_where_it_is_switched_off);
  RUN_BOTH(test_vibration_makes_the_tilt_less_sure_instead_of_the_gate);
  RUN_BOTH(test_the_hover_calibration_is_taken_off_in_hover_only);
  RUN_BOTH(test_a_sensor_taken_in_again_is_counted_and_followed);
  RUN_BOTH(test_without_gps_position_and_speed_stay_bounded_and_only_if_asked);
  RUN_BOTH(test_motion_is_bounded_only_so_long_after_the_last_fix);
  RUN_BOTH(test_down_is_bounded_only_without_an_altimeter);
  RUN_BOTH(test_a_standstill_is_used_only_while_the_motors_stand);
  RUN_BOTH(test_in_an_outage_the_uncertainty_of_speed_is_that_of_the_flight_so_far);
  RUN_BOTH(test_before_it_is_aligned_every_call_does_nothing);
}
