// What telemetry and console may ask for, and what a start tells of the one before.
#include <cstring>
#include <string>

#include "FakeFlight.h"
#include "Transmitter.h"
#include "suites.h"

using namespace strix;

namespace {

VehicleCommand ask(CommandKind kind) {
  VehicleCommand command;
  command.kind = kind;
  return command;
}

bool accepts(FakeFlight& flight, const VehicleCommand& command) {
  return flight.software.command(command) == nullptr;
}
bool accepts(FakeFlight& flight, CommandKind kind) { return accepts(flight, ask(kind)); }

void test_a_command_arms_like_a_switch_and_is_refused_in_the_same_words() {
  FakeFlight flight;
  flight.software.setup();
  flight.run(1.0F);
  TEST_ASSERT_EQUAL_STRING(firstRefusal(prearm::kNotCalibrated),
                           flight.software.command(ask(CommandKind::Arm)));
  flight.run(4.7F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::Arm));
  flight.tick();
  TEST_ASSERT_TRUE(flight.state() == FlightState::Armed);
  flight.run(1.0F);  // with the wired switch off
  TEST_ASSERT_TRUE(flight.state() == FlightState::Armed);
  TEST_ASSERT_FALSE(accepts(flight, CommandKind::Arm));
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::Disarm));
  flight.tick();
  TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);
  TEST_ASSERT_TRUE(flight.logSays("arming refused"));
}

void test_a_commanded_flight_takes_off_holds_goes_on_returns_and_lands() {
  FlightSoftwareConfig config = lowFlight();
  config.mission.takeoffHoldTime = 60'000'000;
  FakeFlight flight(0, config);
  flight.getReady();
  TEST_ASSERT_FALSE(accepts(flight, CommandKind::Start));  // not armed
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::Arm));
  flight.tick();
  TEST_ASSERT_FALSE(accepts(flight, CommandKind::Land));
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::Start));
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Hold, 10.0F));
  TEST_ASSERT_FALSE(accepts(flight, CommandKind::Disarm));  // in the air
  flight.tick();
  TEST_ASSERT_TRUE(flight.state() == FlightState::Hold);
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::Return));
  flight.tick();
  TEST_ASSERT_TRUE(flight.state() == FlightState::Return);
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::Hold));
  flight.tick();
  TEST_ASSERT_TRUE(flight.state() == FlightState::Hold);
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::Land));
  flight.tick();
  TEST_ASSERT_TRUE(flight.state() == FlightState::Land);
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Idle, 20.0F));  // no hazard: not SAFE
}

void test_a_commanded_kill_stops_the_motors_in_the_next_tick_from_every_state_and_stays() {
  for (const FlightState state : kMotorStates) {
    FakeFlight flight;
    flight.getReady();
    flight.reach(state);
    TEST_ASSERT_FALSE(accepts(flight, CommandKind::KillOff));  // its motors turn
    TEST_ASSERT_TRUE(accepts(flight, CommandKind::Kill));
    flight.tick();
    TEST_ASSERT_TRUE(flight.state() == FlightState::Safe);
    TEST_ASSERT_TRUE(areOff(flight.board.esc()));
    TEST_ASSERT_FALSE(flight.arm());
    TEST_ASSERT_TRUE(accepts(flight, CommandKind::KillOff));
    TEST_ASSERT_TRUE(flight.arm());
  }
}

void test_a_parameter_is_set_within_its_range_and_its_lock_and_acts() {
  FakeFlight flight;
  flight.board.hold(eulerToQuaternion({8.0F * kDegToRad, 0.0F, 0.0F}));
  flight.getReady();
  VehicleCommand set = ask(CommandKind::SetParameter);
  set.index = static_cast<std::uint16_t>(findParameter("ARM_TILT"));
  set.values[0] = 90.0F;
  TEST_ASSERT_FALSE(accepts(flight, set));
  TEST_ASSERT_EQUAL_FLOAT(20.0F, flight.software.parameters().armTilt);
  set.values[0] = 5.0F;
  TEST_ASSERT_TRUE(accepts(flight, set));
  flight.tick();
  TEST_ASSERT_FALSE(flight.arm());
  TEST_ASSERT_TRUE(flight.logSays(firstRefusal(prearm::kTilt)));
  set.values[0] = 20.0F;
  TEST_ASSERT_TRUE(accepts(flight, set));
  flight.tick();
  flight.reach(FlightState::Hold);
  set.values[0] = 10.0F;
  TEST_ASSERT_FALSE(accepts(flight, set));  // in the air
  set.index = static_cast<std::uint16_t>(findParameter("BAT_LOW"));
  set.values[0] = 3.4F;
  TEST_ASSERT_TRUE(accepts(flight, set));
  set.index = static_cast<std::uint16_t>(kParameterCount);
  TEST_ASSERT_FALSE(accepts(flight, set));
}

