#include "Dense.h"
#include "suites.h"

namespace {

using strix::Micros;
using strix::Vector3f;

constexpr double kDt = 1e-3;
constexpr Micros kStep = 1'000;

// One moment of a lively flight: every block of F is filled.
const Quaterniond kAttitude = fromEuler(25.0, -40.0, 130.0);
const Vector3d kAccel(2.0, -3.5, -11.0);
const Vector3d kGyro(1.5, -2.0, 3.0);

/// Position, velocity and attitude, moved on as DESIGN.md section 4 says.
struct Nominal {
  Vector3d position;
  Vector3d velocity;
  Quaterniond attitude;

  [[nodiscard]] Nominal moved(const Vector3d& accel, const Vector3d& gyro, double dt) const {
    const Vector3d a = attitude * accel + Vector3d(0.0, 0.0, kG);
    return {position + velocity * dt + 0.5 * dt * dt * a, velocity + a * dt,
            attitude * expOf(gyro * dt)};
  }
  [[nodiscard]] Nominal plus(const Vector9d& dx) const {
    return {position + dx.segment<3>(0), velocity + dx.segment<3>(3),
            attitude * expOf(dx.segment<3>(6))};
  }
  [[nodiscard]] Vector9d minus(const Nominal& other) const {
    Vector9d dx;
    dx << position - other.position, velocity - other.velocity,
        2.0 * (other.attitude.conjugate() * attitude).vec();
    return dx;
  }
};

strix::Matrix3f nedToBody(const Quaterniond& q) { return strix::q2R(toFloat(q)); }

void test_at_hover_a_tilt_error_accelerates_by_g() {
  const Vector3f hover(0.0F, 0.0F, -strix::kGravity);
  const strix::Matrix9f phi =
      strix::ESKF::getSTM(strix::Matrix3f::Identity(), hover, Vector3f::Zero(), 1.0F);
  // Rolled right (+x) the thrust points right (east), pitched up (+y) it points back.
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, strix::kGravity, phi(4, 6));
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, -strix::kGravity, phi(3, 7));
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 0.0F, phi(5, 8));
}

void test_the_transition_matrix_is_the_derivative_of_the_nominal_propagation() {
  const Nominal before{Vector3d(3.0, -2.0, 1.0), Vector3d(4.0, 1.0, -2.0), kAttitude};
  const Nominal after = before.moved(kAccel, kGyro, kDt);
  const strix::Matrix9f phi = strix::ESKF::getSTM(nedToBody(kAttitude), toFloat(kAccel),
                                                  toFloat(kGyro), static_cast<float>(kDt));
  const double small = 1e-6;
  // What I + F dt leaves out: dp/dalpha = |f| dt^2 / 2 and dalpha/dalpha = (w dt)^2 / 2.
  const double second = (0.5 * kAccel.norm() + kGyro.squaredNorm()) * kDt * kDt;
  for (int i = 0; i < 9; ++i) {
    const Vector9d dx = small * Vector9d::Unit(i);
    const Vector9d column = before.plus(dx).moved(kAccel, kGyro, kDt).minus(after) / small;
    const double error = (column - phi.col(i).cast<double>()).cwiseAbs().maxCoeff();
    TEST_ASSERT_TRUE(error < second);
  }
}

void test_the_process_noise_equals_the_integral_with_its_cross_terms() {
  const strix::NavigationConfig config;
  const strix::ESKF filter(config);
  for (const double dt : {1e-3, 0.02, 0.2}) {
    const strix::Matrix9f found =
        filter.getQd(nedToBody(kAttitude), toFloat(kAccel), toFloat(kGyro), static_cast<float>(dt));
    const Matrix9d expected =
        processNoise(systemMatrix(kAttitude, kAccel, kGyro), static_cast<double>(config.accelNoise),
                     static_cast<double>(config.gyroNoise), dt);
    TEST_ASSERT_TRUE(expected.block(3, 6, 3, 3).norm() > 0.0);
    TEST_ASSERT_TRUE(relativeDifference(expected, found) < 2e-6);  // some ten float roundings
  }
}

/// A filter in flight, its covariance filled by prediction and by measurements.
strix::ESKF livelyFilter() {
  strix::ESKF filter = filterAt(kAttitude, Vector3f(20.0F, 3.0F, 45.0F));
  Micros now = 0;
  for (int i = 0; i < 500; ++i, now += kStep) {
    filter.predict(toFloat(kAccel), toFloat(kGyro), now);
    const strix::VehicleState& state = filter.state();
    if (i % 10 == 0)
      filter.updateMagMeas(strix::rotateToBody(state.attitude, filter.magReference()), now);
    if (i % 100 == 0) filter.updateGPSMeas(state.positionNed, state.velocityNed);
    filter.injectError();
  }
  return filter;
}

void test_predict_moves_the_covariance_as_the_dense_equation() {
  const strix::NavigationConfig config;
  strix::ESKF filter = livelyFilter();
  const Matrix9d before = filter.covariance().cast<double>();
  const Quaterniond q = toDouble(filter.state().attitude).normalized();
  const Micros step = 5'000;
  filter.predict(toFloat(kAccel), toFloat(kGyro), 499 * kStep + step);

  const double dt = static_cast<double>(step) * 1e-6;
  const Matrix9d f = systemMatrix(q, kAccel, kGyro);
  const Matrix9d phi = Matrix9d::Identity() + f * dt;
  const Matrix9d expected =
      phi * before * phi.transpose() + processNoise(f, static_cast<double>(config.accelNoise),
                                                    static_cast<double>(config.gyroNoise), dt);
  TEST_ASSERT_TRUE(relativeDifference(expected, filter.covariance()) < 2e-6);
  TEST_ASSERT_TRUE(isCovariance(filter.covariance()));
}

