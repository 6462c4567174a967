// The attitude stand: the aircraft turns on a gimbal and goes nowhere.
#include "AssertNear.h"
#include "FakeFlight.h"
#include "suites.h"

using namespace strix;

namespace {

FlightSoftwareConfig onStand() {
  Mission mission;
  mission.name = "stand";
  mission.standAngle = 15.0F * kDegToRad;
  return flightConfig(kQuad5in, kQuad5inGains, mission, 0.07F);
}

struct StandFlight : FakeFlight {
  StandFlight() : FakeFlight(0, onStand()) { board.gps.dead = true; }  // under a roof

  void start() {
    getReady();
    reach(FlightState::AttitudeStand);
  }
};

void test_the_stand_needs_no_gps_and_goes_through_its_sequence_by_itself() {
  StandFlight f;
  f.start();
  f.run(4.9F);
  TEST_ASSERT_TRUE(areOn(f.board.esc()));  // it idles for 5 s
  const Motors motors(kQuad5in);
  for (const float command : f.board.esc()) {
    TEST_ASSERT_EQUAL_FLOAT(motors.command(kQuad5in.speedFlightMin), command);
  }
  f.run(5.0F);  // holds level: thrust of 0.6 weights, and hardly any torque is wanted
  TEST_ASSERT_FLOAT_WITHIN(0.01F, 0.6F * kQuad5in.mass * kGravity,
                           f.software.motors().achieved().thrust);
  f.run(6.0F);  // 15 deg to the right are wanted, and the aircraft is level: it rolls right
  TEST_ASSERT_TRUE(f.software.controller().getControl().torque.x() > 0.02F);
  f.run(8.0F);  // and now to the left
  TEST_ASSERT_TRUE(f.software.controller().getControl().torque.x() < -0.02F);
  TEST_ASSERT_TRUE(f.runUntil(FlightState::Idle, 36.0F));  // 59 s in all
  f.pass();
  TEST_ASSERT_TRUE(areOff(f.board.esc()));
}

void test_a_mission_that_flies_still_needs_gps() {
  FakeFlight f;
  f.board.gps.dead = true;
  f.getReady();
  TEST_ASSERT_FALSE(f.arm());
}

void test_kill_disarm_and_a_lost_imu_stop_the_motors_on_the_stand_too() {
  for (int what = 0; what < 3; ++what) {
    StandFlight f;
    f.start();
    f.run(12.0F);
    if (what == 0) f.board.pilot.kill = true;
    if (what == 1) f.board.pilot.arm = false;
    if (what == 2) {
      f.board.imu.dead = true;
      f.run(0.1F);
    }
    f.tick();
    TEST_ASSERT_TRUE(f.state() == FlightState::Safe);
    TEST_ASSERT_TRUE(areOff(f.board.esc()));
  }
}

}  // namespace

void runStandTests() {
  RUN_TEST(test_the_stand_needs_no_gps_and_goes_through_its_sequence_by_itself);
  RUN_TEST(test_a_mission_that_flies_still_needs_gps);
  RUN_TEST(test_kill_disarm_and_a_lost_imu_stop_the_motors_on_the_stand_too);
}
