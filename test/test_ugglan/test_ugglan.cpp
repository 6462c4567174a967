// Ugglan's own pipeline: arming, rates, and that it flies by the sticks.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "AssertNear.h"
#include "UgglanBench.h"

void setUp() {}
void tearDown() {}

using namespace strix;

namespace {

constexpr float kDeg = kDegToRad;

/// The bench is about 400 KB, most of it the log's rings.
std::unique_ptr<UgglanBench> bench(Micros start = 0) {
  return std::make_unique<UgglanBench>(start);
}

void test_it_arms_on_the_edge_and_idles_until_the_throttle_is_raised() {
  const auto b = bench();
  b->getReady();
  TEST_ASSERT_TRUE(b->arm());
  b->run(0.1F);
  const float idle = b->software.motors().command(kUgglanQ450.speedFlightMin);
  for (const float command : b->board.esc()) TEST_ASSERT_FLOAT_WITHIN(1.0F, idle, command);
  TEST_ASSERT_TRUE(b->logSays("armed"));
}

void test_it_refuses_to_arm_for_each_reason_and_says_it() {
  struct Case {
    void (*make)(UgglanBench&);
    const char* said;
  };
  const Case cases[] = {
      {[](UgglanBench& b) { b.sticks.throttle = 0.1F; }, "throttle is not low"},
      {[](UgglanBench& b) { b.sticks.valid = false; }, "no sticks"},
      {[](UgglanBench& b) { b.board.pilot.kill = true; }, "kill switch is on"},
      {[](UgglanBench& b) { b.board.imu.dead = true; }, "IMU gives no data"},
      {[](UgglanBench& b) { b.board.hold(Quaternion{}, {0.0F, 0.3F, 0.0F}); }, "is moving"},
      {[](UgglanBench& b) {
         const float roll = 40.0F * kDeg;
         b.board.hold(eulerToQuaternion({roll, 0.0F, 0.0F}), {2.0F * roll, 0.0F, 0.0F});
         b.run(0.5F);  // the gyro's turn
         b.board.hold(eulerToQuaternion({roll, 0.0F, 0.0F}));
       },
       "tilted more than 20 deg"},
  };
  for (const Case& c : cases) {
    const auto b = bench();
    b->getReady();
    c.make(*b);
    b->run(0.1F);
    TEST_ASSERT_FALSE_MESSAGE(b->arm(), c.said);
    TEST_ASSERT_TRUE(b->off());
    TEST_ASSERT_TRUE_MESSAGE(b->logSays(c.said), c.said);
  }
  const auto b = bench();  // and before the calibration is done
  b->software.setup();
  b->run(0.5F);
  TEST_ASSERT_FALSE(b->arm());
  TEST_ASSERT_TRUE(b->logSays("calibration is not done"));
}

void test_a_switch_held_through_power_up_arms_nothing() {
  const auto b = bench();
  b->board.pilot.arm = true;
  b->software.setup();
  b->run(6.0F);
  TEST_ASSERT_TRUE(b->software.calibrated());
  TEST_ASSERT_FALSE(b->software.motors().armed());
  TEST_ASSERT_TRUE(b->off());
}

void test_anything_that_forbids_flying_stops_the_motors_in_the_same_pass_and_for_good() {
  struct Case {
    void (*happens)(UgglanBench&);
    void (*passes)(UgglanBench&);
    float after;  ///< s at most
  };
  const Case cases[] = {
      {[](UgglanBench& b) { b.board.pilot.kill = true; },
       [](UgglanBench& b) { b.board.pilot.kill = false; }, 0.0F},
      {[](UgglanBench& b) { b.sticks.valid = false; },
       [](UgglanBench& b) { b.sticks.valid = true; }, 0.007F},
      // A lost IMU is known by its silence, 20 ms.
      {[](UgglanBench& b) { b.board.imu.dead = true; },
       [](UgglanBench& b) { b.board.imu.dead = false; }, 0.023F},
      {[](UgglanBench& b) { b.board.pilot.arm = false; }, [](UgglanBench& /*b*/) {}, 0.0F},
  };
  for (const Case& c : cases) {
    const auto b = bench();
    b->getReady();
    TEST_ASSERT_TRUE(b->arm());
    b->sticks.throttle = 0.6F;
    b->run(0.5F);
    TEST_ASSERT_FALSE(b->off());
    c.happens(*b);
    b->run(c.after);
    b->pass();
    TEST_ASSERT_TRUE(b->off());
    c.passes(*b);
    b->sticks.throttle = 0.0F;
    b->run(0.5F);
    TEST_ASSERT_TRUE(b->off());
    TEST_ASSERT_TRUE(b->arm());  // by a new edge
  }
}

void test_past_90_deg_the_motors_stop() {
  const auto b = bench();
  b->getReady();
  TEST_ASSERT_TRUE(b->arm());
  b->board.hold(eulerToQuaternion({100.0F * kDeg, 0.0F, 0.0F}), {4.0F, 0.0F, 0.0F});
  b->run(0.6F);  // 2.4 rad by the gyro, of which gravity gives back a tenth
  TEST_ASSERT_TRUE(b->off());
  TEST_ASSERT_TRUE(b->logSays("tilted past 90 deg"));
}

void test_it_commands_at_50_hz_and_takes_pressure_at_10_and_esc_status_at_5() {
  const auto b = bench(0xFFFFFFFFU - 6'000'000U);  // the clock wraps on the way
  b->getReady();
  b->board.escWrites.clear();
  const std::uint32_t alt = b->board.alt.taken;
  const std::uint32_t esc = b->board.escs.taken;
  const std::uint32_t imu = b->board.imu.taken;
  b->run(10.0F);
  TEST_ASSERT_UINT32_WITHIN(1, 500, static_cast<std::uint32_t>(b->board.escWrites.size()));
  TEST_ASSERT_UINT32_WITHIN(1, 100, b->board.alt.taken - alt);
  TEST_ASSERT_UINT32_WITHIN(1, 50, b->board.escs.taken - esc);
  TEST_ASSERT_TRUE(b->board.imu.taken - imu > 9000);  // each that a pass can see
}

void test_the_last_pressure_and_voltage_are_held() {
  const auto b = bench();
  b->getReady();
  b->board.alt.reading.pressure -= 24.0F;  // 2 m up
  b->run(0.25F);
  const float height = b->software.height();
  TEST_ASSERT_FLOAT_WITHIN(0.1F, 2.0F, height);
  b->board.alt.dead = true;
  b->board.escs.dead = true;
  b->run(1.0F);
  TEST_ASSERT_EQUAL_FLOAT(height, b->software.height());
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, 11.4F, b->software.voltage());
}

