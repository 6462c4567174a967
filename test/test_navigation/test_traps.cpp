/// The known traps of DESIGN.md, section 4: each test fails when the wrong form is put in.
///
/// Others of that list have their tests where they belong: f in getSTM, Q_d's integral
/// (propagation); declination (alignment); z - h - H dx in every order (updates); knots and the
/// magnetometer's left hand (test_sensors, test_processing.cpp).
#include "Dense.h"
#include "suites.h"

namespace {

using strix::Micros;
using strix::Vector3f;

const Vector3d kField(20.0, 3.0, 45.0);
const Quaterniond kAttitude = fromEuler(25.0, -40.0, 130.0);

strix::NavigationConfig certain() {
  strix::NavigationConfig config = testConfig();
  config.positionSigma0 = config.velocitySigma0 = config.tiltSigma0 = config.headingSigma0 = 0.0F;
  config.accelBiasSigma0 = config.gyroBiasSigma0 = config.magBiasSigma0 = 0.0F;
  return config;
}

/// f is the specific force: in hover a tilt error accelerates by g, although nothing accelerates.
template <int States>
void test_in_hover_the_filter_knows_that_tilt_becomes_velocity() {
  const strix::NavigationConfig config = testConfig();
  strix::ESKF<States> filter = filterAt<States>(Quaterniond::Identity(), Vector3f::Zero(), config);
  const Vector3f hover(0.0F, 0.0F, -strix::kGravity);
  const float dt = 0.01F;
  filter.predict(hover, Vector3f::Zero(), 0);
  filter.predict(hover, Vector3f::Zero(), 10'000);
  // Rolled right, +x, it goes east; pitched up, +y, it goes back. The noise in between adds 1e-3.
  const float expected = strix::kGravity * dt * config.tiltSigma0 * config.tiltSigma0;
  TEST_ASSERT_FLOAT_WITHIN(0.01F * expected, expected, filter.covariance()(4, 6));
  TEST_ASSERT_FLOAT_WITHIN(0.01F * expected, -expected, filter.covariance()(3, 7));
}

/// Free fall: no specific force, so attitude does not matter, although it accelerates by g.
template <int States>
void test_in_free_fall_tilt_does_not_become_velocity() {
  strix::ESKF<States> filter = filterAt<States>(kAttitude, Vector3f::Zero());
  filter.predict(Vector3f::Zero(), Vector3f::Zero(), 0);
  filter.predict(Vector3f::Zero(), Vector3f::Zero(), 10'000);
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 0.01F * strix::kGravity, filter.state().velocityNed.z());
  TEST_ASSERT_TRUE(toDouble(filter.covariance()).block(3, 6, 3, 3).isZero(0.0));
}

/// What an accelerometer bias does in the step it walks in, it does to velocity; a gyro's, to
/// attitude. From P = 0 the first step leaves just that: -R^T sigma_ba^2 dt^2/2, -I sigma_bg^2
/// dt^2/2.
void test_the_noise_of_a_bias_is_correlated_with_what_it_drives() {
  const strix::NavigationConfig config = certain();
  const Vector3f force(2.0F, -3.5F, -11.0F);
  const Vector3f rate(1.5F, -2.0F, 3.0F);
  const double dt = 0.02;
  strix::ESKF<18> filter = filterAt<18>(kAttitude, Vector3f::Zero(), config);
  filter.predict(force, rate, 0);
  filter.predict(force, rate, 20'000);
  const MatrixXd predicted = toDouble(filter.covariance());
  const MatrixXd noise =
      toDouble(filter.getQd(strix::q2R(toFloat(kAttitude)), force, rate, static_cast<float>(dt)));
  const auto half = [dt](float walk) {
    return 0.5 * dt * dt * static_cast<double>(walk) * static_cast<double>(walk);
  };
  const Matrix3d toNed = kAttitude.toRotationMatrix();
  const Matrix3d velocity = -toNed * half(config.accelBiasWalk);
  const Matrix3d attitude = -Matrix3d::Identity() * half(config.gyroBiasWalk);
  for (const MatrixXd& q : {predicted, noise}) {
    const auto block = [&q](int i, int j) -> Matrix3d { return q.block<3, 3>(i, j); };
    // Rounding of R, 1e-7 of the block.
    TEST_ASSERT_TRUE((block(3, 9) - velocity).norm() < 1e-6 * velocity.norm());
    TEST_ASSERT_TRUE((block(6, 12) - attitude).norm() < 1e-6 * attitude.norm());
    TEST_ASSERT_TRUE(block(3, 12).isZero(0.0));  // gyro's bias: velocity only in the next step
    TEST_ASSERT_TRUE(block(6, 9).isZero(0.0));
    TEST_ASSERT_TRUE(block(3, 15).isZero(0.0) && block(6, 15).isZero(0.0));
    TEST_ASSERT_TRUE(block(9, 12).isZero(0.0) && block(9, 15).isZero(0.0) &&
                     block(12, 15).isZero(0.0));
  }
}

/// The error is injected on the right. On the left it is right at yaw 0, and at yaw 180 an error in
/// roll and pitch is doubled instead of taken out.
template <int States>
void test_injection_takes_the_whole_error_out_at_every_yaw() {
  strix::NavigationConfig config = testConfig();
  config.nisGate = 1e6F;
  config.tilt = config.mag = {1e-3F, 0.0F};  // one sample is enough
  config.tiltSigma0 = config.headingSigma0 = 0.1F;
  config.accelBiasSigma0 = config.magBiasSigma0 = 1e-4F;
  for (int yaw = -180; yaw < 180; yaw += 30) {
    const Quaterniond truth = fromEuler(5.0, -10.0, yaw);
    const Quaterniond wrong = truth * expOf(Vector3d(0.05, -0.04, 0.03)).conjugate();  // 4.1 deg
    strix::ESKF<States> filter = filterAt<States>(wrong, toFloat(kField), config);
    filter.predict(toFloat(restForce(truth)), Vector3f::Zero(), 0);
    filter.predict(toFloat(restForce(truth)), Vector3f::Zero(), 1'000);
    filter.updateTiltMeas(toFloat(restForce(truth)));
    filter.updateMagMeas(toFloat(truth.conjugate() * kField), 1'000);
    filter.injectError();
    // Linearised once: half the square of the error, 0.07^2/2 rad = 0.15 deg, is left.
    TEST_ASSERT_TRUE(angleDeg(truth, toDouble(filter.state().attitude)) < 0.15);
  }
}

/// A residual counts what is pending in dx: two equal heights in one pass are not believed twice.
template <int States>
void test_a_second_measurement_in_a_pass_sees_the_first() {
  const strix::NavigationConfig config = testConfig();
  strix::ESKF<States> filter = filterAt<States>(kAttitude, toFloat(kField), config);
  filter.predict(toFloat(restForce(kAttitude)), Vector3f::Zero(), 0);
  filter.updateAltMeas(0.3F, 20'000);
  filter.updateAltMeas(0.3F, 40'000);
  // The mean of two samples against sigma_0: 0.5^2 / (0.5^2 + 0.3^2/2) of 0.3 m.
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, -0.3F * 0.25F / (0.25F + 0.045F), filter.error()[2]);
  // The second's innovation is what the first left: 0.09 / (0.25 + 0.09) of 0.3 m.
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, -0.3F * 0.09F / 0.34F, filter.altInnovation().value[0]);
}

/// The same for a bias that is pending in dx, and for the field: two equal readings in one pass.
void test_a_second_field_in_a_pass_sees_the_bias_the_first_found() {
  strix::NavigationConfig config = certain();
  config.magBiasSigma0 = 1.0F;
  config.mag = {0.5F, 0.0F};
  strix::ESKF<18> filter = filterAt<18>(kAttitude, toFloat(kField), config);
  filter.predict(toFloat(restForce(kAttitude)), Vector3f::Zero(), 0);
  const Vector3d bias(0.8, -0.4, 0.2);
  const Vector3f mag = toFloat(kAttitude.conjugate() * kField + bias);
  filter.updateMagMeas(mag, 20'000);
  filter.updateMagMeas(mag, 40'000);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto b = static_cast<float>(bias(static_cast<Eigen::Index>(axis)));
    // As above, with 1 uT against 0.5 uT; the field of 50 uT rounds to 4e-6.
    TEST_ASSERT_FLOAT_WITHIN(2e-5F, b / 1.125F, filter.error()[strix::kMagBias + axis]);
    TEST_ASSERT_FLOAT_WITHIN(2e-5F, b * 0.25F / 1.25F, filter.magInnovation().value[axis]);
  }
}

/// Index 8 is the last of the 9-state filter: it holds 9 of everything, and does what the 18-state
/// filter does whose biases are known to be zero for ever.
void test_the_9_states_are_the_18_whose_biases_are_known() {
  static_assert(strix::SymmetricMatrix<9>::kElements == 45 &&
                strix::SymmetricMatrix<18>::kElements == 171);
  static_assert(std::tuple_size_v<strix::ESKF<9>::Vector> == 9 &&
                std::tuple_size_v<strix::ESKF<18>::Vector> == 18);
  strix::NavigationConfig config = testConfig();
  config.accelBiasWalk = config.gyroBiasWalk = config.magBiasWalk = 0.0F;
  config.accelBiasSigma0 = config.gyroBiasSigma0 = config.magBiasSigma0 = 0.0F;
  config.readmitGyroBias = 0.0F;
  strix::ESKF<9> small = filterAt<9>(kAttitude, toFloat(kField), config);
  strix::ESKF<18> large = filterAt<18>(kAttitude, toFloat(kField), config);
  const auto pass = [](auto& filter, std::uint32_t i) {
    const Micros now = i * 1'000U;
    const float t = static_cast<float>(i) * 1e-3F;
    const Vector3f accel(0.5F * strix::sine(3.0F * t), 0.3F, -9.7F);
    filter.predict(accel, {0.8F * strix::cosine(2.0F * t), -0.4F, 0.3F}, now);
    filter.updateTiltMeas(accel);
    const Vector3f bent = toFloat(kField) + Vector3f(0.5F, -0.3F, 0.2F);
    if (i % 10U == 0U) {
      filter.updateMagMeas(strix::rotateToBody(filter.state().attitude, bent), now);
    }
    if (i % 20U == 0U) filter.updateAltMeas(0.2F, now);
    if (i % 100U == 0U) filter.updateGPSMeas({0.5F, -0.4F, 0.0F}, {0.1F, 0.1F, 0.0F});
    filter.injectError();
  };
  for (std::uint32_t i = 0; i < 3'000U; ++i) {
    pass(small, i);
    pass(large, i);
  }
  // 3000 passes sum the same terms in another order, 6e-8 each: a random walk to 3e-6, and what the
  // small variance of a direction keeps of a large one, as in test_vectors.cpp.
  const MatrixXd expected = toDouble(large.covariance());
  TEST_ASSERT_TRUE(relativeDifference(expected.topLeftCorner(9, 9), toDouble(small.covariance())) <
                   1e-4);
  TEST_ASSERT_TRUE(expected.rightCols(9).isZero(0.0));
  TEST_ASSERT_TRUE(large.accelBias().isZero(0.0F) && large.gyroBias().isZero(0.0F) &&
                   large.magBias().isZero(0.0F));
  TEST_ASSERT_TRUE((small.state().positionNed - large.state().positionNed).norm() < 1e-4F);
  TEST_ASSERT_TRUE((small.state().velocityNed - large.state().velocityNed).norm() < 1e-4F);
  TEST_ASSERT_TRUE(angleDeg(toDouble(small.state().attitude), toDouble(large.state().attitude)) <
                   1e-3);
}

}  // namespace

void runTrapTests() {
  Unity.TestFile = __FILE__;
  RUN_BOTH(test_in_hover_the_filter_knows_that_tilt_becomes_velocity);
  RUN_BOTH(test_in_free_fall_tilt_does_not_become_velocity);
  RUN_TEST(test_the_noise_of_a_bias_is_correlated_with_what_it_drives);
  RUN_BOTH(test_injection_takes_the_whole_error_out_at_every_yaw);
  RUN_BOTH(test_a_second_measurement_in_a_pass_sees_the_first);
  RUN_TEST(test_a_second_field_in_a_pass_sees_the_bias_the_first_found);
  RUN_TEST(test_the_9_states_are_the_18_whose_biases_are_known);
}
