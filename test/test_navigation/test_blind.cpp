// Down without an IMU: what the model learns while it lives, and what it is worth when it does not.
#include <BlindFlight.h>
#include <Controller.h>
#include <FlightConfig.h>
#include <Motors.h>
#include <RigidQuad.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "AssertNear.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

using Vector3d = Eigen::Vector3d;

/// What the aircraft and its surroundings are, and what sensors it has left.
struct Setting {
  double height = 5.0;                    ///< m
  double mass = 1.0;                      ///< true over the vehicle file's
  Vector3d torque = {0.01, -0.015, 0.0};  ///< N m: a centre of mass 2 mm beside the middle
  Vector3d wind = Vector3d::Zero();       ///< m/s, where it blows to
  double gust = 0.0;                      ///< m/s, one sigma, of 1 s
  double gustTorque = 0.0;                ///< N m, one sigma, of 0.3 s
  bool field = true;
  bool altimeter = true;
};

/// A hover, learnt in for 10 s; then the IMU stops.
class Flight {
 public:
  static constexpr float kPeriod = 0.002F;

  explicit Flight(const Setting& setting, std::uint32_t seed = 1)
      : setting_(setting),
        random_(seed),
        real_(heavier(setting.mass)),
        quad(real_, random_.uniform(-3.0F, 3.0F)),
        controller_(kQuad5in, kQuad5inGains),
        motors_(kQuad5in),
        blind(kQuad5in) {
    quad.position.z() = -setting.height;
    attitudeError_ = 0.01F * gaussian();  // 0.6 deg
    velocityError_ = 0.1F * gaussian();
    motors_.arm();
    controller_.reset(now_);
    controller_.setGrounded(false);
    reference.positionNed.z() = static_cast<float>(-setting.height);
    reference.yaw = static_cast<float>(quad.yaw());
    run(10.0F);
  }

  /// The IMU gives no more; it is noticed after 20 ms.
  void loseImu() {
    lost_ = true;
    run(0.02F);
    started_ = true;
    blind.start(estimate_);
    reference = {};
    reference.positionNed = blind.state().positionNed;
    reference.yaw = yawOf(blind.state().attitude);
  }

  template <class Each>
  void run(float seconds, Each&& each) {
    const int ticks = static_cast<int>(std::lround(seconds / kPeriod));
    for (int i = 0; i < ticks; ++i) {
      step();
      each();
    }
  }
  void run(float seconds) {
    run(seconds, [] {});
  }

  /// Down as guidance does it: m/s that grow with the root of the height. @return s it took
  float descend() {
    float time = 0.0F;
    float sink = 0.0F;
    while (quad.position.z() < 0.0 && time < 15.0F) {
      const float above = std::max(0.0F, -reference.positionNed.z() - 0.6F);
      const float wanted = std::min(4.0F, std::sqrt(1.44F + 5.0F * above));
      sink += std::clamp(wanted - sink, -0.01F, 0.01F);
      reference.velocityNed.z() = sink;
      reference.positionNed.z() += sink * kPeriod;
      run(kPeriod);
      time += kPeriod;
    }
    return time;
  }

  [[nodiscard]] const VehicleState& model() const { return blind.state(); }
  void stopMotors() { motors_.disarm(); }

 private:
  Setting setting_;
  Random random_;
  Vehicle real_;

 public:
  RigidQuad quad;
  Reference reference;
  std::optional<float> heldHeight;  ///< m that the altimeter says, whatever is true

 private:
  static Vehicle heavier(double factor) {
    Vehicle v = kQuad5in;
    v.mass *= static_cast<float>(factor);
    return v;
  }

  /// Of variance 1, by the sum of twelve.
  [[nodiscard]] float normal() {
    float sum = -6.0F;
    for (int i = 0; i < 12; ++i) sum += random_.uniform(0.0F, 1.0F);
    return sum;
  }
  [[nodiscard]] Vector3f gaussian() {
    const float x = normal();
    const float y = normal();
    return {x, y, normal()};
  }

