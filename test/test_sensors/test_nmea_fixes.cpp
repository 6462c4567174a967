// Which sentences make a fix, and what becomes of those that are damaged, lost or swapped.
#include <unity.h>

#include <algorithm>

#include "NmeaEar.h"
#include "NmeaOracle.h"
#include "NmeaTalker.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

void test_only_what_was_measured_is_a_fix() {
  const std::string gga = "GPGGA,202640.000,4404.1306,N,12118.8515,W,";
  const std::string ggaEnd = ",10,0.98,1127.7,M,-19.6,M,,";
  const std::string rmcEnd = ",4404.1306,N,12118.8515,W,0.03,225.97,130415,,,";
  const auto fixOf = [&](const std::string& quality, const std::string& status,
                         const std::string& mode) {
    Ear ear;
    ear.hear(kGsa + nmeaLine(gga + quality + ggaEnd) +
             nmeaLine("GPRMC,202640.000," + status + rmcEnd + mode));
    TEST_ASSERT_EQUAL_INT(1, ear.handedOut);
    return ear.fix.fix;
  };
  for (const char* quality : {"1", "2", "3", "4", "5"}) {
    TEST_ASSERT_EQUAL_UINT8(3, fixOf(quality, "A", "A"));
  }
  for (const char* mode : {"A", "D", "P", "R", "F", ""}) {
    TEST_ASSERT_EQUAL_UINT8(3, fixOf("1", "A", mode));
  }
  // Dead reckoning, typed in, simulated, and a receiver that says it is lost.
  for (const char* quality : {"", "0", "6", "7", "8"}) {
    TEST_ASSERT_EQUAL_UINT8(0, fixOf(quality, "A", "A"));
  }
  for (const char* mode : {"E", "M", "S", "N"}) TEST_ASSERT_EQUAL_UINT8(0, fixOf("1", "A", mode));
  TEST_ASSERT_EQUAL_UINT8(0, fixOf("1", "V", "A"));
}

void test_values_the_receiver_leaves_out_are_not_made_up() {
  const auto hear = [](const char* gga, const char* rmc) {
    Ear ear;
    ear.hear(kGsa + nmeaLine(gga) + nmeaLine(rmc));
    TEST_ASSERT_EQUAL_INT(1, ear.handedOut);
    return ear.fix;
  };
  constexpr const char* kFull =
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,";
  constexpr const char* kMoving =
      "GPRMC,202640.000,A,4404.1306,N,12118.8515,W,12.5,225.97,130415,,,A";
  TEST_ASSERT_EQUAL_UINT8(3, hear(kFull, kMoving).fix);
  // No height: a place on the map. No dilution, no count: not good enough for anybody.
  const GpsRaw bare = hear("GPGGA,202640.000,4404.1306,N,12118.8515,W,1,,,,,,,,", kMoving);
  TEST_ASSERT_EQUAL_UINT8(2, bare.fix);
  TEST_ASSERT_EQUAL_UINT8(0, bare.satellites);
  TEST_ASSERT_TRUE(bare.hdop == 99.0F);
  // No place, or no speed: no fix, since GpsRaw has no way to say which half is missing.
  TEST_ASSERT_EQUAL_UINT8(0,
                          hear("GPGGA,202640.000,,,,,1,10,0.98,1127.7,M,-19.6,M,,", kMoving).fix);
  TEST_ASSERT_EQUAL_UINT8(
      0, hear(kFull, "GPRMC,202640.000,A,4404.1306,N,12118.8515,W,,225.97,130415,,,A").fix);
  // Fast, but where to?
  TEST_ASSERT_EQUAL_UINT8(
      0, hear(kFull, "GPRMC,202640.000,A,4404.1306,N,12118.8515,W,2.43,,130415,,,A").fix);
}

