// The GPS adapter, unchanged, on a serial port with a model of the receiver at its other end.
#include <unity.h>

#include "../../src/board/GpsMtk3333.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr Micros kReadBound = 100;            // us, GpsMtk3333::read
constexpr std::uint32_t kSilentBound = 1000;  // ms, GpsMtk3333::begin
constexpr std::uint32_t kLateBound = 3100;    // ms

struct Bench {
  explicit Bench(Micros start = 300'000) {
    powerUpTeensy(start);
    talker.nextEpoch = start - start % 1'000'000;  // powered with it, not an hour before
  }

  NmeaTalker talker;
  HardwareSerialIMXRT port{talker};
  GpsMtk3333 gps{port};
  GpsRaw fix;
  Micros longest = 0;  ///< us that one read() took

  [[nodiscard]] static std::uint64_t now() { return fakeTeensy().clock.now() / 1000U; }

  /// ms that begin() took.
  std::uint32_t begin(bool expected) {
    const std::uint64_t start = now();
    TEST_ASSERT_EQUAL(expected, gps.begin());
    return static_cast<std::uint32_t>((now() - start) / 1000U);
  }

  /// Fixes in this time, us, read every `pass` us; each is shown to `look`.
  template <class Look>
  int fixes(std::uint64_t duration, Micros pass, Look&& look) {
    int count = 0;
    const std::uint64_t end = now() + duration;
    while (now() < end) {
      const std::uint32_t taken = port.taken;
      const std::uint64_t start = now();
      const bool isNew = gps.read(fix);
      const auto took = static_cast<Micros>(now() - start);
      if (took > longest) longest = took;
      TEST_ASSERT_TRUE(port.taken - taken <= 96);
      if (isNew) {
        ++count;
        look(fix);
      }
      delayMicroseconds(pass);
    }
    return count;
  }
  int fixes(std::uint64_t duration, Micros pass = 500) {
    return fixes(duration, pass, [](const GpsRaw&) {});
  }
};

