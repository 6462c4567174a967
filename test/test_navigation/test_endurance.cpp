#include "Dense.h"
#include "suites.h"

namespace {

using strix::Micros;
using strix::Vector3f;

/// One hour of the 1 kHz loop, turning about all axes, inverted included; the clock wraps near its
/// end. Measurements agree with the state, so that every one is accepted and P is as small, and so
/// as close to losing its rank, as it gets.
template <int States>
void keepsItsCovariance(const strix::NavigationConfig& config) {
  strix::ESKF<States> filter =
      filterAt<States>(fromEuler(0.0, 0.0, 30.0), Vector3f(20.0F, 3.0F, 45.0F), config);
  const Vector3f down(0.0F, 0.0F, 1.0F);
  Micros now = 0xFFFFFFFFU - 3'000'000'000U;
  for (std::uint32_t i = 0; i < 3'600'000U; ++i, now += 1'000) {
    const strix::VehicleState& state = filter.state();
    const float phase = static_cast<float>(i % 62'832U) * 1e-4F;  // a period of 62.8 s
    const Vector3f gyro(0.8F * strix::sine(phase), 0.6F * strix::cosine(3.0F * phase), 0.3F);
    // Alternately a sample that tilt uses and one of a climb, which it does not.
    const float force = i % 4'000U < 2'000U ? strix::kGravity : 1.3F * strix::kGravity;
    const Vector3f accel = -force * strix::rotateToBody(state.attitude, down);
    filter.predict(accel, gyro, now);
    filter.updateTiltMeas(accel);
    if (i % 10U == 0U) {
      filter.updateMagMeas(strix::rotateToBody(state.attitude, filter.magReference()), now);
    }
    if (i % 20U == 0U) filter.updateAltMeas(-state.positionNed.z(), now);
    if (i % 100U == 0U) filter.updateGPSMeas(state.positionNed, state.velocityNed);
    filter.injectError();
    if (i % 1'000U == 0U && !isCovariance(filter.covariance())) {
      TEST_FAIL_MESSAGE("P is no longer symmetric and positive definite");
    }
  }
  TEST_ASSERT_TRUE(filter.healthy());
  TEST_ASSERT_EQUAL(0, filter.gpsInnovation().rejections);
}

template <int States>
void test_the_covariance_stays_symmetric_and_positive_definite_for_an_hour() {
  keepsItsCovariance<States>(testConfig());
}

/// Biases that do not walk are known better for ever, and their variances shrink without end.
void test_constant_biases_keep_it_so_for_an_hour() {
  strix::NavigationConfig config = testConfig();
  config.accelBiasWalk = config.gyroBiasWalk = config.magBiasWalk = 0.0F;
  keepsItsCovariance<18>(config);
}

/// As configured for flight.
void test_the_defaults_keep_it_so_for_an_hour() { keepsItsCovariance<18>({}); }

}  // namespace

void runEnduranceTests() {
  Unity.TestFile = __FILE__;
  RUN_BOTH(test_the_covariance_stays_symmetric_and_positive_definite_for_an_hour);
  RUN_TEST(test_constant_biases_keep_it_so_for_an_hour);
  RUN_TEST(test_the_defaults_keep_it_so_for_an_hour);
}