void test_predict_moves_the_state_as_the_double_precision_model() {
  strix::ESKF filter = filterAt(kAttitude, Vector3f::Zero());
  Nominal truth{Vector3d::Zero(), Vector3d::Zero(), kAttitude};
  filter.predict(toFloat(kAccel), toFloat(kGyro), 0);
  for (Micros i = 1; i <= 2000; ++i) {
    filter.predict(toFloat(kAccel), toFloat(kGyro), i * kStep);
    truth = truth.moved(kAccel, kGyro, kDt);
  }
  // 2000 roundings of 6e-8 add up as a random walk to 3e-6; position and velocity are ~ 15.
  TEST_ASSERT_TRUE(angleDeg(truth.attitude, toDouble(filter.state().attitude)) < 1e-3);
  TEST_ASSERT_TRUE((truth.velocity - filter.state().velocityNed.cast<double>()).norm() < 1e-3);
  TEST_ASSERT_TRUE((truth.position - filter.state().positionNed.cast<double>()).norm() < 1e-3);
}

void test_a_gap_counts_as_the_longest_step_and_no_more() {
  strix::ESKF gap = filterAt(kAttitude, Vector3f::Zero());
  strix::ESKF longest = gap;
  gap.predict(toFloat(kAccel), toFloat(kGyro), 0);
  gap.predict(toFloat(kAccel), toFloat(kGyro), 30'000'000);
  longest.predict(toFloat(kAccel), toFloat(kGyro), 0);
  longest.predict(toFloat(kAccel), toFloat(kGyro), strix::kMaxPredictStep);
  TEST_ASSERT_TRUE(gap.covariance() == longest.covariance());
  TEST_ASSERT_TRUE(gap.state().velocityNed == longest.state().velocityNed);
  // And the next step is an ordinary one again.
  gap.predict(toFloat(kAccel), toFloat(kGyro), 30'000'000 + kStep);
  longest.predict(toFloat(kAccel), toFloat(kGyro), strix::kMaxPredictStep + kStep);
  TEST_ASSERT_TRUE(gap.covariance() == longest.covariance());
}

void test_a_sample_that_comes_twice_changes_nothing() {
  strix::ESKF filter = livelyFilter();
  const strix::Matrix9f before = filter.covariance();
  const Vector3f velocity = filter.state().velocityNed;
  filter.predict(toFloat(kAccel), toFloat(kGyro), 499 * kStep);
  filter.updateTiltMeas(Vector3f(0.0F, 0.0F, -strix::kGravity));
  TEST_ASSERT_TRUE(before == filter.covariance());
  TEST_ASSERT_TRUE(velocity == filter.state().velocityNed);
}

void test_the_clock_may_wrap_in_flight() {
  const Vector3f reference(20.0F, 3.0F, 45.0F);
  strix::ESKF wrapped = filterAt(kAttitude, reference);
  strix::ESKF plain = wrapped;
  const Micros justBefore = 0xFFFFFFFFU - 25'500U;  // wraps within a step, and within every period
  for (Micros i = 0; i < 60; ++i) {
    for (strix::ESKF* filter : {&wrapped, &plain}) {
      const Micros now = (filter == &wrapped ? justBefore : 0U) + i * kStep;
      filter->predict(toFloat(kAccel), toFloat(kGyro), now);
      filter->updateTiltMeas(Vector3f(1.0F, 0.5F, -9.7F));
      if (i % 10 == 5) filter->updateMagMeas(Vector3f(30.0F, 10.0F, 35.0F), now);
      if (i % 20 == 5) filter->updateAltMeas(1.0F, now);
      filter->injectError();
    }
  }
  TEST_ASSERT_TRUE(plain.altInnovation().accepted > 0);
  TEST_ASSERT_TRUE(wrapped.covariance() == plain.covariance());
  TEST_ASSERT_TRUE(wrapped.state().positionNed == plain.state().positionNed);
  TEST_ASSERT_TRUE(wrapped.state().attitude.vec() == plain.state().attitude.vec());
}

void test_a_broken_imu_sample_is_not_healthy() {
  strix::ESKF filter = livelyFilter();
  TEST_ASSERT_TRUE(filter.healthy());
  filter.predict(Vector3f(NAN, 0.0F, 0.0F), Vector3f::Zero(), 500 * kStep);
  TEST_ASSERT_FALSE(filter.healthy());
}

}  // namespace

void runPropagationTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_at_hover_a_tilt_error_accelerates_by_g);
  RUN_TEST(test_the_transition_matrix_is_the_derivative_of_the_nominal_propagation);
  RUN_TEST(test_the_process_noise_equals_the_integral_with_its_cross_terms);
  RUN_TEST(test_predict_moves_the_covariance_as_the_dense_equation);
  RUN_TEST(test_predict_moves_the_state_as_the_double_precision_model);
  RUN_TEST(test_a_gap_counts_as_the_longest_step_and_no_more);
  RUN_TEST(test_a_sample_that_comes_twice_changes_nothing);
  RUN_TEST(test_the_clock_may_wrap_in_flight);
  RUN_TEST(test_a_broken_imu_sample_is_not_healthy);
}