void test_a_receiver_is_set_up_from_power_up_and_after_a_restart() {
  for (const std::uint32_t speed : {9600U, 57600U}) {
    for (const int lost : {0, 1, 2}) {
      Bench bench;
      bench.talker.speed = speed;
      bench.talker.lostAfterNewSpeed = lost;
      bench.talker.moment.latitude = -34'452'000;  // 1e-4 min
      bench.talker.moment.speed = 1234;
      bench.talker.moment.course = 27'150;
      TEST_ASSERT_TRUE(bench.begin(true) < kLateBound);
      TEST_ASSERT_EQUAL_UINT32(57600, bench.talker.speed);
      TEST_ASSERT_EQUAL_UINT32(100, bench.talker.period);
      TEST_ASSERT_EQUAL_UINT32(GpsMtk3333::kPeriod, 1000U * bench.talker.fixPeriod);
      TEST_ASSERT_EQUAL_STRING("RMCGGAGSA", bench.talker.outputs.c_str());

      TEST_ASSERT_INT_WITHIN(1, 100, bench.fixes(10'000'000));
      TEST_ASSERT_EQUAL_INT32(-574'200'000, bench.fix.latitude);  // 1e-7 deg
      TEST_ASSERT_EQUAL_INT32(119'700'000, bench.fix.longitude);
      TEST_ASSERT_EQUAL_INT32(40'000, bench.fix.altitude);  // mm
      TEST_ASSERT_TRUE(bench.fix.speedKnots == 12.34F && bench.fix.courseDeg == 271.5F);
      TEST_ASSERT_TRUE(bench.fix.hdop == 0.98F);
      TEST_ASSERT_EQUAL_UINT8(3, bench.fix.fix);
      TEST_ASSERT_EQUAL_UINT8(11, bench.fix.satellites);
      TEST_ASSERT_EQUAL_UINT32(100, bench.gps.interval());
      TEST_ASSERT_EQUAL_UINT32(0, bench.gps.overflows() + bench.gps.fixes().malformed);
    }
  }
}

void test_a_receiver_that_is_not_there_or_not_itself_fails_in_time() {
  for (int i = 0; i < 4; ++i) {
    Bench bench;
    bench.talker.silent = i == 0;
    bench.talker.babbling = i == 1;
    bench.talker.deaf = i == 1 || i == 2;  // and so speaks at 9600 baud
    if (i == 3) bench.talker.speed = 115200;
    TEST_ASSERT_TRUE(bench.begin(false) < kSilentBound);
    TEST_ASSERT_EQUAL_UINT32(0, bench.gps.lines().sound);
    TEST_ASSERT_EQUAL(i == 0, bench.gps.lines().bytes == 0);
  }
}

void test_a_setting_that_is_refused_or_not_kept_is_noticed() {
  Bench refusing;
  refusing.talker.refusing = true;
  TEST_ASSERT_TRUE(refusing.begin(false) < kSilentBound);
  // Acknowledged, but nothing changed: one fix a second, or the same one ten times.
  for (const int ignored : {220, 300}) {
    Bench bench;
    bench.talker.ignoring = ignored;
    TEST_ASSERT_TRUE(bench.begin(false) < kLateBound);
    TEST_ASSERT_INT_WITHIN(1, 10, bench.fixes(10'000'000));
    TEST_ASSERT_EQUAL_UINT32(1000, bench.gps.interval());
    TEST_ASSERT_EQUAL(ignored == 300, bench.gps.fixes().repeated > 80);
  }
}

void test_a_receiver_lost_in_flight_costs_its_fixes_and_no_time() {
  Bench bench;
  (void)bench.begin(true);
  (void)bench.fixes(1'000'000);
  // Unplugged: nothing at all.
  bench.talker.silent = true;
  (void)bench.fixes(200'000);
  const std::uint32_t bytes = bench.gps.lines().bytes;
  TEST_ASSERT_EQUAL_INT(0, bench.fixes(2'000'000));
  TEST_ASSERT_EQUAL_UINT32(bytes, bench.gps.lines().bytes);
  // Nonsense: seen as bytes that are no lines.
  bench.talker.silent = false;
  bench.talker.babbling = true;
  const std::uint32_t sound = bench.gps.lines().sound;
  TEST_ASSERT_EQUAL_INT(0, bench.fixes(2'000'000));
  TEST_ASSERT_TRUE(bench.gps.lines().bytes - bytes > 3000);
  TEST_ASSERT_EQUAL_UINT32(sound, bench.gps.lines().sound);
  // Plugged in again.
  bench.talker.babbling = false;
  TEST_ASSERT_INT_WITHIN(2, 20, bench.fixes(2'000'000));
  TEST_ASSERT_TRUE(bench.longest < kReadBound);
}

void test_flipped_bits_on_the_line_never_move_the_aircraft() {
  Bench bench;
  (void)bench.begin(true);
  bench.talker.garbleEvery = 211;  // about one sentence in three
  int wrong = 0;
  const int count = bench.fixes(60'000'000, 500, [&wrong](const GpsRaw& fix) {
    if (fix.latitude != 574'200'000 || fix.longitude != 119'700'000) ++wrong;
  });
  TEST_ASSERT_EQUAL_INT(0, wrong);
  TEST_ASSERT_TRUE(count > 60 && count < 590);  // some came through, some did not
  TEST_ASSERT_TRUE(bench.gps.rejected() > 300);
}

void test_the_stamp_is_that_of_the_first_character_however_late_it_is_read() {
  // micros() wraps on the way.
  constexpr Micros kBeforeWrap = 0U - 5'000'000U;
  for (const Micros pass : {Micros{100}, Micros{500}, Micros{2000}}) {
    Bench bench(kBeforeWrap);
    (void)bench.begin(true);
    // As lib/Sensors asks: not until 100 ms after the last fix, when all but the end of an epoch
    // has been waiting for up to 35 ms.
    PeriodicTask task(GpsMtk3333::kPeriod);
    task.start(static_cast<Micros>(Bench::now()));
    int count = 0;
    while (Bench::now() < std::uint64_t{kBeforeWrap} + 12'000'000U) {
      const auto now = static_cast<Micros>(Bench::now());
      if (task.due(now) && bench.gps.read(bench.fix)) {
        count == 0 ? task.postpone(now) : task.done(now);
        ++count;
        // The model's epochs start at whole tenths of a second after power-up.
        const std::uint64_t stamp =
            Bench::now() - elapsed(static_cast<Micros>(Bench::now()), bench.fix.sampled);
        const std::uint64_t late = stamp % 100'000U;
        // Not before it came, one byte (174 us) after the start. An idle line cannot be told from a
        // fresh one: that is two passes at most, one to be due and one to look.
        TEST_ASSERT_TRUE(late >= 170 && late <= 2 * pass + 400);
      }
      delayMicroseconds(pass);
    }
    TEST_ASSERT_TRUE(count >= 100);
  }
}

void test_how_often_it_is_read_changes_no_fix() {
  for (const Micros pass : {Micros{50}, Micros{700}, Micros{7000}, Micros{30'000}}) {
    Bench bench;
    (void)bench.begin(true);
    std::int64_t next = 0;
    const int count = bench.fixes(5'000'000, pass, [&](const GpsRaw& fix) {
      // The aircraft moves by one digit from fix to fix, and none is left out.
      if (next != 0) TEST_ASSERT_INT32_WITHIN(9, next, fix.latitude);
      next = fix.latitude + 16;  // 1e-4 min is 16.7e-7 deg
      ++bench.talker.moment.latitude;
    });
    TEST_ASSERT_INT_WITHIN(1, 50, count);
    TEST_ASSERT_EQUAL_UINT32(0, bench.gps.fixes().unlike);
  }
}

void test_a_loop_that_stood_still_loses_bytes_that_are_counted() {
  Bench bench;
  (void)bench.begin(true);
  (void)bench.fixes(1'000'000);
  TEST_ASSERT_EQUAL_UINT32(0, bench.gps.overflows());
  delay(1000);
  const int count = bench.fixes(1'000'000);
  TEST_ASSERT_TRUE(bench.port.lost > 0);
  TEST_ASSERT_EQUAL_UINT32(1, bench.gps.overflows());
  TEST_ASSERT_INT_WITHIN(3, 10, count);
}

}  // namespace

void runGpsTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_receiver_is_set_up_from_power_up_and_after_a_restart);
  RUN_TEST(test_a_receiver_that_is_not_there_or_not_itself_fails_in_time);
  RUN_TEST(test_a_setting_that_is_refused_or_not_kept_is_noticed);
  RUN_TEST(test_a_receiver_lost_in_flight_costs_its_fixes_and_no_time);
  RUN_TEST(test_flipped_bits_on_the_line_never_move_the_aircraft);
  RUN_TEST(test_the_stamp_is_that_of_the_first_character_however_late_it_is_read);
  RUN_TEST(test_how_often_it_is_read_changes_no_fix);
  RUN_TEST(test_a_loop_that_stood_still_loses_bytes_that_are_counted);
}
