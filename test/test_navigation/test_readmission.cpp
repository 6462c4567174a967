/// A gate that cannot lock itself out, and a rejected sensor that is taken in again.
#include "Dense.h"
#include "suites.h"

namespace {

using strix::Micros;
using strix::Vector3f;

constexpr Micros kStep = 20'000;  // of IMU and every sensor here
constexpr Micros kPatience = 1'000'000;
const Vector3d kField(20.0, 3.0, 45.0);
const Quaterniond kAttitude = fromEuler(10.0, 5.0, 40.0);

strix::NavigationConfig patient(Micros readmitAfter = kPatience) {
  strix::NavigationConfig config = testConfig();
  config.readmitAfter = readmitAfter;
  return config;
}

/// A filter at rest with one sensor, which agrees with it so far.
template <int States, class Sensor>
class Rest {
 public:
  Rest(const strix::NavigationConfig& config, const Sensor& sensor)
      : filter(filterAt<States>(kAttitude, toFloat(kField), config)), sensor_(sensor) {
    wait(0.5);
    pass(500, 0.0F);
  }

  /// Passes of the loop in which the sensor is off by `error`.
  void pass(int count, float error) {
    for (int i = 0; i < count; ++i) {
      move();
      sensor_(filter, error, now);
      filter.injectError();
    }
  }
  /// Time without the sensor.
  void wait(double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * 1e6) / static_cast<int>(kStep); ++i) move();
  }

  strix::ESKF<States> filter;
  Micros now = 0;

 private:
  void move() {
    now += kStep;
    filter.predict(toFloat(restForce(kAttitude)), Vector3f::Zero(), now);
    filter.updateTiltMeas(toFloat(restForce(kAttitude)));
  }
  const Sensor& sensor_;
};

constexpr int kPatientPasses = static_cast<int>(kPatience / kStep);

const auto kHeight = [](auto& filter, float error, Micros now) {
  filter.updateAltMeas(error, now);
};
const auto kGps = [](auto& filter, float error, Micros) {
  filter.updateGPSMeas(Vector3f(error, 0.0F, 0.0F), Vector3f::Zero());
};
/// The field of an aircraft turned by `error` rad.
const auto kMag = [](auto& filter, float error, Micros now) {
  const Quaterniond q = fromEuler(0.0, 0.0, static_cast<double>(error) / kDeg) * kAttitude;
  filter.updateMagMeas(toFloat(q.conjugate() * kField), now);
};

template <int States>
void test_a_height_that_stays_elsewhere_is_refused_then_taken_in_then_followed() {
  Rest<States, decltype(kHeight)> rest(patient(), kHeight);
  const float before = rest.filter.covariance()(2, 2);
  // The first refusal starts the clock; the one just after kPatience is taken in.
  rest.pass(kPatientPasses + 1, 100.0F);
  TEST_ASSERT_EQUAL(0, rest.filter.altInnovation().readmissions);
  TEST_ASSERT_EQUAL(kPatientPasses + 1, rest.filter.altInnovation().rejections);
  TEST_ASSERT_TRUE(std::abs(rest.filter.state().positionNed.z()) < 1.0F);

  rest.pass(1, 100.0F);
  TEST_ASSERT_EQUAL(1, rest.filter.altInnovation().readmissions);
  // As unsure now as one measurement leaves it: its own 0.3 m.
  TEST_ASSERT_TRUE(rest.filter.covariance()(2, 2) > 3.0F * before);
  TEST_ASSERT_FLOAT_WITHIN(0.01F, 0.09F, rest.filter.covariance()(2, 2));
  TEST_ASSERT_FLOAT_WITHIN(1.0F, -100.0F, rest.filter.state().positionNed.z());
  TEST_ASSERT_TRUE(isCovariance(rest.filter.covariance()));

  const std::uint32_t refused = rest.filter.altInnovation().rejections;
  rest.pass(500, 100.0F);
  TEST_ASSERT_EQUAL(refused, rest.filter.altInnovation().rejections);
  TEST_ASSERT_FLOAT_WITHIN(1.0F, -100.0F, rest.filter.state().positionNed.z());
}

template <int States>
void test_gps_components_are_taken_in_one_by_one() {
  Rest<States, decltype(kGps)> rest(patient(), kGps);
  rest.pass(kPatientPasses + 2, 500.0F);
  TEST_ASSERT_EQUAL(1, rest.filter.gpsInnovation().readmissions);
  TEST_ASSERT_EQUAL(0b0001, rest.filter.gpsInnovation().rejected);
  TEST_ASSERT_FLOAT_WITHIN(1.0F, 500.0F, rest.filter.state().positionNed.x());
  TEST_ASSERT_FLOAT_WITHIN(1.0F, 0.0F, rest.filter.state().positionNed.y());
}

