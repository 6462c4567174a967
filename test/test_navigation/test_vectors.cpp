/// Both filters in float32 against the double-precision reference of tools/matlab, step by step.
#include "Dense.h"
#include "VectorFile.h"
#include "suites.h"

#include <cmath>
#include <cstdio>
#include <string>

namespace {

using strix::Vector3f;
using strix::VectorFile;

Vector3f vectorOf(const std::vector<double>& row, std::size_t first) {
  return Vector3d(row[first], row[first + 1], row[first + 2]).cast<float>();
}

strix::NavigationConfig configOf(const VectorFile& file) {
  const auto number = [&file](const char* name) { return static_cast<float>(file.value(name)); };
  strix::NavigationConfig c;
  c.gravity = number("gravity");
  c.accelNoise = number("accelNoise");
  c.gyroNoise = number("gyroNoise");
  c.accelBiasWalk = number("accelBiasWalk");
  c.gyroBiasWalk = number("gyroBiasWalk");
  c.magBiasWalk = number("magBiasWalk");
  c.tilt = {number("tiltSigma"), 0.0F};
  c.tiltGate = number("tiltGate");
  c.magFusion = strix::MagFusion::ThreeAxis;
  c.mag = {number("magSigma"), 0.0F};
  c.alt = {number("altSigma"), 0.0F};
  c.gpsPositionSigma = number("gpsPositionSigma");
  c.gpsVelocitySigma = number("gpsVelocitySigma");
  c.nisGate = number("nisGate");
  c.readmitAfter = 0;  // the reference keeps a gate shut
  c.positionSigma0 = number("positionSigma0");
  c.velocitySigma0 = number("velocitySigma0");
  c.tiltSigma0 = number("tiltSigma0");
  c.headingSigma0 = number("headingSigma0");
  c.accelBiasSigma0 = number("accelBiasSigma0");
  c.gyroBiasSigma0 = number("gyroBiasSigma0");
  c.magBiasSigma0 = number("magBiasSigma0");
  return c;
}

strix::Alignment alignmentOf(const VectorFile& file) {
  const auto number = [&file](const char* name) { return static_cast<float>(file.value(name)); };
  strix::Alignment a;
  a.attitude = {number("attitude0.w"), number("attitude0.x"), number("attitude0.y"),
                number("attitude0.z")};
  a.magReference = {number("magReference.n"), number("magReference.e"), number("magReference.d")};
  return a;
}

/// The inputs of a case, row by row.
class Inputs {
 public:
  explicit Inputs(const VectorFile& file)
      : file_(file),
        time_(file.column("t_us")),
        accel_(file.column("accel_x")),
        gyro_(file.column("gyro_x")),
        mag_(file.column("mag_due")),
        alt_(file.column("alt_due")),
        gps_(file.column("gps_due")) {}

  [[nodiscard]] bool magDue(std::size_t i) const { return file_.row(i)[mag_] == 1.0; }
  [[nodiscard]] bool altDue(std::size_t i) const { return file_.row(i)[alt_] == 1.0; }
  [[nodiscard]] bool gpsDue(std::size_t i) const { return file_.row(i)[gps_] == 1.0; }

  /// One pass of the flight loop over row i.
  template <class Filter>
  void feed(Filter& filter, std::size_t i) const {
    const std::vector<double>& row = file_.row(i);
    const auto now = static_cast<strix::Micros>(row[time_]);
    const Vector3f accel = vectorOf(row, accel_);
    filter.predict(accel, vectorOf(row, gyro_), now);
    filter.updateTiltMeas(accel);
    if (magDue(i)) filter.updateMagMeas(vectorOf(row, mag_ + 1), now);
    if (altDue(i)) filter.updateAltMeas(static_cast<float>(row[alt_ + 1]), now);
    if (gpsDue(i)) {
      const Vector3d position(row[gps_ + 1], row[gps_ + 2], 0.0);
      const Vector3d velocity(row[gps_ + 3], row[gps_ + 4], 0.0);
      filter.updateGPSMeas(toFloat(position), toFloat(velocity));
    }
    filter.injectError();
  }

