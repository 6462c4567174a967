/// The filter between gyro and rate control. Its response is compared with SciPy's in
/// tools/tests/test_biquad.py; here stands what it must never do to an aircraft.
#include <GyroFilter.h>
#include <unity.h>

#include <limits>

#include "suites.h"

using namespace strix;

namespace {

constexpr float kImuHz = 1125.0F;
constexpr float kControlHz = 0.5F * kImuHz;
constexpr float kMotorLag = 0.04F;  // s, Quad5in's
constexpr float kInfinity = std::numeric_limits<float>::infinity();

GyroFilterConfig notchConfig() {
  GyroFilterConfig config;
  config.notchMin = 80.0F;
  config.notchMax = 320.0F;
  config.notchQ = 3.0F;
  return config;
}

GyroFilter makeFilter(const GyroFilterConfig& config) {
  return {config, kImuHz, kControlHz, kMotorLag};
}

float size(float x) { return x < 0.0F ? -x : x; }

/// Largest of what a filter adds to or leaves of a signal.
struct Largest {
  float value = 0.0F;
  void add(float x) {
    if (size(x) > value) value = size(x);
  }
};

/// Commanded motor speed of a flight with full throttle steps, rev/s: every 0.25 s from one of the
/// notch's limits to the other.
float stepsOfThrottle(int sample) { return (sample / 281) % 2 == 0 ? 80.0F : 320.0F; }

/// Runs the filter as the flight software does: motor speed every other sample.
template <class Signal, class Look>
void fly(GyroFilter& filter, int samples, Signal&& signal, Look&& look) {
  for (int i = 0; i < samples; ++i) {
    if (i % 2 == 0) filter.setMotorSpeed(stepsOfThrottle(i));
    const float in = signal(i);
    const Vector3f out = filter.update({in, -in, 0.5F * in});
    look(i, in, out);
  }
}

void test_all_off_passes_the_gyro_bit_for_bit() {
  GyroFilter filter = makeFilter({});
  TEST_ASSERT_TRUE(filter.valid());
  for (int i = 0; i < 100; ++i) {
    filter.setMotorSpeed(3.0F * static_cast<float>(i));
    const float x = sine(0.7F * static_cast<float>(i));
    const Vector3f gyro{x, 3.0F - x, 1e-9F * x};
    const Vector3f out = filter.update(gyro);
    TEST_ASSERT_TRUE(out == gyro);
  }
}

void test_power_up_in_a_turn_starts_at_its_rate_and_not_at_zero() {
  GyroFilterConfig config = notchConfig();
  config.lowPass = 25.0F;
  GyroFilter filter = makeFilter(config);
  for (int i = 0; i < 2000; ++i) {
    const Vector3f out = filter.update({2.0F, -3.0F, 30.0F});
    // 25 Hz of 1125 Hz magnifies rounding (6e-8 of a term) by 1 / 0.018: 1e-5 for a few terms.
    TEST_ASSERT_FLOAT_WITHIN(1e-5F * 2.0F, 2.0F, out.x());
    TEST_ASSERT_FLOAT_WITHIN(1e-5F * 3.0F, -3.0F, out.y());
    TEST_ASSERT_FLOAT_WITHIN(1e-5F * 30.0F, 30.0F, out.z());
  }
}

void test_throttle_steps_in_a_steady_turn_make_no_click() {
  GyroFilter filter = makeFilter(notchConfig());
  Largest click;
  fly(
      filter, 4500, [](int) { return 5.0F; },
      [&](int, float in, const Vector3f& out) { click.add(out.x() - in); });
  // 80 Hz of 1125 Hz magnifies the rounding of 5 rad/s (2.4e-7) some 5 times, in each of four
  // terms. With a transposed form II the click is 0.24 rad/s.
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 0.0F, click.value);
}

void test_throttle_steps_in_a_manoeuvre_make_no_step() {
  GyroFilter filter = makeFilter(notchConfig());
  Largest inStep;
  Largest outStep;
  float lastIn = 0.0F;
  Vector3f lastOut = Vector3f::Zero();
  const auto tenHertz = [](int i) {
    return 3.0F * sine(2.0F * kPi * 10.0F * static_cast<float>(i) / kImuHz);
  };
  fly(filter, 4500, tenHertz, [&](int, float in, const Vector3f& out) {
    inStep.add(in - lastIn);
    outStep.add(out.x() - lastOut.x());
    lastIn = in;
    lastOut = out;
  });
  // A notch at 80 Hz lags by 2.4 deg at 10 Hz; letting go of that lag is 4 % of the amplitude,
  // spread over the motors' 40 ms. The manoeuvre itself moves by 5.6 % of it a sample.
  TEST_ASSERT_TRUE(outStep.value < 1.1F * inStep.value);
}