/// The wrench asked for in the air by an aircraft that hangs still at this attitude.
Wrench askedAt(const Quaternion& attitude, const PilotInput& sticks) {
  const auto b = bench();
  b->getReady();
  TEST_ASSERT_TRUE(b->arm());
  b->sticks = sticks;
  b->sticks.valid = true;
  b->board.hold(attitude);
  b->run(0.3F);
  TEST_ASSERT_TRUE(b->software.controlling());
  return b->software.wanted();
}

void test_the_sticks_and_the_attitude_drive_the_right_way() {
  PilotInput sticks;
  sticks.throttle = 0.6F;
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 12.0F, askedAt({}, sticks).thrust);
  sticks.roll = 0.5F;
  TEST_ASSERT_TRUE(askedAt({}, sticks).torque.x() > 0.02F);  // roll right
  sticks = {};
  sticks.throttle = 0.6F;
  sticks.pitch = 0.5F;                                       // pulled back
  TEST_ASSERT_TRUE(askedAt({}, sticks).torque.y() > 0.02F);  // nose up
  sticks = {};
  sticks.throttle = 0.6F;
  sticks.yaw = 0.3F;
  TEST_ASSERT_TRUE(askedAt({}, sticks).torque.z() > 0.02F);  // nose right
}

void test_on_the_ground_the_law_rests_and_remembers_nothing() {
  const auto b = bench();
  b->getReady();
  TEST_ASSERT_TRUE(b->arm());
  b->sticks.roll = 1.0F;
  b->sticks.throttle = 0.2F;
  b->run(3.0F);
  assertNear(0.0F, Vector3f(0.0F, 0.0F, 0.0F), b->software.wanted().torque);
  assertNear(0.0F, Vector3f(0.0F, 0.0F, 0.0F), b->software.law().integral());
  b->sticks.throttle = 0.6F;
  b->run(0.1F);
  TEST_ASSERT_TRUE(b->software.wanted().torque.x() > 0.02F);
  b->sticks.throttle = 0.0F;  // pulled down in the air: it goes on
  b->run(1.0F);
  TEST_ASSERT_TRUE(b->software.controlling());
  b->run(1.5F);  // for so long nobody falls
  TEST_ASSERT_FALSE(b->software.controlling());
  assertNear(0.0F, Vector3f(0.0F, 0.0F, 0.0F), b->software.law().integral());
}

/// Roll, pitch and turn in 3 s in the air with these sticks, the nose at `heading` at the start.
EulerAngles flown(float heading, float roll, float pitch, float yaw, double seconds) {
  const auto b = bench();
  b->getReady(eulerToQuaternion({0.0F, 0.0F, heading}));
  TEST_ASSERT_TRUE(b->arm());
  RigidQuad quad(kUgglanQ450, static_cast<double>(heading));
  b->sticks.throttle = UgglanBench::hoverThrottle();
  for (int k = 0; k < 500; ++k) b->fly(quad);
  b->sticks.roll = roll;
  b->sticks.pitch = pitch;
  b->sticks.yaw = yaw;
  for (int k = 0; k < static_cast<int>(seconds * 1e3); ++k) b->fly(quad);
  EulerAngles e = quaternionToEuler(quad.state().attitude);
  e.yaw = wrapAngle(e.yaw - heading);
  return e;
}

