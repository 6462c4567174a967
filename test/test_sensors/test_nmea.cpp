// What a GPS receiver says, and all that can go wrong on its line. Sentences marked `gpsd` are from
// test/daemon of gpsd (gitlab.com/gpsd/gpsd, BSD-2-Clause), recorded from the receiver that is
// named.
#include <unity.h>

#include <cstring>

#include "NmeaEar.h"
#include "NmeaTalker.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

bool isSame(const GpsRaw& a, const GpsRaw& b) {
  return a.latitude == b.latitude && a.longitude == b.longitude && a.altitude == b.altitude &&
         a.speedKnots == b.speedKnots && a.courseDeg == b.courseDeg && a.hdop == b.hdop &&
         a.fix == b.fix && a.satellites == b.satellites;
}

void test_epochs_of_real_receivers_are_read_to_the_last_digit() {
  struct Case {
    const char* text;
    std::int32_t latitude, longitude, altitude;
    float knots, course, hdop;
    std::uint8_t fix, satellites;
  };
  const Case cases[] = {
      // gpsd, quectel.log (EC25): south and east, six decimals; no GSA yet, so not known to be 3-D.
      {"$GPGGA,022021.00,3644.759368,S,17444.072860,E,1,07,1.1,56.1,M,37.0,M,,*49\r\n"
       "$GPRMC,022021.00,A,3644.759368,S,17444.072860,E,0.0,301.9,071020,18.3,E,A,V*6E\r\n",
       -367459895, 1747345477, 56100, 0.0F, 301.9F, 1.1F, 2, 7},
      // gpsd, mt3339.log.
      {"$GPGGA,202640.000,4404.1306,N,12118.8515,W,2,10,0.98,1127.7,M,-19.6,M,0000,0000*6C\r\n"
       "$GPGSA,A,3,20,16,09,03,07,10,23,19,27,30,,,1.64,0.98,1.31*05\r\n"
       "$GPRMC,202640.000,A,4404.1306,N,12118.8515,W,0.03,225.97,130415,,,D*73\r\n",
       440688433, -1213141917, 1127700, 0.03F, 225.97F, 0.98F, 3, 10},
      // gpsd, ublox-neo-m9n-nmea.log: RMC first, four systems, and no course at standstill.
      {"$GNRMC,223745.00,A,3806.62964,N,12237.61382,W,0.040,,110720,,,D,V*0E\r\n"
       "$GNGSA,A,3,29,20,18,16,51,13,44,26,,,,,0.99,0.54,0.83,1*0E\r\n"
       "$GNGGA,223745.00,3806.62964,N,12237.61382,W,2,12,0.54,83.1,M,-29.5,M,,0000*44\r\n",
       381104940, -1226268970, 83100, 0.0F, 0.0F, 0.54F, 3, 12},
      // gpsd, ublox-f9p-hpnmea.log: seven decimals, 85 characters between '$' and the line's end.
      {"$GNRMC,014500.00,A,4404.1306024,N,12118.8446777,W,0.013,,231221,,,D,V*04\r\n"
       "$GNGGA,014500.00,4404.1306024,N,12118.8446777,W,2,12,0.49,1129.913,M,-21.350,M,,0278*4C"
       "\r\n",
       440688434, -1213140780, 1129913, 0.0F, 0.0F, 0.49F, 3, 12},
      // nmea_navsat_driver issue 159 (Garmin 18x): NMEA 2.0 without a mode, whole seconds.
      {"$GPRMC,130845,A,4822.1369,N,00957.1466,E,000.0,125.2,090123,002.2,E*7F\r\n"
       "$GPGGA,130845,4822.1369,N,00957.1466,E,2,08,1.0,497.7,M,46.8,M,,*4B\r\n",
       483689483, 99524433, 497700, 0.0F, 125.2F, 1.0F, 2, 8},
      // gpsd, tr737A+.log (MT3329) before its first fix, the sentences of one moment: MediaTek's
      // `nowhere` is 89 deg 60 min north.
      {"$GPRMC,071733.929,V,8960.0000,N,00000.0000,E,0.00,0.00,111111,,,N*72\r\n"
       "$GPGSA,A,1,,,,,,,,,,,,,,,*1E\r\n"
       "$GPGGA,071733.929,8960.0000,N,00000.0000,E,0,0,,137.0,M,13.0,M,,*40\r\n",
       0, 0, 0, 0.0F, 0.0F, 99.0F, 0, 0},
      // gpsd, mtk-3301.log: a fix from three satellites.
      {"$GPGGA,081439.000,5212.981832,N,00653.104686,E,1,3,2.88,102.930,M,47.093,M,,*5A\r\n"
       "$GPGSA,A,2,21,28,08,,,,,,,,,,3.05,2.88,1.00*07\r\n"
       "$GPRMC,081439.000,A,5212.981832,N,00653.104686,E,0.205,0.00,230808,,,A*5F\r\n",
       522163639, 68850781, 102930, 0.205F, 0.0F, 2.88F, 2, 3},
  };
  Ear ear;
  int count = 0;
  for (const Case& c : cases) {
    ear.hear(c.text);
    TEST_ASSERT_EQUAL_INT(++count, ear.handedOut);
    TEST_ASSERT_EQUAL_INT32(c.latitude, ear.fix.latitude);
    TEST_ASSERT_EQUAL_INT32(c.longitude, ear.fix.longitude);
    TEST_ASSERT_EQUAL_INT32(c.altitude, ear.fix.altitude);
    // The same float that the digits mean: nothing is lost.
    TEST_ASSERT_TRUE(c.knots == ear.fix.speedKnots && c.course == ear.fix.courseDeg);
    TEST_ASSERT_TRUE(c.hdop == ear.fix.hdop);
    TEST_ASSERT_EQUAL_UINT8(c.fix, ear.fix.fix);
    TEST_ASSERT_EQUAL_UINT8(c.satellites, ear.fix.satellites);
  }
  TEST_ASSERT_EQUAL_UINT32(0, ear.fixes.counts().malformed);
  TEST_ASSERT_EQUAL_UINT32(0, ear.lines.counts().broken + ear.lines.counts().badChecksum);
}

