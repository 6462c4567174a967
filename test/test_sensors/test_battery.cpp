/// The battery's voltage as the motors' compensation gets it.
#include <unity.h>

#include <cmath>
#include <limits>

#include "BatteryMonitor.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

BatteryRaw battery(float voltage) { return {0, voltage, 0.0F}; }

EscRaw escs(float a, float b, float c, float d) {
  EscRaw raw;
  raw.voltage = {a, b, c, d};
  return raw;
}

void test_the_first_reading_counts_whole_and_the_next_a_fifth() {
  BatteryMonitor monitor(6);
  TEST_ASSERT_EQUAL_FLOAT(0.0F, monitor.voltage());  // not known
  monitor.add(battery(24.0F));
  TEST_ASSERT_EQUAL_FLOAT(24.0F, monitor.voltage());
  monitor.add(battery(22.0F));
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 23.6F, monitor.voltage());
}

void test_what_no_lipo_of_these_cells_gives_is_left_out_and_counted() {
  BatteryMonitor monitor(6);
  monitor.add(battery(24.0F));
  for (const float wrong : {0.0F, 14.9F, 27.1F, -24.0F, kNan, 1e30F}) monitor.add(battery(wrong));
  TEST_ASSERT_EQUAL_FLOAT(24.0F, monitor.voltage());
  TEST_ASSERT_EQUAL_UINT32(6, monitor.invalid());
}

void test_escs_serve_where_the_board_cannot_measure() {
  BatteryMonitor monitor(3);
  monitor.add(escs(11.0F, 12.0F, kNan, 11.5F));  // one does not tell
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 11.5F, monitor.voltage());
  monitor.add(escs(kNan, kNan, kNan, kNan));
  TEST_ASSERT_FLOAT_WITHIN(1e-5F, 11.5F, monitor.voltage());
  TEST_ASSERT_EQUAL_UINT32(0, monitor.invalid());
}

void test_the_boards_own_reading_goes_before_the_escs() {
  BatteryMonitor monitor(3);
  monitor.add(battery(12.0F));
  monitor.add(escs(10.0F, 10.0F, 10.0F, 10.0F));  // behind thin wires
  TEST_ASSERT_EQUAL_FLOAT(12.0F, monitor.voltage());
}

}  // namespace

void runBatteryTests() {
  RUN_TEST(test_the_first_reading_counts_whole_and_the_next_a_fifth);
  RUN_TEST(test_what_no_lipo_of_these_cells_gives_is_left_out_and_counted);
  RUN_TEST(test_escs_serve_where_the_board_cannot_measure);
  RUN_TEST(test_the_boards_own_reading_goes_before_the_escs);
}
