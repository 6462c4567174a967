// When a transmitter counts as lost, and as found again.
#include <unity.h>

#include "RadioLink.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr Micros kFrame = 7'000;        // us between frames
constexpr Micros kStart = 0xFFFF'0000;  // the clock wraps on the way

RadioChannels saying(std::uint16_t pulse) {
  RadioChannels channels;
  channels.count = 16;
  channels.pulse.fill(pulse);
  return channels;
}

struct Heard {
  RadioLink link;
  Micros now = kStart;

  void frames(int count, const RadioChannels& channels) {
    for (int k = 0; k < count; ++k) link.add(channels, now += kFrame);
  }

  /// How long it takes to be lost when nothing comes, us.
  Micros silentFor() {
    const Micros from = now;
    while (!link.lost(now)) now += 1'000;
    return now - from;
  }
};

void test_it_is_lost_until_ten_frames_were_heard() {
  Heard heard;
  TEST_ASSERT_TRUE(heard.link.lost(heard.now));
  heard.frames(9, saying(1200));
  TEST_ASSERT_TRUE(heard.link.lost(heard.now));
  TEST_ASSERT_EQUAL(0, heard.link.channels().pulse[0]);
  heard.frames(1, saying(1200));
  TEST_ASSERT_FALSE(heard.link.lost(heard.now));
  TEST_ASSERT_EQUAL(1200, heard.link.channels().pulse[0]);
  TEST_ASSERT_EQUAL_UINT32(0, heard.link.losses());
}

void test_silence_loses_it_and_it_says_what_it_said_before() {
  Heard heard;
  heard.frames(20, saying(1200));
  const Micros silence = heard.silentFor();
  TEST_ASSERT_TRUE(silence > 500'000 && silence <= 502'000);
  TEST_ASSERT_EQUAL(1200, heard.link.channels().pulse[3]);
  TEST_ASSERT_EQUAL_UINT32(1, heard.link.losses());
  // A whole turn of the clock later it is still lost.
  for (int k = 0; k < 9000; ++k) TEST_ASSERT_TRUE(heard.link.lost(heard.now += 490'000));
  TEST_ASSERT_EQUAL_UINT32(1, heard.link.losses());
}

void test_failsafe_loses_it_at_once_and_ten_good_frames_in_a_row_find_it() {
  Heard heard;
  heard.frames(20, saying(1200));
  RadioChannels failsafe = saying(2000);
  failsafe.failsafe = true;
  heard.frames(1, failsafe);
  TEST_ASSERT_TRUE(heard.link.lost(heard.now));
  TEST_ASSERT_EQUAL(1200, heard.link.channels().pulse[0]);
  heard.frames(9, saying(1300));
  heard.frames(1, failsafe);
  heard.frames(9, saying(1300));
  TEST_ASSERT_TRUE(heard.link.lost(heard.now));
  heard.frames(1, saying(1300));
  TEST_ASSERT_FALSE(heard.link.lost(heard.now));
  TEST_ASSERT_EQUAL_UINT32(1, heard.link.losses());
}

void test_frames_repeated_by_the_receiver_are_silence() {
  Heard heard;
  heard.frames(20, saying(1200));
  RadioChannels repeated = saying(2000);
  repeated.frameLost = true;
  heard.frames(60, repeated);  // 0.42 s
  TEST_ASSERT_FALSE(heard.link.lost(heard.now));
  TEST_ASSERT_EQUAL(1200, heard.link.channels().pulse[0]);
  heard.frames(15, repeated);
  TEST_ASSERT_TRUE(heard.link.lost(heard.now));
}

void test_a_silence_that_nobody_asked_about_counts() {
  Heard heard;
  heard.frames(20, saying(1200));
  heard.now += 600'000;
  heard.frames(1, saying(1300));
  TEST_ASSERT_TRUE(heard.link.lost(heard.now));
  TEST_ASSERT_EQUAL_UINT32(1, heard.link.losses());
}

void test_single_frames_between_long_silences_do_not_find_it() {
  Heard heard;
  for (int k = 0; k < 30; ++k) {
    heard.frames(1, saying(1200));
    TEST_ASSERT_TRUE(heard.link.lost(heard.now));
    heard.now += 600'000;
  }
}

}  // namespace

void runRadioLinkTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_it_is_lost_until_ten_frames_were_heard);
  RUN_TEST(test_silence_loses_it_and_it_says_what_it_said_before);
  RUN_TEST(test_failsafe_loses_it_at_once_and_ten_good_frames_in_a_row_find_it);
  RUN_TEST(test_frames_repeated_by_the_receiver_are_silence);
  RUN_TEST(test_a_silence_that_nobody_asked_about_counts);
  RUN_TEST(test_single_frames_between_long_silences_do_not_find_it);
}
