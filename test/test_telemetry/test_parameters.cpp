// Parameters: the list, single ones, changes, and what keeps them.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "TelemetryBench.h"
#include "suites.h"

using namespace strix;

namespace {

/// As the protocol has it: 16 characters, and a zero only behind a shorter one.
template <std::size_t Size>
void setName(char (&field)[Size], const char* name) {
  std::memcpy(field, name, std::min(Size, std::strlen(name)));
}

mavlink_param_set_t setMessage(const char* name, float value,
                               std::uint8_t type = MAV_PARAM_TYPE_REAL32) {
  mavlink_param_set_t m{};
  m.param_value = value;
  m.target_system = 1;
  m.target_component = kAutopilot;
  setName(m.param_id, name);
  m.param_type = type;
  return m;
}

/// The value that comes back.
float setParameterTo(TelemetryBench& bench, const char* name, float value,
                     std::uint8_t type = MAV_PARAM_TYPE_REAL32) {
  bench.heard.clear();
  bench.say(mavlink_msg_param_set_encode_status, setMessage(name, value, type));
  bench.run(0.3F);
  const auto values = bench.all<mavlink_param_value_t>(MAVLINK_MSG_ID_PARAM_VALUE);
  TEST_ASSERT_EQUAL_size_t(1, values.size());
  TEST_ASSERT_EQUAL_STRING(
      name, std::string(values[0].param_id, strnlen(values[0].param_id, 16)).c_str());
  return values[0].param_value;
}

void test_the_list_is_the_table_and_leaves_the_streams_their_half() {
  TelemetryBench bench;
  bench.say(mavlink_msg_param_request_list_encode_status,
            mavlink_param_request_list_t{1, kAutopilot});
  bench.run(3.0F);
  const auto values = bench.all<mavlink_param_value_t>(MAVLINK_MSG_ID_PARAM_VALUE);
  TEST_ASSERT_EQUAL_size_t(kParameterCount, values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    TEST_ASSERT_EQUAL_UINT16(i, values[i].param_index);
    TEST_ASSERT_EQUAL_UINT16(kParameterCount, values[i].param_count);
    TEST_ASSERT_TRUE(kParameterTable[i].name ==
                     std::string_view(values[i].param_id, strnlen(values[i].param_id, 16)));
    TEST_ASSERT_EQUAL_FLOAT(kParameterTable[i].standard, values[i].param_value);
    TEST_ASSERT_EQUAL(MAV_PARAM_TYPE_REAL32, values[i].param_type);
  }
  TEST_ASSERT_GREATER_THAN_size_t(15, bench.count(MAVLINK_MSG_ID_ATTITUDE_QUATERNION));
  TEST_ASSERT_GREATER_THAN_size_t(1, bench.count(MAVLINK_MSG_ID_HEARTBEAT));
}

void test_one_is_read_by_name_or_by_place() {
  TelemetryBench bench;
  const auto read = [&bench](std::int16_t index, const char* name) {
    mavlink_param_request_read_t m{index, 1, kAutopilot, {}};
    setName(m.param_id, name);
    bench.heard.clear();
    bench.say(mavlink_msg_param_request_read_encode_status, m);
    bench.run(0.2F);
    const auto values = bench.all<mavlink_param_value_t>(MAVLINK_MSG_ID_PARAM_VALUE);
    return values.empty() ? -1 : static_cast<int>(values[0].param_index);
  };
  TEST_ASSERT_EQUAL_INT(5, read(5, ""));
  TEST_ASSERT_EQUAL_INT(static_cast<int>(findParameter("RC_MAP_THROTTLE")),
                        read(-1, "RC_MAP_THROTTLE"));
  TEST_ASSERT_EQUAL_INT(-1, read(-1, "NO_SUCH"));
  TEST_ASSERT_EQUAL_INT(-1, read(static_cast<std::int16_t>(kParameterCount), ""));
}

void test_a_change_is_answered_with_the_new_value() {
  TelemetryBench bench;
  TEST_ASSERT_EQUAL_FLOAT(25.0F, setParameterTo(bench, "FENCE_RADIUS", 25.0F));
  TEST_ASSERT_EQUAL_FLOAT(25.0F, bench.flight.values.fenceRadius);
}

void test_a_refused_change_is_answered_with_the_old_value_and_the_reason() {
  TelemetryBench bench;
  TEST_ASSERT_EQUAL_FLOAT(30.0F, setParameterTo(bench, "FENCE_RADIUS", 5000.0F));
  assertTold(bench, "FENCE_RADIUS is from 5 to 500 m");
  TEST_ASSERT_EQUAL_FLOAT(30.0F, setParameterTo(bench, "FENCE_RADIUS", NAN));
  TEST_ASSERT_EQUAL_FLOAT(30.0F,
                          setParameterTo(bench, "FENCE_RADIUS", 25.0F, MAV_PARAM_TYPE_INT32));
  assertTold(bench, "REAL32");
  bench.flight.now.motorsOn = true;
  TEST_ASSERT_EQUAL_FLOAT(30.0F, setParameterTo(bench, "FENCE_RADIUS", 25.0F));
  assertTold(bench, "with the motors off only");
  TEST_ASSERT_EQUAL_FLOAT(4.0F, setParameterTo(bench, "RETURN_HEIGHT", 4.0F));  // in flight, too
}

void test_a_name_that_there_is_not_is_told() {
  TelemetryBench bench;
  bench.say(mavlink_msg_param_set_encode_status, setMessage("NO_SUCH", 1.0F));
  bench.run(0.3F);
  assertTold(bench, "no parameter of that name");
  TEST_ASSERT_EQUAL_size_t(0, bench.count(MAVLINK_MSG_ID_PARAM_VALUE));
}

void test_changes_are_saved_together_and_with_the_motors_off() {
  TelemetryBench bench;
  setParameterTo(bench, "FENCE_RADIUS", 25.0F);
  setParameterTo(bench, "FENCE_HEIGHT", 10.0F);
  TEST_ASSERT_EQUAL_INT(0, bench.flight.saved);
  bench.run(3.0F);
  TEST_ASSERT_EQUAL_INT(1, bench.flight.saved);
  bench.run(10.0F);
  TEST_ASSERT_EQUAL_INT(1, bench.flight.saved);

  bench.flight.now.motorsOn = true;
  setParameterTo(bench, "RETURN_HEIGHT", 4.0F);
  bench.run(10.0F);
  TEST_ASSERT_EQUAL_INT(1, bench.flight.saved);
  bench.flight.now.motorsOn = false;
  bench.run(3.0F);
  TEST_ASSERT_EQUAL_INT(2, bench.flight.saved);
  setParameterTo(bench, "FENCE_RADIUS", -1.0F);  // nothing changed
  bench.run(10.0F);
  TEST_ASSERT_EQUAL_INT(2, bench.flight.saved);
}

}  // namespace

void runParameterTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_list_is_the_table_and_leaves_the_streams_their_half);
  RUN_TEST(test_one_is_read_by_name_or_by_place);
  RUN_TEST(test_a_change_is_answered_with_the_new_value);
  RUN_TEST(test_a_refused_change_is_answered_with_the_old_value_and_the_reason);
  RUN_TEST(test_a_name_that_there_is_not_is_told);
  RUN_TEST(test_changes_are_saved_together_and_with_the_motors_off);
}
