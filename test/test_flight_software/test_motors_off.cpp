// Everything that must stop the motors, and how soon.
#include "FakeFlight.h"
#include "suites.h"

using namespace strix;

namespace {

/// One control period. Between two only a disarming writes to the ESCs.
constexpr std::uint64_t kControlPeriod = 2000;  // us

/// Flips a switch in every phase of the control period, then looks at what the ESCs were told.
template <class Flip>
void assertStopsWithinAPeriod(FakeFlight& flight, Flip&& flip) {
  flip(flight.board.pilot);
  const std::uint64_t flipped = flight.board.time();
  const std::size_t before = flight.board.escWrites.size();
  flight.run(0.05F);
  const auto& writes = flight.board.escWrites;
  TEST_ASSERT_TRUE(writes.size() > before);
  for (std::size_t i = before; i < writes.size(); ++i) {
    if (writes[i].time - flipped >= kControlPeriod) TEST_ASSERT_TRUE(areOff(writes[i].commands));
  }
  // And there was such a write in time, not only none to the contrary.
  bool inTime = false;
  for (std::size_t i = before; i < writes.size(); ++i) {
    inTime = inTime || (areOff(writes[i].commands) && writes[i].time - flipped <= kControlPeriod);
  }
  TEST_ASSERT_TRUE(inTime);
  TEST_ASSERT_FALSE(flight.software.motors().armed());
}

/// What may be broken at the moment the pilot wants the motors off.
struct Trouble {
  const char* name;
  void (*begin)(FakeBoard&);
};

const Trouble kTroubles[] = {
    {"nothing", [](FakeBoard&) {}},
    {"IMU dead", [](FakeBoard& b) { b.imu.dead = true; }},
    {"IMU gives NaN", [](FakeBoard& b) { b.imu.reading.accel.setConstant(kNaN); }},
    {"card busy for ever", [](FakeBoard& b) { b.sd.stallUntil(~std::uint64_t{0}); }},
    {"card refuses", [](FakeBoard& b) { b.sd.refuses = true; }},
    {"GPS silent", [](FakeBoard& b) { b.gps.dead = true; }},
    {"everything dead",
     [](FakeBoard& b) {
       b.imu.dead = b.mag.dead = b.alt.dead = b.gps.dead = true;
       b.sd.refuses = true;
     }},
};

template <class Flip>
void assertStopsFromEveryStateInEveryTrouble(Flip&& flip) {
  int phase = 0;
  for (const FlightState state : kMotorStates) {
    for (const Trouble& trouble : kTroubles) {
      FakeFlight flight;
      flight.getReady();
      flight.reach(state);
      flight.run(0.01F + 0.0005F * static_cast<float>(phase++ % 4));
      TEST_ASSERT_TRUE_MESSAGE(flight.state() == state, trouble.name);
      TEST_ASSERT_TRUE(areOn(flight.board.esc()));
      trouble.begin(flight.board);
      assertStopsWithinAPeriod(flight, flip);
    }
  }
}

void test_disarming_reaches_the_escs_within_a_control_period_whatever_is_broken() {
  assertStopsFromEveryStateInEveryTrouble([](PilotSwitches& pilot) { pilot.arm = false; });
}

void test_the_kill_switch_reaches_the_escs_within_a_control_period_whatever_is_broken() {
  assertStopsFromEveryStateInEveryTrouble([](PilotSwitches& pilot) { pilot.kill = true; });
}

void test_a_trouble_that_has_lasted_does_not_delay_disarming_either() {
  // Those that the aircraft flies on with; the card's rings have overflown by then.
  for (const Trouble& trouble : {kTroubles[3], kTroubles[4], kTroubles[5]}) {
    for (int phase = 0; phase < 4; ++phase) {
      FakeFlight flight;
      flight.getReady();
      flight.reach(FlightState::Armed);
      trouble.begin(flight.board);
      flight.run(5.0F + 0.0005F * static_cast<float>(phase));
      TEST_ASSERT_TRUE_MESSAGE(flight.state() == FlightState::Armed, trouble.name);
      assertStopsWithinAPeriod(flight, [](PilotSwitches& pilot) { pilot.arm = false; });
    }
  }
}

void test_disarming_on_the_ground_leads_to_idle_and_in_flight_to_safe() {
  for (const FlightState state : kMotorStates) {
    FakeFlight flight;
    flight.getReady();
    flight.reach(state);
    flight.board.pilot.arm = false;
    flight.tick();
    TEST_ASSERT_TRUE(flight.state() ==
                     (state == FlightState::Armed ? FlightState::Idle : FlightState::Safe));
  }
}

/// As lowFlight(), but that nobody tries to come down without an IMU.
FlightSoftwareConfig neverBlind() {
  FlightSoftwareConfig config = lowFlight();
  config.parameters.blindTime = 0.0F;
  return config;
}

void test_an_imu_silent_for_more_than_20_ms_stops_the_motors() {
  for (const FlightState state : kMotorStates) {
    FakeFlight flight(0, neverBlind());
    flight.getReady();
    flight.reach(state);
    flight.board.imu.dead = true;
    flight.run(0.018F);  // the last reading may be a millisecond old
    TEST_ASSERT_TRUE(flight.state() == state);
    flight.run(0.006F);  // in flight by way of BLIND, for one tick
    TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);
    TEST_ASSERT_TRUE(flight.software.stateMachine().getCriticalErrorFlag());
    flight.run(0.002F);
    TEST_ASSERT_TRUE(areOff(flight.board.esc()));
    TEST_ASSERT_TRUE(flight.logSays("IMU lost"));
  }
}