void test_the_motors_line_is_taken_out_while_their_speed_changes() {
  GyroFilter filter = makeFilter(notchConfig());
  float speed = 80.0F;
  float turns = 0.0F;
  Largest atRest;
  Largest moving;
  const auto vibration = [&](int i) {  // once a turn of motors behind their command by their lag
    const float step = 1.0F / (kMotorLag * kImuHz);
    speed += step / (1.0F + step) * (stepsOfThrottle(i) - speed);
    turns += speed / kImuHz;
    if (turns > 1.0F) turns -= 1.0F;
    return sine(2.0F * kPi * turns);
  };
  fly(filter, 4500, vibration, [&](int i, float, const Vector3f& out) {
    if (i < 281) return;  // the first 0.25 s
    (i % 281 > 225 ? atRest : moving).add(out.x());
  });
  TEST_ASSERT_TRUE(atRest.value < 0.01F);  // of 1: after 5 time constants of the motors
  TEST_ASSERT_TRUE(moving.value < 0.15F);  // while the line runs by up to 6000 Hz/s
}

void test_a_sample_that_is_no_number_is_left_out_and_forgotten() {
  GyroFilterConfig config = notchConfig();
  config.lowPass = 80.0F;
  GyroFilter filter = makeFilter(config);
  GyroFilter untouched = makeFilter(config);
  Vector3f last = Vector3f::Zero();
  for (int i = 0; i < 200; ++i) {
    const float x = sine(0.1F * static_cast<float>(i));
    if (i == 100) {
      for (const float bad : {kNaN, kInfinity, -kInfinity}) {
        TEST_ASSERT_TRUE(filter.update({x, bad, x}) == last);
      }
    }
    last = filter.update({x, 2.0F * x, -x});
    TEST_ASSERT_TRUE(last == untouched.update({x, 2.0F * x, -x}));
  }
}

void test_numbers_beyond_any_sensor_do_not_stay() {
  for (const float cutoff : {6.0F, 25.0F, 500.0F}) {
    GyroFilterConfig config = notchConfig();
    config.lowPass = cutoff;
    GyroFilter filter = makeFilter(config);
    for (int i = 0; i < 9; ++i) {
      const Vector3f out = filter.update({3.4e38F, i % 2 == 0 ? -3.4e38F : 3.4e38F, 1.0F});
      TEST_ASSERT_TRUE(isFinite(out));
    }
    Vector3f out = Vector3f::Zero();
    // 1e38 down to 1 by the slowest decay, 6 Hz: 88 / (2 pi 6 / sqrt(2)) = 3.3 s.
    for (int i = 0; i < 8000; ++i) out = filter.update({1.0F, 1.0F, 1.0F});
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, 1.0F, out.x());
    TEST_ASSERT_FLOAT_WITHIN(1e-3F, 1.0F, out.y());
  }
}

void test_every_legal_setting_is_stable() {
  int tried = 0;
  for (const float rate : {200.0F, 500.0F, 1000.0F, 1125.0F, 9000.0F}) {
    for (int i = 0; i <= 40; ++i) {
      // 1/200 to 0.45 of the rate, evenly in ratio: 90^(1/40) = 1.119.
      float hz = rate / 200.0F;
      for (int k = 0; k < i; ++k) hz *= 1.119F;
      if (!isFilterFrequency(hz, rate)) continue;
      const float qs[] = {0.0F, 1.0F, 2.5F, 20.0F};  // 0: the low-pass
      for (const float q : qs) {
        const BiquadCoefficients c = q == 0.0F ? lowPass(hz, rate) : notch(hz, q, rate);
        // Poles within the unit circle: Jury's conditions for a second-order polynomial.
        TEST_ASSERT_TRUE(c.a2 < 1.0F);
        TEST_ASSERT_TRUE((1.0F + c.a1) + c.a2 > 0.0F);
        TEST_ASSERT_TRUE((1.0F - c.a1) + c.a2 > 0.0F);
        // Gain 1 at 0 Hz, by the coefficients that the filter really has.
        TEST_ASSERT_DOUBLE_WITHIN(
            1e-4, 1.0,
            (static_cast<double>(c.b0) + c.b1 + c.b2) / (1.0 + static_cast<double>(c.a1) + c.a2));
        ++tried;
      }
    }
  }
  TEST_ASSERT_TRUE(tried > 780);
}