void test_it_flies_the_attitude_of_the_sticks_alike_at_every_heading() {
  for (const float heading : {0.0F, 90.0F * kDeg, 180.0F * kDeg, -135.0F * kDeg}) {
    const float stick = 10.0F / 22.5F;
    const EulerAngles roll = flown(heading, stick, 0.0F, 0.0F, 1.5);
    // Up to 1.4 deg of overshoot by the integral; and 1.5 s of 10 deg, in which an accelerometer
    // under a thrust calls the body's own axis down, pull 10 deg 1.5/6, at most, out of the filter.
    TEST_ASSERT_FLOAT_WITHIN(1.95F * kDeg, 11.95F * kDeg, roll.roll);
    TEST_ASSERT_FLOAT_WITHIN(0.5F * kDeg, 0.0F, roll.pitch);
    TEST_ASSERT_FLOAT_WITHIN(1.0F * kDeg, 0.0F, roll.yaw);
    const EulerAngles pitch = flown(heading, 0.0F, -stick, 0.0F, 1.5);
    TEST_ASSERT_FLOAT_WITHIN(1.95F * kDeg, -11.95F * kDeg, pitch.pitch);
    TEST_ASSERT_FLOAT_WITHIN(0.5F * kDeg, 0.0F, pitch.roll);
    const EulerAngles yaw = flown(heading, 0.0F, 0.0F, 0.2F, 3.0);
    TEST_ASSERT_FLOAT_WITHIN(10.0F * kDeg, 108.0F * kDeg, yaw.yaw);  // 36 deg/s for 3 s
    TEST_ASSERT_FLOAT_WITHIN(1.0F * kDeg, 0.0F, yaw.roll);
  }
}

void test_readings_that_are_no_numbers_neither_arm_nor_keep_it_flying() {
  const auto b = bench();
  b->getReady();
  TEST_ASSERT_TRUE(b->arm());
  b->sticks.throttle = 0.6F;
  b->run(0.3F);
  b->board.imu.reading.gyro.x() = std::numeric_limits<float>::quiet_NaN();
  b->run(0.05F);  // none is taken: the IMU is silent
  TEST_ASSERT_TRUE(b->off());
  b->sticks.throttle = 0.0F;
  TEST_ASSERT_FALSE(b->arm());
}

void test_the_log_has_what_a_flight_is_judged_by() {
  const auto b = bench();
  b->getReady();
  TEST_ASSERT_TRUE(b->arm());
  b->run(1.0F);
  const std::string log = b->log();
  for (const char* topic : {"sensor_combined", "sensor_mag", "sensor_baro", "esc_status",
                            "vehicle_attitude", "vehicle_angular_velocity", "wrench_setpoint",
                            "wrench_achieved", "actuator_outputs", "manual_control_switches"}) {
    TEST_ASSERT_TRUE_MESSAGE(log.find(topic) != std::string::npos, topic);
  }
  TEST_ASSERT_EQUAL_UINT32(0, b->software.logger().dropped());
}

void test_a_card_that_stalls_holds_nothing_up() {
  const auto b = bench();
  b->getReady();
  TEST_ASSERT_TRUE(b->arm());
  b->board.sd.stallUntil(b->board.time() + 1'000'000);
  b->board.escWrites.clear();
  b->run(1.0F);
  TEST_ASSERT_UINT32_WITHIN(1, 50, static_cast<std::uint32_t>(b->board.escWrites.size()));
}

}  // namespace

int main() {
  UNITY_BEGIN();
  RUN_TEST(test_it_arms_on_the_edge_and_idles_until_the_throttle_is_raised);
  RUN_TEST(test_it_refuses_to_arm_for_each_reason_and_says_it);
  RUN_TEST(test_a_switch_held_through_power_up_arms_nothing);
  RUN_TEST(test_anything_that_forbids_flying_stops_the_motors_in_the_same_pass_and_for_good);
  RUN_TEST(test_past_90_deg_the_motors_stop);
  RUN_TEST(test_it_commands_at_50_hz_and_takes_pressure_at_10_and_esc_status_at_5);
  RUN_TEST(test_the_last_pressure_and_voltage_are_held);
  RUN_TEST(test_the_sticks_and_the_attitude_drive_the_right_way);
  RUN_TEST(test_on_the_ground_the_law_rests_and_remembers_nothing);
  RUN_TEST(test_it_flies_the_attitude_of_the_sticks_alike_at_every_heading);
  RUN_TEST(test_readings_that_are_no_numbers_neither_arm_nor_keep_it_flying);
  RUN_TEST(test_the_log_has_what_a_flight_is_judged_by);
  RUN_TEST(test_a_card_that_stalls_holds_nothing_up);
  UNITY_END();
  return 0;
}