void test_standing_still_without_a_course_is_a_fix_that_does_not_move() {
  Ear ear;
  // gpsd, hab-gpspi.log: 0.25 knots and no course.
  ear.hear(
      "$GNGSA,A,3,22,17,28,15,18,,,,,,,,1.75,0.96,1.47*13\r\n"
      "$GNRMC,092835.00,A,4804.14539,N,01621.54005,E,0.250,,210615,,,A*6F\r\n"
      "$GNGGA,092835.00,4804.14539,N,01621.54005,E,1,10,0.96,205.3,M,42.0,M,,*49\r\n");
  TEST_ASSERT_EQUAL_INT(1, ear.handedOut);
  TEST_ASSERT_EQUAL_UINT8(3, ear.fix.fix);
  // Not 0.25 knots to the north.
  TEST_ASSERT_TRUE(ear.fix.speedKnots == 0.0F && ear.fix.courseDeg == 0.0F);
}

void test_only_halves_of_one_moment_are_joined() {
  NmeaMoment a, b;
  b.time = a.time + 100;
  b.latitude += 5;
  for (const bool rmcFirst : {false, true}) {
    Ear ear;
    // The second half of a and the first of b are lost.
    ear.hear(rmcFirst ? a.rmc() + b.gga() : a.gga() + b.rmc());
    TEST_ASSERT_EQUAL_INT(0, ear.handedOut);
    TEST_ASSERT_EQUAL_UINT32(1, ear.fixes.counts().unpaired);
    ear.hear(rmcFirst ? b.rmc() : b.gga());  // swapped on the way: b is whole all the same
    TEST_ASSERT_EQUAL_INT(1, ear.handedOut);
    // The stamp is that of the first character of b.
    const std::size_t lost = rmcFirst ? a.rmc().size() : a.gga().size();
    TEST_ASSERT_EQUAL_UINT32(174 * (lost + 1), ear.fix.sampled);
  }
  // The same half twice.
  Ear ear;
  ear.hear(a.gga() + b.gga() + b.rmc());
  TEST_ASSERT_EQUAL_INT(1, ear.handedOut);
  TEST_ASSERT_EQUAL_UINT32(1, ear.fixes.counts().unpaired);
  TEST_ASSERT_EQUAL_INT32((b.latitude * 100 + 3) / 6, ear.fix.latitude);
  TEST_ASSERT_EQUAL_UINT32(174 * (a.gga().size() + 1), ear.fix.sampled);
}

void test_two_positions_for_one_moment_are_none() {
  NmeaMoment a, b;
  b.latitude += 2;  // two digits damaged together, say, and the checksum did not see it
  Ear ear;
  ear.hear(a.gga() + b.rmc());
  TEST_ASSERT_EQUAL_INT(0, ear.handedOut);
  TEST_ASSERT_EQUAL_UINT32(1, ear.fixes.counts().unlike);
  // gpsd, ac12.log: a receiver that writes one digit less in RMC.
  ear.hear(nmeaLine("GPRMC,193221.00,A,2037.7279,N,08704.0848,W,0.03,225.97,130415,,,A") +
           nmeaLine("GPGGA,193221.00,2037.72792,N,08704.08478,W,1,10,0.98,12.7,M,-19.6,M,,"));
  TEST_ASSERT_EQUAL_INT(1, ear.handedOut);
}

void test_the_real_rate_is_seen_and_a_clock_that_stands_still() {
  NmeaMoment moment;
  moment.time = 86'399'900;  // to midnight
  Ear ear;
  ear.hear(moment.gga() + moment.rmc());
  TEST_ASSERT_EQUAL_UINT32(0, ear.fixes.interval());
  moment.time = 0;
  ear.hear(moment.gga() + moment.rmc());
  TEST_ASSERT_EQUAL_UINT32(100, ear.fixes.interval());
  ear.hear(moment.gga() + moment.rmc());
  TEST_ASSERT_EQUAL_INT(2, ear.handedOut);
  TEST_ASSERT_EQUAL_UINT32(1, ear.fixes.counts().repeated);
}

