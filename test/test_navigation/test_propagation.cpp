#include "Dense.h"
#include "suites.h"

namespace {

using strix::Micros;
using strix::Vector3f;

constexpr double kDt = 1e-3;
constexpr Micros kStep = 1'000;

// One moment of a lively flight: every block of F is filled.
const Quaterniond kAttitude = fromEuler(25.0, -40.0, 130.0);
const Vector3d kForce(2.0, -3.5, -11.0);
const Vector3d kRate(1.5, -2.0, 3.0);

/// The nominal state, moved on as DESIGN.md section 4 says.
struct Nominal {
  Vector3d position;
  Vector3d velocity;
  Quaterniond attitude;
  Vector3d accelBias;
  Vector3d gyroBias;
  Vector3d magBias;

  /// @param accel  as measured, m/s^2, body    @param gyro  as measured, rad/s, body
  [[nodiscard]] Nominal moved(const Vector3d& accel, const Vector3d& gyro, double dt) const {
    const Vector3d a = attitude * (accel - accelBias) + Vector3d(0.0, 0.0, kG);
    Nominal next = *this;
    next.position += velocity * dt + 0.5 * dt * dt * a;
    next.velocity += a * dt;
    next.attitude = attitude * expOf((gyro - gyroBias) * dt);
    return next;
  }
  [[nodiscard]] Nominal plus(const VectorXd& dx) const {
    return {position + dx.segment<3>(0),        velocity + dx.segment<3>(3),
            attitude * expOf(dx.segment<3>(6)), accelBias + dx.segment<3>(9),
            gyroBias + dx.segment<3>(12),       magBias + dx.segment<3>(15)};
  }
  [[nodiscard]] VectorXd minus(const Nominal& other) const {
    VectorXd dx(18);
    dx << position - other.position, velocity - other.velocity,
        2.0 * (other.attitude.conjugate() * attitude).vec(), accelBias - other.accelBias,
        gyroBias - other.gyroBias, magBias - other.magBias;
    return dx;
  }
};

strix::Matrix3f nedToBody(const Quaterniond& q) { return strix::q2R(toFloat(q)); }

template <int States>
void test_at_hover_a_tilt_error_accelerates_by_g() {
  const Vector3f hover(0.0F, 0.0F, -strix::kGravity);
  const auto phi =
      strix::ESKF<States>::getSTM(strix::Matrix3f::Identity(), hover, Vector3f::Zero(), 1.0F);
  // Rolled right (+x) the thrust points right (east), pitched up (+y) it points back.
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, strix::kGravity, phi(4, 6));
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, -strix::kGravity, phi(3, 7));
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 0.0F, phi(5, 8));
}

template <int States>
void test_the_transition_matrix_is_the_derivative_of_the_nominal_propagation() {
  const Nominal before{
      Vector3d(3.0, -2.0, 1.0), Vector3d(4.0, 1.0, -2.0),    kAttitude,
      Vector3d(0.3, -0.2, 0.1), Vector3d(0.02, 0.01, -0.03), Vector3d(2.0, -1.0, 3.0)};
  const Vector3d accel = kForce + before.accelBias;
  const Vector3d gyro = kRate + before.gyroBias;
  const Nominal after = before.moved(accel, gyro, kDt);
  const MatrixXd phi = toDouble(strix::ESKF<States>::getSTM(
      nedToBody(kAttitude), toFloat(kForce), toFloat(kRate), static_cast<float>(kDt)));
  const double small = 1e-6;
  // What I + F dt leaves out: dp/dalpha = |f| dt^2 / 2 and dalpha/dalpha = (w dt)^2 / 2.
  const double second = (0.5 * kForce.norm() + kRate.squaredNorm()) * kDt * kDt;
  for (int i = 0; i < States; ++i) {
    const VectorXd dx = small * VectorXd::Unit(18, i);
    const VectorXd column = before.plus(dx).moved(accel, gyro, kDt).minus(after) / small;
    const double error = (column.head(States) - phi.col(i)).cwiseAbs().maxCoeff();
    TEST_ASSERT_TRUE(error < second);
  }
}