void test_settings_that_cannot_be_made_are_refused_and_filter_nothing() {
  const auto refused = [](auto&& change) {
    GyroFilterConfig config = notchConfig();
    config.lowPass = 80.0F;
    TEST_ASSERT_TRUE(isGyroFilter(config, kImuHz));
    change(config);
    GyroFilter filter = makeFilter(config);
    const Vector3f gyro{1.0F, -2.0F, 3.0F};
    static_cast<void>(filter.update(Vector3f::Zero()));
    return !filter.valid() && filter.update(gyro) == gyro;
  };
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.lowPass = 5.0F; }));    // below rate / 200
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.lowPass = 507.0F; }));  // above 0.45 rate
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.lowPass = -80.0F; }));
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.lowPass = kNaN; }));
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.notchMin = 321.0F; }));  // above notchMax
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.notchMin = 0.0F; }));
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.notchMax = 0.0F; }));
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.notchMax = kNaN; }));
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.notchQ = 0.9F; }));
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.notchQ = kNaN; }));
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.notchHarmonics = 0; }));
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) { c.notchHarmonics = 2; }));  // 640 Hz
  TEST_ASSERT_TRUE(refused([](GyroFilterConfig& c) {
    c.notchMax = 100.0F;
    c.notchHarmonics = 4;
  }));
}

void test_the_notch_follows_the_motors_with_their_lag_and_within_its_limits() {
  GyroFilter filter = makeFilter(notchConfig());
  TEST_ASSERT_EQUAL_FLOAT(80.0F, filter.notchCentre());
  filter.setMotorSpeed(kNaN);
  TEST_ASSERT_EQUAL_FLOAT(80.0F, filter.notchCentre());
  for (int i = 0; i < 23; ++i) filter.setMotorSpeed(200.0F);  // 0.041 s: one time constant
  // 1 - 1/e = 0.632 of the way; the steps of 1.8 ms are good to 2 % of it.
  TEST_ASSERT_FLOAT_WITHIN(2.5F, 0.632F * 200.0F, filter.notchCentre());
  for (int i = 0; i < 500; ++i) filter.setMotorSpeed(200.0F);
  TEST_ASSERT_FLOAT_WITHIN(0.01F, 200.0F, filter.notchCentre());
  for (int i = 0; i < 500; ++i) filter.setMotorSpeed(1000.0F);
  TEST_ASSERT_EQUAL_FLOAT(320.0F, filter.notchCentre());
  for (int i = 0; i < 500; ++i) filter.setMotorSpeed(0.0F);
  TEST_ASSERT_EQUAL_FLOAT(80.0F, filter.notchCentre());
}

void test_harmonics_have_notches_of_their_own() {
  GyroFilterConfig config = notchConfig();
  config.notchMax = 160.0F;
  config.notchHarmonics = 3;
  for (int harmonic = 1; harmonic <= 3; ++harmonic) {
    GyroFilter filter = makeFilter(config);
    for (int i = 0; i < 500; ++i) filter.setMotorSpeed(150.0F);
    Largest left;
    for (int i = 0; i < 2250; ++i) {
      const int at = i * harmonic * 150 % 1125;  // exact phase, 1/1125 turns
      const Vector3f out =
          filter.update({sine(2.0F * kPi * static_cast<float>(at) / kImuHz), 0.0F, 0.0F});
      if (i > 1125) left.add(out.x());
    }
    // The notch stands within the last bits of 150 Hz: 40 dB at the very least.
    TEST_ASSERT_TRUE(left.value < 0.01F);
  }
}

}  // namespace

void runBiquadTests() {
  RUN_TEST(test_all_off_passes_the_gyro_bit_for_bit);
  RUN_TEST(test_power_up_in_a_turn_starts_at_its_rate_and_not_at_zero);
  RUN_TEST(test_throttle_steps_in_a_steady_turn_make_no_click);
  RUN_TEST(test_throttle_steps_in_a_manoeuvre_make_no_step);
  RUN_TEST(test_the_motors_line_is_taken_out_while_their_speed_changes);
  RUN_TEST(test_a_sample_that_is_no_number_is_left_out_and_forgotten);
  RUN_TEST(test_numbers_beyond_any_sensor_do_not_stay);
  RUN_TEST(test_every_legal_setting_is_stable);
  RUN_TEST(test_settings_that_cannot_be_made_are_refused_and_filter_nothing);
  RUN_TEST(test_the_notch_follows_the_motors_with_their_lag_and_within_its_limits);
  RUN_TEST(test_harmonics_have_notches_of_their_own);
}
