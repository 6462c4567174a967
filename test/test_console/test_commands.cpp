// What the commands do, and what they refuse.
#include <cstring>

#include "ConsoleBench.h"
#include "suites.h"

using namespace strix;

namespace {

void test_simple_commands_reach_the_flight_and_its_refusal_the_terminal() {
  struct Case {
    const char* line;
    CommandKind kind;
  };
  for (const Case& c : {Case{"disarm", CommandKind::Disarm}, Case{"kill", CommandKind::Kill},
                        Case{"kill off", CommandKind::KillOff}, Case{"land", CommandKind::Land},
                        Case{"calibrate", CommandKind::Calibrate}}) {
    ConsoleBench bench;
    assertIs("ok", bench.outcome(c.line));
    TEST_ASSERT_EQUAL_size_t(1, bench.flight.asked.size());
    TEST_ASSERT_TRUE(bench.flight.asked[0].kind == c.kind);
    TEST_ASSERT_TRUE(bench.flight.asked[0].source == CommandSource::Console);
    bench.flight.refusal = "not now: later";
    assertIs("error: not now: later", bench.outcome(c.line));
  }
}

void test_arming_counts_down_five_seconds() {
  ConsoleBench bench;
  const std::vector<std::string> lines = bench.say("arm", 4.9F);
  TEST_ASSERT_EQUAL_size_t(5, lines.size());
  assertIs("arming in 5 s: any key stops it", lines[0]);
  assertIs("arming in 1 s: any key stops it", lines[4]);
  TEST_ASSERT_TRUE(bench.flight.asked.empty());
  assertIs("ok\n", bench.type("", 0.2F));
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.asked.size());
  TEST_ASSERT_TRUE(bench.flight.asked[0].kind == CommandKind::Arm);
}

void test_any_key_stops_arming_and_counts_as_typed() {
  ConsoleBench bench;
  bench.say("arm", 4.8F);
  assertHas(bench.type("ver", 10.0F), "error: stopped by a key\n");
  assertHas(bench.type("sion\n"), "Strix");
  TEST_ASSERT_TRUE(bench.flight.asked.empty());
}

void test_arming_is_refused_at_once_where_a_check_fails_or_the_motors_are_on() {
  ConsoleBench bench;
  bench.flight.now.refusal = "IMU gives no data: check its wiring";
  assertIs("error: IMU gives no data: check its wiring", bench.outcome("arm"));
  bench.flight.now.refusal = "";
  bench.setMotors(true);
  assertIs("error: the motors are on already", bench.outcome("arm"));
  bench.run(10.0F);
  TEST_ASSERT_TRUE(bench.flight.asked.empty());
}

void test_what_the_flight_refuses_at_the_end_of_the_countdown_is_told() {
  ConsoleBench bench;
  bench.flight.refusal = "throttle is not low: pull it down";
  assertIs("error: throttle is not low: pull it down", bench.outcome("arm", 6.0F));
}

void test_a_motor_turns_as_asked_after_the_promise_and_three_seconds() {
  ConsoleBench bench;
  bench.say("props off");
  assertIs("turning in 1 s: any key stops it", bench.outcome("motor 3 15 2.5", 2.9F));
  TEST_ASSERT_TRUE(bench.flight.motors.empty());
  assertIs("M3 turns: any key stops it\n", bench.type("", 0.2F));
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.motors.size());
  TEST_ASSERT_EQUAL_INT(2, bench.flight.motors[0].motor);
  TEST_ASSERT_EQUAL_FLOAT(0.15F, bench.flight.motors[0].throttle);
  TEST_ASSERT_EQUAL_UINT32(2'500'000, bench.flight.motors[0].duration);
  assertIs("", bench.type("", 2.2F));
  assertIs("ok\n", bench.type("", 0.4F));
}