  void blow() {
    constexpr double dt = kPeriod;
    gust_ += -dt * gust_ + setting_.gust * std::sqrt(2.0 * dt) * gaussian().cast<double>();
    const Vector3d turn = Vector3d(1.0, 1.0, 0.2).cwiseProduct(gaussian().cast<double>());
    gustTorque_ += -dt / 0.3 * gustTorque_ + setting_.gustTorque * std::sqrt(2.0 * dt / 0.3) * turn;
    // Rotor drag: 0.4 of the mass for each m/s.
    quad.forceNed = -0.4 * real_.mass * (quad.velocity - setting_.wind - gust_);
    quad.torqueBody = setting_.torque + gustTorque_;
  }

  void sense() {
    if (!lost_) {
      estimate_ = quad.state();
      estimate_.velocityNed += velocityError_;
      estimate_.attitude = injectRight(estimate_.attitude, attitudeError_);
      rateNoise_ = 0.8F * rateNoise_ + 0.006F * gaussian();  // 0.01 rad/s
      estimate_.rateBody += rateNoise_;
    }
    if (setting_.field && tick_ % 5 == 0) {
      const Vector3d field(20.0, 2.0, 45.0);
      blind.updateMagMeas((quad.attitude().conjugate() * field).cast<float>() + 0.3F * gaussian());
    }
    if (setting_.altimeter && tick_ % 10 == 0) {
      const float noise = 0.17F * normal();
      blind.updateAltMeas(heldHeight.value_or(static_cast<float>(-quad.position.z())) + noise);
    }
  }

  void step() {
    ++tick_;
    now_ += 2000;
    blow();
    sense();
    const auto& wrench = controller_.wrenchEstimate().now();
    VehicleState flown = estimate_;
    if (started_) {
      flown = blind.update(wrench, kPeriod);
    } else {
      blind.observe(wrench, estimate_, kPeriod);
    }
    controller_.updateControl(now_, reference, flown);
    motors_.commandControl(controller_.getControl());
    controller_.setAchieved(motors_.achieved());
    quad.step(motors_.commands(), 0.001);
    quad.step(motors_.commands(), 0.001);
  }

  Controller controller_;
  Motors motors_;
  VehicleState estimate_;
  Vector3f attitudeError_ = Vector3f::Zero();
  Vector3f velocityError_ = Vector3f::Zero();
  Vector3f rateNoise_ = Vector3f::Zero();
  Vector3d gust_ = Vector3d::Zero();
  Vector3d gustTorque_ = Vector3d::Zero();
  Micros now_ = 0;
  int tick_ = 0;
  bool lost_ = false;
  bool started_ = false;

 public:
  BlindFlight blind;
};

void test_what_steady_flight_needed_is_known_and_the_model_stays_where_the_aircraft_is() {
  for (const double mass : {0.9, 1.2}) {
    Setting setting;
    setting.mass = mass;
    setting.wind = {3.0, -2.0, 0.0};
    setting.field = setting.altimeter = false;
    Flight flight(setting);
    flight.loseImu();
    // 2 s on wrenches alone. What is left of learning: 0.2 rad/s^2 of turning (0.01 rad/s of noise)
    // would be 20 deg by now; half of it is seen.
    flight.run(1.0F, [&] { TEST_ASSERT_TRUE(flight.quad.tilt() < 22.0 * kDegToRad); });
    const Vector3d drift = flight.quad.position - flight.model().positionNed.cast<double>();
    TEST_ASSERT_TRUE(drift.norm() < 0.5);
    TEST_ASSERT_DOUBLE_WITHIN(0.3, -5.0, flight.quad.position.z());
  }
}

void test_a_gust_tips_the_model_alone_over_and_the_field_keeps_it_upright() {
  int overturned = 0;
  int upright = 0;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    for (const bool field : {false, true}) {
      Setting setting;
      setting.height = 50.0;
      setting.gustTorque = 0.005;  // N m: 6 g more lift on one side
      setting.field = field;
      Flight flight(setting, seed);
      flight.loseImu();
      double most = 0.0;
      flight.run(2.0F, [&] { most = std::max(most, flight.quad.tilt()); });
      overturned += !field && most > 45.0 * kDegToRad ? 1 : 0;
      upright += field && most < 45.0 * kDegToRad ? 1 : 0;
    }
  }
  TEST_ASSERT_TRUE(overturned >= 16);
  TEST_ASSERT_TRUE(upright >= 18);
}

