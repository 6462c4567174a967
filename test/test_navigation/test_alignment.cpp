#include "Dense.h"
#include "suites.h"

namespace {

// Scandinavia: 72 deg of dip, where a tilt error turns the heading most.
const Vector3d kFieldMagneticNorth(15.5, 0.0, 48.0);

Vector3d fieldNed(double declinationDeg) {
  return fromEuler(0.0, 0.0, declinationDeg) * kFieldMagneticNorth;
}

void test_alignment_recovers_any_attitude_from_gravity_and_field() {
  for (int roll = -180; roll <= 180; roll += 30) {
    for (int pitch = -80; pitch <= 80; pitch += 20) {
      for (int yaw = -180; yaw <= 180; yaw += 45) {
        const Quaterniond truth = fromEuler(roll, pitch, yaw);
        const strix::Alignment found = strix::alignStill(
            toFloat(restForce(truth)), toFloat(truth.conjugate() * kFieldMagneticNorth), 0.0F);
        // Float rounding of the inputs, 1e-7, is magnified by 1/cos(80 deg) = 6 and by the dip.
        TEST_ASSERT_TRUE(angleDeg(truth, toDouble(found.attitude)) < 1e-3);
      }
    }
  }
}

template <int States>
void test_declination_turns_the_reference_and_not_the_measurement() {
  const double declinationDeg = 11.7;
  const Quaterniond truth = fromEuler(5.0, -8.0, 70.0);
  const strix::Vector3f mag = toFloat(truth.conjugate() * fieldNed(declinationDeg));
  const strix::Alignment found =
      strix::alignStill(toFloat(restForce(truth)), mag, static_cast<float>(declinationDeg * kDeg));
  TEST_ASSERT_TRUE(angleDeg(truth, toDouble(found.attitude)) < 1e-3);
  const Vector3d reference = found.magReference.cast<double>();
  TEST_ASSERT_TRUE((reference - fieldNed(declinationDeg)).norm() < 1e-4);  // uT, of 50

  // The filter compares the raw measurement with it: at the true attitude nothing is left over.
  strix::ESKF<States> filter = filterAt<States>(truth, found.magReference);
  filter.predict(toFloat(restForce(truth)), strix::Vector3f::Zero(), 0);
  filter.updateMagMeas(mag, 10'000);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    TEST_ASSERT_FLOAT_WITHIN(1e-4F, 0.0F, filter.magInnovation().value[axis]);
  }
}

template <int States>
void test_without_a_magnetometer_the_heading_is_zero_and_no_field_is_expected() {
  const Quaterniond truth = fromEuler(10.0, 20.0, 0.0);
  const strix::Alignment found =
      strix::alignStill(toFloat(restForce(truth)), strix::Vector3f::Zero(), 0.2F);
  TEST_ASSERT_TRUE(angleDeg(truth, toDouble(found.attitude)) < 1e-4);
  TEST_ASSERT_TRUE(found.magReference.isZero(0.0F));

  strix::ESKF<States> filter = filterAt<States>(truth, found.magReference);
  filter.predict(toFloat(restForce(truth)), strix::Vector3f::Zero(), 0);
  filter.updateMagMeas({20.0F, 5.0F, 40.0F}, 10'000);
  TEST_ASSERT_EQUAL(0, filter.magInnovation().count);
}

template <int States>
void test_the_start_is_unsure_of_heading_about_the_vertical_whatever_the_attitude() {
  const strix::NavigationConfig config = testConfig();
  const Quaterniond onItsSide = fromEuler(90.0, 0.0, 0.0);  // down is the body's +y
  const strix::ESKF<States> filter = filterAt<States>(onItsSide, strix::Vector3f::Zero(), config);
  const float heading = config.headingSigma0 * config.headingSigma0;
  const float tilt = config.tiltSigma0 * config.tiltSigma0;
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, tilt, filter.covariance()(6, 6));
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, heading, filter.covariance()(7, 7));
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, tilt, filter.covariance()(8, 8));
}

}  // namespace

void runAlignmentTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_alignment_recovers_any_attitude_from_gravity_and_field);
  RUN_BOTH(test_declination_turns_the_reference_and_not_the_measurement);
  RUN_BOTH(test_without_a_magnetometer_the_heading_is_zero_and_no_field_is_expected);
  RUN_BOTH(test_the_start_is_unsure_of_heading_about_the_vertical_whatever_the_attitude);
}
