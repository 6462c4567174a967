// docs/bring-up.md shows what the program prints: each block here stands there, letter by letter.
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "CheckoutBench.h"
#include "Hand.h"
#include "PowerUpChoice.h"
#include "suites.h"

using namespace strix;

namespace {

std::string manual() {
  const char* root = std::getenv("STRIX_ROOT");  // as for sim_vectors
  std::ifstream in(std::string(root == nullptr ? "." : root) + "/docs/bring-up.md");
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Without the prompt that follows, carriage returns and empty lines at its ends.
std::string trimmed(std::string text) {
  text.erase(std::remove(text.begin(), text.end(), '\r'), text.end());
  if (text.size() >= 3 && text.substr(text.size() - 3) == "\n> ") text.resize(text.size() - 3);
  const std::size_t first = text.find_first_not_of('\n');
  const std::size_t last = text.find_last_not_of('\n');
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

void shown(const std::string& printed) {
  const std::string block = "```\n" + trimmed(printed) + "\n```";
  if (manual().find(block) != std::string::npos) return;
  TEST_FAIL_MESSAGE(("not in docs/bring-up.md:\n" + block).c_str());
}

void test_the_manual_shows_the_opening() {
  shown(PowerUpChoice::kQuestion);
  CheckoutBench bench;
  bench.checkout.begin();
  bench.run(0.01F);
  std::string text = bench.output;
  text.replace(text.find(FakeBoard::kName), std::string(FakeBoard::kName).size(), "Teensy 4.1");
  shown(text);
}

void test_the_manual_shows_a_good_table() {
  CheckoutBench bench;
  bench.begin();
  shown("> " + bench.say("sensors", 5.1F));
}

void test_the_manual_shows_faults() {
  CheckoutBench bench;
  bench.board.found.mag = false;
  bench.disturb = [](CheckoutBench& b) {
    b.board.imu.period = 1000;
    b.board.faults[SensorFault::ImuLate] = static_cast<std::uint32_t>(b.board.time() / 1000);
    b.board.gps.reading.fix = 0;
    b.board.gps.reading.satellites = 2;
    b.board.gps.reading.hdop = 99.9F;
  };
  bench.begin();
  shown("> " + bench.say("sensors", 5.1F));
}

void test_the_manual_shows_the_axes() {
  CheckoutBench bench;
  bench.begin();
  shown("> axes\n" + trimmed(fivePoses(bench)).substr(5));
}

void test_the_manual_shows_a_motor_test() {
  CheckoutBench bench;
  bench.begin();
  std::string text = "> " + bench.say("motor 1");
  text += bench.say("props off");
  shown(text + bench.say("motor 1", 5.2F));
}

void test_the_manual_shows_how_escs_are_taught() {
  CheckoutBench bench;
  bench.begin();
  std::string text = "> " + bench.say("teach escs");
  for (const char* line : {"props off", "teach escs", "battery off"}) text += bench.say(line);
  text += bench.say("teach escs", 3.1F);
  bench.output.clear();
  bench.input += " ";
  bench.run(0.1F);
  const std::string ended = trimmed(bench.output);
  shown(text + ended.substr(0, ended.rfind("\n> ")));
}

void test_the_manual_shows_the_pilots_switches() {
  CheckoutBench bench;
  bench.begin();
  std::string text = "> " + bench.say("pilot", 0.7F);
  bench.board.pilot.arm = true;
  bench.output.clear();
  bench.run(0.5F);
  text += bench.output;
  bench.board.pilot.kill = true;
  bench.output.clear();
  bench.run(0.5F);
  shown(text + bench.output);
}

}  // namespace

void runManualTests() {
  RUN_TEST(test_the_manual_shows_the_opening);
  RUN_TEST(test_the_manual_shows_a_good_table);
  RUN_TEST(test_the_manual_shows_faults);
  RUN_TEST(test_the_manual_shows_the_pilots_switches);
  RUN_TEST(test_the_manual_shows_the_axes);
  RUN_TEST(test_the_manual_shows_a_motor_test);
  RUN_TEST(test_the_manual_shows_how_escs_are_taught);
}