void test_broken_lines_of_real_receivers_are_each_counted_and_give_no_position() {
  enum Fate { Nothing, BadChecksum, Broken, Overlong, Malformed, Unknown, Unpaired };
  struct Case {
    const char* text;
    Fate fate;
  };
  const Case cases[] = {
      // Adafruit_GPS issue 128, the module itself: the right checksum around three fields too few.
      {"$GPRMC,181536.000,A,5936.79K,D*3A\r\n", Malformed},
      // nmea_navsat_driver issue 150, u-blox F9P on a bad line.
      {"$GPRMC,045429.00-A,3454.85336,S,13850.01762,E,2.487,77.91,120622,8.07,E,A,V*67\r\n",
       BadChecksum},
      {"$GPGSA,A,3,07,p9,08,04,20,05,14,30,27,,,,1.70,0.91,1.43,1*11\r\n", BadChecksum},
      {"$GPGSA,A,3,07,09,08,04,20,05,14,30,27,,,,1.70,0.91,1.43,1*1q\r\n", Broken},
      // nmea_navsat_driver issue 100, Garmin 18x: the end of a line.
      {"1225,N,08835.9985,W,000.0,000.0,200420,003.4,W*79\r\n", Nothing},
      // gpsd, gp-320fw-2019-04-07-coldboot.log: a receiver whose buffer overflows as it starts.
      {"$GPRMC,000344.03,A,4808.9992,N,4,02.3*05\r\n", BadChecksum},
      {"$GPN,00000.0000,E,0,00,0.0,,M,,M,,*5D\r\n", BadChecksum},
      {"$GPGSA,A,1,,,,,,,,,,,,,,,*1E0,*4E\r\n", Broken},
      {"$GPGSA,A,1,,,,,,,,,,,,,,,*1E*43\r\n", Broken},
      {"$GPGGA,235952.00,0000.0000,N,00000.0000,E,0,00,0.0,,M,,M,,*00.0000,N,00000.0000,E,0,00,"
       "0.0,,M,,M,,*51\r\n",
       Broken},
      {"$GPGGA,235955.00,0000.0000,N,00000.0000,E,0,00,0.0,,M,,,,,,,,,,,*1E\r\n", BadChecksum},
      {"$GPGSV,3,3,12,2,40,16,00,090,*72\r\n", Unknown},
      // gpsd, hp58534a.log: no checksum. holux-gm-210.log: cut.
      {"$GPGGA,222449,3349.0337,S,01843.9282,E,1,07,02.31,000115.4,M,0033.3,M,,\r\n", Broken},
      {"$GPGGA,012530.562,4131.7353,N,09336.8150,W,0,00,50.\r\n", Broken},
      // gpsd, ch-4701.log and beidou-bd.log: the right checksum and another number of fields.
      {"$GPGSA,A,3,23,13,07,25,,,,,,,,,,,,,,,,,,,,,09.2,07.2,05.7*0D\r\n", Malformed},
      {"$GNGGA,074157.799,3114.8902,N,12135.2443,E,1,07,1.1,192.9,M,8.3,M,,0000,1.8*70\r\n",
       Malformed},
      // gpsd, mtk-3301.log: MediaTek's channel status.
      {"$PMTKCHN,21422,28522,26482,25452,07442,08502,27482,10442,15452,03382,19392,05252,16342,"
       "22031,14001,29001,23001,02001,11001,20001,18001,06001,09001,13001,30001,04001,01001,24001,"
       "31001,17001,12001,32001*43\r\n",
       Overlong},
      // gpsd, quectel-L70.log: an answer, of no use in flight.
      {"$PMTK001,314,3*36\r\n", Unknown},
      // minmea's tests.c: a digit too many, and a receiver that does not know the time yet.
      {"$GPRMC,,V,,,,,,,,,,N*532\r\n", Broken},
      {"$GPRMC,,V,,,,,,,,,,N*53\r\n", Unpaired},
      {"$GPGGA,,,,,,0,00,99.99,,,,,,*48\r\n", Unpaired},
  };
  for (const Case& c : cases) {
    Ear ear;
    ear.hear(c.text);
    const NmeaLines::Counts& line = ear.lines.counts();
    const NmeaFixes::Counts& fix = ear.fixes.counts();
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(c.fate == BadChecksum, line.badChecksum, c.text);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(c.fate == Broken, line.broken, c.text);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(c.fate == Overlong, line.overlong, c.text);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(c.fate == Malformed, fix.malformed, c.text);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(c.fate == Unknown, fix.unknown, c.text);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(c.fate == Unpaired, fix.unpaired, c.text);
    TEST_ASSERT_EQUAL_UINT32(std::strlen(c.text), line.bytes);
    TEST_ASSERT_EQUAL_INT(0, ear.handedOut);
    // And the next epoch is read as if nothing had been.
    TEST_ASSERT_EQUAL_INT(1, ear.hear(realEpoch()).handedOut);
    TEST_ASSERT_EQUAL_INT32(440688433, ear.fix.latitude);
  }
}