/// The field turns by 60 deg and stays so: the tilt never follows.
/// @return where the heading is 20 s later, deg from where it was
template <int States>
double headingInATurnedField(strix::MagFusion fusion) {
  strix::NavigationConfig config = patient();
  config.magFusion = fusion;
  config.mag = {0.5F, 0.0F};  // sure of itself, so that 60 deg are far outside its gate
  config.heading = {0.02F, 0.0F};
  config.gyroNoise = 1e-3F;
  Rest<States, decltype(kMag)> rest(config, kMag);
  const auto sixty = static_cast<float>(60.0 * kDeg);
  const auto attitude = [&rest] { return toDouble(rest.filter.state().attitude); };
  rest.pass(kPatientPasses + 1, sixty);
  TEST_ASSERT_EQUAL(0, rest.filter.magInnovation().readmissions);
  TEST_ASSERT_TRUE(rest.filter.magInnovation().rejections > 0);
  // Until then at most some component inside the gate, of 2.6 sigma, has pulled.
  TEST_ASSERT_TRUE(angleDeg(kAttitude, attitude()) < 10.0);
  for (int i = 0; i < 20 * kPatientPasses; ++i) {
    rest.pass(1, sixty);
    TEST_ASSERT_TRUE(isCovariance(rest.filter.covariance()));
    TEST_ASSERT_TRUE(tiltBetweenDeg(kAttitude, attitude()) < 4.0);
  }
  TEST_ASSERT_TRUE(rest.filter.magInnovation().readmissions > 0);
  return headingBetweenDeg(kAttitude, attitude());
}

template <int States>
void test_a_heading_from_elsewhere_is_followed_in_the_end() {
  const double heading = headingInATurnedField<States>(strix::MagFusion::HeadingOnly);
  TEST_ASSERT_TRUE(std::abs(heading - 60.0) < 2.0);
}

template <int States>
void test_a_field_from_elsewhere_is_followed_and_does_not_tip_the_aircraft() {
  const double heading = headingInATurnedField<States>(strix::MagFusion::ThreeAxis);
  TEST_ASSERT_TRUE(std::abs(heading - 60.0) < 2.0);
}

/// Level, no turn makes the vertical specific force longer: taken in again, it must not turn
/// anything.
template <int States>
void test_what_no_turn_explains_turns_nothing() {
  strix::NavigationConfig config = patient();
  config.tilt = {0.01F, 0.0F};
  config.accelBiasSigma0 = 0.01F;
  strix::ESKF<States> filter =
      filterAt<States>(fromEuler(0.0, 0.0, 40.0), Vector3f::Zero(), config);
  const Vector3f accel(0.0F, 0.0F, -strix::kGravity - 0.4F);
  for (Micros now = 0; now < 10'000'000U; now += kStep) {
    filter.predict(accel, Vector3f::Zero(), now);
    filter.updateTiltMeas(accel);
    filter.injectError();
    TEST_ASSERT_TRUE(filter.healthy());
  }
  TEST_ASSERT_TRUE(filter.tiltInnovation().readmissions > 0);
  TEST_ASSERT_TRUE(angleDeg(fromEuler(0.0, 0.0, 40.0), toDouble(filter.state().attitude)) < 0.1);
}

