// What the pilot's sticks do to the aircraft, in each of his modes.
#include <array>

#include "StickRig.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr std::array<float, 4> kYaws = {0.0F, 1.6F, 3.1F, -2.0F};
constexpr std::array<PilotMode, 3> kModes = {PilotMode::Attitude, PilotMode::AltitudeHold,
                                             PilotMode::PositionHold};

struct Deflection {
  float roll;
  float pitch;
};
constexpr std::array<Deflection, 4> kDeflections = {
    {{1.0F, 0.0F}, {0.0F, -1.0F}, {-0.6F, 0.3F}, {1.0F, 1.0F}}};

void test_a_deflection_does_the_same_at_every_heading_in_every_mode() {
  for (const PilotMode mode : kModes) {
    for (const Deflection& d : kDeflections) {
      Eigen::Vector3d first;
      for (const float yaw : kYaws) {
        StickRig rig(FlightState::Manual, yaw);
        rig.sticks.mode = mode;
        rig.sticks.roll = d.roll;
        rig.sticks.pitch = d.pitch;
        rig.run(1.5F);
        if (yaw == kYaws[0]) first = rig.seen();
        // Some 3 m/s: float rounding at another heading makes a hundredth of it.
        TEST_ASSERT_TRUE((rig.seen() - first).norm() < 0.03);
      }
      // Right and pulled back: to the right and backwards, and as far as the sticks lean.
      TEST_ASSERT_TRUE(first.head<2>().norm() > 0.8);
      const Eigen::Vector2d asked(-d.pitch, d.roll);
      TEST_ASSERT_TRUE(first.head<2>().normalized().dot(asked.normalized()) > 0.998);
    }
  }
}

void test_sticks_let_go_bring_position_hold_to_rest_where_it_then_stays() {
  for (const float yaw : kYaws) {
    StickRig rig(FlightState::Manual, yaw);
    rig.sticks.pitch = -1.0F;
    rig.sticks.roll = 0.5F;
    rig.run(4.0F);
    const Eigen::Vector3d released = rig.quad.position;
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 2.0, rig.levelSpeed());
    rig.sticks.pitch = rig.sticks.roll = 0.0F;
    rig.run(4.0F);
    // 2 m/s are braked with 2 m/s^2 in 1 m; building that up takes a third of a second and as long
    // to end it.
    TEST_ASSERT_TRUE((rig.quad.position - released).norm() < 2.2);
    const Eigen::Vector3d stopped = rig.quad.position;
    rig.run(3.0F);
    TEST_ASSERT_TRUE((rig.quad.position - stopped).norm() < 0.05);
    TEST_ASSERT_TRUE(rig.reference().velocityNed.norm() == 0.0F);
  }
}

void test_no_limit_is_exceeded_whatever_the_sticks_do() {
  StickRig rig(FlightState::Manual, 0.7F);
  const TrajectoryLimits limits;
  unsigned random = 1;
  const auto stick = [&random] {  // an end, the middle or the other end
    random = random * 1664525U + 1013904223U;
    return static_cast<float>((random >> 20U) % 3U) - 1.0F;
  };
  for (int i = 0; i < 60; ++i) {
    rig.sticks.roll = stick();
    rig.sticks.pitch = stick();
    rig.sticks.yaw = stick();
    rig.sticks.throttle = 0.5F + 0.5F * stick();
    rig.run(0.3F + 0.05F * static_cast<float>(i % 8), [&] {
      const Reference& r = rig.reference();
      // In a change of direction the end of the old acceleration adds 2 % (measured).
      TEST_ASSERT_TRUE(r.velocityNed.head<2>().norm() <= 1.03F * rig.parameters.stickSpeed);
      TEST_ASSERT_TRUE(std::abs(r.velocityNed.z()) <= rig.parameters.stickClimb + 0.01F);
      TEST_ASSERT_TRUE(r.accelerationNed.head<2>().norm() <= limits.acceleration + 0.01F);
      TEST_ASSERT_TRUE(std::abs(r.accelerationNed.z()) <= limits.acceleration + 0.01F);
      TEST_ASSERT_TRUE(std::abs(r.yawRate) <= rig.parameters.stickYaw * kDegToRad + 1e-4F);
      // Level and vertical each keep the jerk: sqrt(2) together.
      TEST_ASSERT_TRUE(rig.step().second <= 1.42F * limits.jerk * StickRig::kPeriod + 1e-4F);
      TEST_ASSERT_TRUE(rig.quad.tilt() < 25.0 * kDegToRad);
    });
  }
}

