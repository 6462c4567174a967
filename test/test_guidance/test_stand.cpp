// The attitude stand: its sequence to the tick.
#include "GuidedFlight.h"
#include "suites.h"

using namespace strix;

namespace {

struct Part {
  float begin;  ///< s from the start
  float end;
  EulerAngles wanted;  ///< in angles A
  bool idle;
};

// Issue 7, point 5, written out.
const Part kSequence[] = {
    {0, 5, {0, 0, 0}, true},     {5, 15, {0, 0, 0}, false},   {15, 19, {1, 0, 0}, false},
    {19, 23, {0, 0, 0}, false},  {23, 27, {-1, 0, 0}, false}, {27, 31, {0, 0, 0}, false},
    {31, 35, {0, 1, 0}, false},  {35, 39, {0, 0, 0}, false},  {39, 43, {0, -1, 0}, false},
    {43, 47, {0, 0, 0}, false},  {47, 51, {0, 0, 1}, false},  {51, 55, {0, 0, 0}, false},
    {55, 59, {0, 0, -1}, false},
};

void test_the_stand_goes_through_its_sequence_to_the_tick() {
  for (const float yaw : {0.0F, 3.0F}) {
    for (const char* text : {"stand 15\n", "stand 30\n"}) {
      GuidedFlight stand(text, yaw);
      TEST_ASSERT_TRUE(stand.at(FlightState::AttitudeStand));
      const float angle = GuidedFlight::parsed(text).standAngle;
      const Micros start = stand.now;
      for (const Part& part : kSequence) {
        while (elapsed(stand.now, start) < static_cast<Micros>(part.end * 1e6F)) {
          const Reference& r = stand.reference();
          TEST_ASSERT_TRUE(stand.at(FlightState::AttitudeStand));
          TEST_ASSERT_TRUE(r.mode == ReferenceMode::Attitude);
          TEST_ASSERT_TRUE(stand.guidance.idles() == part.idle);
          TEST_ASSERT_EQUAL_FLOAT(part.idle ? 0.0F : 0.6F * kWeight, r.thrust);
          assertSameRotation(1e-6F,
                             eulerToQuaternion({part.wanted.roll * angle, part.wanted.pitch * angle,
                                                yaw + part.wanted.yaw * angle}),
                             r.attitude);
          stand.step();
        }
      }
      TEST_ASSERT_TRUE(stand.at(FlightState::Idle));  // in the very tick
      TEST_ASSERT_FALSE(stand.guidance.idles());
    }
  }
}

void test_a_stand_can_be_run_again_from_another_heading() {
  GuidedFlight stand("stand 15\n");
  stand.runUntil(FlightState::Idle);
  stand.state.attitude = eulerToQuaternion({0.0F, 0.0F, 1.0F});
  stand.step(condition::kArmEdge);
  stand.step(condition::kStart);
  TEST_ASSERT_TRUE(stand.at(FlightState::AttitudeStand));
  TEST_ASSERT_TRUE(stand.guidance.idles());
  assertSameRotation(1e-6F, stand.state.attitude, stand.reference().attitude);
  TEST_ASSERT_EQUAL_FLOAT(0.0F, stand.reference().thrust);
}

}  // namespace

void runStandTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_stand_goes_through_its_sequence_to_the_tick);
  RUN_TEST(test_a_stand_can_be_run_again_from_another_heading);
}