void test_an_imu_that_gives_only_nan_is_as_good_as_silent() {
  FakeFlight flight(0, neverBlind());
  flight.getReady();
  flight.reach(FlightState::Hold);
  flight.board.imu.reading.gyro.y() = kNaN;
  flight.run(0.028F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);
  TEST_ASSERT_TRUE(areOff(flight.board.esc()));
  TEST_ASSERT_TRUE(flight.logSays("IMU lost"));
}

void test_a_short_silence_of_the_imu_stops_nothing() {
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Hold);
  flight.board.imu.dead = true;
  flight.run(0.015F);
  flight.board.imu.dead = false;
  flight.run(0.1F);
  TEST_ASSERT_FALSE(flight.state() == FlightState::Safe);
  TEST_ASSERT_TRUE(areOn(flight.board.esc()));
}

/// Turns the aircraft steadily and returns the tilt, in deg, at which the motors stopped.
float tiltAtStop(const Vector3f& rate) {
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Takeoff);
  Quaternion attitude;
  const Vector3f turn = rate * toSeconds(flight.passTime);
  for (int i = 0; i < 20'000 && flight.state() != FlightState::Safe; ++i) {
    attitude = normalized(attitude * quaternionExp(turn));
    flight.board.hold(attitude, rate);
    flight.pass();
  }
  TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);
  flight.run(0.002F);
  TEST_ASSERT_TRUE(areOff(flight.board.esc()));
  TEST_ASSERT_TRUE(flight.logSays("tilt past 90 deg: motors off"));
  return arcCosine(cosTilt(attitude)) * kRadToDeg;
}

void test_a_tilt_past_90_deg_stops_the_motors_whichever_way_it_goes() {
  for (const Vector3f& rate : {Vector3f{3.0F, 0.0F, 0.0F}, Vector3f{-3.0F, 0.0F, 0.0F},
                               Vector3f{0.0F, 3.0F, 0.0F}, Vector3f{2.0F, -2.0F, 0.5F}}) {
    // 3 rad/s are 0.17 deg a millisecond; the estimate may lag a reading or two.
    TEST_ASSERT_FLOAT_WITHIN(2.0F, 90.0F, tiltAtStop(rate));
  }
}

void test_leaving_the_fence_turns_home_and_ends_in_safe() {
  FlightSoftwareConfig config = lowFlight();
  config.mission.legCount = 0;
  config.mission.takeoffHoldTime = 60'000'000;
  config.parameters.fenceRadius = 0.5F;
  FakeFlight flight(0, config);
  flight.getReady();
  flight.reach(FlightState::Hold);
  flight.board.gps.reading.latitude += 270;  // 3 m north
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Return, 20.0F));
  TEST_ASSERT_FLOAT_WITHIN(0.1F, 0.5F, flight.software.estimator().state().positionNed.x());
  TEST_ASSERT_TRUE(flight.software.stateMachine().getFailsafeFlag());
  TEST_ASSERT_TRUE(flight.logSays("outside the fence: returning home"));
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Land, 20.0F));
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Safe, 20.0F));  // not IDLE
  flight.run(0.002F);
  TEST_ASSERT_TRUE(areOff(flight.board.esc()));
}

void test_a_sick_estimator_stops_the_motors() {
  FlightSoftwareConfig config = lowFlight();
  believeAnything(config);
  for (const FlightState state : kMotorStates) {
    FakeFlight flight(0, config);
    flight.getReady();
    flight.reach(state);
    flight.board.imu.reading.gyro.y() = 1e30F;
    flight.run(0.006F);
    TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);
    TEST_ASSERT_TRUE(areOff(flight.board.esc()));
  }
}

