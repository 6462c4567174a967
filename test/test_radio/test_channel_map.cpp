// What the pilot's channels mean: signs, ends, switches, and pulses that cannot be.
#include <unity.h>

#include "ChannelMap.h"
#include "suites.h"

using namespace strix;

namespace {

/// Sticks in the middle, throttle and switches down.
RadioChannels resting() {
  RadioChannels channels;
  channels.count = 16;
  channels.pulse.fill(1000);
  channels.pulse[0] = channels.pulse[1] = channels.pulse[3] = 1500;
  return channels;
}

PilotInput mapped(std::size_t channel, std::uint16_t pulse, const ChannelMapConfig& config = {}) {
  ChannelMap map(config);
  RadioChannels channels = resting();
  channels.pulse[channel] = pulse;
  return map.update(channels);
}

void test_right_back_and_up_are_positive() {
  TEST_ASSERT_EQUAL_FLOAT(1.0F, mapped(0, 2000).roll);
  TEST_ASSERT_EQUAL_FLOAT(-1.0F, mapped(0, 1000).roll);
  TEST_ASSERT_EQUAL_FLOAT(-1.0F, mapped(1, 2000).pitch);  // forward is the longer pulse: nose down
  TEST_ASSERT_EQUAL_FLOAT(1.0F, mapped(1, 1000).pitch);
  TEST_ASSERT_EQUAL_FLOAT(1.0F, mapped(3, 2000).yaw);
  TEST_ASSERT_EQUAL_FLOAT(0.0F, mapped(2, 1000).throttle);
  TEST_ASSERT_EQUAL_FLOAT(0.5F, mapped(2, 1500).throttle);
  TEST_ASSERT_EQUAL_FLOAT(1.0F, mapped(2, 2000).throttle);
}

void test_each_stick_moves_its_own_value_alone_and_a_reversed_one_the_other_way() {
  for (std::size_t channel = 0; channel < 4; ++channel) {
    ChannelMapConfig reversed;
    reversed.reversed = static_cast<std::uint16_t>(1U << channel);
    const PilotInput a = mapped(channel, 1800);
    const PilotInput b = mapped(channel, 1200, reversed);
    TEST_ASSERT_EQUAL_FLOAT(a.roll, b.roll);
    TEST_ASSERT_EQUAL_FLOAT(a.pitch, b.pitch);
    TEST_ASSERT_EQUAL_FLOAT(a.yaw, b.yaw);
    TEST_ASSERT_EQUAL_INT(channel == 0, a.roll != 0.0F);
    TEST_ASSERT_EQUAL_INT(channel == 1, a.pitch != 0.0F);
    TEST_ASSERT_EQUAL_INT(channel == 2, a.throttle != 0.0F);
    TEST_ASSERT_EQUAL_INT(channel == 3, a.yaw != 0.0F);
  }
}

void test_a_stick_is_steady_from_end_to_end_and_still_in_the_middle() {
  float before = -2.0F;
  for (std::uint16_t pulse = 900; pulse <= 2100; ++pulse) {
    const float roll = mapped(0, pulse).roll;
    TEST_ASSERT_TRUE(roll >= before && roll - before < (pulse == 900 ? 2.0F : 0.003F));
    if (pulse >= 1490 && pulse <= 1510) TEST_ASSERT_EQUAL_FLOAT(0.0F, roll);
    if (pulse == 1489 || pulse == 1511) TEST_ASSERT_TRUE(roll != 0.0F);
    before = roll;
  }
  TEST_ASSERT_EQUAL_FLOAT(1.0F, before);
}

void test_switches_keep_their_position_in_between() {
  const auto stateOf = [](const PilotInput& input, std::size_t channel) {
    return channel == 4 ? input.arm : channel == 5 ? input.kill : input.start;
  };
  for (const std::size_t channel : {std::size_t{4}, std::size_t{5}, std::size_t{7}}) {
    ChannelMap map;
    RadioChannels channels = resting();
    const auto at = [&](std::uint16_t pulse) {
      channels.pulse[channel] = pulse;
      return stateOf(map.update(channels), channel);
    };
    TEST_ASSERT_FALSE(at(1000));
    TEST_ASSERT_FALSE(at(1500));
    TEST_ASSERT_TRUE(at(1700));
    TEST_ASSERT_TRUE(at(1500));
    TEST_ASSERT_FALSE(at(1300));
    TEST_ASSERT_FALSE(at(1500));
    for (const std::size_t other : {std::size_t{4}, std::size_t{5}, std::size_t{7}}) {
      if (other != channel) TEST_ASSERT_FALSE(stateOf(map.input(), other));
    }
  }
}

void test_the_mode_switch_has_three_positions() {
  ChannelMap map;
  RadioChannels channels = resting();
  const auto at = [&](std::uint16_t pulse) {
    channels.pulse[6] = pulse;
    return map.update(channels).mode;
  };
  TEST_ASSERT_TRUE(at(1000) == PilotMode::Attitude);
  TEST_ASSERT_TRUE(at(1350) == PilotMode::Attitude);
  TEST_ASSERT_TRUE(at(1500) == PilotMode::PositionHold);
  TEST_ASSERT_TRUE(at(1350) == PilotMode::PositionHold);
  TEST_ASSERT_TRUE(at(1650) == PilotMode::PositionHold);
  TEST_ASSERT_TRUE(at(2000) == PilotMode::Mission);
  TEST_ASSERT_TRUE(at(1650) == PilotMode::Mission);
  TEST_ASSERT_TRUE(at(1200) == PilotMode::Attitude);
}

void test_a_pulse_that_cannot_be_or_a_channel_that_is_missing_changes_nothing() {
  for (std::size_t channel = 0; channel < 8; ++channel) {
    ChannelMap map;
    RadioChannels channels = resting();
    channels.pulse[0] = 1700;
    channels.pulse[5] = 2000;
    TEST_ASSERT_TRUE(map.update(channels).valid);
    const float roll = map.input().roll;
    for (const int wrong : {0, 799, 2201, 65535}) {
      RadioChannels broken = resting();
      broken.pulse[channel] = static_cast<std::uint16_t>(wrong);
      TEST_ASSERT_FALSE(map.update(broken).valid);
      TEST_ASSERT_EQUAL_FLOAT(roll, map.input().roll);
      TEST_ASSERT_TRUE(map.input().kill);
    }
    TEST_ASSERT_TRUE(map.update(channels).valid);
    channels.count = static_cast<std::uint8_t>(channel);
    TEST_ASSERT_FALSE(map.update(channels).valid);
  }
}

void test_before_any_frame_nothing_is_asked_for() {
  const ChannelMap map;
  TEST_ASSERT_FALSE(map.input().valid || map.input().arm || map.input().start);
  TEST_ASSERT_EQUAL_FLOAT(0.0F, map.input().throttle);
}

}  // namespace

void runChannelMapTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_right_back_and_up_are_positive);
  RUN_TEST(test_each_stick_moves_its_own_value_alone_and_a_reversed_one_the_other_way);
  RUN_TEST(test_a_stick_is_steady_from_end_to_end_and_still_in_the_middle);
  RUN_TEST(test_switches_keep_their_position_in_between);
  RUN_TEST(test_the_mode_switch_has_three_positions);
  RUN_TEST(test_a_pulse_that_cannot_be_or_a_channel_that_is_missing_changes_nothing);
  RUN_TEST(test_before_any_frame_nothing_is_asked_for);
}
