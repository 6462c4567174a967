// What a pilot's sticks ask for.
#include <StickMapping.h>
#include <unity.h>

#include <limits>

#include "suites.h"

using namespace strix;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

struct Sticks {
  float roll = 0.0F;
  float pitch = 0.0F;
  float yaw = 0.0F;
  float throttle = 0.0F;
};

void test_full_sticks_ask_for_an_eighth_of_pi_a_half_turn_a_second_and_20_n() {
  const StickMapping mapping;
  PilotDemand d = mapping.demand(Sticks{1.0F, -1.0F, 1.0F, 1.0F});
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 0.3926991F, d.roll);
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, -0.3926991F, d.pitch);
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 3.1415927F, d.yawRate);
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 20.0F, d.thrust);
  d = mapping.demand(Sticks{7.0F, kNan, -3.0F, -1.0F});  // beyond the range, or garbled
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, 0.3926991F, d.roll);
  TEST_ASSERT_EQUAL_FLOAT(0.0F, d.pitch);
  TEST_ASSERT_FLOAT_WITHIN(1e-6F, -3.1415927F, d.yawRate);
  TEST_ASSERT_EQUAL_FLOAT(0.0F, d.thrust);
}

void test_the_wanted_heading_turns_with_the_stick_and_does_not_run_away() {
  StickMapping mapping;
  mapping.reset(3.0F);
  PilotDemand d;
  d.roll = 0.1F;
  d.yawRate = 1.0F;
  Reference r;
  for (int k = 0; k < 25; ++k) r = mapping.reference(d, 3.0F, 0.02F);
  TEST_ASSERT_TRUE(r.mode == ReferenceMode::Attitude);
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, wrapAngle(3.5F), r.yaw);  // across south
  TEST_ASSERT_EQUAL_FLOAT(1.0F, r.yawRate);
  const EulerAngles e = quaternionToEuler(r.attitude);
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 0.1F, e.roll);
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, r.yaw, e.yaw);
  for (int k = 0; k < 500; ++k) r = mapping.reference(d, 3.0F, 0.02F);  // held fast
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, wrapAngle(4.0F), r.yaw);
}

}  // namespace

void runStickMappingTests() {
  RUN_TEST(test_full_sticks_ask_for_an_eighth_of_pi_a_half_turn_a_second_and_20_n);
  RUN_TEST(test_the_wanted_heading_turns_with_the_stick_and_does_not_run_away);
}