template <int States>
void test_the_process_noise_equals_the_integral_with_its_cross_terms() {
  const strix::NavigationConfig config = testConfig();
  const strix::ESKF<States> filter(config);
  const MatrixXd f = systemMatrix(States, kAttitude, kForce, kRate);
  for (const double dt : {1e-3, 0.02, 0.2}) {
    const MatrixXd found = toDouble(filter.getQd(nedToBody(kAttitude), toFloat(kForce),
                                                 toFloat(kRate), static_cast<float>(dt)));
    const MatrixXd expected = processNoise(f, noiseDensity(States, config), dt);
    TEST_ASSERT_TRUE(expected.block(3, 6, 3, 3).norm() > 0.0);
    // Some ten float roundings, 6e-8 each, of each block: the cross terms are 1e-5 of their
    // neighbours at 1 kHz, and count as much.
    TEST_ASSERT_TRUE(blockDifference(expected, found) < 1e-6);
  }
}

/// A filter in flight, its covariance filled by prediction and by measurements.
template <int States>
strix::ESKF<States> livelyFilter() {
  strix::ESKF<States> filter = filterAt<States>(kAttitude, Vector3f(20.0F, 3.0F, 45.0F));
  Micros now = 0;
  for (int i = 0; i < 500; ++i, now += kStep) {
    filter.predict(toFloat(kForce), toFloat(kRate), now);
    const strix::VehicleState& state = filter.state();
    if (i % 10 == 0)
      filter.updateMagMeas(strix::rotateToBody(state.attitude, filter.magReference()), now);
    if (i % 100 == 0) filter.updateGPSMeas(state.positionNed, state.velocityNed);
    filter.injectError();
  }
  return filter;
}

