#include <random>

#include <unity.h>
#include "StandstillDetector.h"
#include "suites.h"

namespace {

using strix::Micros;
using strix::StandstillConfig;
using strix::StandstillDetector;
using strix::Vector3f;

const Vector3f kRest(0.5F, -0.3F, -9.79F);    // specific force at rest, a little tilted, m/s^2
const Vector3f kBias(0.02F, -0.01F, 0.005F);  // of the gyro, rad/s
constexpr float kForceSigma = 0.03F;          // of a sample, m/s^2: DESIGN.md, 5
constexpr float kRateSigma = 0.003F;          // rad/s

/// A detector and the noisy sensors it watches.
class Watch {
 public:
  explicit Watch(Micros step = 1'000, Micros begin = 0) : step_(step), now_(begin) {}

  /// @return seconds until it was held, of at most `seconds`; negative if it never was
  float run(float seconds, const Vector3f& accel, const Vector3f& gyro) {
    const auto steps = static_cast<Micros>(seconds * 1e6F) / step_;
    float heldAt = -1.0F;
    for (Micros i = 0; i < steps; ++i, now_ += step_) {
      detector_.update(now_, accel + noise(kForceSigma), gyro + noise(kRateSigma));
      if (detector_.held() && heldAt < 0.0F) heldAt = strix::toSeconds(i * step_);
    }
    return heldAt;
  }

  [[nodiscard]] const StandstillDetector& detector() const { return detector_; }

 private:
  Vector3f noise(float sigma) {
    std::normal_distribution<float> normal(0.0F, sigma);
    return {normal(random_), normal(random_), normal(random_)};
  }

  std::mt19937 random_{1};
  StandstillDetector detector_{StandstillConfig{}};
  Micros step_;
  Micros now_;
};

void test_rest_is_held_after_its_time_at_any_sample_rate_and_across_the_clocks_wrap() {
  const float duration = strix::toSeconds(StandstillConfig{}.duration);
  for (const Micros step : {Micros{1'000}, Micros{5'000}, Micros{20'000}}) {
    for (const Micros begin : {Micros{0}, Micros{0xFFFFFFFFU - 700'000U}}) {
      Watch watch(step, begin);
      // The first sample counts as rest, so two steps of tolerance.
      TEST_ASSERT_FLOAT_WITHIN(2e-6F * static_cast<float>(step), duration,
                               watch.run(5.0F, kRest, kBias));
      TEST_ASSERT_TRUE(watch.detector().held());
    }
  }
}

void test_the_mean_rate_at_rest_is_the_gyros_bias() {
  Watch watch;
  watch.run(5.0F, kRest, kBias);
  // The low-pass averages over about 2 x 0.5 s = 1000 samples: 0.003 / sqrt(1000) = 1e-4 rad/s an
  // axis; what is left of its start, from one noisy sample, is exp(-10) of 0.003. Four sigma.
  TEST_ASSERT_TRUE((watch.detector().meanGyro() - kBias).cwiseAbs().maxCoeff() < 4e-4F);
}

void test_a_bump_or_a_turn_ends_rest_at_once_and_it_must_begin_anew() {
  const Vector3f bump(1.0F, 0.0F, 0.0F);
  const Vector3f turn(0.0F, 0.1F, 0.0F);
  for (const bool turned : {false, true}) {
    Watch watch;
    watch.run(3.0F, kRest, kBias);
    TEST_ASSERT_TRUE(watch.detector().held());
    watch.run(0.01F, turned ? kRest : kRest + bump, turned ? kBias + turn : kBias);
    TEST_ASSERT_FALSE(watch.detector().held());
    TEST_ASSERT_TRUE(watch.run(1.4F, kRest, kBias) < 0.0F);  // not yet 1.5 s
    TEST_ASSERT_TRUE(watch.run(1.0F, kRest, kBias) >= 0.0F);
  }
}

void test_a_smooth_turn_is_no_rest() {
  Watch watch;
  const Vector3f turn(0.0F, 0.0F, 0.15F);  // 9 deg/s, steady
  TEST_ASSERT_TRUE(watch.run(20.0F, kRest, turn) < 0.0F);
}

void test_free_fall_and_a_steady_climb_are_no_rest() {
  for (const float force : {0.0F, 8.0F, 11.5F}) {
    Watch watch;
    TEST_ASSERT_TRUE(watch.run(20.0F, Vector3f(0.0F, 0.0F, -force), kBias) < 0.0F);
  }
}

}  // namespace

void runStandstillTests() {
  RUN_TEST(test_rest_is_held_after_its_time_at_any_sample_rate_and_across_the_clocks_wrap);
  RUN_TEST(test_the_mean_rate_at_rest_is_the_gyros_bias);
  RUN_TEST(test_a_bump_or_a_turn_ends_rest_at_once_and_it_must_begin_anew);
  RUN_TEST(test_a_smooth_turn_is_no_rest);
  RUN_TEST(test_free_fall_and_a_steady_climb_are_no_rest);
}