void test_full_sticks_in_a_corner_tilt_no_further_than_at_a_side() {
  Parameters p;
  p.stickTilt = 45.0F;
  for (const float yaw : kYaws) {
    StickRig rig(FlightState::Manual, yaw, p);
    rig.sticks.mode = PilotMode::AltitudeHold;
    rig.sticks.roll = 1.0F;
    rig.sticks.pitch = 1.0F;
    double most = 0.0;
    rig.run(2.0F, [&] { most = std::max(most, rig.quad.tilt()); });
    // A step of the attitude overshoots by a tenth at most (docs/control.md).
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * kDegToRad, 45.0 * kDegToRad, most);
  }
}

void test_the_throttles_middle_hovers_and_holds() {
  for (const PilotMode mode : kModes) {
    StickRig rig(FlightState::Manual);
    rig.sticks.mode = mode;
    rig.run(3.0F);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, -5.0, rig.quad.position.z());
    rig.sticks.throttle = mode == PilotMode::Attitude ? 0.45F : 0.41F;  // still its dead zone
    rig.run(1.0F);
    const double sunk = rig.quad.position.z() + 5.0;
    // A tenth of the weight less for 1 s: g/10 t^2/2, the motors' lag taken off.
    const double expected = mode == PilotMode::Attitude ? 0.45 : 0.0;
    TEST_ASSERT_DOUBLE_WITHIN(0.05, expected, sunk);
  }
}

void test_the_throttle_climbs_and_sinks_at_its_speed_and_letting_go_holds_that_height() {
  for (const PilotMode mode : {PilotMode::AltitudeHold, PilotMode::PositionHold}) {
    for (const float way : {1.0F, -1.0F}) {
      StickRig rig(FlightState::Manual);
      rig.sticks.mode = mode;
      rig.sticks.throttle = 0.5F + 0.5F * way;
      rig.run(2.0F);
      TEST_ASSERT_DOUBLE_WITHIN(0.05, way * 1.0F, rig.seen().z());
      rig.sticks.throttle = 0.5F;
      rig.run(3.0F);
      const double held = rig.quad.position.z();
      rig.run(2.0F);
      TEST_ASSERT_DOUBLE_WITHIN(0.02, held, rig.quad.position.z());
    }
  }
}

void test_the_yaw_stick_turns_at_its_rate_and_stops_when_let_go() {
  for (const PilotMode mode : kModes) {
    StickRig rig(FlightState::Manual, 3.0F);  // across south
    rig.sticks.mode = mode;
    rig.sticks.yaw = 0.5F;
    rig.run(2.0F);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 30.0 * kDegToRad, rig.quad.rate.z());
    rig.sticks.yaw = 0.0F;
    const double released = rig.quad.yaw();
    rig.run(2.0F);
    TEST_ASSERT_TRUE(std::abs(rig.quad.rate.z()) < 0.01);
    TEST_ASSERT_TRUE(std::abs(wrapAngle(static_cast<float>(rig.quad.yaw() - released))) < 0.3F);
  }
}

void test_a_nose_that_is_held_fast_is_not_wound_up() {
  StickRig rig(FlightState::Manual);
  rig.sticks.mode = PilotMode::Attitude;
  rig.sticks.yaw = 1.0F;
  Micros now = rig.now;
  for (int i = 0; i < 2500; ++i) {  // 5 s at 60 deg/s, and the nose still at north
    rig.guidance.setPilot(rig.sticks, true, true, false);
    rig.guidance.update(now += 2000, rig.quad.state());
  }
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, 1.0F, rig.reference().yaw);
}