void test_saved_parameters_are_there_after_the_next_start() {
  FlightSoftwareConfig config = lowFlight();
  config.parameters.returnHeight = 7.0F;
  FakeFlight first(0, config);
  first.getReady();
  VehicleCommand set = ask(CommandKind::SetParameter);
  set.index = static_cast<std::uint16_t>(findParameter("FENCE_RADIUS"));
  set.values[0] = 12.0F;
  TEST_ASSERT_TRUE(accepts(first, set));
  TEST_ASSERT_NULL(first.software.saveParameters());
  first.run(2.0F);
  FakeFlight second;
  second.board.storage = first.board.storage;
  second.getReady();
  TEST_ASSERT_EQUAL_FLOAT(12.0F, second.software.parameters().fenceRadius);
  TEST_ASSERT_EQUAL_FLOAT(7.0F, second.software.parameters().returnHeight);
  TEST_ASSERT_TRUE(second.arm());
  TEST_ASSERT_NOT_NULL(second.software.saveParameters());  // with the motors on
}

/// Uploads take-off and as many legs as asked, and says whether that was taken.
bool upload(FakeFlight& flight, std::uint16_t legs, float north) {
  if (!accepts(flight, CommandKind::MissionClear)) return false;
  for (std::uint16_t i = 0; i < legs; ++i) {
    VehicleCommand leg = ask(CommandKind::MissionLeg);
    leg.index = i;
    leg.values = {north, 0.0F, 0.3F};
    leg.time = 100'000;
    if (!accepts(flight, leg)) return false;
  }
  VehicleCommand done = ask(CommandKind::MissionDone);
  done.index = legs;
  done.values[0] = 0.3F;
  done.detail = static_cast<std::uint8_t>(MissionEnd::Land);
  return accepts(flight, done);
}

void test_an_uploaded_mission_is_flown_and_a_bad_one_changes_nothing() {
  FakeFlight flight;
  flight.getReady();
  TEST_ASSERT_FALSE(upload(flight, 2, 31.0F));  // outside the fence
  TEST_ASSERT_FALSE(upload(flight, Mission::kMaxLegs + 1, 0.1F));
  VehicleCommand stray = ask(CommandKind::MissionLeg);
  stray.index = 7;
  TEST_ASSERT_FALSE(accepts(flight, stray));
  TEST_ASSERT_EQUAL_STRING("low", flight.software.mission().name);
  TEST_ASSERT_TRUE(upload(flight, 3, 0.1F));
  TEST_ASSERT_EQUAL(3, flight.software.mission().legCount);
  flight.reach(FlightState::Takeoff);
  TEST_ASSERT_FALSE(upload(flight, 1, 0.1F));  // in the air
  int legs = 0;
  FlightState before = FlightState::Takeoff;
  for (int i = 0; i < 60'000 && flight.state() != FlightState::Idle; ++i) {
    flight.pass();
    if (flight.state() == FlightState::Waypoint && before != FlightState::Waypoint) ++legs;
    before = flight.state();
  }
  TEST_ASSERT_EQUAL(3, legs);
}

VehicleCommand motorTest(std::uint16_t motor, float share, std::uint32_t time) {
  VehicleCommand test = ask(CommandKind::MotorTest);
  test.index = motor;
  test.values[0] = share;
  test.time = time;
  return test;
}

/// How many motors are told to turn; -1: another than the one asked for.
int turning(const FakeFlight& flight, std::size_t motor) {
  int count = 0;
  for (std::size_t i = 0; i < kMotorCount; ++i) {
    if (flight.board.esc()[i] == kQuad5in.commandOff) continue;
    if (i != motor) return -1;
    ++count;
  }
  return count;
}

