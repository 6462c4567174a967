// What the flight software tells the navigation, and what it makes of what it hears from it.
#include <cmath>

#include "FakeFlight.h"
#include "suites.h"

using namespace strix;

namespace {

/// Every record of a topic's first instance that is on the card.
template <class Topic>
std::vector<Topic> recorded(FakeFlight& flight) {
  constexpr auto kSize =
      static_cast<std::uint16_t>(ulog::kDataHeader - ulog::kMessageHeader + kPayloadSize<Topic>);
  constexpr auto kId = static_cast<std::uint16_t>(logStreamId<Topic, 0>());
  std::array<char, ulog::kDataHeader> header{};
  std::memcpy(&header[0], &kSize, sizeof kSize);
  header[2] = 'D';
  std::memcpy(&header[3], &kId, sizeof kId);
  const std::string bytes = flight.log();
  std::vector<Topic> found;
  for (std::size_t at = 0;; ++at) {
    at = bytes.find({header.data(), header.size()}, at);
    if (at == std::string::npos) break;
    const std::size_t end = at + header.size() + kPayloadSize<Topic>;
    if (end > bytes.size()) break;
    Topic record{};
    std::memcpy(static_cast<void*>(&record), &bytes[at + header.size()], kPayloadSize<Topic>);
    found.push_back(record);
  }
  return found;
}

std::size_t timesSaid(FakeFlight& flight, const char* text) {
  const std::string bytes = flight.log();
  std::size_t times = 0;
  for (std::size_t at = bytes.find(text); at != std::string::npos; at = bytes.find(text, at + 1)) {
    ++times;
  }
  return times;
}

[[nodiscard]] const char* sentence(NavigationHealth bit) {
  for (const HealthText& text : kHealthTexts) {
    if (text.bit == bit) return text.said;
  }
  return "no such bit";
}

const Quaternion kNorthEast = eulerToQuaternion({0.0F, 0.0F, kPi / 4.0F});

/// Seen by an aircraft that points north-east, 4.2e38 m/s^2 north: infinite in float. The attitude
/// stays sound, so a filter can begin anew.
const Vector3f kOverflow(3e38F, -3e38F, 0.0F);

/// One reading of the IMU, then those of the aircraft on the ground again.
void strike(FakeFlight& flight, const Vector3f& accel) {
  flight.board.imu.reading.accel = accel;
  for (const std::uint32_t taken = flight.board.imu.taken; flight.board.imu.taken == taken;) {
    flight.pass();
  }
  flight.board.hold(kNorthEast);
}

// ---- what the motors do reaches the filter ----

/// Whether the newest magnetic field counted.
bool magUsed(const FakeFlight& flight) {
  return flight.software.estimator().magInnovation().count > 0;
}

FlightSoftwareConfig magnetometer(WithMotors use) {
  FlightSoftwareConfig config = lowFlight();
  config.navigation.magWithMotors = use;
  config.mission.takeoffHoldTime = 20'000'000;
  return config;
}

void test_the_navigation_knows_whether_the_motors_stand_hover_or_disturb() {
  for (const WithMotors use : {WithMotors::HoverOnly, WithMotors::Off, WithMotors::On}) {
    FakeFlight flight(0, magnetometer(use));
    flight.getReady();
    TEST_ASSERT_TRUE(magUsed(flight));  // they stand
    TEST_ASSERT_TRUE(flight.arm());
    flight.run(1.0F);  // they idle, far from the weight
    TEST_ASSERT_EQUAL(use == WithMotors::On, magUsed(flight));
    flight.board.pilot.start = true;
    TEST_ASSERT_TRUE(flight.runUntil(FlightState::Hold, 10.0F));
    const float weight = kQuad5in.mass * kGravity;
    flight.run(2.0F);  // 0.5 s near the weight makes it hovering
    TEST_ASSERT_FLOAT_WITHIN(0.2F * weight, weight, flight.software.motors().achieved().thrust);
    TEST_ASSERT_EQUAL(use != WithMotors::Off, magUsed(flight));
    flight.board.pilot.arm = false;
    flight.run(0.1F);
    TEST_ASSERT_TRUE(magUsed(flight));  // they stand again
  }
}

void test_near_the_weight_is_no_hover_before_it_has_lasted() {
  FlightSoftwareConfig config = magnetometer(WithMotors::HoverOnly);
  config.hover.duration = 5'000'000;
  FakeFlight flight(0, config);
  flight.getReady();
  flight.reach(FlightState::Hold);
  flight.run(2.0F);
  TEST_ASSERT_FALSE(magUsed(flight));
  flight.run(5.0F);
  TEST_ASSERT_TRUE(magUsed(flight));
}

// ---- what goes wrong is said ----

void test_a_sensor_taken_in_again_is_said_in_the_log() {
  const char* said = "estimator: takes in again a sensor it had rejected for long";
  FakeFlight flight;
  flight.getReady();
  flight.board.alt.reading.pressure -= 1200.0F;  // 100 m higher
  flight.run(0.9F);
  TEST_ASSERT_EQUAL(0, timesSaid(flight, said));
  flight.run(0.4F);
  TEST_ASSERT_EQUAL(1, timesSaid(flight, said));
  TEST_ASSERT_EQUAL(1, flight.software.navigation().readmissions());
  flight.run(3.0F);
  TEST_ASSERT_EQUAL(1, timesSaid(flight, said));  // it is followed now
  flight.board.alt.reading.pressure += 1200.0F;
  flight.run(1.3F);
  TEST_ASSERT_EQUAL(2, timesSaid(flight, said));
}

/// A health bit and what brings it about on an aircraft that stands ready.
struct Sickness {
  NavigationHealth bit;
  void (*configure)(FlightSoftwareConfig&);
  void (*spoil)(FakeFlight&);
};

constexpr auto kAsUsual = [](auto&) {};

const Sickness kSicknesses[] = {
    {health::kNotFinite, believeAnything,
     [](FakeFlight& f) {
       f.board.imu.reading.gyro.x() = 1e30F;  // a finite one: NaN is no reading
       f.run(0.01F);
       f.board.hold(kNorthEast);
     }},
    // Once is a new start; the second time within 10 s it stays so.
    {health::kNotPositiveDefinite, believeAnything,
     [](FakeFlight& f) {
       strike(f, kOverflow);
       f.run(0.2F);
       for (int i = 0; i < 1'000 && f.software.navigation().healthy(); ++i) {
         strike(f, {1e8F, -2e7F, 3e7F});
       }
     }},
    {health::kRestarted, believeAnything, [](FakeFlight& f) { strike(f, kOverflow); }},
    // Gravity from elsewhere, and a filter that believes its gyro alone.
    {health::kAttitudesDisagree,
     [](FlightSoftwareConfig& c) {
       c.navigation.standstillAid = false;
       c.navigation.boundedMotion = false;
       c.navigation.gpsPositionSigma = c.navigation.gpsVelocitySigma = 1e4F;
       c.navigation.alt.sigma = 1e4F;
       c.navigation.complementary.tiltTime = 0.5F;
     },
     [](FakeFlight& f) {
       f.board.hold(eulerToQuaternion({0.6F, 0.0F, kPi / 4.0F}));
       f.run(6.0F);  // for 5 s
     }},
    {health::kNoGps, kAsUsual,
     [](FakeFlight& f) {
       f.board.gps.dead = true;
       f.run(5.1F);
     }},
    {health::kNoAltimeter, kAsUsual,
     [](FakeFlight& f) {
       f.board.alt.dead = true;
       f.run(2.1F);
     }},
    {health::kNoMagnetometer, kAsUsual,
     [](FakeFlight& f) {
       f.board.mag.dead = true;
       f.run(30.1F);
     }},
};

void test_each_sickness_of_the_filter_is_said_once_and_refuses_arming_if_it_is_grave() {
  NavigationHealth tested = 0;
  for (const Sickness& sickness : kSicknesses) {
    FlightSoftwareConfig config = lowFlight();
    sickness.configure(config);
    FakeFlight flight(0, config);
    flight.board.hold(kNorthEast);
    flight.getReady();
    const char* said = sentence(sickness.bit);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(0, flight.software.navigation().health(), said);
    TEST_ASSERT_EQUAL_MESSAGE(0, timesSaid(flight, said), said);
    sickness.spoil(flight);
    flight.run(0.5F);
    TEST_ASSERT_TRUE_MESSAGE((flight.software.navigation().health() & sickness.bit) != 0, said);
    TEST_ASSERT_EQUAL_MESSAGE(1, timesSaid(flight, said), said);
    TEST_ASSERT_FALSE_MESSAGE(flight.arm(), said);  // of a dead sensor too, each for its own reason
    const bool grave = (health::kNoArming & sickness.bit) != 0;
    TEST_ASSERT_EQUAL_MESSAGE(grave, flight.logSays(firstRefusal(prearm::kEstimator)), said);
    const auto status = recorded<topic::EstimatorHealth>(flight);
    TEST_ASSERT_TRUE_MESSAGE((status.back().filter_fault_flags & sickness.bit) != 0, said);
    tested |= sickness.bit;
  }
  for (const HealthText& text : kHealthTexts) tested &= ~text.bit;
  TEST_ASSERT_EQUAL_HEX32(0, tested);
  TEST_ASSERT_EQUAL(kHealthTexts.size(), std::size(kSicknesses));
}

void test_what_comes_back_is_said_again() {
  FakeFlight flight;
  flight.getReady();
  for (std::size_t time = 1; time <= 3; ++time) {
    flight.board.alt.dead = true;
    flight.run(2.3F);
    TEST_ASSERT_EQUAL(time, timesSaid(flight, sentence(health::kNoAltimeter)));
    flight.board.alt.dead = false;
    flight.run(0.5F);
    TEST_ASSERT_EQUAL_HEX32(0, flight.software.navigation().health());
  }
}

/// A filter that began anew flies on: only what is lost for good ends a flight.
void test_a_flight_whose_filter_begins_anew_goes_on() {
  FlightSoftwareConfig config = lowFlight();
  config.mission.takeoffHoldTime = 20'000'000;
  believeAnything(config);
  FakeFlight flight(0, config);
  flight.board.hold(kNorthEast);
  flight.getReady();
  flight.reach(FlightState::Hold);
  strike(flight, kOverflow);
  flight.run(2.0F);
  TEST_ASSERT_EQUAL(1, flight.software.navigation().restarts());
  TEST_ASSERT_TRUE(flight.state() == FlightState::Hold);
  TEST_ASSERT_TRUE(areOn(flight.board.esc()));
  strike(flight, kOverflow);
  flight.run(0.01F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);
  TEST_ASSERT_TRUE(areOff(flight.board.esc()));
}

// ---- what the controller gets ----

void test_the_controllers_rates_are_filtered_and_the_estimators_are_not() {
  for (const float lowPass : {0.0F, 40.0F}) {
    FlightSoftwareConfig config = lowFlight();
    config.gyroFilter.lowPass = lowPass;
    FakeFlight flight(0, config);
    flight.passTime = 1000;
    flight.getReady();
    float control = 0.0F;
    float estimate = 0.0F;
    for (int i = 0; i < 600; ++i) {  // a shake of 250 Hz
      flight.board.hold(Quaternion{}, {i / 2 % 2 == 0 ? 0.5F : -0.5F, 0.0F, 0.0F});
      flight.pass();
      if (i < 300) continue;  // what the filter was before
      control = std::fmax(control, std::fabs(flight.software.controller().error()(9)));
      estimate = std::fmax(estimate, std::fabs(flight.software.estimator().state().rateBody.x()));
    }
    TEST_ASSERT_FLOAT_WITHIN(0.05F, 0.5F, estimate);
    // Second order: (40/250)^2 = 0.026 of it, less near Nyquist.
    lowPass == 0.0F ? TEST_ASSERT_FLOAT_WITHIN(0.05F, 0.5F, control)
                    : TEST_ASSERT_FLOAT_WITHIN(0.02F, 0.0F, control);
  }
}

// ---- what is recorded ----

void test_status_and_biases_of_the_filter_are_in_the_log_ten_times_a_second() {
  FlightSoftwareConfig config = lowFlight();
  believeAnything(config);
  FakeFlight flight(0, config);
  flight.board.hold(kNorthEast);
  flight.getReady();
  flight.board.gyroBias += Vector3f(0.002F, -0.001F, 0.0015F);  // what the calibration missed
  flight.board.hold(kNorthEast);
  const std::size_t before = recorded<topic::EstimatorHealth>(flight).size();
  flight.run(20.0F);
  const ESKF<18>& filter = flight.software.estimator();
  const auto status = recorded<topic::EstimatorHealth>(flight);
  const auto biases = recorded<topic::EstimatorSensorBias>(flight);
  TEST_ASSERT_EQUAL(200, status.size() - before);
  TEST_ASSERT_EQUAL(status.size(), biases.size());
  TEST_ASSERT_EQUAL(100'000, status[before + 1].timestamp - status[before].timestamp);
  // The last of them is at most 0.1 s old; at rest nothing moves in that.
  for (int i = 0; i < 3; ++i) {
    const auto axis = static_cast<std::size_t>(i);
    TEST_ASSERT_FLOAT_WITHIN(1e-5F, filter.gyroBias()(i), biases.back().gyro_bias[axis]);
    TEST_ASSERT_FLOAT_WITHIN(1e-4F, filter.accelBias()(i), biases.back().accel_bias[axis]);
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, filter.magBias()(i), biases.back().mag_bias[axis]);
  }
  TEST_ASSERT_FLOAT_WITHIN(5e-4F, 0.002F, biases.back().gyro_bias[0]);  // it did learn it
  TEST_ASSERT_FLOAT_WITHIN(5e-4F, -0.001F, biases.back().gyro_bias[1]);

  for (const float jump : {-1200.0F, 1200.0F}) {  // Pa: 100 m up, and down again
    flight.board.alt.reading.pressure += jump;
    flight.run(1.5F);
  }
  strike(flight, kOverflow);
  flight.run(0.2F);
  const topic::EstimatorHealth last = recorded<topic::EstimatorHealth>(flight).back();
  TEST_ASSERT_EQUAL_HEX32(flight.software.navigation().health(), last.filter_fault_flags);
  TEST_ASSERT_EQUAL(1, last.reset_count);
  TEST_ASSERT_EQUAL(2, last.readmissions);
}

void test_vibration_is_in_the_log() {
  FakeFlight flight;
  flight.getReady();
  for (int i = 0; i < 3'000; ++i) {
    flight.board.hold(Quaternion{});
    flight.board.imu.reading.accel.z() += (i / 2) % 2 == 0 ? 2.0F : -2.0F;  // each 1 ms reading
    flight.pass();
  }
  flight.run(0.1F);
  // Its mean takes 1 s: after 1.5 s of shaking 1 - e^-1.5 = 0.78 of the square is there.
  TEST_ASSERT_FLOAT_WITHIN(0.3F, 1.7F, recorded<topic::EstimatorHealth>(flight).back().vibration);
}

}  // namespace

void runNavigationUseTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_navigation_knows_whether_the_motors_stand_hover_or_disturb);
  RUN_TEST(test_near_the_weight_is_no_hover_before_it_has_lasted);
  RUN_TEST(test_a_sensor_taken_in_again_is_said_in_the_log);
  RUN_TEST(test_each_sickness_of_the_filter_is_said_once_and_refuses_arming_if_it_is_grave);
  RUN_TEST(test_what_comes_back_is_said_again);
  RUN_TEST(test_a_flight_whose_filter_begins_anew_goes_on);
  RUN_TEST(test_status_and_biases_of_the_filter_are_in_the_log_ten_times_a_second);
  RUN_TEST(test_the_controllers_rates_are_filtered_and_the_estimators_are_not);
  RUN_TEST(test_vibration_is_in_the_log);
}