void test_from_a_hover_in_gusty_wind_it_comes_down_slower_than_three_metres_a_second() {
  for (std::uint32_t seed = 1; seed <= 25; ++seed) {
    Setting setting;
    setting.height = 2.0;
    setting.mass = seed % 2 == 0 ? 1.1 : 1.0;
    setting.wind = {4.0 * std::cos(seed), 4.0 * std::sin(seed), 0.0};
    setting.gust = 1.0;
    setting.gustTorque = 0.003;
    Flight flight(setting, seed);
    flight.loseImu();
    TEST_ASSERT_TRUE(flight.descend() < 3.5F);
    TEST_ASSERT_TRUE(flight.quad.velocity.z() < 3.0);
    TEST_ASSERT_TRUE(flight.quad.tilt() < 45.0 * kDegToRad);
  }
}

void test_the_motors_that_went_on_since_the_last_sample_are_made_up_for() {
  Setting setting;
  setting.field = setting.altimeter = false;
  Flight flight(setting);
  // In the middle of a turn: 10 deg of tilt wanted, so that the torque is large.
  flight.reference.mode = ReferenceMode::AttitudeHeight;
  flight.reference.attitude = eulerToQuaternion({10.0F * kDegToRad, 0.0F, flight.reference.yaw});
  flight.run(0.03F);
  const double stale = flight.quad.rate.x();
  flight.loseImu();
  // In 20 ms the rate has changed by much more than the model's error.
  const double changed = std::abs(flight.quad.rate.x() - stale);
  TEST_ASSERT_TRUE(changed > 0.2);
  TEST_ASSERT_TRUE(std::abs(flight.quad.rate.x() -
                            static_cast<double>(flight.model().rateBody.x())) < 0.2 * changed);
}

void test_the_altimeter_keeps_the_height_of_an_aircraft_that_has_lost_thrust() {
  Setting setting;
  setting.height = 20.0;
  Flight with(setting);
  setting.altimeter = false;
  Flight without(setting);
  for (Flight* flight : {&with, &without}) {
    flight->loseImu();
    flight->run(4.0F, [&] {  // 3 % of the weight
      flight->quad.velocity.z() += 0.03 * 9.80665 * static_cast<double>(Flight::kPeriod);
    });
  }
  // a t^2/2 is 2.4 m, less what the air brakes; with the altimeter an offset of a/w^2, 0.1 m.
  TEST_ASSERT_TRUE(without.quad.position.z() > -20.0 + 1.2);
  TEST_ASSERT_DOUBLE_WITHIN(0.25, -20.0, with.quad.position.z());
}

void test_it_is_over_when_the_altimeter_stands_and_the_model_sinks() {
  Setting setting;
  setting.height = 1.0;
  Flight flight(setting);
  flight.loseImu();
  flight.run(0.3F);
  TEST_ASSERT_FALSE(flight.blind.over());
  flight.heldHeight = 0.6F;  // of a higher ground
  float time = 0.0F;
  while (!flight.blind.over() && time < 3.0F) {
    flight.reference.velocityNed.z() = 1.2F;
    flight.reference.positionNed.z() += 1.2F * Flight::kPeriod;
    flight.run(Flight::kPeriod);
    time += Flight::kPeriod;
  }
  TEST_ASSERT_TRUE(flight.blind.over());
  TEST_ASSERT_TRUE(time > 0.3F && time < 2.5F);
}