template <int States>
void test_predict_moves_the_covariance_as_the_dense_equation() {
  for (const Micros step : {1'000U, 5'000U, 20'000U}) {
    strix::ESKF<States> filter = livelyFilter<States>();
    const MatrixXd before = toDouble(filter.covariance());
    const Quaterniond q = toDouble(filter.state().attitude).normalized();
    const Vector3d force = kForce - filter.accelBias().template cast<double>();
    const Vector3d rate = kRate - filter.gyroBias().template cast<double>();
    filter.predict(toFloat(kForce), toFloat(kRate), 499 * kStep + step);

    const double dt = static_cast<double>(step) * 1e-6;
    const MatrixXd f = systemMatrix(States, q, force, rate);
    const MatrixXd phi = MatrixXd::Identity(States, States) + f * dt;
    const MatrixXd qc = noiseDensity(States, testConfig());
    const MatrixXd expected = phi * before * phi.transpose() + processNoise(f, qc, dt);
    // Some thirty float roundings, 6e-8 each, beside the trapezoidal rule's known excess.
    const MatrixXd found = toDouble(filter.covariance());
    TEST_ASSERT_TRUE(relativeDifference(expected, found, trapezoidalExcess(f, qc, dt)) < 2e-6);
    TEST_ASSERT_TRUE(isCovariance(filter.covariance()));
  }
}

/// From P = 0 one step leaves Q_d alone: nothing larger hides its cross terms.
template <int States>
void test_predict_from_certainty_leaves_the_process_noise() {
  strix::NavigationConfig config = testConfig();
  config.positionSigma0 = config.velocitySigma0 = config.tiltSigma0 = config.headingSigma0 = 0.0F;
  config.accelBiasSigma0 = config.gyroBiasSigma0 = config.magBiasSigma0 = 0.0F;
  for (const double dt : {1e-3, 0.02}) {
    strix::ESKF<States> filter = filterAt<States>(kAttitude, Vector3f::Zero(), config);
    filter.predict(toFloat(kForce), toFloat(kRate), 0);
    filter.predict(toFloat(kForce), toFloat(kRate), static_cast<Micros>(dt * 1e6 + 0.5));
    const MatrixXd f = systemMatrix(States, kAttitude, kForce, kRate);
    const MatrixXd qc = noiseDensity(States, config);
    const MatrixXd trapezoidal = processNoise(f, qc, dt) + trapezoidalExcess(f, qc, dt);
    // kAttitude in float and some thirty roundings, 6e-8 each, of each block.
    TEST_ASSERT_TRUE(blockDifference(trapezoidal, toDouble(filter.covariance())) < 2e-6);
  }
}

template <int States>
void test_predict_moves_the_state_as_the_double_precision_model() {
  strix::ESKF<States> filter = filterAt<States>(kAttitude, Vector3f::Zero());
  const Vector3d zero = Vector3d::Zero();
  Nominal truth{zero, zero, kAttitude, zero, zero, zero};
  filter.predict(toFloat(kForce), toFloat(kRate), 0);
  for (Micros i = 1; i <= 2000; ++i) {
    filter.predict(toFloat(kForce), toFloat(kRate), i * kStep);
    truth = truth.moved(kForce, kRate, kDt);
  }
  // 2000 roundings of 6e-8 add up as a random walk to 3e-6; position and velocity are ~ 15.
  TEST_ASSERT_TRUE(angleDeg(truth.attitude, toDouble(filter.state().attitude)) < 1e-3);
  TEST_ASSERT_TRUE((truth.velocity - filter.state().velocityNed.template cast<double>()).norm() <
                   1e-3);
  TEST_ASSERT_TRUE((truth.position - filter.state().positionNed.template cast<double>()).norm() <
                   1e-3);
}

/// A filter on the ground whose attitude is certain: what gravity, field and rate show beyond it
/// can only be bias.
strix::ESKF<18> filterThatLearnt(const Vector3d& accelBias, const Vector3d& gyroBias,
                                 const Vector3d& magBias) {
  strix::NavigationConfig config = testConfig();
  config.tiltSigma0 = config.headingSigma0 = config.gyroNoise = 0.0F;
  config.tilt = {1e-4F, 0.0F};
  config.mag = {1e-3F, 0.0F};
  const Vector3d field(20.0, 3.0, 45.0);
  strix::ESKF<18> filter = filterAt<18>(kAttitude, toFloat(field), config);
  const Vector3f accel = toFloat(restForce(kAttitude) + accelBias);
  filter.predict(accel, toFloat(gyroBias), 0);
  filter.updateStandstillRate(toFloat(gyroBias), 1e-6F);
  filter.injectError();
  filter.predict(accel, toFloat(gyroBias), kStep);
  filter.updateTiltMeas(accel);
  filter.updateMagMeas(toFloat(kAttitude.conjugate() * field + magBias), kStep);
  filter.injectError();
  return filter;
}

void test_the_18_states_learn_the_biases_and_predict_without_them() {
  const Vector3d accelBias(0.05, -0.1, 0.08);
  const Vector3d gyroBias(0.004, -0.002, 0.003);
  const Vector3d magBias(1.5, -0.8, 0.6);
  strix::ESKF<18> filter = filterThatLearnt(accelBias, gyroBias, magBias);
  // Noise over sigma_0, squared, is the part not learnt: 1e-6 of the bias, as is the rounding of
  // the 10 m/s^2 and 50 uT it is a difference of.
  TEST_ASSERT_TRUE((filter.accelBias().cast<double>() - accelBias).norm() < 1e-5);
  TEST_ASSERT_TRUE((filter.gyroBias().cast<double>() - gyroBias).norm() < 1e-7);
  TEST_ASSERT_TRUE((filter.magBias().cast<double>() - magBias).norm() < 1e-4);

  const strix::VehicleState start = filter.state();
  const Vector3d zero = Vector3d::Zero();
  Nominal truth{start.positionNed.cast<double>(),
                start.velocityNed.cast<double>(),
                toDouble(start.attitude),
                zero,
                zero,
                zero};
  for (Micros i = 2; i <= 1001; ++i) {
    filter.predict(toFloat(kForce + accelBias), toFloat(kRate + gyroBias), i * kStep);
    truth = truth.moved(kForce, kRate, kDt);
  }
  // One second: 1e-5 m/s^2 and 1e-7 rad/s left of the biases, and rounding as above. With the
  // biases left in, 0.14 m/s and 0.3 deg.
  TEST_ASSERT_TRUE(angleDeg(truth.attitude, toDouble(filter.state().attitude)) < 1e-3);
  TEST_ASSERT_TRUE((truth.velocity - filter.state().velocityNed.cast<double>()).norm() < 1e-3);
  TEST_ASSERT_TRUE((filter.state().rateBody.cast<double>() - kRate).norm() < 1e-6);
}

template <int States>
void test_a_gap_counts_as_the_longest_step_and_no_more() {
  strix::ESKF<States> gap = filterAt<States>(kAttitude, Vector3f::Zero());
  strix::ESKF<States> longest = gap;
  gap.predict(toFloat(kForce), toFloat(kRate), 0);
  gap.predict(toFloat(kForce), toFloat(kRate), 30'000'000);
  longest.predict(toFloat(kForce), toFloat(kRate), 0);
  longest.predict(toFloat(kForce), toFloat(kRate), strix::kMaxPredictStep);
  TEST_ASSERT_TRUE(same(gap, longest));
  // And the next step is an ordinary one again.
  gap.predict(toFloat(kForce), toFloat(kRate), 30'000'000 + kStep);
  longest.predict(toFloat(kForce), toFloat(kRate), strix::kMaxPredictStep + kStep);
  TEST_ASSERT_TRUE(same(gap, longest));
}

template <int States>
void test_a_sample_that_comes_twice_changes_nothing() {
  strix::ESKF<States> filter = livelyFilter<States>();
  const strix::ESKF<States> before = filter;
  filter.predict(toFloat(kForce), toFloat(kRate), 499 * kStep);
  filter.updateTiltMeas(Vector3f(0.0F, 0.0F, -strix::kGravity));
  TEST_ASSERT_TRUE(same(before, filter));
}

template <int States>
void test_the_clock_may_wrap_in_flight() {
  const Vector3f reference(20.0F, 3.0F, 45.0F);
  strix::ESKF<States> wrapped = filterAt<States>(kAttitude, reference);
  strix::ESKF<States> plain = wrapped;
  const Micros justBefore = 0xFFFFFFFFU - 25'500U;  // wraps within a step, and within every period
  for (Micros i = 0; i < 60; ++i) {
    for (strix::ESKF<States>* filter : {&wrapped, &plain}) {
      const Micros now = (filter == &wrapped ? justBefore : 0U) + i * kStep;
      filter->predict(toFloat(kForce), toFloat(kRate), now);
      filter->updateTiltMeas(Vector3f(1.0F, 0.5F, -9.7F));
      if (i % 10 == 5) filter->updateMagMeas(Vector3f(30.0F, 10.0F, 35.0F), now);
      if (i % 20 == 5) filter->updateAltMeas(1.0F, now);
      filter->injectError();
    }
  }
  TEST_ASSERT_TRUE(plain.altInnovation().accepted > 0);
  TEST_ASSERT_TRUE(same(wrapped, plain));
}

template <int States>
void test_a_broken_imu_sample_is_not_healthy() {
  strix::ESKF<States> filter = livelyFilter<States>();
  TEST_ASSERT_TRUE(filter.healthy());
  filter.predict(Vector3f(NAN, 0.0F, 0.0F), Vector3f::Zero(), 500 * kStep);
  TEST_ASSERT_FALSE(filter.healthy());
}

}  // namespace

void runPropagationTests() {
  Unity.TestFile = __FILE__;
  RUN_BOTH(test_at_hover_a_tilt_error_accelerates_by_g);
  RUN_BOTH(test_the_transition_matrix_is_the_derivative_of_the_nominal_propagation);
  RUN_BOTH(test_the_process_noise_equals_the_integral_with_its_cross_terms);
  RUN_BOTH(test_predict_moves_the_covariance_as_the_dense_equation);
  RUN_BOTH(test_predict_from_certainty_leaves_the_process_noise);
  RUN_BOTH(test_predict_moves_the_state_as_the_double_precision_model);
  RUN_TEST(test_the_18_states_learn_the_biases_and_predict_without_them);
  RUN_BOTH(test_a_gap_counts_as_the_longest_step_and_no_more);
  RUN_BOTH(test_a_sample_that_comes_twice_changes_nothing);
  RUN_BOTH(test_the_clock_may_wrap_in_flight);
  RUN_BOTH(test_a_broken_imu_sample_is_not_healthy);
}
