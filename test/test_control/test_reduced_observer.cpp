// Ugglan's attitude law: its observer, its loop on the linear plant, and the two slips in print.
#include <ReducedObserver.h>
#include <gains/UgglanQ450Observer.h>
#include <unity.h>
#include <vehicles/UgglanQ450.h>

#include <cmath>
#include <limits>

#include "AssertNear.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kInertia = 0.014;  // kg m^2
constexpr double kTau = 0.08;       // s

/// Ugglan's published gains of roll (24 January 2021) with the observer of the slips' test case.
constexpr ObserverAxisGains kPublished{1.5F, 4.0F, 0.6F, 1.5F, 0.2F, 0.3F};

/// One axis of the linear model, exact over any time for a u that is held.
struct LinearAxis {
  double inertia = kInertia;
  double tau = kTau;
  double angle = 0.0;
  double rate = 0.0;
  double torque = 0.0;

  void step(double u, double dt, double disturbance = 0.0) {
    const double e = std::exp(-dt / tau);
    const double c = 1.0 / inertia;
    const double past = torque - u;  // torque(t) = u + past exp(-t/tau)
    angle +=
        rate * dt + c * ((u + disturbance) * 0.5 * dt * dt + past * tau * (dt - tau * (1.0 - e)));
    rate += c * ((u + disturbance) * dt + past * tau * (1.0 - e));
    torque = u + past * e;
  }
};

/// The law as printed, with one of its slips, in double precision.
class PrintedLaw {
 public:
  enum class Slip { None, RateTerm, StoredControl };

  PrintedLaw(const ObserverAxisGains& gains, double dt, Slip slip)
      : g_(gains), dt_(dt), slip_(slip) {
    const double a = gains.observer;
    const double b4 = kTau + dt * (1.0 + a * kTau / kInertia);
    b1_ = kTau / b4;
    b2_ = -a * dt * (1.0 + a * kTau / kInertia) / b4;
    b3_ = dt / b4;
  }

  double step(double angle, double rate) {
    const double a = g_.observer;
    integral_ += dt_ * angle;
    const double ofRate = slip_ == Slip::RateTerm ? b2_ : b2_ + a;
    const double known = b1_ * (stored_ - a * rateBefore_) + ofRate * rate;
    const double u =
        -(g_.integral * integral_ + g_.angle * angle + g_.rate * rate + g_.torque * known) /
        (1.0 + g_.torque * b3_);
    stored_ = slip_ == Slip::StoredControl ? u : known + b3_ * u;
    rateBefore_ = rate;
    return u;
  }

 private:
  ObserverAxisGains g_;
  double dt_;
  Slip slip_;
  double b1_;
  double b2_;
  double b3_;
  double integral_ = 0.0;
  double stored_ = 0.0;
  double rateBefore_ = 0.0;
};

/// Largest angle in the last of `seconds` after a start at 0.01 rad.
template <class Law>
double angleLeft(Law&& law, LinearAxis body, double dt, double seconds) {
  body.angle = 0.01;
  double largest = 0.0;
  const int steps = static_cast<int>(seconds / dt);
  for (int k = 0; k < steps && std::fabs(body.angle) < 1e3; ++k) {
    body.step(law(body), dt);
    if (k * dt > seconds - 1.0) largest = std::fmax(largest, std::fabs(body.angle));
  }
  return std::fmax(largest, std::fabs(body.angle));
}

ReducedObserverAxis axisOf(const ObserverAxisGains& gains, double dt) {
  ReducedObserverAxis axis(gains, static_cast<float>(kInertia), static_cast<float>(kTau),
                           static_cast<float>(dt));
  axis.reset();
  return axis;
}

/// As it flies: the class on the linear plant.
double angleLeftByOurs(const ObserverAxisGains& gains, double dt, double seconds) {
  ReducedObserverAxis axis = axisOf(gains, dt);
  return angleLeft(
      [&axis](const LinearAxis& b) {
        return axis.holdAngle(static_cast<float>(b.angle), static_cast<float>(b.rate));
      },
      {}, dt, seconds);
}

double angleLeftByPrinted(double dt, PrintedLaw::Slip slip) {
  PrintedLaw law(kPublished, dt, slip);
  return angleLeft([&law](const LinearAxis& b) { return law.step(b.angle, b.rate); }, {}, dt, 20.0);
}

