// A person's typing, a script's waiting, and a terminal that is slow or gone.
#include "ConsoleBench.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

void test_a_person_sees_what_he_types_and_can_correct_it() {
  ConsoleBench bench;
  const std::string shown = bench.type("versoi\b\bion\r");
  assertHas(shown, "versoi\b \b\b \bion\nStrix ");
  assertHas(shown, "\nok\n> ");
}

void test_each_command_ends_with_one_line_that_a_script_can_wait_for() {
  ConsoleBench bench;
  for (const char* line : {"help",
                           "help set",
                           "status",
                           "sensors",
                           "checks",
                           "params",
                           "params rc",
                           "param TILT_TIME",
                           "set TILT_TIME 1",
                           "defaults",
                           "disarm",
                           "kill",
                           "kill off",
                           "land",
                           "props off",
                           "calibrate",
                           "texts on",
                           "echo off",
                           "version",
                           "reboot",
                           "stop",
                           "STATUS",
                           "  status  "}) {
    const std::vector<std::string> lines = bench.say(line);
    assertIs("ok", lines.back());
    for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
      TEST_ASSERT_TRUE(lines[i] != "ok" && lines[i].rfind("error", 0) != 0);
      if (lines[i].size() > 80) TEST_FAIL_MESSAGE(lines[i].c_str());
    }
  }
  for (const char* line : {"hlep",
                           "help hlep",
                           "param",
                           "param X",
                           "params xyz",
                           "set TILT_TIME",
                           "set X 1",
                           "set TILT_TIME one",
                           "set TILT_TIME 99",
                           "props on",
                           "motor 1",
                           "motor 5 10 1",
                           "motor 0 10 1",
                           "motor 1.5 10 1",
                           "motor 1 31 1",
                           "motor 1 0 1",
                           "motor 1 10 11",
                           "motor 1 10 nan",
                           "log",
                           "log get",
                           "log get -1",
                           "log get x",
                           "log get 7",
                           "texts",
                           "echo maybe",
                           "kill on"}) {
    const std::vector<std::string> lines = bench.say(line);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(1, lines.size(), line);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, static_cast<int>(lines[0].rfind("error: ", 0)), line);
  }
  TEST_ASSERT_TRUE(bench.say("").empty());
}

void test_every_command_of_the_help_has_an_example_that_is_understood() {
  ConsoleBench bench;
  bench.card.logs = {{12, "log"}};
  int commands = 0;
  for (const std::string& line : bench.say("help")) {
    if (line.rfind("  ", 0) != 0) continue;
    const std::string name = line.substr(2, line.find(' ', 2) - 2);
    const std::string detail = joined(bench.say("help " + name));
    const std::string mark = "for example: ";
    const std::size_t at = detail.find(mark) + mark.size();
    const std::string example = detail.substr(at, detail.find('\n', at) - at);
    TEST_ASSERT_EQUAL_INT(0, static_cast<int>(example.rfind(name, 0)));
    bench.say("props off");
    bench.flight.saving.now = SaveState::Done;
    const std::vector<std::string> answer = bench.say(example, 6.0F);
    assertIs(name == "save" ? "" : "ok", answer.empty() ? "" : answer.back());
    bench.flight.saving.now = SaveState::Done;
    bench.run(0.01F);
    ++commands;
  }
  TEST_ASSERT_EQUAL_INT(22, commands);
}

void test_a_line_too_long_is_none() {
  ConsoleBench bench;
  assertIs("error: that line is longer than 40 characters",
           bench.outcome("kill" + std::string(296, ' ')));
  TEST_ASSERT_TRUE(bench.flight.asked.empty());
  assertIs("ok", bench.outcome("version"));
}

void test_return_and_line_feed_of_one_key_are_one_key() {
  ConsoleBench bench;
  bench.type("echo off\r\n");
  bench.type("arm\r\n", 1.0F);
  const std::string rest = bench.type("", 5.0F);
  assertHas(rest, "ok\n");
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.asked.size());
}

void test_noise_on_the_line_commands_nothing_and_leaves_the_console_alive() {
  ConsoleBench bench;
  Random random(3);
  std::string noise;
  for (int i = 0; i < 20'000; ++i) {
    noise += static_cast<char>(random.below(256));
  }
  bench.type(noise, 5.0F);
  TEST_ASSERT_TRUE(bench.flight.asked.empty());
  TEST_ASSERT_TRUE(bench.flight.motors.empty());
  bench.type("\r");
  assertHas(bench.type("version\r"), "Strix");
}

void test_a_step_takes_and_gives_a_few_characters_whatever_waits() {
  ConsoleBench bench;
  bench.port.input = std::string(1000, 'x');
  bench.console.step(bench.now);
  TEST_ASSERT_EQUAL_size_t(1000 - 16, bench.port.input.size());
  bench.port.input = "\rparams\rhelp\r";
  bench.run(0.1F);
  TEST_ASSERT_LESS_OR_EQUAL_size_t(512, bench.port.mostAtOnce);
}

void test_a_slow_terminal_gets_the_same_characters() {
  ConsoleBench quick;
  ConsoleBench slow;
  slow.port.free = 1;
  TEST_ASSERT_TRUE(quick.type("params\r", 1.0F) == slow.type("params\r", 10.0F));
}

void test_a_terminal_that_is_gone_holds_up_nothing_and_is_not_flooded_when_it_comes_back() {
  ConsoleBench bench;
  bench.port.free = 0;
  bench.type("params\rparams\rparams\rkill\r", 1.0F);
  TEST_ASSERT_EQUAL_size_t(1, bench.flight.asked.size());
  for (int i = 0; i < 1000; ++i) bench.flight.history.add(6, "text");
  bench.run(1.0F);
  bench.port.free = 1000;
  const std::string text = bench.type("", 1.0F);
  TEST_ASSERT_LESS_THAN_size_t(TextOut::kCapacity + 1000, text.size());
  assertHas(text, "characters lost");
}

void test_texts_come_as_they_are_said_beside_what_is_typed() {
  ConsoleBench bench;
  bench.type("sta");
  bench.flight.history.add(4, "battery low");
  assertIs("\n* warning: battery low\n> sta", bench.type(""));
  assertHas(bench.type("tus\r"), "state");
  bench.flight.history.add(6, "armed");
  bench.flight.history.add(3, "crash");
  assertIs("* armed\n> * error: crash\n> ", bench.type(""));
  bench.type("texts off\r");
  bench.flight.history.add(6, "quiet");
  assertIs("", bench.type(""));
}

}  // namespace

void runLineTests() {
  RUN_TEST(test_a_person_sees_what_he_types_and_can_correct_it);
  RUN_TEST(test_each_command_ends_with_one_line_that_a_script_can_wait_for);
  RUN_TEST(test_every_command_of_the_help_has_an_example_that_is_understood);
  RUN_TEST(test_a_line_too_long_is_none);
  RUN_TEST(test_return_and_line_feed_of_one_key_are_one_key);
  RUN_TEST(test_noise_on_the_line_commands_nothing_and_leaves_the_console_alive);
  RUN_TEST(test_a_step_takes_and_gives_a_few_characters_whatever_waits);
  RUN_TEST(test_a_slow_terminal_gets_the_same_characters);
  RUN_TEST(test_a_terminal_that_is_gone_holds_up_nothing_and_is_not_flooded_when_it_comes_back);
  RUN_TEST(test_texts_come_as_they_are_said_beside_what_is_typed);
}