void test_a_motor_does_not_turn_without_the_promise_or_with_motors_on() {
  ConsoleBench bench;
  assertHas(bench.outcome("motor 1 10 1"), "error: take the propellers off");
  bench.say("props off");
  bench.run(61.0F);
  assertHas(bench.outcome("motor 1 10 1"), "error: take the propellers off");
  bench.run(4294.0F - 30.0F);  // the clock has been once around
  assertHas(bench.outcome("motor 1 10 1"), "error: take the propellers off");
  bench.say("props off");
  bench.setMotors(true);
  assertIs("error: the motors are on: disarm first", bench.outcome("motor 1 10 1"));
  bench.run(10.0F);
  TEST_ASSERT_TRUE(bench.flight.motors.empty());
}

void test_any_key_stops_a_motor() {
  ConsoleBench bench;
  bench.say("props off");
  bench.say("motor 1 10 10", 4.0F);
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.motors.size());
  assertIs("error: stopped by a key\n", bench.type(" "));
  TEST_ASSERT_EQUAL_size_t(2, bench.flight.motors.size());
  TEST_ASSERT_EQUAL_UINT32(0, bench.flight.motors[1].duration);
  TEST_ASSERT_EQUAL_FLOAT(0.0F, bench.flight.motors[1].throttle);
  bench.say("\nmotor 1 10 10", 1.0F);
  bench.type("x", 10.0F);
  TEST_ASSERT_EQUAL_size_t(2, bench.flight.motors.size());  // stopped before it began
}

void test_a_motor_that_the_flight_refuses_is_told() {
  ConsoleBench bench;
  bench.say("props off");
  bench.flight.refusal = "the aircraft moves: let it stand still";
  assertIs("error: the aircraft moves: let it stand still", bench.outcome("motor 1 10 1", 4.0F));
}

void test_a_parameter_is_set_shown_and_refused_with_its_reason() {
  ConsoleBench bench;
  assertHas(joined(bench.say("set fence_radius 25.5")), "FENCE_RADIUS = 25.5 m");
  TEST_ASSERT_EQUAL_FLOAT(25.5F, bench.flight.values.fenceRadius);
  assertHas(joined(bench.say("param FENCE_RADIUS")), "FENCE_RADIUS = 25.5 m\n");
  assertIs("error: FENCE_RADIUS is from 5 to 500 m", bench.outcome("set FENCE_RADIUS 4"));
  assertIs("error: RC_MAP_ROLL is a whole number from 1 to 16",
           bench.outcome("set RC_MAP_ROLL 1.5"));
  bench.setMotors(true);
  assertIs("error: FENCE_RADIUS can be changed with the motors off only",
           bench.outcome("set FENCE_RADIUS 30"));
  assertIs("ok", bench.outcome("set RETURN_HEIGHT 5"));
  TEST_ASSERT_EQUAL_FLOAT(25.5F, bench.flight.values.fenceRadius);
}

void test_the_list_of_parameters_has_each_once_and_marks_the_changed() {
  ConsoleBench bench;
  bench.flight.values.tiltTime = 2.0F;
  const std::vector<std::string> lines = bench.say("params");
  TEST_ASSERT_EQUAL_size_t(kParameterCount + 2, lines.size());  // a heading, and ok
  for (std::size_t i = 0; i < kParameterCount; ++i) {
    const ParameterInfo& info = kParameterTable[i];
    const std::string& line = lines[i + 1];
    TEST_ASSERT_TRUE(line.substr(0, line.find(' ')) == info.name);
    TEST_ASSERT_EQUAL(info.name == "TILT_TIME", line.find(" * ") != std::string::npos);
    TEST_ASSERT_EQUAL_FLOAT(getParameter(bench.flight.values, i), std::stof(line.substr(18)));
    TEST_ASSERT_EQUAL_FLOAT(info.standard, std::stof(line.substr(34)));
    TEST_ASSERT_EQUAL_FLOAT(info.lowest, std::stof(line.substr(44)));
  }
  TEST_ASSERT_EQUAL_size_t(8 + 2, bench.say("params rc_map").size());
}