void test_it_is_over_below_the_ground_and_not_high_above_it() {
  Setting setting;
  setting.altimeter = false;
  Flight flight(setting);
  flight.loseImu();
  for (int i = 0; i < 5000 && !flight.blind.over(); ++i) {
    TEST_ASSERT_TRUE(flight.model().positionNed.z() < 1.5F);
    flight.reference.velocityNed.z() = 1.2F;
    flight.reference.positionNed.z() += 1.2F * Flight::kPeriod;
    flight.run(Flight::kPeriod);
  }
  TEST_ASSERT_TRUE(flight.blind.over());
  TEST_ASSERT_FLOAT_WITHIN(0.01F, 1.5F, flight.model().positionNed.z());

  Setting high;
  high.height = 6.0;
  Flight stuck(high);
  stuck.loseImu();
  stuck.heldHeight = 6.6F;  // an altimeter that hangs
  stuck.run(1.0F, [&] { TEST_ASSERT_FALSE(stuck.blind.over()); });
}

void test_readings_that_cannot_be_change_nothing() {
  Flight flight{Setting()};
  flight.loseImu();
  const VehicleState before = flight.model();
  flight.blind.updateMagMeas(Vector3f::Constant(kNaN));
  flight.blind.updateMagMeas({1e30F, 1e30F, 0.0F});
  flight.blind.updateAltMeas(kNaN);
  flight.blind.updateAltMeas(300.0F);
  const VehicleState& after = flight.model();
  TEST_ASSERT_TRUE(after.positionNed == before.positionNed);
  TEST_ASSERT_TRUE(after.velocityNed == before.velocityNed);
  TEST_ASSERT_TRUE(after.rateBody == before.rateBody);
  TEST_ASSERT_TRUE(after.attitude.w == before.attitude.w && after.attitude.x == before.attitude.x);
}

void test_on_the_ground_nothing_is_learnt_and_a_new_flight_begins_with_nothing() {
  BlindFlight blind(kQuad5in);
  VehicleState standing;
  const float idle = 0.12F * kQuad5in.mass * kGravity;
  for (int i = 0; i < 5000; ++i) blind.observe({idle, 0.01F, 0.0F, 0.0F}, standing, 0.002F);
  const float weight = kQuad5in.mass * kGravity;
  /// Sink after a second under this thrust, m/s.
  const auto sink = [&blind, &standing](float thrust) {
    blind.start(standing);
    const Vector3f before = blind.state().velocityNed;
    for (int i = 0; i < 500; ++i) blind.update({thrust, 0.0F, 0.0F, 0.0F}, 0.002F);
    return (blind.state().velocityNed - before).z();
  };
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, 0.0F, sink(weight));
  const float heavy = 1.2F * weight;
  for (int i = 0; i < 5000; ++i) {
    standing.rateBody.x() = i % 2 == 0 ? 1e-4F : -1e-4F;
    blind.observe({heavy, 0.0F, 0.0F, 0.0F}, standing, 0.002F);
  }
  // Learnt with a time constant of 1 s, for 10 s: e^-10 of 2 m/s^2 are left, and 11 times that.
  TEST_ASSERT_FLOAT_WITHIN(5e-3F, 0.0F, sink(heavy));
  blind.reset();
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, 0.0F, sink(weight));
}

}  // namespace

void runBlindTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_what_steady_flight_needed_is_known_and_the_model_stays_where_the_aircraft_is);
  RUN_TEST(test_a_gust_tips_the_model_alone_over_and_the_field_keeps_it_upright);
  RUN_TEST(test_from_a_hover_in_gusty_wind_it_comes_down_slower_than_three_metres_a_second);
  RUN_TEST(test_the_motors_that_went_on_since_the_last_sample_are_made_up_for);
  RUN_TEST(test_the_altimeter_keeps_the_height_of_an_aircraft_that_has_lost_thrust);
  RUN_TEST(test_it_is_over_when_the_altimeter_stands_and_the_model_sinks);
  RUN_TEST(test_it_is_over_below_the_ground_and_not_high_above_it);
  RUN_TEST(test_readings_that_cannot_be_change_nothing);
  RUN_TEST(test_on_the_ground_nothing_is_learnt_and_a_new_flight_begins_with_nothing);
}
