#include <unity.h>
#include "Vibration.h"
#include "suites.h"

namespace {

using strix::Micros;
using strix::Vector3f;
using strix::Vibration;

const Vector3f kHover(0.0F, 0.0F, -strix::kGravity);  // m/s^2, body
constexpr float kAmplitude = 3.0F;                    // m/s^2, of each shaken axis

/// Shakes for a while at 100 Hz, sampled at 1 kHz; with amplitude zero, rests.
void shake(Vibration& v, float seconds, const Vector3f& amplitude, Micros& now) {
  const auto samples = static_cast<int>(seconds * 1e3F);
  for (int i = 0; i < samples; ++i, now += 1'000) {
    const float phase = 0.2F * strix::kPi * static_cast<float>(i % 10);
    v.update(now, kHover + strix::sine(phase) * amplitude);
  }
}

void test_a_shaken_body_shows_the_mean_square_of_its_shaking_summed_over_the_axes() {
  for (const Micros begin : {Micros{0}, Micros{0xFFFFFFFFU - 4'000'000U}}) {  // across the wrap
    Vibration v;
    Micros now = begin;
    shake(v, 8.0F, Vector3f(kAmplitude, 0.0F, kAmplitude), now);
    // Half the amplitude squared, twice. The mean over 1 s has 0.03 % left of its start after 8 s
    // and 0.3 % of ripple; the high-pass at 1.6 Hz takes 0.03 % of 100 Hz and adds a sample's part,
    // dt / (0.1 s + dt) = 1 %, of phase.
    TEST_ASSERT_FLOAT_WITHIN(0.02F * kAmplitude * kAmplitude, kAmplitude * kAmplitude,
                             v.meanSquare());
    TEST_ASSERT_FLOAT_WITHIN(0.01F * kAmplitude, kAmplitude, v.rms());
  }
}

void test_a_force_that_stays_is_no_vibration_from_the_first_sample_on() {
  Vibration v;
  Micros now = 0;
  for (int i = 0; i < 100; ++i, now += 1'000) {
    v.update(now, kHover);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, v.meanSquare());
  }
}

void test_a_manoeuvre_counts_little() {
  Vibration v;
  // Gravity turning through the body at 0.5 rad/s: 9.8 x 0.5 x 0.1 s = 0.49 m/s^2 behind.
  for (int i = 0; i < 20'000; ++i) {
    const strix::SinCos s = strix::sinCos(0.0005F * static_cast<float>(i));
    v.update(static_cast<Micros>(i) * 1'000U, strix::kGravity * Vector3f(s.sin, 0.0F, -s.cos));
  }
  TEST_ASSERT_FLOAT_WITHIN(0.02F, 0.49F, v.rms());
}

void test_vibration_is_forgotten_in_seconds() {
  Vibration v;
  Micros now = 0;
  shake(v, 5.0F, Vector3f(kAmplitude, 0.0F, 0.0F), now);
  const float before = v.meanSquare();
  shake(v, 3.0F, Vector3f::Zero(), now);
  // exp(-3) = 0.0498, and 0.5 % of what follows the last sample.
  TEST_ASSERT_FLOAT_WITHIN(0.005F * before, 0.0498F * before, v.meanSquare());
}

}  // namespace

void runVibrationTests() {
  RUN_TEST(test_a_shaken_body_shows_the_mean_square_of_its_shaking_summed_over_the_axes);
  RUN_TEST(test_a_force_that_stays_is_no_vibration_from_the_first_sample_on);
  RUN_TEST(test_a_manoeuvre_counts_little);
  RUN_TEST(test_vibration_is_forgotten_in_seconds);
}