/// The worst tilt error, deg, of a filter in a hover whose tilt nothing but GPS says.
/// @param since  s, of a minute
/// @param disturb  changes the gyro, rad/s, and the velocity of GPS, m/s, at a time, s
template <int States, class Disturb>
double worstTilt(const strix::NavigationConfig& config, float since, Disturb&& disturb) {
  constexpr Micros kTick = 2'000;
  strix::ESKF<States> filter = filterAt<States>(kAttitude, toFloat(kField), config);
  const Vector3f field = toFloat(kAttitude.conjugate() * kField);
  double worst = 0.0;
  for (Micros now = 0; now < 60'000'000U; now += kTick) {
    Vector3f gyro = Vector3f::Zero();
    Vector3f velocity = Vector3f::Zero();
    const float time = static_cast<float>(now) * 1e-6F;
    disturb(time, gyro, velocity);
    filter.predict(toFloat(restForce(kAttitude)), gyro, now);
    if (now % 10'000 == 0) filter.updateMagMeas(field, now);
    if (now % 20'000 == 0) filter.updateAltMeas(0.0F, now);
    if (now % 100'000 == 0) filter.updateGPSMeas(Vector3f::Zero(), velocity);
    filter.injectError();
    if (time < since) continue;
    worst = std::max(worst, tiltBetweenDeg(kAttitude, toDouble(filter.state().attitude)));
  }
  TEST_ASSERT_TRUE(isCovariance(filter.covariance()) && filter.healthy());
  return worst;
}

[[nodiscard]] strix::NavigationConfig byHeadingAndGps() {
  strix::NavigationConfig config;
  config.gpsPositionSigma = 3.0F;
  config.gpsVelocitySigma = 0.3F;
  return config;
}

/// To 5 deg/s, an ICM20649's zero-rate tolerance, within 12 s: far faster than its walk in the
/// filter. GPS's velocity shows it, is refused, and is believed in the end.
void test_a_gyro_that_drifts_away_is_found_out_by_gps() {
  const auto drift = [](float time, Vector3f& gyro, Vector3f&) {
    const double deg = std::min(0.4 * time, 5.0);
    gyro = Vector3f::Constant(static_cast<float>(deg * kDeg));
  };
  TEST_ASSERT_TRUE(worstTilt<18>(byHeadingAndGps(), 40.0F, drift) < 2.0);
  strix::NavigationConfig sure = byHeadingAndGps();
  sure.readmitGyroBias = 0.0F;
  TEST_ASSERT_TRUE(worstTilt<18>(sure, 40.0F, drift) > 8.0);
}

/// A velocity from elsewhere comes once; a tilt would make it grow.
template <int States>
void test_a_velocity_from_elsewhere_does_not_tip_the_aircraft() {
  const auto pull = [](float time, Vector3f&, Vector3f& velocity) {
    if (time > 5.0F && time < 15.0F) velocity.x() = 4.0F;
  };
  TEST_ASSERT_TRUE(worstTilt<States>(byHeadingAndGps(), 0.0F, pull) < 10.0);
}

template <int States>
void test_without_patience_a_sensor_stays_refused() {
  Rest<States, decltype(kHeight)> rest(patient(0), kHeight);
  rest.pass(20 * kPatientPasses, 100.0F);
  TEST_ASSERT_EQUAL(0, rest.filter.altInnovation().readmissions);
  TEST_ASSERT_EQUAL(20 * kPatientPasses, rest.filter.altInnovation().rejections);
  TEST_ASSERT_TRUE(std::abs(rest.filter.state().positionNed.z()) < 2.0F);
}

template <int States>
void test_one_outlier_after_a_silence_is_refused() {
  Rest<States, decltype(kHeight)> rest(patient(), kHeight);
  rest.wait(5.0);
  rest.pass(1, 1e4F);
  TEST_ASSERT_EQUAL(0, rest.filter.altInnovation().readmissions);
  TEST_ASSERT_EQUAL(1, rest.filter.altInnovation().rejected);
}

/// The last value before an outage and the first after it may both be bad.
template <int States>
void test_two_outliers_far_apart_are_not_one_long_failure() {
  Rest<States, decltype(kHeight)> rest(patient(), kHeight);
  rest.pass(1, 1e4F);
  rest.wait(5.0);
  rest.pass(1, 1e4F);
  TEST_ASSERT_EQUAL(0, rest.filter.altInnovation().readmissions);
  TEST_ASSERT_EQUAL(2, rest.filter.altInnovation().rejections);
}

/// Outliers among good values are never taken in, however long they go on.
template <int States>
void test_outliers_among_good_values_stay_refused() {
  Rest<States, decltype(kHeight)> rest(patient(), kHeight);
  for (int i = 0; i < 5 * kPatientPasses; ++i) {
    rest.pass(1, 100.0F);
    rest.pass(1, 0.0F);
  }
  TEST_ASSERT_EQUAL(0, rest.filter.altInnovation().readmissions);
  TEST_ASSERT_EQUAL(5 * kPatientPasses, rest.filter.altInnovation().rejections);
  TEST_ASSERT_TRUE(std::abs(rest.filter.state().positionNed.z()) < 1.0F);
}

template <int States>
void test_what_is_not_a_number_is_refused_for_ever() {
  Rest<States, decltype(kHeight)> rest(patient(), kHeight);
  for (int i = 0; i < 5 * kPatientPasses; ++i) {
    rest.wait(0.02);
    const strix::ESKF<States> before = rest.filter;
    rest.filter.updateAltMeas(NAN, rest.now);
    TEST_ASSERT_TRUE(same(before, rest.filter));
  }
  TEST_ASSERT_TRUE(rest.filter.healthy());
}

}  // namespace

void runReadmissionTests() {
  Unity.TestFile = __FILE__;
  RUN_BOTH(test_a_height_that_stays_elsewhere_is_refused_then_taken_in_then_followed);
  RUN_BOTH(test_gps_components_are_taken_in_one_by_one);
  RUN_BOTH(test_a_heading_from_elsewhere_is_followed_in_the_end);
  RUN_BOTH(test_a_field_from_elsewhere_is_followed_and_does_not_tip_the_aircraft);
  RUN_BOTH(test_what_no_turn_explains_turns_nothing);
  RUN_TEST(test_a_gyro_that_drifts_away_is_found_out_by_gps);
  RUN_BOTH(test_a_velocity_from_elsewhere_does_not_tip_the_aircraft);
  RUN_BOTH(test_without_patience_a_sensor_stays_refused);
  RUN_BOTH(test_one_outlier_after_a_silence_is_refused);
  RUN_BOTH(test_two_outliers_far_apart_are_not_one_long_failure);
  RUN_BOTH(test_outliers_among_good_values_stay_refused);
  RUN_BOTH(test_what_is_not_a_number_is_refused_for_ever);
}
