/// A measurement that arrives late is compared with the state at its own time.
#include "NavigationRig.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr Micros kDelay = 137'000;

/// Speeds up from rest for a second, or then glides, and measures what was true `kDelay` ago.
template <int States>
struct DelayedFlight {
  DelayedFlight(const NavigationConfig& config, bool gliding) : rig(config) {
    rig.accelerationNed = {4.0F, -3.0F, 2.0F};
    rig.predict();
    rig.run(1.0F);
    if (gliding) {
      rig.accelerationNed.setZero();
      rig.run(1.0F);
    }
    for (Micros since = 0; since <= kDelay; since += kStep) {
      if (since == 0) then = rig.filter().state();
      if (since < kDelay) rig.pass();
    }
    Navigation<States> other = rig.navigation;  // so that neither waits for what the other says
    other.updateAltMeas(-then.positionNed.z(), rig.now);
    height = other.filter().altInnovation();
    rig.navigation.updateGPSMeas(then.positionNed, then.velocityNed, rig.now);
    gps = rig.filter().gpsInnovation();
    TEST_ASSERT_EQUAL(4, gps.count);
    TEST_ASSERT_EQUAL(1, height.count);
  }

  Rig<States> rig;
  VehicleState then;
  Innovation gps;
  Innovation height;
};

template <int States>
void test_a_delayed_measurement_agrees_with_the_state_of_its_own_time() {
  for (const bool gliding : {false, true}) {
    NavigationConfig config = bare();
    config.gpsDelay = kDelay;
    config.altDelay = kDelay;
    const DelayedFlight<States> flight(config, gliding);
    // The chord over 10 ms of a parabola, a h^2/8 = 7e-5 m, and 2000 roundings of 6 m.
    for (const float innovation : flight.gps.value) {
      TEST_ASSERT_FLOAT_WITHIN(2e-4F, 0.0F, innovation);
    }
    TEST_ASSERT_FLOAT_WITHIN(2e-4F, 0.0F, flight.height.value[0]);
  }
}

template <int States>
void test_an_unknown_delay_shows_as_lag_behind_the_motion() {
  const DelayedFlight<States> flight(bare(), true);
  const Vector3f lag = -toSeconds(kDelay) * flight.then.velocityNed;  // it was there; it has moved
  // The first scalar of each: what it says moves what is expected of the others.
  TEST_ASSERT_FLOAT_WITHIN(2e-4F, lag.x(), flight.gps.value[0]);
  TEST_ASSERT_FLOAT_WITHIN(2e-4F, lag.z(), flight.height.value[0]);  // of z, positive down
}

template <int States>
void test_a_delay_that_is_none_shows_as_lead() {
  NavigationConfig config = bare();
  config.gpsDelay = kDelay;
  Rig<States> rig(config);
  rig.accelerationNed = {4.0F, -3.0F, 0.0F};
  rig.run(1.0F);
  rig.accelerationNed.setZero();
  rig.run(1.0F);
  const VehicleState s = rig.filter().state();
  rig.navigation.updateGPSMeas(s.positionNed, s.velocityNed, rig.now);
  TEST_ASSERT_FLOAT_WITHIN(2e-4F, toSeconds(kDelay) * s.velocityNed.x(),
                           rig.filter().gpsInnovation().value[0]);
}

/// What a fix has corrected is not corrected once more by a fix that is as old.
template <int States>
void test_a_correction_is_no_motion() {
  NavigationConfig config = bare();
  config.gpsDelay = kDelay;
  config.altDelay = kDelay;
  Rig<States> rig(config);
  rig.run(0.5F);
  const Vector3f truth(1.0F, -0.8F, 0.0F);
  float correction = 0.0F;
  for (int fix = 0; fix < 5; ++fix) {
    const VehicleState before = rig.filter().state();
    rig.navigation.updateGPSMeas(truth, before.velocityNed, rig.now);
    // The speed that corrections gave it is motion: dead reckoning follows it.
    const float drift = 0.05F * static_cast<float>(fix) * correction;
    TEST_ASSERT_FLOAT_WITHIN(1e-4F + drift, truth.x() - before.positionNed.x(),
                             rig.filter().gpsInnovation().value[0]);
    rig.navigation.updateAltMeas(2.0F, rig.now);
    TEST_ASSERT_FLOAT_WITHIN(0.02F, -2.0F - before.positionNed.z(),
                             rig.filter().altInnovation().value[0]);
    rig.navigation.finishPass(rig.now);
    correction = rig.filter().state().positionNed.x();
    TEST_ASSERT_TRUE(correction > 0.3F);
    rig.run(0.01F);
  }
}

}  // namespace

void runDelayTests() {
  Unity.TestFile = __FILE__;
  RUN_BOTH(test_a_delayed_measurement_agrees_with_the_state_of_its_own_time);
  RUN_BOTH(test_an_unknown_delay_shows_as_lag_behind_the_motion);
  RUN_BOTH(test_a_delay_that_is_none_shows_as_lead);
  RUN_BOTH(test_a_correction_is_no_motion);
}
