#include "Dense.h"
#include "suites.h"

namespace {

using strix::Micros;
using strix::Vector3f;

const Vector3f kMagReference(20.0F, 3.0F, 45.0F);
const Quaterniond kAttitude = fromEuler(12.0, -7.0, 130.0);
constexpr Micros kEpoch = 1'000'000;  // of the filter below
constexpr Micros kNow = kEpoch + 10'000;

/// A filter one second into a flight, with correlations between all its states.
template <int States>
strix::ESKF<States> flyingFilter(const strix::NavigationConfig& config = testConfig()) {
  strix::ESKF<States> filter = filterAt<States>(kAttitude, kMagReference, config);
  for (Micros now = 0; now <= kEpoch; now += 1'000) {
    filter.predict(toFloat(restForce(kAttitude)) * 1.2F, Vector3f(0.02F, 0.01F, -0.03F), now);
  }
  return filter;
}

/// All that can be measured in one pass of the loop, none injected in between: as the aircraft does
/// it, and as the textbook sees it.
template <int States>
class Pass {
 public:
  enum Sensor { Tilt, Mag, Alt, Gps };

  explicit Pass(const strix::ESKF<States>& filter) {
    const Quaterniond q = toDouble(filter.state().attitude).normalized();
    const Vector3d position = filter.state().positionNed.template cast<double>();
    const Vector3d velocity = filter.state().velocityNed.template cast<double>();
    gravity_ = restForce(q);
    field_ = q.conjugate() * kMagReference.cast<double>();
    accel_ = gravity_ + Vector3d(0.3, -0.2, 0.1);
    mag_ = field_ + Vector3d(-2.0, 1.0, 3.0);
    down_ = position.z();
    gpsPosition_ = position + Vector3d(1.0, -2.0, 0.0);
    gpsVelocity_ = velocity + Vector3d(0.2, 0.3, 0.0);
  }

  void measure(strix::ESKF<States>& filter, Sensor sensor) const {
    switch (sensor) {
      case Tilt:
        filter.updateTiltMeas(toFloat(accel_));
        TEST_ASSERT_EQUAL(3, filter.tiltInnovation().count);
        TEST_ASSERT_EQUAL(0, filter.tiltInnovation().rejected);
        break;
      case Mag:
        filter.updateMagMeas(toFloat(mag_), kNow);
        TEST_ASSERT_EQUAL(3, filter.magInnovation().accepted);
        break;
      case Alt:
        filter.updateAltMeas(static_cast<float>(-down_ + 0.3), kNow);
        TEST_ASSERT_EQUAL(1, filter.altInnovation().accepted);
        break;
      case Gps:
        filter.updateGPSMeas(toFloat(gpsPosition_), toFloat(gpsVelocity_));
        TEST_ASSERT_EQUAL(4, filter.gpsInnovation().accepted);
        break;
    }
  }

  void add(Batch& batch, Sensor sensor) const {
    const strix::NavigationConfig config = testConfig();
    // Time since the last magnetometer and altimeter reading: longer than the longest step.
    const float maxStep = strix::toSeconds(strix::kMaxPredictStep);
    const auto square = [](float x) { return static_cast<double>(x) * static_cast<double>(x); };
    const auto unit = [](int i) -> VectorXd { return VectorXd::Unit(States, i); };
    switch (sensor) {
      case Tilt:
        batch.addDirection(States, 9, accel_, gravity_,
                           static_cast<double>(config.tilt.variance(1e-3F)));
        break;
      case Mag:
        batch.addDirection(States, 15, mag_, field_,
                           static_cast<double>(config.mag.variance(maxStep)));
        break;
      case Alt:
        batch.add(unit(2), -0.3, static_cast<double>(config.alt.variance(maxStep)));
        break;
      case Gps:
        batch.add(unit(0), 1.0, square(config.gpsPositionSigma));
        batch.add(unit(1), -2.0, square(config.gpsPositionSigma));
        batch.add(unit(3), 0.2, square(config.gpsVelocitySigma));
        batch.add(unit(4), 0.3, square(config.gpsVelocitySigma));
        break;
    }
  }