// At a = 0.2 a radius of 1.049 grows 1e5 times in the 1000 steps of 20 s.
void test_the_printed_recursion_is_unstable_at_50_hz_where_ours_is_not() {
  TEST_ASSERT_TRUE(angleLeftByPrinted(0.02, PrintedLaw::Slip::RateTerm) > 1.0);
  TEST_ASSERT_TRUE(angleLeftByPrinted(0.02, PrintedLaw::Slip::None) < 1e-4);
  TEST_ASSERT_TRUE(angleLeftByOurs(kPublished, 0.02, 20.0) < 1e-4);
}

void test_storing_the_control_for_the_torque_is_unstable_at_500_hz_where_ours_is_not() {
  TEST_ASSERT_TRUE(angleLeftByPrinted(0.002, PrintedLaw::Slip::StoredControl) > 1.0);
  TEST_ASSERT_TRUE(angleLeftByPrinted(0.002, PrintedLaw::Slip::None) < 1e-4);
  TEST_ASSERT_TRUE(angleLeftByOurs(kPublished, 0.002, 20.0) < 1e-4);
}

/// Largest difference from the continuous observer in 1 s, both fed the same rate and torque.
double observerError(double dt) {
  const ObserverAxisGains gains{0.0F, 0.0F, 0.0F, 0.0F, 0.2F, 1.0F};
  ReducedObserverAxis axis = axisOf(gains, dt);
  const auto u = [](double t) { return 0.1 * std::sin(9.0 * t); };
  const auto rate = [](double t) { return std::sin(5.0 * t); };
  double z = 0.0;  // of the continuous observer, integrated 100 times as finely
  double largest = 0.0;
  const int steps = static_cast<int>(1.0 / dt);
  (void)axis.holdAngle(0.0F, static_cast<float>(rate(0.0)));
  for (int k = 1; k <= steps; ++k) {
    for (int part = 0; part < 100; ++part) {
      const double t = (k - 1 + (part + 0.5) / 100.0) * dt;
      const double torque = z + gains.observer * rate(t);
      z += dt / 100.0 * ((u(t) - torque) / kTau - gains.observer / kInertia * torque);
    }
    (void)axis.holdAngle(0.0F, static_cast<float>(rate(k * dt)));
    axis.setAchieved(static_cast<float>(u(k * dt)));
    const double exact = z + static_cast<double>(gains.observer) * rate(k * dt);
    largest = std::fmax(largest, std::fabs(exact - static_cast<double>(axis.torqueNow())));
  }
  return largest;
}

void test_the_recursion_becomes_the_continuous_observer_as_the_period_shrinks() {
  // A backward difference is of first order: a quarter of the period, a quarter of the error.
  const double coarse = observerError(4e-3);
  const double fine = observerError(1e-3);
  TEST_ASSERT_TRUE(coarse < 0.03);  // of a torque of 0.1 N m
  TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.25, fine / coarse);
}

void test_a_constant_disturbance_shows_in_the_estimate_by_the_observers_share() {
  // x_v' = c (u + d) without end: x_a goes to u + d a c tau/(1 + a c tau), from z' = const.
  const double dt = 0.02;
  ReducedObserverAxis axis = axisOf({0.0F, 0.0F, 0.0F, 0.0F, 0.2F, 1.0F}, dt);
  const double u = 0.05;
  const double disturbance = -0.02;
  LinearAxis body;
  body.torque = u;
  for (int k = 0; k < 200; ++k) {
    (void)axis.holdAngle(0.0F, static_cast<float>(body.rate));
    axis.setAchieved(static_cast<float>(u));
    body.step(u, dt, disturbance);
  }
  const double weight = 0.2 * kTau / kInertia;
  // Differences of a rate of 8 rad/s in float, over dt and times a tau: 1e-6 of it.
  TEST_ASSERT_DOUBLE_WITHIN(2e-5, u + disturbance * weight / (1.0 + weight),
                            static_cast<double>(axis.torqueNow()));
}