 private:
  const VectorFile& file_;
  std::size_t time_, accel_, gyro_, mag_, alt_, gps_;
};

/// Differences from the reference: |dP_ij| and |dx_i| in parts of the sigma of their blocks.
struct Worst {
  double covariance = 0.0;
  double state = 0.0;
};

/// Keeps the largest; NaN is larger than all.
void raise(double& worst, double difference) {
  if (!(difference <= worst)) worst = difference < 1e9 ? difference : 1e9;
}

template <int States>
using Square = Eigen::Matrix<double, States, States>;

/// Uncertainty of the block of three that state i belongs to, sqrt of its trace. Attitude and
/// biases are in body axes: turns mix the three, so an axis known well takes over the rounding of
/// the others, and only the block as a whole has a scale of its own.
template <int States>
double scaleOf(const Square<States>& p, int i) {
  return std::sqrt(p.diagonal().template segment<3>(i - i % 3).sum());
}

/// @param expected  t_us and the upper triangle, row by row
template <int States>
void compareCovariance(const strix::ESKF<States>& filter, const std::vector<double>& expected,
                       Worst& worst) {
  const Eigen::Matrix<float, States, States> p = filter.covariance();
  Square<States> reference;
  std::size_t next = 1;
  for (int i = 0; i < States; ++i) {
    for (int j = i; j < States; ++j) reference(i, j) = expected[next++];
  }
  for (int i = 0; i < States; ++i) {
    for (int j = i; j < States; ++j) {
      const double difference = static_cast<double>(p(i, j)) - reference(i, j);
      const double scale = scaleOf<States>(reference, i) * scaleOf<States>(reference, j);
      raise(worst.covariance, std::abs(difference) / scale);
    }
  }
}

/// Differences as the error state has them: position, velocity, alpha, biases.
template <int States>
void compareState(const strix::ESKF<States>& filter, const std::vector<double>& expected,
                  Worst& worst) {
  Eigen::Matrix<double, States, 1> difference;
  const auto reference = [&expected](std::size_t first) {
    return Vector3d(expected[first], expected[first + 1], expected[first + 2]);
  };
  const Quaterniond q(expected[7], expected[8], expected[9], expected[10]);
  const Quaterniond turn = q.conjugate() * toDouble(filter.state().attitude);
  difference.template segment<3>(0) =
      filter.state().positionNed.template cast<double>() - reference(1);
  difference.template segment<3>(3) =
      filter.state().velocityNed.template cast<double>() - reference(4);
  difference.template segment<3>(6) = 2.0 * (turn.w() < 0.0 ? -1.0 : 1.0) * turn.vec();
  if constexpr (States == 18) {
    difference.template segment<3>(9) = filter.accelBias().template cast<double>() - reference(11);
    difference.template segment<3>(12) = filter.gyroBias().template cast<double>() - reference(14);
    difference.template segment<3>(15) = filter.magBias().template cast<double>() - reference(17);
  }
  const Square<States> p = filter.covariance().template cast<double>();
  for (int i = 0; i < States; ++i) {
    raise(worst.state, std::abs(difference(i)) / scaleOf<States>(p, i));
  }
}

/// Both masks of rejected scalars; a sensor that did not measure keeps its mask of before.
template <int States>
void compareRejected(const strix::ESKF<States>& filter, const Inputs& inputs, std::size_t i,
                     const std::vector<double>& expected) {
  TEST_ASSERT_EQUAL(static_cast<int>(expected[1]), filter.tiltInnovation().rejected);
  if (inputs.magDue(i)) {
    TEST_ASSERT_EQUAL(static_cast<int>(expected[2]), filter.magInnovation().rejected);
  }
  if (inputs.altDue(i)) {
    TEST_ASSERT_EQUAL(static_cast<int>(expected[3]), filter.altInnovation().rejected);
  }
  if (inputs.gpsDue(i)) {
    TEST_ASSERT_EQUAL(static_cast<int>(expected[4]), filter.gpsInnovation().rejected);
  }
}

/// What float32 may make of a case. Every row rounds P, R and q by eps = 2^-24 of a block's scale,
/// a random walk over n rows. The magnetometer makes most of it: where it shrinks the variance of
/// heading by c = (sigma_0 |m| / sigma_mag)^2, the rounding of the larger variance is left in the
/// smaller. So dP < 2 eps sqrt(n) c; the 2 is for the other sensors and the trapezoidal Q_d, which
/// makes 5e-5 at 50 Hz. A correction of s sigmas takes up s times that, and 0.1 rad of heading is
/// some 20 of the sigmas that follow. In double precision the same code gave 5e-7, the rounding of
/// the files, and 1e-5.
Worst tolerance(const VectorFile& config, std::size_t rows) {
  const double field = Vector3d(config.value("magReference.n"), config.value("magReference.e"),
                                config.value("magReference.d"))
                           .norm();
  const double known = config.value("headingSigma0") * field / config.value("magSigma");
  const double covariance = 2.0 * std::ldexp(1.0, -24) * std::sqrt(rows) * known * known;
  return {covariance, 20.0 * covariance};
}

/// Runs a filter over one case and compares it with the reference after every row.
template <int States>
void followReference(const std::string& name, double seconds) {
  const std::string which = "_" + std::to_string(States) + ".csv";
  const VectorFile config(name + "/config.csv");
  const VectorFile file(name + "/inputs.csv");
  const VectorFile states(name + "/state" + which);
  const VectorFile covariances(name + "/covariance" + which);
  const VectorFile rejected(name + "/rejected" + which);  // only where the gate is shut
  strix::needVectors(config);
  TEST_ASSERT_EQUAL(file.size(), states.size());

  const Inputs inputs(file);
  strix::ESKF<States> filter(configOf(config));
  filter.initialize(alignmentOf(config), static_cast<float>(config.value("gravity")));
  Worst worst;
  std::size_t nextCovariance = 0;
  for (std::size_t i = 0; i < file.size(); ++i) {
    inputs.feed(filter, i);
    const double time = file.row(i)[0];
    TEST_ASSERT_TRUE(time == states.row(i)[0]);
    compareState(filter, states.row(i), worst);
    if (nextCovariance < covariances.size() && covariances.row(nextCovariance)[0] == time) {
      compareCovariance(filter, covariances.row(nextCovariance++), worst);
    }
    if (!rejected.empty()) compareRejected(filter, inputs, i, rejected.row(i));
  }
  TEST_ASSERT_EQUAL(covariances.size(), nextCovariance);  // none left out
  TEST_ASSERT_TRUE(file.row(file.size() - 1)[0] - file.row(0)[0] >= seconds * 1e6);

  const Worst allowed = tolerance(config, file.size());
  char text[160];
  std::snprintf(text, sizeof text,
                "%s, %d states: dP %.1e of at most %.1e, dx %.1e of at most %.1e", name.c_str(),
                States, worst.covariance, allowed.covariance, worst.state, allowed.state);
  TEST_MESSAGE(text);
  TEST_ASSERT_TRUE_MESSAGE(worst.covariance < allowed.covariance, text);
  TEST_ASSERT_TRUE_MESSAGE(worst.state < allowed.state, text);
}

void test_a_minute_with_full_turns_gives_the_reference_states_and_covariance() {
  followReference<9>("flight", 60.0);
  followReference<18>("flight", 60.0);
}

void test_two_seconds_of_fast_turns_at_1_kHz_give_the_reference() {
  followReference<9>("fast", 2.0);
  followReference<18>("fast", 2.0);
}

void test_the_gate_refuses_the_same_scalars_as_the_reference_and_nothing_else_changes() {
  followReference<9>("gate", 6.0);
  followReference<18>("gate", 6.0);
}

}  // namespace

void runVectorTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_minute_with_full_turns_gives_the_reference_states_and_covariance);
  RUN_TEST(test_two_seconds_of_fast_turns_at_1_kHz_give_the_reference);
  RUN_TEST(test_the_gate_refuses_the_same_scalars_as_the_reference_and_nothing_else_changes);
}
