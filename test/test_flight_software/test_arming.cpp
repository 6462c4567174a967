// From power-up to turning motors, and every reason not to get there.
#include <cstring>

#include "FakeFlight.h"
#include "Transmitter.h"
#include "suites.h"

using namespace strix;

namespace {

void test_a_still_aircraft_goes_from_boot_to_idle_in_two_seconds() {
  FakeFlight flight;
  flight.software.setup();
  flight.run(1.9F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Boot);
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Idle, 0.5F));
  TEST_ASSERT_TRUE(flight.logSays("calibrated"));
}

void test_the_estimate_of_a_still_aircraft_stays_where_it_is() {
  FakeFlight flight;
  flight.board.hold(eulerToQuaternion({0.1F, -0.05F, 2.0F}));
  flight.getReady();
  flight.run(5.0F);
  const VehicleState& s = flight.software.estimator().state();
  const EulerAngles e = quaternionToEuler(s.attitude);
  // Noise-free readings: what is left are gyro biases rounded in the means, and the GPS's rounding.
  TEST_ASSERT_FLOAT_WITHIN(2e-3F, 0.1F, e.roll);
  TEST_ASSERT_FLOAT_WITHIN(2e-3F, -0.05F, e.pitch);
  // The board's field points 1.1/15.6 = 0.0704 rad east, the configured declination is 0.07.
  TEST_ASSERT_FLOAT_WITHIN(5e-3F, 2.0F, e.yaw);
  TEST_ASSERT_TRUE(s.positionNed.norm() < 0.1F);
  TEST_ASSERT_TRUE(s.velocityNed.norm() < 0.02F);
  TEST_ASSERT_TRUE(s.rateBody.norm() < 1e-4F);
}

void test_the_arm_switch_arms_and_the_motors_idle() {
  FakeFlight flight;
  flight.getReady();
  TEST_ASSERT_TRUE(flight.arm());
  flight.run(0.01F);
  const float idle = Motors(kQuad5in).command(kQuad5in.speedFlightMin);
  for (const float command : flight.board.esc()) TEST_ASSERT_TRUE(command == idle);
  TEST_ASSERT_TRUE(flight.logSays("armed"));
  TEST_ASSERT_FALSE(flight.logSays("arming refused"));
}

void test_a_switch_held_through_power_up_never_arms() {
  FakeFlight flight;
  flight.board.pilot.arm = true;
  flight.software.setup();
  flight.run(20.0F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);
  for (const auto& write : flight.board.escWrites) TEST_ASSERT_TRUE(areOff(write.commands));
  TEST_ASSERT_FALSE(flight.logSays("arming refused"));  // it was no attempt either
  TEST_ASSERT_TRUE(flight.arm());                       // released and thrown, it does
}

void test_a_switch_thrown_too_early_must_be_thrown_again() {
  FakeFlight flight;
  flight.software.setup();
  flight.run(1.0F);
  flight.board.pilot.arm = true;  // in BOOT
  flight.run(10.0F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);
  TEST_ASSERT_TRUE(flight.logSays("start-up calibration is not done"));
}

/// One reason to refuse, brought about by `spoil` in an aircraft that is otherwise ready.
struct Refusal {
  PreArmSet bit;
  void (*configure)(FlightSoftwareConfig&);
  void (*beforePowerUp)(FakeBoard&);
  void (*spoil)(FakeFlight&);
};

constexpr auto kAsUsual = [](auto&) {};