void test_defaults_sets_what_differs_and_nothing_in_the_air() {
  ConsoleBench bench;
  bench.flight.values.tiltTime = 2.0F;
  bench.flight.values.linkRate = 900.0F;
  bench.setMotors(true);
  assertIs("error: the motors are on: disarm first", bench.outcome("defaults"));
  bench.setMotors(false);
  assertHas(joined(bench.say("defaults")), "2 changed");
  TEST_ASSERT_EQUAL_size_t(2, bench.flight.asked.size());
  TEST_ASSERT_EQUAL_FLOAT(Parameters{}.tiltTime, bench.flight.values.tiltTime);
  TEST_ASSERT_EQUAL_FLOAT(Parameters{}.linkRate, bench.flight.values.linkRate);
}

void test_save_answers_when_it_is_done_and_what_is_typed_meanwhile_waits() {
  ConsoleBench bench;
  TEST_ASSERT_TRUE(bench.say("save", 1.0F).empty());
  TEST_ASSERT_TRUE(bench.say("version", 1.0F).empty());
  bench.flight.saving.now = SaveState::Done;
  const std::string text = bench.type("");
  assertHas(text, "ok\nStrix");
  bench.say("save");
  bench.flight.saving.now = SaveState::Failed;
  assertHas(bench.type(""), "error: the memory does not keep it");
  assertHas(bench.outcome("save", 11.0F), "error: not saved");
  bench.flight.refusal = "disarm first";
  assertIs("error: disarm first", bench.outcome("save"));
}

void test_checks_show_each_check_and_the_sentence_of_those_that_fail() {
  ConsoleBench bench;
  std::vector<std::string> lines = bench.say("checks");
  TEST_ASSERT_EQUAL_size_t(kPreArmChecks.size() + 1, lines.size());
  bench.flight.now.preArm = prearm::kGps | prearm::kRestarted;
  lines = bench.say("checks");
  std::size_t passing = 0;
  for (const std::string& line : lines) passing += line.find("  ok") != std::string::npos ? 1 : 0;
  TEST_ASSERT_EQUAL_size_t(kPreArmChecks.size() - 2, passing);
  const std::string text = joined(lines);
  assertHas(text, "GPS           NO  no usable GPS fix: wait, or go under open sky\n");
  assertHas(text, "restart       NO  restarted while its motors were on: look it over");
  for (const std::string& line : lines) TEST_ASSERT_LESS_OR_EQUAL_size_t(80, line.size());
}

/// Every bit's word must be about the sentence beside it.
void test_the_subject_of_a_check_is_that_of_its_sentence() {
  struct Case {
    PreArmSet bit;
    const char* subject;
  };
  for (const Case& c :
       {Case{prearm::kNotCalibrated, "calibration"}, Case{prearm::kImu, "IMU"},
        Case{prearm::kKillSwitch, "kill"}, Case{prearm::kMounting, "mounting"},
        Case{prearm::kRadio, "radio"}, Case{prearm::kThrottle, "throttle"},
        Case{prearm::kBattery, "battery"}, Case{prearm::kRestarted, "restart"},
        Case{prearm::kParameters, "parameters"}, Case{prearm::kKillCommand, "kill command"}}) {
    ConsoleBench bench;
    bench.flight.now.preArm = c.bit;
    int failing = 0;
    for (const std::string& line : bench.say("checks")) {
      if (line.find(" NO ") == std::string::npos) continue;
      ++failing;
      assertIs(c.subject, line.substr(0, std::strlen(c.subject)));
    }
    TEST_ASSERT_EQUAL_INT(1, failing);
  }
}