void test_a_motor_test_turns_one_motor_for_its_time_and_anything_ends_it() {
  for (std::uint16_t motor = 0; motor < kMotorCount; ++motor) {
    FakeFlight flight;
    flight.getReady();
    TEST_ASSERT_TRUE(accepts(flight, motorTest(motor, 0.2F, 500'000)));
    flight.tick();
    TEST_ASSERT_TRUE(flight.state() == FlightState::MotorTest);
    TEST_ASSERT_EQUAL(1, turning(flight, motor));
    const float range = kQuad5in.commandMax - kQuad5in.commandOff;
    TEST_ASSERT_FLOAT_WITHIN(0.1F, kQuad5in.commandOff + 0.2F * range, flight.board.esc()[motor]);
    flight.run(0.49F);
    TEST_ASSERT_EQUAL(1, turning(flight, motor));
    flight.run(0.02F);
    TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);
    TEST_ASSERT_TRUE(areOff(flight.board.esc()));
  }
  void (*const ends[])(FakeFlight&) = {
      [](FakeFlight& f) { f.board.pilot.kill = true; },
      [](FakeFlight& f) { f.board.pilot.arm = true; },
      [](FakeFlight& f) { f.board.imu.dead = true; },
      [](FakeFlight& f) { TEST_ASSERT_TRUE(accepts(f, CommandKind::Disarm)); },
      [](FakeFlight& f) { TEST_ASSERT_TRUE(accepts(f, motorTest(0, 0.0F, 0))); },
  };
  for (const auto& end : ends) {
    FakeFlight flight;
    flight.getReady();
    TEST_ASSERT_TRUE(accepts(flight, motorTest(0, 0.2F, 5'000'000)));
    flight.run(0.1F);
    TEST_ASSERT_EQUAL(1, turning(flight, 0));
    end(flight);
    flight.run(0.025F);  // an IMU is missed after 20 ms
    TEST_ASSERT_TRUE(areOff(flight.board.esc()));
    TEST_ASSERT_FALSE(flight.software.motors().armed());
  }
}

void test_a_motor_test_is_refused_in_flight_beyond_its_limits_and_after_a_kill() {
  FakeFlight flight;
  flight.getReady();
  TEST_ASSERT_FALSE(accepts(flight, motorTest(0, 0.31F, 100'000)));
  TEST_ASSERT_FALSE(accepts(flight, motorTest(0, kNaN, 100'000)));
  TEST_ASSERT_FALSE(accepts(flight, motorTest(4, 0.1F, 100'000)));
  TEST_ASSERT_FALSE(accepts(flight, motorTest(0, 0.1F, 10'000'001)));
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::Kill));
  flight.tick();
  TEST_ASSERT_FALSE(accepts(flight, motorTest(0, 0.1F, 100'000)));
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::KillOff));
  flight.tick();
  TEST_ASSERT_TRUE(flight.arm());
  TEST_ASSERT_FALSE(accepts(flight, motorTest(0, 0.1F, 100'000)));
  flight.board.pilot.arm = false;
  flight.run(0.5F);  // no refused wish comes true later
  TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);
  for (int i = 0; i < 4; ++i) TEST_ASSERT_EQUAL(0, turning(flight, 4));
}

void test_calibrating_again_begins_anew_and_only_on_the_ground() {
  FakeFlight flight;
  flight.getReady();
  flight.board.gyroBias.x() += 0.02F;  // it has become warm
  flight.board.hold(Quaternion{});
  TEST_ASSERT_TRUE(accepts(flight, CommandKind::Calibrate));
  flight.tick();
  TEST_ASSERT_TRUE(flight.state() == FlightState::Boot);
  TEST_ASSERT_FALSE(flight.arm());
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Idle, 3.0F));
  flight.run(3.0F);
  TEST_ASSERT_FLOAT_WITHIN(1e-3F, 0.0F, flight.software.estimator().state().rateBody.norm());
  flight.board.pilot.arm = false;
  flight.tick();
  TEST_ASSERT_TRUE(flight.arm());
  TEST_ASSERT_FALSE(accepts(flight, CommandKind::Calibrate));
}

void test_a_restart_in_flight_comes_back_disarmed_says_so_and_never_arms() {
  FakeFlight flight;
  flight.board.reset = {reset::kWatchdog, true};
  flight.board.pilot.arm = true;  // as the switch was
  flight.software.setup();
  flight.run(6.0F);
  TEST_ASSERT_FALSE(flight.software.motors().armed());
  TEST_ASSERT_FALSE(flight.arm());
  TEST_ASSERT_FALSE(accepts(flight, CommandKind::Arm));
  for (const auto& write : flight.board.escWrites) TEST_ASSERT_TRUE(areOff(write.commands));
  TEST_ASSERT_TRUE(flight.logSays("restarted while the motors were on: disarmed"));
}

void test_the_board_remembers_whether_the_motors_are_on_and_its_watchdog_sees_each_tick() {
  FakeFlight flight;
  flight.getReady();
  TEST_ASSERT_FALSE(flight.board.motorsRemembered);
  TEST_ASSERT_TRUE(flight.arm());
  TEST_ASSERT_TRUE(flight.board.motorsRemembered);
  const std::uint32_t fed = flight.board.watchdogFed;
  const std::size_t writes = flight.board.escWrites.size();
  flight.run(1.0F);
  TEST_ASSERT_EQUAL(flight.board.escWrites.size() - writes, flight.board.watchdogFed - fed);
  TEST_ASSERT_INT_WITHIN(1, 500, flight.board.watchdogFed - fed);
  flight.board.pilot.kill = true;
  flight.tick();
  TEST_ASSERT_FALSE(flight.board.motorsRemembered);
}

void test_a_critical_error_saves_the_log_without_stopping_the_loop_and_says_whether_it_could() {
  for (const bool dead : {false, true}) {
    FakeFlight flight;
    flight.getReady();
    flight.reach(FlightState::Hold);
    if (dead) flight.board.sd.refuses = true;
    flight.board.pilot.kill = true;
    flight.tick();
    TEST_ASSERT_TRUE(areOff(flight.board.esc()));
    const std::uint32_t fed = flight.board.watchdogFed;
    flight.run(7.0F);
    TEST_ASSERT_INT_WITHIN(1, 3500, flight.board.watchdogFed - fed);
    std::string said;
    std::uint32_t place = 0;
    while (const TextHistory::Text* text = flight.software.texts().next(place)) {
      said += std::string(text->text()) + "\n";
    }
    TEST_ASSERT_EQUAL(!dead, said.find("log saved") != std::string::npos);
    TEST_ASSERT_EQUAL(dead, said.find("log not saved") != std::string::npos);
  }
}

void test_a_transmitter_arms_with_the_throttle_low_and_its_loss_disarms_on_the_ground() {
  FlightSoftwareConfig config = lowFlight();
  config.parameters.radioProtocol = 1.0F;
  FakeFlight flight(0, config);
  PilotInput sticks;
  sticks.valid = true;
  const auto transmit = [&flight, &sticks](float seconds) {
    for (int i = 0; i < static_cast<int>(seconds / 0.007F); ++i) {
      flight.board.radio.push_back(frameOf(sticks));
      flight.run(0.007F);
    }
  };
  flight.software.setup();
  TEST_ASSERT_TRUE(flight.board.radioProtocol == RadioProtocol::Ibus);
  sticks.throttle = 0.4F;
  transmit(6.0F);
  sticks.arm = true;
  transmit(0.2F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);
  TEST_ASSERT_TRUE(flight.logSays(firstRefusal(prearm::kThrottle)));
  sticks.throttle = 0.0F;
  sticks.arm = false;
  transmit(0.2F);
  sticks.arm = true;
  transmit(0.2F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Armed);
  flight.run(0.45F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Armed);  // RC_TIMEOUT is 0.5 s
  flight.run(0.1F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Idle);
  TEST_ASSERT_TRUE(flight.logSays("transmitter lost"));
}

}  // namespace

void runCommandTests() {
  RUN_TEST(test_a_command_arms_like_a_switch_and_is_refused_in_the_same_words);
  RUN_TEST(test_a_commanded_flight_takes_off_holds_goes_on_returns_and_lands);
  RUN_TEST(test_a_commanded_kill_stops_the_motors_in_the_next_tick_from_every_state_and_stays);
  RUN_TEST(test_a_parameter_is_set_within_its_range_and_its_lock_and_acts);
  RUN_TEST(test_saved_parameters_are_there_after_the_next_start);
  RUN_TEST(test_an_uploaded_mission_is_flown_and_a_bad_one_changes_nothing);
  RUN_TEST(test_a_motor_test_turns_one_motor_for_its_time_and_anything_ends_it);
  RUN_TEST(test_a_motor_test_is_refused_in_flight_beyond_its_limits_and_after_a_kill);
  RUN_TEST(test_calibrating_again_begins_anew_and_only_on_the_ground);
  RUN_TEST(test_a_restart_in_flight_comes_back_disarmed_says_so_and_never_arms);
  RUN_TEST(test_the_board_remembers_whether_the_motors_are_on_and_its_watchdog_sees_each_tick);
  RUN_TEST(test_a_critical_error_saves_the_log_without_stopping_the_loop_and_says_whether_it_could);
  RUN_TEST(test_a_transmitter_arms_with_the_throttle_low_and_its_loss_disarms_on_the_ground);
}
