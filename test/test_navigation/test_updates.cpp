#include "Dense.h"
#include "suites.h"

#include <vector>

namespace {

using strix::Micros;
using strix::Vector3f;

const Vector3f kMagReference(20.0F, 3.0F, 45.0F);
const Quaterniond kAttitude = fromEuler(12.0, -7.0, 130.0);
constexpr Micros kEpoch = 1'000'000;  // of the filter below

/// A filter one second into a flight, with correlations between all its states.
strix::ESKF flyingFilter(const strix::NavigationConfig& config = {}) {
  strix::ESKF filter = filterAt(kAttitude, kMagReference, config);
  for (Micros now = 0; now <= kEpoch; now += 1'000) {
    filter.predict(toFloat(restForce(kAttitude)) * 1.2F, Vector3f(0.02F, 0.01F, -0.03F), now);
  }
  return filter;
}

/// The scalars of one loop pass as the textbook sees them: H, z - h(x) and R, row by row.
struct Batch {
  std::vector<Vector9d> rows;
  std::vector<double> innovations;
  std::vector<double> variances;

  void add(const Vector9d& row, double innovation, double variance) {
    rows.push_back(row);
    innovations.push_back(innovation);
    variances.push_back(variance);
  }

  void addDirection(const Vector3d& measured, const Vector3d& predicted, double variance) {
    const Matrix3d h = cross(predicted);
    for (int axis = 0; axis < 3; ++axis) {
      Vector9d row = Vector9d::Zero();
      row.segment<3>(6) = h.row(axis);
      add(row, measured(axis) - predicted(axis), variance);
    }
  }