const Refusal kRefusals[] = {
    {prearm::kImu, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.board.imu.dead = true;
       f.run(0.1F);
     }},
    {prearm::kMag, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.board.mag.dead = true;
       f.run(0.6F);
     }},
    {prearm::kAlt, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.board.alt.dead = true;
       f.run(0.6F);
     }},
    // A device that spoke but had the wrong identity at start.
    {prearm::kImu, kAsUsual, [](FakeBoard& b) { b.found.imu = false; }, kAsUsual},
    {prearm::kMag, kAsUsual, [](FakeBoard& b) { b.found.mag = false; }, kAsUsual},
    {prearm::kAlt, kAsUsual, [](FakeBoard& b) { b.found.alt = false; }, kAsUsual},
    {prearm::kGps, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.board.gps.dead = true;
       f.run(1.2F);
     }},
    {prearm::kGps, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.board.gps.reading.fix = 2;
       f.run(0.2F);
     }},
    {prearm::kGps, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.board.gps.reading.satellites = 5;
       f.run(0.2F);
     }},
    {prearm::kOrigin, [](FlightSoftwareConfig& c) { c.originFixes = 100; }, kAsUsual, kAsUsual},
    {prearm::kEstimator, believeAnything, kAsUsual,
     [](FakeFlight& f) {
       f.board.imu.reading.gyro.x() = 1e30F;  // a finite one: NaN is no reading
       f.run(0.01F);
       f.board.hold(Quaternion{});
       f.run(1.0F);
     }},
    {prearm::kTilt, kAsUsual,
     [](FakeBoard& b) { b.hold(eulerToQuaternion({21.0F * kDegToRad, 0.0F, 0.0F})); }, kAsUsual},
    {prearm::kTilt, kAsUsual,
     [](FakeBoard& b) { b.hold(eulerToQuaternion({0.0F, -21.0F * kDegToRad, 1.0F})); }, kAsUsual},
    {prearm::kMoving, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.board.hold(Quaternion{}, {0.0F, 0.0F, 0.15F});
       f.run(0.1F);
     }},
    {prearm::kMoving, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.board.imu.reading.accel *= 0.93F;  // 0.7 m/s^2 short of g: it falls
       f.run(0.1F);
     }},
    {prearm::kKillSwitch, kAsUsual, kAsUsual, [](FakeFlight& f) { f.board.pilot.kill = true; }},
    {prearm::kStartSwitch, kAsUsual, kAsUsual, [](FakeFlight& f) { f.board.pilot.start = true; }},
    {prearm::kLog, kAsUsual, [](FakeBoard& b) { b.found.card = false; }, kAsUsual},
    {prearm::kRestarted, kAsUsual, [](FakeBoard& b) { b.reset = {reset::kWatchdog, true}; },
     kAsUsual},
    // A set of parameters that was torn: its beginning, and not the rest.
    {prearm::kParameters, kAsUsual, [](FakeBoard& b) { std::memcpy(b.storage.data(), "STRX", 4); },
     kAsUsual},
    {prearm::kBattery, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.board.battery.dead = false;
       f.board.battery.reading.voltage = 3.3F * 6.0F;
       f.run(8.0F);
     }},
    {prearm::kRadio, [](FlightSoftwareConfig& c) { c.parameters.radioProtocol = 1.0F; }, kAsUsual,
     kAsUsual},
    {prearm::kThrottle, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       PilotInput sticks;
       sticks.valid = true;
       sticks.throttle = 0.3F;
       f.board.radio.assign(600, frameOf(sticks));  // one each tick
       f.run(0.1F);
     }},
    {prearm::kKillCommand, kAsUsual, kAsUsual,
     [](FakeFlight& f) { (void)f.software.command({CommandKind::Kill}); }},
    {prearm::kOverrun, kAsUsual, kAsUsual,
     [](FakeFlight& f) {
       f.passTime = 4500;  // every other control tick is missed
       f.run(2.5F);
       f.passTime = 500;
     }},
    {prearm::kMounting, [](FlightSoftwareConfig& c) { c.sensors.mag.sensorToBody(0, 0) = 1.1F; },
     kAsUsual, kAsUsual},
    {prearm::kMission, [](FlightSoftwareConfig& c) { c.mission.legs[0].north = 31.0F; }, kAsUsual,
     kAsUsual},
    {prearm::kMission, [](FlightSoftwareConfig& c) { c.mission.takeoffHeight = -1.0F; }, kAsUsual,
     kAsUsual},
    {prearm::kMission, kAsUsual, [](FakeBoard& b) { b.mission = "takeoff 2 1\nleg 31 0 2 0 1\n"; },
     kAsUsual},
    {prearm::kGyroFilter, [](FlightSoftwareConfig& c) { c.gyroFilter.lowPass = 600.0F; }, kAsUsual,
     kAsUsual},  // beyond Nyquist
    // The estimate left a fence of 3 cm, on the ground, with the GPS.
    {prearm::kFence,
     [](FlightSoftwareConfig& c) {
       c.mission.legCount = 0;
       c.parameters.fenceRadius = 0.03F;
     },
     kAsUsual,
     [](FakeFlight& f) {
       f.board.gps.reading.latitude += 200;  // 2.2 m
       f.run(2.0F);
     }},
};

void test_each_check_that_fails_refuses_arming_and_says_why() {
  PreArmSet tested = prearm::kNotCalibrated | prearm::kLayout;  // have tests of their own
  for (const Refusal& refusal : kRefusals) {
    FlightSoftwareConfig config = lowFlight();
    refusal.configure(config);
    FakeFlight flight(0, config);
    refusal.beforePowerUp(flight.board);
    flight.getReady();
    refusal.spoil(flight);
    const char* sentence = firstRefusal(refusal.bit);
    flight.board.pilot.arm = true;
    flight.run(1.0F);
    TEST_ASSERT_TRUE_MESSAGE(flight.state() == FlightState::Idle, sentence);
    for (const auto& write : flight.board.escWrites) TEST_ASSERT_TRUE(areOff(write.commands));
    TEST_ASSERT_TRUE_MESSAGE(flight.logSays("arming refused"), sentence);
    TEST_ASSERT_TRUE_MESSAGE(flight.logSays(sentence), sentence);
    tested |= refusal.bit;
  }
  TEST_ASSERT_EQUAL_HEX32((PreArmSet{1} << kPreArmChecks.size()) - 1U, tested);
}