void test_a_line_cut_by_the_next_one_costs_that_line_alone() {
  // gpsd, gp-320fw-2019-04-07-coldboot.log, two lines in one; then binary UBX in between
  // (nmea_navsat_driver issue 45).
  Ear ear;
  ear.hear(
      "$GPGSV,3,1,11,23,87,270,,13,68,270,,24,60,270,$GPRMC,000002.00,V,0000.0000,N,"
      "00000.0000,E,,,260910,,,N*48\r\n");
  TEST_ASSERT_EQUAL_UINT32(1, ear.lines.counts().broken);
  TEST_ASSERT_EQUAL_UINT32(1, ear.lines.counts().sound);
  const std::string ubx("\xb5\x62\x01\x06\x34\x00\x38\x0e\xce\x09\x05\xe6\x01\x00\xe2\x07", 16);
  ear.hear(ubx + kGga + ubx + kGsa + ubx + kRmc);
  TEST_ASSERT_EQUAL_INT(1, ear.handedOut);
  // In the middle of a line they do cost it.
  ear.hear(std::string(kGga).insert(30, ubx) + kGsa + kRmc);
  TEST_ASSERT_EQUAL_INT(1, ear.handedOut);
  TEST_ASSERT_EQUAL_UINT32(2, ear.lines.counts().broken);
}