  [[nodiscard]] Posterior update(const Matrix9d& p) const {
    const auto n = static_cast<Eigen::Index>(rows.size());
    Eigen::MatrixXd h(n, 9);
    for (Eigen::Index i = 0; i < n; ++i) h.row(i) = rows[static_cast<std::size_t>(i)];
    return batchUpdate(p, h, Eigen::Map<const Eigen::VectorXd>(innovations.data(), n),
                       Eigen::Map<const Eigen::VectorXd>(variances.data(), n));
  }
};

/// All 11 scalars of one pass, one after the other, none injected in between.
void test_scalars_in_sequence_equal_the_batch_update() {
  const strix::NavigationConfig config;
  strix::ESKF filter = flyingFilter(config);
  const Matrix9d before = filter.covariance().cast<double>();
  const Quaterniond q = toDouble(filter.state().attitude).normalized();
  const Vector3d position = filter.state().positionNed.cast<double>();
  const Vector3d velocity = filter.state().velocityNed.cast<double>();

  const Vector3d gravity = restForce(q);
  const Vector3d field = q.conjugate() * kMagReference.cast<double>();
  const Vector3d accel = gravity + Vector3d(0.3, -0.2, 0.1);
  const Vector3d mag = field + Vector3d(-2.0, 1.0, 3.0);
  const double height = -position.z() + 0.3;
  const Vector3d gpsPosition = position + Vector3d(1.0, -2.0, 0.0);
  const Vector3d gpsVelocity = velocity + Vector3d(0.2, 0.3, 0.0);
  const Micros now = kEpoch + 10'000;

  filter.updateTiltMeas(toFloat(accel));
  filter.updateMagMeas(toFloat(mag), kEpoch + 10'000);
  filter.updateAltMeas(static_cast<float>(height), now);
  filter.updateGPSMeas(toFloat(gpsPosition), toFloat(gpsVelocity));
  TEST_ASSERT_EQUAL(3, filter.tiltInnovation().accepted);
  TEST_ASSERT_EQUAL(3, filter.magInnovation().accepted);
  TEST_ASSERT_EQUAL(1, filter.altInnovation().accepted);
  TEST_ASSERT_EQUAL(4, filter.gpsInnovation().accepted);

  // Time since the last magnetometer and altimeter reading: longer than the longest step.
  const float maxStep = strix::toSeconds(strix::kMaxPredictStep);
  const auto square = [](float x) { return static_cast<double>(x) * static_cast<double>(x); };
  Batch batch;
  batch.addDirection(accel, gravity, static_cast<double>(config.tilt.variance(1e-3F)));
  batch.addDirection(mag, field, static_cast<double>(config.mag.variance(maxStep)));
  batch.add(Vector9d::Unit(2), -height - position.z(),
            static_cast<double>(config.alt.variance(maxStep)));
  batch.add(Vector9d::Unit(0), 1.0, square(config.gpsPositionSigma));
  batch.add(Vector9d::Unit(1), -2.0, square(config.gpsPositionSigma));
  batch.add(Vector9d::Unit(3), 0.2, square(config.gpsVelocitySigma));
  batch.add(Vector9d::Unit(4), 0.3, square(config.gpsVelocitySigma));
  const Posterior expected = batch.update(before);

  // Float rounding of eleven updates and of measurements near 50: a few 1e-6 of sigma.
  TEST_ASSERT_TRUE(relativeDifference(expected.covariance, filter.covariance()) < 2e-5);
  const Vector9d sigma = expected.covariance.diagonal().cwiseSqrt();
  const Vector9d difference = filter.error().cast<double>() - expected.error;
  TEST_ASSERT_TRUE(difference.cwiseQuotient(sigma).cwiseAbs().maxCoeff() < 1e-4);
}

void test_a_tilt_error_is_taken_out_at_every_heading() {
  strix::NavigationConfig config;
  config.tilt = {0.01F, 0.0F};  // one sample is enough
  for (const double yaw : {0.0, 90.0, 180.0, -135.0}) {
    const Quaterniond truth = fromEuler(4.0, 3.0, yaw);
    const Quaterniond wrong = truth * expOf(Vector3d(0.03, -0.02, 0.0));  // 2.1 deg
    strix::ESKF filter = filterAt(wrong, Vector3f::Zero(), config);
    filter.predict(toFloat(restForce(truth)), Vector3f::Zero(), 0);
    filter.predict(toFloat(restForce(truth)), Vector3f::Zero(), 1'000);
    filter.updateTiltMeas(toFloat(restForce(truth)));
    filter.injectError();
    // Left on the wrong side the error would have doubled at 180 deg.
    TEST_ASSERT_TRUE(tiltBetweenDeg(truth, toDouble(filter.state().attitude)) < 0.1);
    TEST_ASSERT_TRUE(filter.error().isZero(0.0F));
  }
}

void test_a_rejected_component_changes_neither_state_nor_covariance() {
  const strix::NavigationConfig config;
  strix::ESKF filter = flyingFilter(config);
  const Matrix9d before = filter.covariance().cast<double>();
  const Quaterniond q = toDouble(filter.state().attitude).normalized();
  const Vector3d field = q.conjugate() * kMagReference.cast<double>();
  const Vector3d spike = field + Vector3d(1.0, 500.0, -2.0);
  filter.updateMagMeas(toFloat(spike), kEpoch + 10'000);

  TEST_ASSERT_EQUAL(3, filter.magInnovation().count);
  TEST_ASSERT_EQUAL(0b010, filter.magInnovation().rejected);
  TEST_ASSERT_EQUAL(1, filter.magInnovation().rejections);
  TEST_ASSERT_EQUAL(2, filter.magInnovation().accepted);
  // What is left is the update with the other two components.
  Batch all;
  all.addDirection(
      spike, field,
      static_cast<double>(config.mag.variance(strix::toSeconds(strix::kMaxPredictStep))));
  Batch good;
  for (const std::size_t axis : {0U, 2U}) {
    good.add(all.rows[axis], all.innovations[axis], all.variances[axis]);
  }
  const Posterior expected = good.update(before);
  TEST_ASSERT_TRUE(relativeDifference(expected.covariance, filter.covariance()) < 2e-5);
  TEST_ASSERT_TRUE((filter.error().cast<double>() - expected.error).norm() < 1e-5);
}

/// Nothing may differ by a single bit after the measurement.
template <class Measurement>
void assertChangesNothing(const Measurement& measure) {
  strix::ESKF filter = flyingFilter();
  const strix::ESKF before = filter;
  measure(filter);
  filter.injectError();
  TEST_ASSERT_TRUE(before.covariance() == filter.covariance());
  TEST_ASSERT_TRUE(before.state().positionNed == filter.state().positionNed);
  TEST_ASSERT_TRUE(before.state().velocityNed == filter.state().velocityNed);
  TEST_ASSERT_TRUE(angleDeg(toDouble(before.state().attitude), toDouble(filter.state().attitude)) <
                   1e-5);  // injection normalises: one rounding
  TEST_ASSERT_TRUE(filter.healthy());
}

void test_an_outlier_changes_nothing_and_is_counted() {
  assertChangesNothing([](strix::ESKF& filter) {
    filter.updateAltMeas(1e4F, kEpoch + 10'000);
    TEST_ASSERT_EQUAL(1, filter.altInnovation().rejections);
    TEST_ASSERT_EQUAL(0, filter.altInnovation().accepted);
  });
  assertChangesNothing([](strix::ESKF& filter) {
    filter.updateGPSMeas(Vector3f(1e5F, -1e5F, 0.0F), Vector3f(1e3F, 1e3F, 0.0F));
    TEST_ASSERT_EQUAL(4, filter.gpsInnovation().rejections);
  });
}

void test_a_measurement_that_is_not_a_number_changes_nothing() {
  for (const float bad : {NAN, INFINITY, -INFINITY}) {
    const Vector3f vector = Vector3f::Constant(bad);
    assertChangesNothing([&](strix::ESKF& filter) { filter.updateTiltMeas(vector); });
    assertChangesNothing(
        [&](strix::ESKF& filter) { filter.updateMagMeas(vector, kEpoch + 1'000); });
    assertChangesNothing([&](strix::ESKF& filter) { filter.updateAltMeas(bad, kEpoch + 1'000); });
    assertChangesNothing([&](strix::ESKF& filter) { filter.updateGPSMeas(vector, vector); });
  }
}

void test_tilt_is_used_only_while_the_specific_force_is_g_long() {
  const strix::NavigationConfig config;
  for (const float excess : {-0.6F, -0.4F, 0.0F, 0.4F, 0.6F}) {
    strix::ESKF filter = flyingFilter(config);
    const Vector3f down = strix::rotateToBody(filter.state().attitude, Vector3f(0.0F, 0.0F, 1.0F));
    filter.updateTiltMeas(-(strix::kGravity + excess) * down);
    const bool used = excess > -config.tiltGate && excess < config.tiltGate;
    TEST_ASSERT_EQUAL(used ? 3 : 0, filter.tiltInnovation().count);
  }
}

void test_a_gps_fix_is_compared_with_the_position_at_its_own_time() {
  strix::NavigationConfig config;
  config.gpsDelay = 200'000;
  strix::ESKF filter = flyingFilter(config);
  const Vector3f velocity = filter.state().velocityNed;
  filter.updateGPSMeas(filter.state().positionNed - 0.2F * velocity, velocity);
  TEST_ASSERT_TRUE(velocity.head<2>().norm() > 0.1F);
  for (std::size_t i = 0; i < 4; ++i) {
    TEST_ASSERT_FLOAT_WITHIN(1e-5F, 0.0F, filter.gpsInnovation().value[i]);
  }
}

void test_at_standstill_the_velocity_goes_and_the_heading_stays() {
  strix::ESKF filter = filterAt(kAttitude, kMagReference);
  const Vector3f accel = toFloat(restForce(kAttitude)) + Vector3f(0.1F, -0.05F, 0.05F);
  for (Micros now = 0; now <= kEpoch; now += 1'000) filter.predict(accel, Vector3f::Zero(), now);
  const strix::VehicleState before = filter.state();
  TEST_ASSERT_TRUE(before.velocityNed.norm() > 0.1F);
  filter.updateStandstill();
  filter.injectError();
  TEST_ASSERT_TRUE(filter.state().velocityNed.norm() < 0.3F * before.velocityNed.norm());
  TEST_ASSERT_TRUE(std::abs(headingBetweenDeg(toDouble(before.attitude),
                                              toDouble(filter.state().attitude))) < 0.5);
}

void test_information_grows_with_time_and_not_with_the_rate_of_a_sensor() {
  const strix::MeasurementNoise noise{0.0F, 0.5F};
  // n samples a second: variance of their mean.
  const float slow = noise.variance(1.0F / 100.0F) / 100.0F;
  const float fast = noise.variance(1.0F / 1000.0F) / 1000.0F;
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, slow, fast);
}

}  // namespace

void runUpdateTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_scalars_in_sequence_equal_the_batch_update);
  RUN_TEST(test_a_tilt_error_is_taken_out_at_every_heading);
  RUN_TEST(test_a_rejected_component_changes_neither_state_nor_covariance);
  RUN_TEST(test_an_outlier_changes_nothing_and_is_counted);
  RUN_TEST(test_a_measurement_that_is_not_a_number_changes_nothing);
  RUN_TEST(test_tilt_is_used_only_while_the_specific_force_is_g_long);
  RUN_TEST(test_a_gps_fix_is_compared_with_the_position_at_its_own_time);
  RUN_TEST(test_at_standstill_the_velocity_goes_and_the_heading_stays);
  RUN_TEST(test_information_grows_with_time_and_not_with_the_rate_of_a_sensor);
}