void test_without_gps_position_hold_becomes_altitude_hold_and_comes_back_smoothly() {
  StickRig rig(FlightState::Manual, -2.0F);
  rig.sticks.pitch = -1.0F;
  rig.run(2.0F);
  rig.positionKnown = false;
  rig.run(1.0F, [&] {
    TEST_ASSERT_TRUE(rig.guidance.effectiveMode() == PilotMode::AltitudeHold);
    TEST_ASSERT_TRUE(rig.reference().mode == ReferenceMode::AttitudeHeight);
  });
  TEST_ASSERT_DOUBLE_WITHIN(0.1, -5.0, rig.quad.position.z());
  TEST_ASSERT_TRUE(rig.levelSpeed() > 4.0);  // full stick is a tilt now
  rig.positionKnown = true;
  rig.sticks.pitch = 0.0F;
  rig.run(StickRig::kPeriod);
  // It goes on from the tilt that is there: 25 deg forward, as much as is fed forward.
  TEST_ASSERT_FLOAT_WITHIN(0.02F, 2.0F, rig.reference().accelerationNed.head<2>().norm());
  assertNear(0.05F, rig.quad.state().velocityNed, rig.reference().velocityNed);
  double fastest = 0.0;
  rig.run(6.0F, [&] {
    TEST_ASSERT_TRUE(rig.guidance.effectiveMode() == PilotMode::PositionHold);
    // From 5 m/s and more nothing jumps: 6 m/s^3 in 2 ms.
    TEST_ASSERT_TRUE(rig.step().second <= 6.0F * StickRig::kPeriod * 1.01F);
    fastest = std::max(fastest, rig.levelSpeed());
  });
  TEST_ASSERT_TRUE(fastest < 7.5);
  TEST_ASSERT_TRUE(rig.levelSpeed() < 0.05);
}

void test_without_a_height_the_throttle_is_thrust() {
  StickRig rig(FlightState::Manual);
  rig.heightKnown = false;
  for (const PilotMode mode : kModes) {
    rig.sticks.mode = mode;
    rig.run(0.1F);
    TEST_ASSERT_TRUE(rig.guidance.effectiveMode() == PilotMode::Attitude);
    TEST_ASSERT_TRUE(rig.reference().mode == ReferenceMode::Attitude);
    TEST_ASSERT_FLOAT_WITHIN(1e-4F, kQuad5in.mass * kGravity, rig.reference().thrust);
  }
  rig.positionKnown = false;
  rig.run(0.1F);
  TEST_ASSERT_TRUE(rig.guidance.effectiveMode() == PilotMode::Attitude);
}

void test_modes_changed_in_the_middle_of_a_turn_do_not_upset_the_aircraft() {
  for (const float yaw : kYaws) {
    StickRig rig(FlightState::Manual, yaw);
    rig.sticks.roll = 1.0F;
    rig.sticks.yaw = -1.0F;
    double most = 0.0;
    for (int i = 0; i < 12; ++i) {
      rig.sticks.mode = kModes[static_cast<std::size_t>(i) * 2 % 3];
      rig.run(0.7F, [&] { most = std::max(most, rig.quad.tilt()); });
    }
    TEST_ASSERT_TRUE(most < 36.0 * kDegToRad);  // the controller's limit in Position is 35 deg
    TEST_ASSERT_TRUE(std::abs(rig.quad.position.z() + 5.0) < 3.0);
  }
}

void test_sticks_that_are_no_number_or_of_no_transmitter_are_the_middle() {
  for (const PilotMode mode : kModes) {
    for (const bool valid : {true, false}) {
      StickRig rig(FlightState::Manual, 1.0F);
      rig.sticks.mode = mode;
      rig.sticks.valid = valid;
      rig.sticks.roll = rig.sticks.pitch = rig.sticks.yaw = rig.sticks.throttle =
          valid ? kNaN : 1.0F;
      rig.run(2.0F);
      assertNear(0.05F, Vector3f{0.0F, 0.0F, -5.0F}, rig.quad.state().positionNed);
      TEST_ASSERT_DOUBLE_WITHIN(0.01, 1.0, rig.quad.yaw());
    }
  }
}