void test_status_and_sensors_show_numbers_with_their_units() {
  ConsoleBench bench;
  FlightStatus& s = bench.flight.now;
  s.stateName = "HOLD";
  s.motorsOn = true;
  s.estimate.positionNed = {1.0F, -2.5F, -3.25F};
  s.estimate.attitude = eulerToQuaternion({0.1F, -0.2F, 0.3F});
  s.voltage = 22.2F;
  s.cells = 6;
  s.motors = {0.1F, 0.2F, 0.3F, 0.4F};
  s.latitude = 574'200'000;
  s.fix = 3;
  s.gpsFresh = true;
  s.accel = {0.0F, 0.0F, -9.81F};
  const std::string status = joined(bench.say("status"));
  for (const char* part :
       {"HOLD, motors ON", "1.00 m north, -2.50 m east, 3.25 m up (without GPS)",
        "roll 5.7, pitch -11.5, yaw 17.2 deg", "10 20 30 40 %", "22.20 V, 6 cells"}) {
    assertHas(status, part);
  }
  const std::string sensors = joined(bench.say("sensors"));
  for (const char* part : {"IMU           LOST  0.00 0.00 -9.81 m/s^2",
                           "GPS           good  3D fix", "57.4200000 N"}) {
    assertHas(sensors, part);
  }
}

void test_reboot_waits_for_its_answer_and_never_happens_with_motors_on() {
  ConsoleBench bench;
  bench.setMotors(true);
  assertIs("error: the motors are on: disarm first", bench.outcome("reboot"));
  TEST_ASSERT_FALSE(bench.console.rebootAsked());
  bench.setMotors(false);
  bench.port.free = 0;
  bench.type("reboot\n");
  TEST_ASSERT_FALSE(bench.console.rebootAsked());
  bench.port.free = 100;
  bench.type("");
  TEST_ASSERT_TRUE(bench.console.rebootAsked());
}

void test_numbers_are_printed_without_useless_digits() {
  TextOut out;
  out << Plain{0.1F} << " " << Plain{3.2F} << " " << Plain{50'000.0F} << " " << Plain{-180.0F}
      << " " << Plain{500.123F} << " " << Plain{0.0F} << " " << Plain{65'535.0F} << " "
      << Plain{1e-6F} << " " << Plain{16'777'215.0F} << " " << Plain{kNaN} << " " << Plain{3e20F};
  std::string text;
  out.drain([&text](const char* from, std::size_t count) {
    text.append(from, count);
    return count;
  });
  assertIs("0.1 3.2 50000 -180 500.123 0 65535 0.000001 16777215 no number > 1e9", text);
}

}  // namespace

void runCommandTests() {
  RUN_TEST(test_simple_commands_reach_the_flight_and_its_refusal_the_terminal);
  RUN_TEST(test_arming_counts_down_five_seconds);
  RUN_TEST(test_any_key_stops_arming_and_counts_as_typed);
  RUN_TEST(test_arming_is_refused_at_once_where_a_check_fails_or_the_motors_are_on);
  RUN_TEST(test_what_the_flight_refuses_at_the_end_of_the_countdown_is_told);
  RUN_TEST(test_a_motor_turns_as_asked_after_the_promise_and_three_seconds);
  RUN_TEST(test_a_motor_does_not_turn_without_the_promise_or_with_motors_on);
  RUN_TEST(test_any_key_stops_a_motor);
  RUN_TEST(test_a_motor_that_the_flight_refuses_is_told);
  RUN_TEST(test_a_parameter_is_set_shown_and_refused_with_its_reason);
  RUN_TEST(test_the_list_of_parameters_has_each_once_and_marks_the_changed);
  RUN_TEST(test_defaults_sets_what_differs_and_nothing_in_the_air);
  RUN_TEST(test_save_answers_when_it_is_done_and_what_is_typed_meanwhile_waits);
  RUN_TEST(test_checks_show_each_check_and_the_sentence_of_those_that_fail);
  RUN_TEST(test_the_subject_of_a_check_is_that_of_its_sentence);
  RUN_TEST(test_status_and_sensors_show_numbers_with_their_units);
  RUN_TEST(test_reboot_waits_for_its_answer_and_never_happens_with_motors_on);
  RUN_TEST(test_numbers_are_printed_without_useless_digits);
}