 private:
  Vector3d gravity_, field_, accel_, mag_, gpsPosition_, gpsVelocity_;
  double down_ = 0.0;
};

/// Each sensor alone, all eleven scalars in three orders, and one sensor twice: the second time its
/// bias is pending in dx.
template <int States>
void test_scalars_in_sequence_equal_the_batch_update_in_any_order() {
  using P = Pass<States>;
  const std::vector<std::vector<typename P::Sensor>> orders = {{P::Tilt},
                                                               {P::Mag},
                                                               {P::Alt},
                                                               {P::Gps},
                                                               {P::Tilt, P::Mag, P::Alt, P::Gps},
                                                               {P::Gps, P::Alt, P::Mag, P::Tilt},
                                                               {P::Mag, P::Gps, P::Tilt, P::Alt},
                                                               {P::Tilt, P::Mag, P::Gps, P::Tilt}};
  const strix::ESKF<States> before = flyingFilter<States>();
  const P pass(before);
  for (const auto& order : orders) {
    strix::ESKF<States> filter = before;
    Batch batch;
    for (const auto sensor : order) {
      pass.measure(filter, sensor);
      pass.add(batch, sensor);
    }
    const Posterior expected = batch.update(toDouble(before.covariance()));

    // Float rounding of eleven updates and of measurements near 50: a few 1e-6 of sigma.
    const MatrixXd found = toDouble(filter.covariance());
    TEST_ASSERT_TRUE(relativeDifference(expected.covariance, found) < 2e-5);
    const VectorXd sigma = expected.covariance.diagonal().cwiseSqrt();
    const VectorXd difference = toDouble(filter.error()) - expected.error;
    TEST_ASSERT_TRUE(difference.cwiseQuotient(sigma).cwiseAbs().maxCoeff() < 1e-4);
    TEST_ASSERT_TRUE(isCovariance(filter.covariance()));
    TEST_ASSERT_TRUE(filter.state().positionNed == before.state().positionNed);  // not injected
  }
}

template <int States>
void test_a_tilt_error_is_taken_out_at_every_heading() {
  strix::NavigationConfig config = testConfig();
  config.tilt = {0.01F, 0.0F};  // one sample is enough
  config.accelBiasSigma0 = 0.001F;
  for (const double yaw : {0.0, 90.0, 180.0, -135.0}) {
    const Quaterniond truth = fromEuler(4.0, 3.0, yaw);
    const Quaterniond wrong = truth * expOf(Vector3d(0.03, -0.02, 0.0));  // 2.1 deg
    strix::ESKF<States> filter = filterAt<States>(wrong, Vector3f::Zero(), config);
    filter.predict(toFloat(restForce(truth)), Vector3f::Zero(), 0);
    filter.predict(toFloat(restForce(truth)), Vector3f::Zero(), 1'000);
    filter.updateTiltMeas(toFloat(restForce(truth)));
    filter.injectError();
    // Left on the wrong side the error would have doubled at 180 deg.
    TEST_ASSERT_TRUE(tiltBetweenDeg(truth, toDouble(filter.state().attitude)) < 0.1);
    for (const float element : filter.error()) TEST_ASSERT_TRUE(element == 0.0F);
  }
}

template <int States>
void test_what_a_rejected_component_leaves_is_the_update_with_the_others() {
  const strix::NavigationConfig config = testConfig();
  strix::ESKF<States> filter = flyingFilter<States>(config);
  const MatrixXd before = toDouble(filter.covariance());
  const Quaterniond q = toDouble(filter.state().attitude).normalized();
  const Vector3d field = q.conjugate() * kMagReference.cast<double>();
  const Vector3d spike = field + Vector3d(1.0, 500.0, -2.0);
  filter.updateMagMeas(toFloat(spike), kNow);

  TEST_ASSERT_EQUAL(3, filter.magInnovation().count);
  TEST_ASSERT_EQUAL(0b010, filter.magInnovation().rejected);
  TEST_ASSERT_EQUAL(1, filter.magInnovation().rejections);
  TEST_ASSERT_EQUAL(2, filter.magInnovation().accepted);
  Batch all;
  all.addDirection(
      States, 15, spike, field,
      static_cast<double>(config.mag.variance(strix::toSeconds(strix::kMaxPredictStep))));
  Batch good;
  for (const std::size_t axis : {0U, 2U}) {
    good.add(all.rows[axis], all.innovations[axis], all.variances[axis]);
  }
  const Posterior expected = good.update(before);
  TEST_ASSERT_TRUE(relativeDifference(expected.covariance, toDouble(filter.covariance())) < 2e-5);
  const VectorXd sigma = expected.covariance.diagonal().cwiseSqrt();
  const VectorXd difference = toDouble(filter.error()) - expected.error;
  TEST_ASSERT_TRUE(difference.cwiseQuotient(sigma).cwiseAbs().maxCoeff() < 1e-4);
}

/// No bit of state, biases, dx or P may differ after the measurement.
template <int States, class Measurement>
void assertChangesNothing(const Measurement& measure,
                          strix::MagFusion fusion = strix::MagFusion::ThreeAxis) {
  strix::NavigationConfig config = testConfig();
  config.magFusion = fusion;
  strix::ESKF<States> filter = flyingFilter<States>(config);
  filter.updateStandstill();  // dx is no longer zero: nothing may touch it either
  TEST_ASSERT_TRUE(filter.error()[strix::kVelocity + 2] != 0.0F);
  const strix::ESKF<States> before = filter;
  measure(filter);
  TEST_ASSERT_TRUE(same(before, filter));
  TEST_ASSERT_TRUE(filter.healthy());
}

template <int States>
void test_an_outlier_changes_nothing_and_is_counted() {
  using Filter = strix::ESKF<States>;
  assertChangesNothing<States>([](Filter& filter) {
    filter.updateAltMeas(1e4F, kNow);
    TEST_ASSERT_EQUAL(1, filter.altInnovation().rejections);
    TEST_ASSERT_EQUAL(0, filter.altInnovation().accepted);
  });
  assertChangesNothing<States>([](Filter& filter) {
    filter.updateGPSMeas(Vector3f(1e5F, -1e5F, 0.0F), Vector3f(1e3F, 1e3F, 0.0F));
    TEST_ASSERT_EQUAL(4, filter.gpsInnovation().rejections);
    TEST_ASSERT_EQUAL(0b1111, filter.gpsInnovation().rejected);
  });
  assertChangesNothing<States>([](Filter& filter) {
    filter.updateMagMeas(Vector3f(500.0F, -500.0F, 500.0F), kNow);
    TEST_ASSERT_EQUAL(3, filter.magInnovation().rejections);
  });
  assertChangesNothing<States>(
      [](Filter& filter) {  // the field from behind
        const Vector3f field = strix::rotateToBody(filter.state().attitude, {-20.0F, -3.0F, 45.0F});
        filter.updateMagMeas(field, kNow);
        TEST_ASSERT_EQUAL(1, filter.magInnovation().rejections);
      },
      strix::MagFusion::HeadingOnly);
}

template <int States>
void test_a_measurement_that_is_not_a_number_changes_nothing() {
  using Filter = strix::ESKF<States>;
  for (const float bad : {NAN, INFINITY, -INFINITY}) {
    const Vector3f vector = Vector3f::Constant(bad);
    const auto mag = [&](Filter& filter) { filter.updateMagMeas(vector, kNow); };
    assertChangesNothing<States>([&](Filter& filter) { filter.updateTiltMeas(vector); });
    assertChangesNothing<States>(mag);
    assertChangesNothing<States>(mag, strix::MagFusion::HeadingOnly);
    assertChangesNothing<States>([&](Filter& filter) { filter.updateAltMeas(bad, kNow); });
    assertChangesNothing<States>([&](Filter& filter) { filter.updateGPSMeas(vector, vector); });
    assertChangesNothing<States>(
        [&](Filter& filter) { filter.updateStandstillRate(vector, 0.001F); });
  }
}

template <int States>
void test_tilt_is_used_only_while_the_specific_force_is_g_long() {
  const strix::NavigationConfig config = testConfig();
  for (const float excess : {-0.6F, -0.4F, 0.0F, 0.4F, 0.6F}) {
    strix::ESKF<States> filter = flyingFilter<States>(config);
    const Vector3f down = strix::rotateToBody(filter.state().attitude, Vector3f(0.0F, 0.0F, 1.0F));
    filter.updateTiltMeas(-(strix::kGravity + excess) * down);
    const bool used = excess > -config.tiltGate && excess < config.tiltGate;
    TEST_ASSERT_EQUAL(used ? 3 : 0, filter.tiltInnovation().count);
  }
}

template <int States>
void test_at_standstill_the_velocity_goes_and_the_heading_stays() {
  strix::ESKF<States> filter = filterAt<States>(kAttitude, kMagReference);
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

void test_the_rate_at_standstill_is_the_gyros_bias() {
  const Vector3f rate(0.002F, -0.001F, 0.003F);
  strix::ESKF<18> filter = flyingFilter<18>();
  filter.updateStandstillRate(rate, 1e-5F);
  filter.injectError();
  // (1e-5 / sigma_0)^2 of the bias is not believed, 1e-5.
  TEST_ASSERT_TRUE((filter.gyroBias() - rate).norm() < 1e-7F);
  strix::ESKF<9> without = flyingFilter<9>();
  const strix::ESKF<9> before = without;
  without.updateStandstillRate(rate, 1e-5F);
  TEST_ASSERT_TRUE(same(before, without));
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
  RUN_BOTH(test_scalars_in_sequence_equal_the_batch_update_in_any_order);
  RUN_BOTH(test_a_tilt_error_is_taken_out_at_every_heading);
  RUN_BOTH(test_what_a_rejected_component_leaves_is_the_update_with_the_others);
  RUN_BOTH(test_an_outlier_changes_nothing_and_is_counted);
  RUN_BOTH(test_a_measurement_that_is_not_a_number_changes_nothing);
  RUN_BOTH(test_tilt_is_used_only_while_the_specific_force_is_g_long);
  RUN_BOTH(test_at_standstill_the_velocity_goes_and_the_heading_stays);
  RUN_TEST(test_the_rate_at_standstill_is_the_gyros_bias);
  RUN_TEST(test_information_grows_with_time_and_not_with_the_rate_of_a_sensor);
}