void test_the_control_satisfies_the_implicit_law() {
  const ObserverAxisGains g = kUgglanQ450ObserverGains.roll;
  for (const double dt : {0.02, 0.002}) {
    ReducedObserverAxis axis = axisOf(g, dt);
    for (int k = 0; k < 500; ++k) {
      const float angle = 0.3F * static_cast<float>(std::sin(0.37 * k));
      const float rate = 2.0F * static_cast<float>(std::sin(0.51 * k + 1.0));
      const float u = axis.holdAngle(angle, rate);
      const float law = -(g.integral * axis.integral() + g.angle * angle + g.rate * rate +
                          g.torque * axis.torqueNow());
      TEST_ASSERT_FLOAT_WITHIN(1e-6F, law, u);  // rounding of terms of 0.4
      if (k % 7 == 0) axis.setAchieved(0.5F * u);
    }
  }
}

/// Angle or rate left 25 s after a disturbance, by one axis of a vehicle unlike the model.
double leftOver(const ObserverGains& gains, int i, double inertiaFactor, double lagFactor,
                double dt) {
  const ObserverAxisGains& own = i == 0 ? gains.roll : i == 1 ? gains.pitch : gains.yaw;
  const float inertia = kUgglanQ450.inertia[static_cast<std::size_t>(i)];
  ReducedObserverAxis axis(own, inertia, kUgglanQ450.motorTimeConstant, static_cast<float>(dt));
  axis.reset();
  LinearAxis body{inertiaFactor * static_cast<double>(inertia),
                  lagFactor * static_cast<double>(kUgglanQ450.motorTimeConstant), 0.3, 1.0, 0.0};
  for (int k = 0; k < static_cast<int>(25.0 / dt); ++k) {
    const auto angle = static_cast<float>(body.angle);
    const auto rate = static_cast<float>(body.rate);
    body.step(i == 2 ? axis.holdRate(rate, 0.0F) : axis.holdAngle(angle, rate), dt);
  }
  return std::fabs(i == 2 ? body.rate : body.angle);
}

void test_it_is_stable_when_lag_and_inertia_are_not_those_of_the_model() {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double inertia : {0.8, 1.0, 1.2}) {
      for (const double lag : {0.5, 1.0, 1.5}) {
        // The slowest pole, -0.5 rad/s, leaves e^-12.5 = 4e-6.
        for (const double dt : {0.02, 0.002}) {
          TEST_ASSERT_TRUE(leftOver(kUgglanQ450ObserverGains, axis, inertia, lag, dt) < 1e-4);
        }
        const ObserverGains& fast = kUgglanQ450ObserverGains500Hz;
        TEST_ASSERT_TRUE(leftOver(fast, axis, inertia, lag, 0.002) < 1e-4);
      }
    }
  }
}

void test_a_steady_torque_leaves_no_angle() {
  ReducedObserverAxis axis = axisOf(kUgglanQ450ObserverGains.roll, 0.02);
  LinearAxis body;
  for (int k = 0; k < 1500; ++k) {
    const float u = axis.holdAngle(static_cast<float>(body.angle), static_cast<float>(body.rate));
    body.step(u, 0.02, 0.02);  // N m: 5 mm of centre of mass to the side give 0.05
    if (k == 49) TEST_ASSERT_TRUE(body.angle > 0.01);  // it is felt
  }
  TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.0, body.angle);
}

void test_the_integrals_stop_at_the_published_limits() {
  ReducedObserverController law(kUgglanQ450, kUgglanQ450ObserverGains, 0.02F);
  law.reset();
  for (int k = 0; k < 2000; ++k) (void)law.update({0.4F, -0.4F, 0.0F}, {0.0F, 0.0F, 0.5F}, 0.0F);
  assertNear(1e-6F, Vector3f(0.2F, -0.2F, 1.0F), law.integral());
  // And they come back from there at once.
  (void)law.update({-0.1F, 0.1F, 0.0F}, {0.0F, 0.0F, -0.5F}, 0.0F);
  assertNear(1e-6F, Vector3f(0.198F, -0.198F, 0.99F), law.integral());
}