void test_no_single_flipped_bit_moves_the_aircraft() {
  const std::string good = realEpoch();
  Ear intact;
  intact.hear(good);
  int changed = 0;
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      std::string bad = good;
      bad[i] = static_cast<char>(static_cast<unsigned char>(bad[i]) ^ (1U << bit));
      Ear ear;
      ear.hear(bad);
      if (ear.handedOut == 0) {
        ++changed;
        continue;
      }
      // A GSA that is lost leaves the number of dimensions open: less is claimed, never more.
      GpsRaw expected = intact.fix;
      if (ear.fix.fix == 2) expected.fix = 2;
      TEST_ASSERT_TRUE(isSame(expected, ear.fix));
    }
  }
  // All of GGA and RMC but their LF, which comes when the line is done already.
  const int bits = 8 * static_cast<int>(std::strlen(kGga) + std::strlen(kRmc) - 2);
  TEST_ASSERT_EQUAL_INT(bits, changed);
}

void test_a_stream_that_ends_anywhere_gives_no_half_of_a_fix() {
  const std::string good = realEpoch();
  for (std::size_t length = 0; length <= good.size(); ++length) {
    Ear ear;
    ear.hear(good.substr(0, length));
    TEST_ASSERT_EQUAL_INT(length >= good.size() - 1 ? 1 : 0, ear.handedOut);
    // What was cut off, and then the receiver is plugged in again.
    ear.handedOut = 0;
    ear.hear(good);
    const bool again = length >= good.size() - 1;  // the same moment twice is not news
    TEST_ASSERT_EQUAL_INT(again ? 0 : 1, ear.handedOut);
    TEST_ASSERT_EQUAL_UINT32(again ? 1 : 0, ear.fixes.counts().repeated);
  }
}

void test_every_place_on_earth_is_read_exactly() {
  Random random(8);
  const auto pick = [&random](std::int64_t limit) {
    const std::int64_t wide = (static_cast<std::int64_t>(random.bits()) << 24) | random.bits();
    return wide % (2 * limit + 1) - limit;
  };
  for (int i = 0; i < 20'000; ++i) {
    // Six decimals of a minute write each 1e-7 deg exactly: 1e-7 deg is 6e-6 min.
    const std::int64_t latitude = i == 0 ? 900'000'000 : pick(900'000'000);
    const std::int64_t longitude = i == 0 ? -1'800'000'000 : pick(1'800'000'000);
    const std::string text = nmeaAngleText(6 * latitude, 6, 2, "N", "S") + "," +
                             nmeaAngleText(6 * longitude, 6, 3, "E", "W");
    const auto position = nmeaPosition(NmeaFields(text), 0);
    TEST_ASSERT_TRUE(position.has_value());
    TEST_ASSERT_EQUAL_INT32(latitude, position->latitude);
    TEST_ASSERT_EQUAL_INT32(longitude, position->longitude);

    // With 4 (MT3333), 5 (u-blox) and up to 9 decimals: the nearest 1e-7 deg.
    std::int64_t unit = 1'000;  // 10^-decimals minutes in a minute
    for (int decimals = 4; decimals <= 9; ++decimals) {
      unit *= 10;
      const std::int64_t minutes = pick(180 * 60 * unit);
      const std::string angle = nmeaAngleText(minutes, decimals, 3, "E", "W");
      const std::size_t comma = angle.find(',');
      const std::string_view view = angle;
      const auto read = nmeaAngle(view.substr(0, comma), 3, view.substr(comma + 1), 'E', 'W', 180);
      TEST_ASSERT_TRUE(read.has_value());
      // In whole numbers, halves away from zero: a long double of the aircraft has too few digits.
      const std::int64_t twice = 200'000 * (minutes < 0 ? -minutes : minutes);
      const std::int64_t one = unit / 10 * 6;  // 1e-7 deg, in 1e-5 of the last digit
      const std::int64_t nearest = (twice + one) / (2 * one);
      TEST_ASSERT_EQUAL_INT32(minutes < 0 ? -nearest : nearest, *read);
    }
  }
}