void test_one_garbled_reading_is_left_out_and_an_imu_that_gives_no_other_is_lost() {
  for (const float garbage : {1e30F, -40.0F}) {  // rad/s; the range is 34.9
    FakeFlight flight(0, neverBlind());
    flight.getReady();
    flight.reach(FlightState::Hold);
    flight.board.imu.reading.gyro.y() = garbage;
    flight.run(0.001F);
    flight.board.hold(Quaternion{});
    flight.run(0.1F);
    TEST_ASSERT_TRUE(flight.state() == FlightState::Hold);
    TEST_ASSERT_TRUE(flight.software.sensors().invalid() > 0);

    flight.board.imu.reading.gyro.y() = garbage;
    flight.run(0.028F);  // 20 ms of silence, a sample before it, two ticks and a pass
    TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);
    TEST_ASSERT_TRUE(areOff(flight.board.esc()));
    TEST_ASSERT_TRUE(
        flight.logSays(kSensorFaultTexts[static_cast<std::size_t>(SensorFault::Invalid)]));
  }
}

void test_a_fault_on_the_way_to_a_sensor_is_named_once_and_again_when_it_comes_back() {
  for (std::size_t i = 0; i < kSensorFaultCount; ++i) {
    const auto fault = static_cast<SensorFault>(i);
    const bool ofTheBoard = fault != SensorFault::ImuClipped && fault != SensorFault::Invalid;
    if (!ofTheBoard) continue;
    const std::string text = kSensorFaultTexts[i];
    FakeFlight flight;
    flight.getReady();
    for (int i = 0; i < 7; ++i) {  // each within a second of the last: one fault
      ++flight.board.faults[fault];
      flight.run(0.3F);
    }
    flight.run(2.0F);
    ++flight.board.faults[fault];
    flight.run(0.2F);
    std::size_t said = 0;
    const std::string log = flight.log();
    for (std::size_t at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) {
      ++said;
    }
    TEST_ASSERT_EQUAL_MESSAGE(2, said, text.c_str());
  }
}

void test_safe_is_left_only_by_arming_anew_on_the_ground() {
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Hold);
  flight.board.pilot.kill = true;
  flight.tick();
  TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);
  flight.board.pilot.kill = false;
  flight.board.pilot.start = false;
  flight.run(5.0F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);  // the arm switch is still on
  flight.board.pilot.arm = false;
  flight.run(1.0F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);

  flight.board.imu.reading.accel *= 0.1F;  // it falls: not the ground
  flight.run(0.1F);
  TEST_ASSERT_FALSE(flight.arm());
  TEST_ASSERT_TRUE(flight.logSays(firstRefusal(prearm::kMoving)));
  flight.board.hold(Quaternion{});
  flight.run(3.0F);
  TEST_ASSERT_TRUE(flight.arm());
  TEST_ASSERT_FALSE(flight.software.stateMachine().getCriticalErrorFlag());
}

void test_the_log_tells_why_the_motors_stopped() {
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Waypoint);
  flight.board.pilot.kill = true;
  flight.run(0.6F);  // two syncs a second bring it to the card without being forced
  const std::vector<std::uint8_t> durable = flight.board.sd.durableFile();
  const std::string text(durable.begin(), durable.end());
  TEST_ASSERT_TRUE(text.find("killed: motors off") != std::string::npos);
}

}  // namespace

void runMotorsOffTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_disarming_reaches_the_escs_within_a_control_period_whatever_is_broken);
  RUN_TEST(test_the_kill_switch_reaches_the_escs_within_a_control_period_whatever_is_broken);
  RUN_TEST(test_a_trouble_that_has_lasted_does_not_delay_disarming_either);
  RUN_TEST(test_disarming_on_the_ground_leads_to_idle_and_in_flight_to_safe);
  RUN_TEST(test_an_imu_silent_for_more_than_20_ms_stops_the_motors);
  RUN_TEST(test_an_imu_that_gives_only_nan_is_as_good_as_silent);
  RUN_TEST(test_a_short_silence_of_the_imu_stops_nothing);
  RUN_TEST(test_a_tilt_past_90_deg_stops_the_motors_whichever_way_it_goes);
  RUN_TEST(test_leaving_the_fence_turns_home_and_ends_in_safe);
  RUN_TEST(test_a_sick_estimator_stops_the_motors);
  RUN_TEST(test_one_garbled_reading_is_left_out_and_an_imu_that_gives_no_other_is_lost);
  RUN_TEST(test_a_fault_on_the_way_to_a_sensor_is_named_once_and_again_when_it_comes_back);
  RUN_TEST(test_safe_is_left_only_by_arming_anew_on_the_ground);
  RUN_TEST(test_the_log_tells_why_the_motors_stopped);
}