void test_an_integral_does_not_grow_into_what_the_motors_cannot_give() {
  ReducedObserverAxis axis = axisOf(kUgglanQ450ObserverGains.roll, 0.02);
  const auto limited = [&axis](float angle) {
    const float u = axis.holdAngle(angle, 0.0F);
    axis.setAchieved(u > 0.01F ? 0.01F : u < -0.01F ? -0.01F : u);
  };
  limited(0.3F);
  const float before = axis.integral();
  for (int k = 0; k < 20; ++k) limited(0.3F);
  TEST_ASSERT_EQUAL_FLOAT(before, axis.integral());
  limited(-0.3F);  // out of the limit: at once
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, before - 0.006F, axis.integral());
  limited(-0.3F);
  const float low = axis.integral();
  for (int k = 0; k < 20; ++k) limited(-0.3F);
  TEST_ASSERT_EQUAL_FLOAT(low, axis.integral());
}

void test_the_estimate_follows_the_torque_that_the_motors_gave() {
  // Still body, a = 0: x_a is the motor model of what was given, here nothing of what was asked.
  ReducedObserverAxis axis = axisOf({0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F}, 0.02);
  for (int k = 0; k < 50; ++k) {
    TEST_ASSERT_EQUAL_FLOAT(-0.3F, axis.holdAngle(0.3F, 0.0F));
    axis.setAchieved(0.0F);
    TEST_ASSERT_FLOAT_WITHIN(1e-8F, 0.0F, axis.torqueNow());
  }
}

void test_a_reset_forgets_everything_and_a_turn_that_was_there_is_no_torque() {
  ReducedObserverController used(kUgglanQ450, kUgglanQ450ObserverGains, 0.02F);
  ReducedObserverController fresh(kUgglanQ450, kUgglanQ450ObserverGains, 0.02F);
  used.reset();
  fresh.reset();
  for (int k = 0; k < 20; ++k) {
    (void)used.update({0.2F, -0.1F, 0.0F}, {1.0F, 2.0F, 3.0F}, 1.0F);
    used.setAchieved({0.01F, 0.02F, 0.0F});
  }
  used.reset();
  for (int k = 0; k < 20; ++k) {
    const Vector3f alpha(0.1F, 0.05F, 0.0F);
    const Vector3f rate(2.0F, -1.0F, 0.3F);
    assertNear(0.0F, fresh.update(alpha, rate, 0.0F), used.update(alpha, rate, 0.0F));
  }
  used.reset();
  const Vector3f u = used.update(Vector3f::Zero(), {2.0F, 0.0F, 0.0F}, 0.0F);
  const float b4 = 0.08F + 0.02F * (1.0F + 0.2F * 0.08F / 0.014F);
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 0.02F / b4 * u.x(), used.torqueNow().x());  // b3 u alone
}

void test_a_step_of_the_yaw_stick_is_not_taken_for_a_torque() {
  // The body has not moved: all the observer may see is the control itself, by b3.
  ReducedObserverController law(kUgglanQ450, kUgglanQ450ObserverGains, 0.02F);
  law.reset();
  for (int k = 0; k < 5; ++k) (void)law.update(Vector3f::Zero(), Vector3f::Zero(), 0.0F);
  const Vector3f u = law.update(Vector3f::Zero(), Vector3f::Zero(), 2.0F);
  const float b4 = 0.08F + 0.02F * (1.0F + 0.2F * 0.08F / 0.026F);
  TEST_ASSERT_TRUE(u.z() > 0.1F);
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 0.02F / b4 * u.z(), law.torqueNow().z());
}

void test_nothing_that_is_no_number_reaches_the_motors_or_is_remembered() {
  ReducedObserverController hit(kUgglanQ450, kUgglanQ450ObserverGains, 0.02F);
  ReducedObserverController spared(kUgglanQ450, kUgglanQ450ObserverGains, 0.02F);
  const Vector3f alpha(0.1F, 0.05F, 0.0F);
  const Vector3f rate(0.2F, -0.1F, 0.3F);
  hit.reset();
  spared.reset();
  assertNear(0.0F, spared.update(alpha, rate, 0.5F), hit.update(alpha, rate, 0.5F));
  const Vector3f none = Vector3f::Zero();
  assertNear(0.0F, none, hit.update({kNan, 0.0F, 0.0F}, rate, 0.0F));
  assertNear(0.0F, none, hit.update(alpha, {0.0F, INFINITY, 0.0F}, 0.0F));
  assertNear(0.0F, none, hit.update(alpha, rate, kNan));
  hit.setAchieved({kNan, kNan, kNan});
  TEST_ASSERT_EQUAL_UINT32(3, hit.invalid());
  assertNear(0.0F, spared.update(alpha, rate, 0.5F), hit.update(alpha, rate, 0.5F));
}