void test_position_hold_stops_inside_the_fence_and_slides_along_it() {
  Parameters p;
  p.fenceRadius = 10.0F;
  p.fenceHeight = 8.0F;
  StickRig rig(FlightState::Manual, 0.5F, p);
  rig.sticks.pitch = -1.0F;
  rig.sticks.throttle = 1.0F;
  double furthest = 0.0;
  double highest = 0.0;
  const auto look = [&] {
    furthest = std::max(furthest, rig.quad.position.head<2>().norm());
    highest = std::max(highest, -rig.quad.position.z());
  };
  rig.run(20.0F, look);
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 9.0, furthest);  // 1 m inside
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 7.0, highest);
  rig.sticks.roll = 1.0F;  // along it
  const Eigen::Vector3d before = rig.quad.position;
  rig.run(5.0F, look);
  TEST_ASSERT_TRUE((rig.quad.position - before).norm() > 2.0);
  TEST_ASSERT_TRUE(furthest < 9.3);
}

void test_a_reference_waits_for_an_aircraft_that_cannot_follow() {
  StickRig rig(FlightState::Manual);
  rig.sticks.pitch = -1.0F;
  const VehicleState held = rig.quad.state();
  Micros now = rig.now;
  for (int i = 0; i < 5000; ++i) {
    rig.guidance.setPilot(rig.sticks, true, true, false);
    rig.guidance.update(now += 2000, held);
  }
  TEST_ASSERT_TRUE((rig.reference().positionNed - held.positionNed).norm() < 1.51F);
}

void test_on_the_ground_the_motors_idle_until_the_throttle_asks_for_lifting_off() {
  for (const PilotMode mode : kModes) {
    StickRig rig(FlightState::Manual);
    rig.sticks.mode = mode;
    VehicleState onGround;
    Micros now = rig.now;
    const auto tick = [&](float throttle, bool standing) {
      rig.sticks.throttle = throttle;
      rig.guidance.setPilot(rig.sticks, true, true, standing);
      rig.guidance.update(now += 2000, onGround);
      return rig.guidance.idles();
    };
    TEST_ASSERT_FALSE(tick(0.5F, false));
    TEST_ASSERT_TRUE(tick(0.0F, true));
    const float most = mode == PilotMode::Attitude ? 0.14F : 0.59F;
    for (float throttle = 0.0F; throttle < most; throttle += 0.01F) {
      TEST_ASSERT_TRUE(tick(throttle, false));
    }
    TEST_ASSERT_FALSE(tick(most + 0.03F, false));
    TEST_ASSERT_FALSE(tick(0.0F, false));  // in the air again: nobody says it stands
    // It lifts off smoothly, from where it stood.
    if (mode != PilotMode::Attitude) {
      TEST_ASSERT_FLOAT_WITHIN(0.01F, 0.0F, rig.reference().velocityNed.norm());
      TEST_ASSERT_FLOAT_WITHIN(0.01F, 0.0F, rig.reference().positionNed.norm());
    }
  }
}

}  // namespace

void runStickTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_deflection_does_the_same_at_every_heading_in_every_mode);
  RUN_TEST(test_sticks_let_go_bring_position_hold_to_rest_where_it_then_stays);
  RUN_TEST(test_no_limit_is_exceeded_whatever_the_sticks_do);
  RUN_TEST(test_full_sticks_in_a_corner_tilt_no_further_than_at_a_side);
  RUN_TEST(test_the_throttles_middle_hovers_and_holds);
  RUN_TEST(test_the_throttle_climbs_and_sinks_at_its_speed_and_letting_go_holds_that_height);
  RUN_TEST(test_the_yaw_stick_turns_at_its_rate_and_stops_when_let_go);
  RUN_TEST(test_a_nose_that_is_held_fast_is_not_wound_up);
  RUN_TEST(test_without_gps_position_hold_becomes_altitude_hold_and_comes_back_smoothly);
  RUN_TEST(test_without_a_height_the_throttle_is_thrust);
  RUN_TEST(test_modes_changed_in_the_middle_of_a_turn_do_not_upset_the_aircraft);
  RUN_TEST(test_sticks_that_are_no_number_or_of_no_transmitter_are_the_middle);
  RUN_TEST(test_position_hold_stops_inside_the_fence_and_slides_along_it);
  RUN_TEST(test_a_reference_waits_for_an_aircraft_that_cannot_follow);
  RUN_TEST(test_on_the_ground_the_motors_idle_until_the_throttle_asks_for_lifting_off);
}