void test_three_dimensions_are_told_or_not_claimed() {
  NmeaMoment moment;
  Ear ear;
  const auto next = [&](const std::string& before) {
    moment.time += 100;
    ear.hear(before + moment.gga() + moment.rmc());
    return ear.fix.fix;
  };
  // MT3333 with GLONASS says it once a system; a system without satellites may say 1.
  const std::string none = nmeaLine("GLGSA,A,1,,,,,,,,,,,,,,,");
  TEST_ASSERT_EQUAL_UINT8(2, next(""));
  TEST_ASSERT_EQUAL_UINT8(3, next(moment.gsa() + none));
  TEST_ASSERT_EQUAL_UINT8(3, next(none + moment.gsa()));
  TEST_ASSERT_EQUAL_UINT8(3, next(""));  // one was lost, or comes behind GGA and RMC
  TEST_ASSERT_EQUAL_UINT8(2, next(""));
  TEST_ASSERT_EQUAL_UINT8(0, next(none));
}

void test_random_damage_never_makes_a_fix_that_was_not_sent() {
  // The fuzzer's questions (NmeaOracle.h) to 100 000 damaged streams, the same in every run.
  Random random(4);
  std::uint32_t withPosition = 0;
  const NmeaMoment moment;
  const std::string good[] = {
      realEpoch(), moment.rmc() + moment.gsa() + moment.gga(),
      "$GNRMC,223745.00,A,3806.62964,N,12237.61382,W,0.040,,110720,,,D,V*0E\r\n"
      "$GNGGA,223745.00,3806.62964,N,12237.61382,W,2,12,0.54,83.1,M,-29.5,M,,0000*44\r\n"};
  constexpr char kLikely[] = "$*,.\r\n0123456789ABCDEFNSEWMGPRC-";
  for (int i = 0; i < 100'000; ++i) {
    std::string text = good[random.below(3)];
    const std::uint32_t changes = random.below(5);
    for (std::uint32_t change = 0; change < changes; ++change) {
      const std::size_t at = random.below(static_cast<std::uint32_t>(text.size()));
      const char c = random.chance(0.7F) ? kLikely[random.below(sizeof(kLikely) - 1)]
                                         : static_cast<char>(random.below(256));
      switch (random.below(4)) {
        case 0:
          text[at] = c;
          break;
        case 1:
          text.insert(at, 1, c);
          break;
        case 2:
          text.erase(at, 1 + random.below(20));
          break;
        default:
          text.insert(at, text.substr(random.below(static_cast<std::uint32_t>(text.size())),
                                      random.below(40)));
      }
      if (text.empty()) text = "$";
    }
    if (random.chance(0.5F)) {  // each line with the checksum that it now needs
      std::string closed;
      std::size_t start = 0;
      while (start < text.size()) {
        const std::size_t end = std::min(text.find('\n', start), text.size());
        const std::string line = text.substr(start, end - start);
        const std::size_t star = std::min(line.find('*'), line.size());
        if (star > 1) closed += nmeaLine(line.substr(1, star - 1));
        start = end + 1;
      }
      text = closed;
    }
    NmeaOracle oracle;
    for (const char c : text) {
      const char* wrong = oracle.push(static_cast<std::uint8_t>(c));
      if (wrong != nullptr) TEST_FAIL_MESSAGE((wrong + (": " + text)).c_str());
    }
    withPosition += oracle.withPosition;
  }
  // The questions were asked of something: a fifth of the streams are not damaged at all.
  TEST_ASSERT_TRUE(withPosition > 20'000);
}

}  // namespace

void runNmeaFixTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_only_what_was_measured_is_a_fix);
  RUN_TEST(test_values_the_receiver_leaves_out_are_not_made_up);
  RUN_TEST(test_standing_still_without_a_course_is_a_fix_that_does_not_move);
  RUN_TEST(test_only_halves_of_one_moment_are_joined);
  RUN_TEST(test_two_positions_for_one_moment_are_none);
  RUN_TEST(test_the_real_rate_is_seen_and_a_clock_that_stands_still);
  RUN_TEST(test_three_dimensions_are_told_or_not_claimed);
  RUN_TEST(test_random_damage_never_makes_a_fix_that_was_not_sent);
}