void test_what_no_receiver_can_mean_is_refused_whatever_its_checksum() {
  constexpr const char* kBad[] = {
      // GGA: time, latitude, sides, longitude, quality, satellites, dilution, height and its unit.
      "GPGGA,240000.000,4404.1306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,206000.000,4404.1306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202661.000,4404.1306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,20264.000,4404.1306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.,4404.1306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,2026-4.000,4404.1306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,9000.0001,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4460.0000,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,404.1306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,44041306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.13 6,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,-404.1306,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306000001,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,E,12118.8515,N,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,,N,12118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,18000.0001,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,2118.8515,W,1,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,9,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,A,10,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,1,100,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,1,-1,0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,1,10,-0.98,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,1,10,nan,1127.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,1,10,0.98,1127.7.7,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,1,10,0.98,1e3,M,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,1,10,0.98,1127.7,F,-19.6,M,,",
      "GPGGA,202640.000,4404.1306,N,12118.8515,W,1,10,0.98,9999999.7,M,-19.6,M,,",
      // RMC: status, speed, course, mode.
      "GPRMC,202640.000,,4404.1306,N,12118.8515,W,0.03,225.97,130415,,,D",
      "GPRMC,202640.000,AA,4404.1306,N,12118.8515,W,0.03,225.97,130415,,,D",
      "GPRMC,202640.000,A,4404.1306,N,12118.8515,W,-0.03,225.97,130415,,,D",
      "GPRMC,202640.000,A,4404.1306,N,12118.8515,W,inf,225.97,130415,,,D",
      "GPRMC,202640.000,A,4404.1306,N,12118.8515,W,0.03,360.01,130415,,,D",
      "GPRMC,202640.000,A,4404.1306,N,12118.8515,W,0.03,225.97,130415,,,X",
      "GPRMC,202640.000,A,4404.1306,N,12118.8515,W,0.03,225.97,130415,,,AD",
      "GPRMC,202640.000,A,4404.1306,N,12118.8515,W,0.03,225.97,130415,",
      // GSA: selection, dimensions.
      "GPGSA,X,3,20,16,09,03,07,10,23,19,27,30,,,1.64,0.98,1.31",
      "GPGSA,A,4,20,16,09,03,07,10,23,19,27,30,,,1.64,0.98,1.31",
      "GPGSA,A,,20,16,09,03,07,10,23,19,27,30,,,1.64,0.98,1.31",
  };
  for (const char* text : kBad) {
    Ear ear;
    ear.hear(nmeaLine(text));
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(1, ear.lines.counts().sound, text);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(1, ear.fixes.counts().malformed, text);
    // The half that was refused is missing: nothing comes of the other half.
    ear.hear(std::strncmp(text + 2, "RMC", 3) == 0 ? kGga : kRmc);
    TEST_ASSERT_EQUAL_INT(0, ear.handedOut);
  }
}

}  // namespace

void runNmeaTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_epochs_of_real_receivers_are_read_to_the_last_digit);
  RUN_TEST(test_broken_lines_of_real_receivers_are_each_counted_and_give_no_position);
  RUN_TEST(test_a_line_cut_by_the_next_one_costs_that_line_alone);
  RUN_TEST(test_no_single_flipped_bit_moves_the_aircraft);
  RUN_TEST(test_a_stream_that_ends_anywhere_gives_no_half_of_a_fix);
  RUN_TEST(test_every_place_on_earth_is_read_exactly);
  RUN_TEST(test_what_no_receiver_can_mean_is_refused_whatever_its_checksum);
}