void test_each_axis_turns_against_its_own_error_and_touches_no_other() {
  ReducedObserverController law(kUgglanQ450, kUgglanQ450ObserverGains, 0.002F);
  const auto torque = [&law](const Vector3f& alpha, const Vector3f& rate, float yawRate) {
    law.reset();
    return law.update(alpha, rate, yawRate);
  };
  Vector3f u = torque({0.1F, 0.0F, 0.0F}, Vector3f::Zero(), 0.0F);
  TEST_ASSERT_TRUE(u.x() < -0.01F && u.y() == 0.0F && u.z() == 0.0F);
  u = torque({0.0F, 0.1F, 0.0F}, Vector3f::Zero(), 0.0F);
  TEST_ASSERT_TRUE(u.y() < -0.01F && u.x() == 0.0F && u.z() == 0.0F);
  u = torque(Vector3f::Zero(), {0.0F, 0.0F, 0.5F}, 0.0F);
  TEST_ASSERT_TRUE(u.z() < -0.01F && u.x() == 0.0F && u.y() == 0.0F);
  u = torque({0.0F, 0.0F, 0.5F}, Vector3f::Zero(), 0.0F);
  assertNear(0.0F, Vector3f(0.0F, 0.0F, 0.0F), u);  // no heading is kept unless it is asked for
}

void test_a_heading_is_reached_and_kept_where_it_is_wanted() {
  for (const float dt : {0.02F, 0.002F}) {
    ReducedObserverController law(kUgglanQ450, kUgglanQ450ObserverGains, dt);
    law.reset();
    LinearAxis body{0.026, kTau, 0.0, 0.0, 0.0};
    const double wanted = 0.5;
    double most = 0.0;
    for (int k = 0; k < static_cast<int>(20.0F / dt); ++k) {
      const auto alpha = static_cast<float>(body.angle - wanted);
      const Vector3f u =
          law.update({0.0F, 0.0F, alpha}, {0.0F, 0.0F, static_cast<float>(body.rate)},
                     law.headingRate(alpha, 0.0F));
      body.step(u.z(), dt, 0.005);  // N m: a motor that is twisted in its mount
      most = std::fmax(most, body.angle);
    }
    TEST_ASSERT_DOUBLE_WITHIN(2e-3, wanted, body.angle);
    TEST_ASSERT_TRUE(most < 1.35 * wanted);  // an integral and a pair of poles with damping 0.7
  }
}

}  // namespace

void runReducedObserverTests() {
  RUN_TEST(test_the_printed_recursion_is_unstable_at_50_hz_where_ours_is_not);
  RUN_TEST(test_storing_the_control_for_the_torque_is_unstable_at_500_hz_where_ours_is_not);
  RUN_TEST(test_the_recursion_becomes_the_continuous_observer_as_the_period_shrinks);
  RUN_TEST(test_a_constant_disturbance_shows_in_the_estimate_by_the_observers_share);
  RUN_TEST(test_the_control_satisfies_the_implicit_law);
  RUN_TEST(test_it_is_stable_when_lag_and_inertia_are_not_those_of_the_model);
  RUN_TEST(test_a_steady_torque_leaves_no_angle);
  RUN_TEST(test_the_integrals_stop_at_the_published_limits);
  RUN_TEST(test_an_integral_does_not_grow_into_what_the_motors_cannot_give);
  RUN_TEST(test_the_estimate_follows_the_torque_that_the_motors_gave);
  RUN_TEST(test_a_reset_forgets_everything_and_a_turn_that_was_there_is_no_torque);
  RUN_TEST(test_a_step_of_the_yaw_stick_is_not_taken_for_a_torque);
  RUN_TEST(test_nothing_that_is_no_number_reaches_the_motors_or_is_remembered);
  RUN_TEST(test_each_axis_turns_against_its_own_error_and_touches_no_other);
  RUN_TEST(test_a_heading_is_reached_and_kept_where_it_is_wanted);
}
