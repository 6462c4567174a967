/// The magnetic update that corrects the heading alone, and the assumptions that leave it alone.
#include "Dense.h"
#include "suites.h"

namespace {

using strix::Micros;
using strix::Vector3f;

const Vector3d kField(20.0, 3.0, 45.0);
constexpr Micros kStep = 10'000;

strix::NavigationConfig headingOnly() {
  strix::NavigationConfig config = testConfig();
  config.magFusion = strix::MagFusion::HeadingOnly;
  return config;
}

/// What a magnetometer at attitude q sees of a field, uT, body.
Vector3f seen(const Quaterniond& q, const Vector3d& field) {
  return toFloat(q.conjugate() * field);
}

// Level, inverted, nose straight up and down, on its side, and any.
const std::vector<Quaterniond> kAttitudes = {
    fromEuler(0.0, 0.0, 0.0),     fromEuler(180.0, 0.0, 40.0), fromEuler(0.0, 90.0, 0.0),
    fromEuler(20.0, -90.0, 70.0), fromEuler(90.0, 0.0, 160.0), fromEuler(-130.0, 50.0, -110.0)};

/// A filter in flight, with correlations between all its states and something pending in dx.
template <int States>
strix::ESKF<States> flyingFilter(const Quaterniond& attitude,
                                 const strix::NavigationConfig& config) {
  strix::ESKF<States> filter = filterAt<States>(attitude, toFloat(kField), config);
  Micros now = 0;
  for (int i = 0; i < 100; ++i, now += kStep) {
    filter.predict(toFloat(restForce(attitude)) * 1.2F, Vector3f(0.02F, 0.01F, -0.03F), now);
    if (i % 10 == 0) filter.updateGPSMeas(filter.state().positionNed, filter.state().velocityNed);
    filter.injectError();
  }
  filter.updateStandstill();
  return filter;
}
constexpr Micros kEpoch = 99 * kStep;  // of this filter
constexpr double kMagStep = 0.2;       // s, no magnetometer before: the longest step counts

/// How heading, as the field shows it, goes with the error state: atan2 of the horizontal field
/// seen, differentiated by hand, in NED. A turn by e moves a field m by e x m.
VectorXd headingRow(Eigen::Index states, const Quaterniond& attitude, const Vector3d& field) {
  const double horizontal2 = field.x() * field.x() + field.y() * field.y();
  const Vector3d gradient(field.y() / horizontal2, -field.x() / horizontal2, 0.0);
  VectorXd h = VectorXd::Zero(states);
  h.segment<3>(6) = attitude.conjugate() * gradient.cross(field);
  if (states == 18) h.segment<3>(15) = attitude.conjugate() * gradient;
  return h;
}

/// In double precision: the vertical part of K = P H^T/S for alpha and the gyro's bias, zero
/// elsewhere, and P' by Joseph's form, which holds for any gain.
Posterior projected(const MatrixXd& p, const VectorXd& dx, const Quaterniond& attitude,
                    double innovation, double variance) {
  const Vector3d down = attitude.conjugate() * Vector3d::UnitZ();
  const VectorXd h = headingRow(p.rows(), attitude, kField);
  const double s = h.dot(p * h) + variance;
  VectorXd gain = VectorXd::Zero(p.rows());
  const VectorXd column = p * h;
  for (const int block : {6, 12}) {
    if (block + 3 > p.rows()) continue;  // 9 states
    gain.segment<3>(block) = down * (down.dot(column.segment<3>(block)) / s);
  }
  const MatrixXd left = MatrixXd::Identity(p.rows(), p.rows()) - gain * h.transpose();
  return {dx + gain * (innovation - h.dot(dx)),
          left * p * left.transpose() + variance * gain * gain.transpose()};
}

template <int States>
void test_a_heading_update_is_the_projected_gain_in_josephs_form() {
  const double turn = 2.0 * kDeg;
  const auto sigma = static_cast<double>(headingOnly().heading.density);
  for (const Quaterniond& attitude : kAttitudes) {
    strix::ESKF<States> filter = flyingFilter<States>(attitude, headingOnly());
    const Quaterniond q = toDouble(filter.state().attitude).normalized();
    const Posterior expected = projected(toDouble(filter.covariance()), toDouble(filter.error()), q,
                                         turn, sigma * sigma / kMagStep);
    // The aircraft looks 2 deg further right than the filter thinks.
    filter.updateMagMeas(seen(fromEuler(0.0, 0.0, 2.0) * q, kField), kEpoch + 10 * kStep);

    TEST_ASSERT_EQUAL(1, filter.magInnovation().accepted);
    // Ten float roundings, 6e-8 each; the angle is a difference of numbers near 50.
    const MatrixXd found = toDouble(filter.covariance());
    TEST_ASSERT_TRUE(relativeDifference(expected.covariance, found) < 2e-6);
    const VectorXd difference = toDouble(filter.error()) - expected.error;
    TEST_ASSERT_TRUE(difference.cwiseAbs().maxCoeff() < 2e-6);
    TEST_ASSERT_TRUE(isCovariance(filter.covariance()));
  }
}

/// The field is bent in every way that leaves a heading: attitude and gyro bias turn about the
/// vertical, and nothing else moves by a bit.
template <int States>
void test_a_bent_field_turns_the_heading_and_moves_nothing_else() {
  strix::NavigationConfig config = headingOnly();
  config.nisGate = 1e9F;
  for (const Quaterniond& attitude : kAttitudes) {
    for (const Vector3d& bent : {Vector3d(20.0, -10.0, 45.0), Vector3d(5.0, 20.0, -45.0),
                                 Vector3d(60.0, 70.0, 0.0), Vector3d(-1.0, 15.0, 300.0)}) {
      strix::ESKF<States> filter = flyingFilter<States>(attitude, config);
      filter.injectError();
      const strix::ESKF<States> before = filter;
      const Quaterniond was = toDouble(before.state().attitude);
      filter.updateMagMeas(seen(was, bent), kEpoch + kStep);
      for (std::size_t i = 0; i < States; ++i) {
        const bool turns = (i >= 6 && i < 9) || (i >= 12 && i < 15);
        if (!turns) TEST_ASSERT_TRUE(filter.error()[i] == 0.0F);
      }
      filter.injectError();
      const Quaterniond is = toDouble(filter.state().attitude);
      TEST_ASSERT_TRUE(angleDeg(was, is) > 0.1);  // it did correct something
      // 1e-6 rad: a turn of up to a radian about an axis rounded to 1e-7, and the roundings of q.
      TEST_ASSERT_TRUE(tiltBetweenDeg(was, is) < 6e-5);
      TEST_ASSERT_TRUE(before.state().positionNed == filter.state().positionNed);
      TEST_ASSERT_TRUE(before.state().velocityNed == filter.state().velocityNed);
      TEST_ASSERT_TRUE(before.accelBias() == filter.accelBias());
      const Vector3f moved = filter.gyroBias() - before.gyroBias();
      const Vector3d turn = moved.cast<double>();
      const Vector3d down = was.conjugate() * Vector3d::UnitZ();
      TEST_ASSERT_TRUE(turn.cross(down).norm() <= 1e-6 * turn.norm() + 1e-9);
      TEST_ASSERT_TRUE(before.magBias() == filter.magBias());
    }
  }
}

template <int States>
void test_a_heading_170_deg_off_converges_and_the_tilt_stays() {
  strix::NavigationConfig config = headingOnly();
  config.nisGate = 1e9F;  // a gate for small errors would refuse this one
  config.headingSigma0 = 3.0F;
  for (const Quaterniond& truth : kAttitudes) {
    for (const double error : {170.0, -170.0}) {
      const Quaterniond start = fromEuler(0.0, 0.0, error) * truth;
      strix::ESKF<States> filter = filterAt<States>(start, toFloat(kField), config);
      for (Micros now = 0; now <= 3'000'000U; now += kStep) {
        filter.predict(toFloat(restForce(truth)), Vector3f::Zero(), now);
        filter.updateMagMeas(seen(truth, kField), now);
        filter.injectError();
        TEST_ASSERT_TRUE(isCovariance(filter.covariance()));
        if (now == 0) continue;
        // 300 passes, each five roundings of q, 3e-7 rad: a random walk to 3e-4 deg, three sigma.
        TEST_ASSERT_TRUE(tiltBetweenDeg(truth, toDouble(filter.state().attitude)) < 1e-3);
      }
      // The first sample, of 1 rad^2, takes nine tenths of the error for [1, alpha/2]: 106 deg. The
      // other 64 deg go with the next 300, whose mean has 1/300 rad^2 beside the 0.9 then left.
      TEST_ASSERT_TRUE(angleDeg(truth, toDouble(filter.state().attitude)) < 64.0 / 270.0 + 0.05);
    }
  }
}

/// Its variance falls and, with 18 states, that of the gyro's bias about the vertical; what was
/// known of the rest stays.
template <int States>
void test_the_heading_gets_surer_and_nothing_else_does() {
  strix::ESKF<States> filter = flyingFilter<States>(fromEuler(0.0, 0.0, 30.0), headingOnly());
  const MatrixXd before = toDouble(filter.covariance());
  const Quaterniond q = toDouble(filter.state().attitude);
  filter.updateMagMeas(seen(q, kField), kEpoch + kStep);
  const MatrixXd after = toDouble(filter.covariance());
  const Vector3d down = q.conjugate() * Vector3d::UnitZ();
  const Vector3d side = down.cross(Vector3d::UnitX()).normalized();
  const auto variance = [](const MatrixXd& p, const Vector3d& axis) {
    return axis.dot(p.block<3, 3>(6, 6) * axis);
  };
  TEST_ASSERT_TRUE(variance(after, down) < 0.9 * variance(before, down));
  TEST_ASSERT_TRUE(std::abs(variance(after, side) / variance(before, side) - 1.0) < 1e-5);
  for (int i = 0; i < States; ++i) {
    const bool turns = (i >= 6 && i < 9) || (i >= 12 && i < 15);
    if (!turns) TEST_ASSERT_TRUE(after(i, i) == before(i, i));
    TEST_ASSERT_TRUE(after(i, i) <= (1.0 + 1e-6) * before(i, i));
  }
}

/// A dead magnetometer, or a field that stands upright, points nowhere: it must not count as north.
template <int States>
void test_a_field_without_a_horizontal_part_changes_nothing() {
  for (const Quaterniond& attitude : kAttitudes) {
    strix::ESKF<States> filter = flyingFilter<States>(attitude, headingOnly());
    const strix::ESKF<States> before = filter;
    filter.updateMagMeas(Vector3f::Zero(), kEpoch + kStep);
    const Quaterniond q = toDouble(filter.state().attitude);
    filter.updateMagMeas(seen(q, Vector3d(0.2, 0.0, 49.0)), kEpoch + 2 * kStep);
    TEST_ASSERT_TRUE(same(before, filter));
    TEST_ASSERT_EQUAL(0, filter.magInnovation().accepted);
  }
}

/// That the aircraft stands still says nothing about where it looks: the usual gain, less its part
/// about the vertical, in double precision and by Joseph's form.
template <int States>
void test_an_assumption_can_leave_the_heading_alone() {
  for (const Quaterniond& attitude : kAttitudes) {
    strix::ESKF<States> filter = flyingFilter<States>(attitude, headingOnly());
    const MatrixXd p = toDouble(filter.covariance());
    const VectorXd dx = toDouble(filter.error());
    const Quaterniond q = toDouble(filter.state().attitude).normalized();
    const Vector3d down = q.conjugate() * Vector3d::UnitZ();
    const double innovation = dx(3) + 0.2;  // of v_n, m/s
    const double variance = 0.01;
    VectorXd gain = p.col(3) / (p(3, 3) + variance);
    TEST_ASSERT_TRUE(std::abs(down.dot(gain.segment<3>(6))) > 0.0);
    gain.segment<3>(6) -= down * down.dot(gain.segment<3>(6));
    MatrixXd left = MatrixXd::Identity(States, States);
    left.col(3) -= gain;
    const MatrixXd expected = left * p * left.transpose() + variance * gain * gain.transpose();

    filter.template scalarAssumedUpdate<strix::kVelocity>(static_cast<float>(innovation),
                                                          static_cast<float>(variance), true);
    // Ten float roundings, 6e-8 each.
    TEST_ASSERT_TRUE(relativeDifference(expected, toDouble(filter.covariance())) < 2e-6);
    const VectorXd change = toDouble(filter.error()) - dx;
    TEST_ASSERT_TRUE((change - gain * 0.2).cwiseAbs().maxCoeff() < 1e-6);
    TEST_ASSERT_TRUE(std::abs(down.dot(change.segment<3>(6))) < 1e-7);
    TEST_ASSERT_TRUE(isCovariance(filter.covariance()));
  }
}

/// Unlike a sensor's, however long it goes on.
template <int States>
void test_an_assumption_outside_the_gate_is_dropped_for_good() {
  strix::ESKF<States> filter = flyingFilter<States>(kAttitudes[0], headingOnly());
  const strix::ESKF<States> before = filter;
  for (const float wrong : {50.0F, NAN, INFINITY}) {
    filter.template scalarAssumedUpdate<strix::kVelocity>(wrong, 0.01F, false);
    filter.template scalarAssumedUpdate<strix::kPosition>(wrong, 0.01F, true);
    TEST_ASSERT_TRUE(same(before, filter));
  }
}

}  // namespace

void runHeadingTests() {
  Unity.TestFile = __FILE__;
  RUN_BOTH(test_a_heading_update_is_the_projected_gain_in_josephs_form);
  RUN_BOTH(test_a_bent_field_turns_the_heading_and_moves_nothing_else);
  RUN_BOTH(test_a_heading_170_deg_off_converges_and_the_tilt_stays);
  RUN_BOTH(test_the_heading_gets_surer_and_nothing_else_does);
  RUN_BOTH(test_a_field_without_a_horizontal_part_changes_nothing);
  RUN_BOTH(test_an_assumption_can_leave_the_heading_alone);
  RUN_BOTH(test_an_assumption_outside_the_gate_is_dropped_for_good);
}