void test_rotors_that_cannot_hold_the_aircraft_level_never_arm() {
  static const Vehicle unbalanced = [] {
    Vehicle vehicle = kQuad5in;
    for (Rotor& rotor : vehicle.rotors) rotor.x = 0.08F;  // all of them in front
    return vehicle;
  }();
  FakeFlight flight(0, flightConfig(unbalanced, kQuad5inGains, kLowMission, 0.07F));
  flight.getReady();
  TEST_ASSERT_FALSE(flight.arm());
  TEST_ASSERT_TRUE(flight.logSays(firstRefusal(prearm::kLayout)));
  for (const auto& write : flight.board.escWrites) TEST_ASSERT_TRUE(areOff(write.commands));
}

void test_arming_in_boot_is_refused_and_says_why() {
  FakeFlight flight;
  flight.software.setup();
  flight.run(1.0F);
  TEST_ASSERT_FALSE(flight.arm());
  TEST_ASSERT_TRUE(flight.logSays(firstRefusal(prearm::kNotCalibrated)));
}

void test_a_dead_device_that_keeps_the_aircraft_in_boot_is_named() {
  FakeFlight flight;
  flight.board.mag.dead = true;
  flight.board.found.mag = false;
  flight.software.setup();
  flight.run(10.0F);
  TEST_ASSERT_FALSE(flight.arm());
  TEST_ASSERT_TRUE(flight.state() == FlightState::Boot);
  TEST_ASSERT_TRUE(flight.logSays(firstRefusal(prearm::kMag)));
}

void test_a_card_that_fails_refuses_arming() {
  FakeFlight flight;
  flight.getReady();
  flight.board.sd.refuses = true;
  flight.run(2.0F);  // 20 failures in a row at 20 Hz
  TEST_ASSERT_FALSE(flight.arm());
}

void test_when_the_reason_is_gone_the_next_throw_arms() {
  FakeFlight flight;
  flight.getReady();
  flight.board.gps.dead = true;
  flight.run(1.5F);
  TEST_ASSERT_FALSE(flight.arm());
  flight.board.gps.dead = false;
  flight.run(1.0F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);  // not by itself
  TEST_ASSERT_TRUE(flight.arm());
}

void test_an_armed_aircraft_that_nobody_starts_disarms_after_30_s() {
  FakeFlight flight;
  flight.getReady();
  TEST_ASSERT_TRUE(flight.arm());
  flight.run(29.9F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Armed);
  flight.run(0.2F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);
  TEST_ASSERT_TRUE(areOff(flight.board.esc()));
}

void test_a_whole_mission_visits_every_state_and_ends_with_motors_off() {
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Takeoff);
  for (const FlightState next : {FlightState::Hold, FlightState::Waypoint, FlightState::Hold,
                                 FlightState::Land, FlightState::Idle}) {
    TEST_ASSERT_TRUE(flight.runUntil(next, 10.0F));
  }
  flight.run(0.002F);
  TEST_ASSERT_TRUE(areOff(flight.board.esc()));
  TEST_ASSERT_TRUE(flight.logSays("landed: disarmed"));
  TEST_ASSERT_FALSE(flight.software.stateMachine().getCriticalErrorFlag());
}

}  // namespace

void runArmingTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_still_aircraft_goes_from_boot_to_idle_in_two_seconds);
  RUN_TEST(test_the_estimate_of_a_still_aircraft_stays_where_it_is);
  RUN_TEST(test_the_arm_switch_arms_and_the_motors_idle);
  RUN_TEST(test_a_switch_held_through_power_up_never_arms);
  RUN_TEST(test_a_switch_thrown_too_early_must_be_thrown_again);
  RUN_TEST(test_each_check_that_fails_refuses_arming_and_says_why);
  RUN_TEST(test_rotors_that_cannot_hold_the_aircraft_level_never_arm);
  RUN_TEST(test_arming_in_boot_is_refused_and_says_why);
  RUN_TEST(test_a_dead_device_that_keeps_the_aircraft_in_boot_is_named);
  RUN_TEST(test_a_card_that_fails_refuses_arming);
  RUN_TEST(test_when_the_reason_is_gone_the_next_throw_arms);
  RUN_TEST(test_an_armed_aircraft_that_nobody_starts_disarms_after_30_s);
  RUN_TEST(test_a_whole_mission_visits_every_state_and_ends_with_motors_off);
}
