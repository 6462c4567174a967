// When sensors are asked, what happens when they are silent, and that no reading is made up.
#include <unity.h>

#include <algorithm>
#include <functional>
#include <limits>

#include "FakeBoard.h"
#include "Sensors.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr Micros kBeforeWrap = 0U - 3'000'000U;  // micros() wraps 3 s later

struct Bench {
  explicit Bench(Micros start = 0, const SensorConfig& c = {}) : board(start), config(c) {
    sensors.start(board.now());
  }

  FakeBoard board;
  SensorConfig config;
  Sensors<FakeBoard> sensors{board, config};

  /// Readings taken by one sensor while the loop passes every `pass` us.
  template <class Update>
  std::uint32_t readings(std::uint64_t duration, Micros pass, Update&& update) {
    std::uint32_t count = 0;
    const std::uint64_t end = board.time() + duration;
    while (board.time() < end) {
      if (update(sensors, board.now())) ++count;
      board.advance(pass);
    }
    return count;
  }
};

constexpr auto kImu = [](Sensors<FakeBoard>& s, Micros now) { return s.imuUpdate(now); };
constexpr auto kMag = [](Sensors<FakeBoard>& s, Micros now) { return s.magUpdate(now); };
constexpr auto kAlt = [](Sensors<FakeBoard>& s, Micros now) { return s.altUpdate(now); };
constexpr auto kGps = [](Sensors<FakeBoard>& s, Micros now) { return s.gpsUpdate(now); };

void test_every_sample_of_an_imu_is_taken() {
  // Of one that measures every 889 us (1125 Hz) and every 1000 us, beside the loop's phase or in
  // it; with quick passes, with ones that do not divide the period, and across the wrap.
  for (const Micros start : {Micros{0}, kBeforeWrap}) {
    for (const Micros period : {Micros{889}, Micros{1000}}) {
      for (const Micros offset : {Micros{0}, Micros{300}, Micros{888}}) {
        for (const Micros pass : {Micros{50}, Micros{130}, Micros{400}}) {
          Bench bench(start);
          bench.board.imu.period = period;
          bench.board.imu.offset = offset;
          // One may be under way at either end.
          TEST_ASSERT_UINT32_WITHIN(1, 10'000'000 / period, bench.readings(10'000'000, pass, kImu));
          TEST_ASSERT_EQUAL_UINT32(0, bench.sensors.missed());
        }
      }
    }
  }
}

void test_a_device_much_faster_than_its_period_is_read_twice_as_often_at_most() {
  Bench bench;
  bench.board.imu.period = 100;
  TEST_ASSERT_UINT32_WITHIN(1, 20'000, bench.readings(10'000'000, 50, kImu));
}

void test_a_reading_with_nan_or_infinity_is_none() {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Bench bench;
  for (const float bad : {kNaN, kInfinity, -kInfinity}) {
    bench.board.imu.reading.accel.z() = bad;
    bench.board.mag.reading.field.x() = bad;
    bench.board.alt.reading.pressure = bad;
    bench.board.gps.reading.speedKnots = bad;
    TEST_ASSERT_EQUAL_UINT32(0, bench.readings(1'000'000, 1000, kImu));
    TEST_ASSERT_EQUAL_UINT32(0, bench.readings(1'000'000, 1000, kMag));
    TEST_ASSERT_EQUAL_UINT32(0, bench.readings(1'000'000, 1000, kAlt));
    TEST_ASSERT_EQUAL_UINT32(0, bench.readings(1'000'000, 1000, kGps));
  }
  TEST_ASSERT_FALSE(bench.sensors.imuFresh(bench.board.now()));
  TEST_ASSERT_TRUE(bench.sensors.invalid() > 3000);
}

void test_a_reading_beyond_the_sensors_range_is_none_and_one_at_its_end_is_counted() {
  Bench bench;
  const SensorConfig& range = bench.config;
  struct Case {
    float& reading;
    float end;
    bool (*update)(Sensors<FakeBoard>&, Micros);
    bool clips;
  };
  FakeBoard& board = bench.board;
  const Case cases[] = {{board.imu.reading.accel.x(), range.accelRange, kImu, true},
                        {board.imu.reading.accel.z(), -range.accelRange, kImu, true},
                        {board.imu.reading.gyro.y(), -range.gyroRange, kImu, true},
                        {board.mag.reading.field.z(), range.magRange, kMag, false},
                        {board.alt.reading.pressure, range.highestPressure, kAlt, false},
                        {board.alt.reading.pressure, range.lowestPressure, kAlt, false}};
  for (const Case& c : cases) {
    const float usual = c.reading;
    const bool lowEnd = c.end == range.lowestPressure;
    c.reading = c.end * (lowEnd ? 0.99F : 1.01F);
    const std::uint32_t invalid = bench.sensors.invalid();
    TEST_ASSERT_EQUAL_UINT32(0, bench.readings(100'000, 1000, c.update));
    TEST_ASSERT_TRUE(bench.sensors.invalid() > invalid);
    c.reading = c.end;
    const std::uint32_t clipped = bench.sensors.clipped();
    const std::uint32_t taken = bench.readings(100'000, 1000, c.update);
    TEST_ASSERT_TRUE(taken > 0);
    TEST_ASSERT_EQUAL_UINT32(c.clips ? taken : 0, bench.sensors.clipped() - clipped);
    c.reading = usual;
  }
}

void test_a_sample_that_no_motion_can_give_is_left_out_and_four_in_a_row_are_believed() {
  struct Case {
    Vector3f accel, gyro;
  };
  SensorConfig config;
  const float gyroStep = config.gyroStep;
  const float accelStep = config.accelStep = 20.0F * kGravity;  // well within its range
  const Case cases[] = {{{1.1F * accelStep, 0.0F, 0.0F}, Vector3f::Zero()},
                        {Vector3f::Zero(), {0.0F, 0.0F, -1.1F * gyroStep}}};
  for (const Case& c : cases) {
    Bench bench(kBeforeWrap, config);
    ImuRaw& reading = bench.board.imu.reading;
    const ImuRaw usual = reading;
    for (int length = 1; length <= 5; ++length) {
      TEST_ASSERT_EQUAL_UINT32(20, bench.readings(20'000, 1000, kImu));
      reading.accel = usual.accel + c.accel;
      reading.gyro = usual.gyro + c.gyro;
      const std::uint32_t invalid = bench.sensors.invalid();
      // Of the samples beside the others the first three do not count.
      const auto most = static_cast<std::uint32_t>(length);
      const std::uint32_t leftOut = std::min<std::uint32_t>(most, 3U);
      TEST_ASSERT_EQUAL_UINT32(most - leftOut, bench.readings(1000 * most, 1000, kImu));
      TEST_ASSERT_EQUAL_UINT32(leftOut, bench.sensors.invalid() - invalid);
      reading.accel = usual.accel;
      reading.gyro = usual.gyro;
      bench.readings(10'000, 1000, kImu);
    }
    // A change that a motion can give is one.
    for (int i = 0; i < 10; ++i) {
      const float share = i % 2 == 0 ? 0.9F : 0.0F;
      reading.accel = usual.accel + share * c.accel;
      reading.gyro = usual.gyro + share * c.gyro;
      const std::uint32_t invalid = bench.sensors.invalid();
      bench.readings(1000, 1000, kImu);
      TEST_ASSERT_EQUAL_UINT32(invalid, bench.sensors.invalid());
    }
  }
}

void test_a_receiver_that_says_the_same_for_a_second_is_stuck_until_it_says_something_else() {
  Bench bench;
  bench.board.gpsRepeats = true;
  TEST_ASSERT_EQUAL_UINT32(10, bench.readings(1'000'000, 1000, kGps));
  TEST_ASSERT_FALSE(bench.sensors.gpsStuck());
  bench.readings(100'000, 1000, kGps);
  TEST_ASSERT_TRUE(bench.sensors.gpsStuck());
  GpsRaw& fix = bench.board.gps.reading;
  const std::function<void()> changes[] = {
      [&fix] { ++fix.latitude; }, [&fix] { --fix.longitude; }, [&fix] { ++fix.altitude; },
      [&fix] { fix.speedKnots += 0.01F; }, [&fix] { fix.courseDeg += 0.01F; }};
  for (const auto& change : changes) {
    change();
    bench.readings(100'000, 1000, kGps);
    TEST_ASSERT_FALSE(bench.sensors.gpsStuck());
    bench.readings(1'100'000, 1000, kGps);
    TEST_ASSERT_TRUE(bench.sensors.gpsStuck());
  }
}

void test_the_slower_sensors_keep_their_rates_too() {
  for (const Micros pass : {Micros{100}, Micros{700}, Micros{1400}}) {
    Bench bench(kBeforeWrap);
    TEST_ASSERT_UINT32_WITHIN(1, 1000, bench.readings(10'000'000, pass, kMag));
    TEST_ASSERT_UINT32_WITHIN(1, 500, bench.readings(10'000'000, pass, kAlt));
    TEST_ASSERT_UINT32_WITHIN(1, 100, bench.readings(10'000'000, pass, kGps));
  }
}

void test_a_device_slower_than_its_task_sets_the_rate_and_nothing_is_read_twice() {
  Bench bench;
  bench.board.imu.period = 1125;
  TEST_ASSERT_EQUAL_UINT32(8889, bench.readings(10'000'000, 50, kImu));
  TEST_ASSERT_EQUAL_UINT32(8889, bench.board.imu.taken);
}

void test_a_reading_comes_through_as_it_was_measured_and_only_once() {
  Bench bench(kBeforeWrap);
  Micros last = 0;
  for (int i = 0; i < 20'000; ++i) {
    const float value = 0.005F * static_cast<float>(i);  // within every range
    bench.board.imu.reading.accel = {value, -value, 2.0F * value};
    bench.board.imu.reading.temperature = value;
    const std::uint32_t taken = bench.board.imu.taken;
    const bool updated = bench.sensors.imuUpdate(bench.board.now());
    TEST_ASSERT_TRUE(updated == (bench.board.imu.taken == taken + 1));
    if (updated) {
      const ImuRaw& raw = bench.sensors.getIMUMeas();
      TEST_ASSERT_TRUE(raw.accel == bench.board.imu.reading.accel);
      TEST_ASSERT_TRUE(raw.temperature == value);
      if (bench.board.imu.taken > 1) TEST_ASSERT_TRUE(elapsed(raw.sampled, last) < 3000);
      TEST_ASSERT_TRUE(raw.sampled != last);
      last = raw.sampled;
    }
    bench.board.advance(400);
  }
}

void test_a_sensor_is_not_asked_before_half_its_period() {
  Bench bench;
  bench.readings(1'000'000, 50, kMag);
  // 100 times: from 5 ms after a reading on, every 50 us up to and with the next.
  TEST_ASSERT_UINT32_WITHIN(100, 100 * 101, bench.board.mag.asked);
}

void test_a_silent_device_is_asked_again_in_every_pass_until_it_answers() {
  Bench bench;
  bench.readings(100'000, 100, kImu);
  bench.board.imu.dead = true;
  const std::uint32_t asked = bench.board.imu.asked;
  TEST_ASSERT_EQUAL_UINT32(0, bench.readings(50'000, 100, kImu));
  TEST_ASSERT_UINT32_WITHIN(10, 500, bench.board.imu.asked - asked);
  bench.board.imu.dead = false;
  TEST_ASSERT_TRUE(bench.sensors.imuUpdate(bench.board.now()));
}

void test_after_a_silence_there_is_no_burst_of_readings_and_each_missed_one_is_counted() {
  Bench bench;
  bench.board.imu.period = 1000;
  bench.readings(100'000, 100, kImu);
  bench.board.imu.dead = true;
  bench.readings(50'000, 100, kImu);
  bench.board.imu.dead = false;
  TEST_ASSERT_EQUAL_UINT32(0, bench.sensors.missed());
  TEST_ASSERT_UINT32_WITHIN(1, 10, bench.readings(10'000, 100, kImu));
  TEST_ASSERT_UINT32_WITHIN(1, 49, bench.sensors.missed());
}

void test_a_loop_too_slow_for_the_imu_counts_every_period_that_it_missed() {
  Bench bench;
  bench.board.imu.period = 1000;
  // Every 4 ms: three between two.
  TEST_ASSERT_EQUAL_UINT32(250, bench.readings(1'000'000, 4000, kImu));
  TEST_ASSERT_EQUAL_UINT32(249 * 3, bench.sensors.missed());
}

struct Freshness {
  const char* name;
  Micros timeout;
  bool (Sensors<FakeBoard>::*fresh)(Micros) const;
  bool (Sensors<FakeBoard>::*update)(Micros);
};

constexpr Freshness kFreshness[] = {
    {"imu", 20'000, &Sensors<FakeBoard>::imuFresh, &Sensors<FakeBoard>::imuUpdate},
    {"mag", 500'000, &Sensors<FakeBoard>::magFresh, &Sensors<FakeBoard>::magUpdate},
    {"alt", 500'000, &Sensors<FakeBoard>::altFresh, &Sensors<FakeBoard>::altUpdate},
    {"gps", 1'000'000, &Sensors<FakeBoard>::gpsFresh, &Sensors<FakeBoard>::gpsUpdate},
};

void silence(FakeBoard& board, bool dead) {
  board.imu.dead = board.mag.dead = board.alt.dead = board.gps.dead = dead;
}

void test_a_sensor_never_heard_is_not_there() {
  for (const Freshness& sensor : kFreshness) {
    for (const Micros start : {Micros{0}, kBeforeWrap}) {
      Bench bench(start);
      silence(bench.board, true);
      for (int i = 0; i < 5000; ++i) {
        TEST_ASSERT_FALSE_MESSAGE((bench.sensors.*sensor.fresh)(bench.board.now()), sensor.name);
        TEST_ASSERT_FALSE_MESSAGE((bench.sensors.*sensor.update)(bench.board.now()), sensor.name);
        bench.board.advance(1000);
      }
    }
  }
}

void test_a_sensor_is_lost_when_its_silence_exceeds_the_limit_and_found_when_it_speaks() {
  for (const Freshness& sensor : kFreshness) {
    Bench bench(0U - 100'000U);  // the wrap falls into the silence
    TEST_ASSERT_TRUE((bench.sensors.*sensor.update)(bench.board.now()));
    silence(bench.board, true);
    bench.board.advance(sensor.timeout);
    TEST_ASSERT_FALSE((bench.sensors.*sensor.update)(bench.board.now()));
    TEST_ASSERT_TRUE_MESSAGE((bench.sensors.*sensor.fresh)(bench.board.now()), sensor.name);
    bench.board.advance(1);
    TEST_ASSERT_FALSE((bench.sensors.*sensor.update)(bench.board.now()));
    TEST_ASSERT_FALSE_MESSAGE((bench.sensors.*sensor.fresh)(bench.board.now()), sensor.name);
    silence(bench.board, false);
    TEST_ASSERT_TRUE((bench.sensors.*sensor.update)(bench.board.now()));
    TEST_ASSERT_TRUE_MESSAGE((bench.sensors.*sensor.fresh)(bench.board.now()), sensor.name);
  }
}

void test_a_sensor_that_died_an_hour_ago_does_not_come_back_with_the_clock() {
  // 71.6 min after its last reading the clock shows the same time again.
  for (const Freshness& sensor : kFreshness) {
    Bench bench;
    TEST_ASSERT_TRUE((bench.sensors.*sensor.update)(bench.board.now()));
    silence(bench.board, true);
    const std::uint64_t wrap = std::uint64_t{1} << 32U;
    while (bench.board.time() < wrap + 2 * std::uint64_t{sensor.timeout}) {
      TEST_ASSERT_FALSE((bench.sensors.*sensor.update)(bench.board.now()));
      if (bench.board.time() > sensor.timeout) {
        TEST_ASSERT_FALSE_MESSAGE((bench.sensors.*sensor.fresh)(bench.board.now()), sensor.name);
      }
      // Slowly through the hour, closely around the wrap.
      const bool near = bench.board.time() + 1'000'000 > wrap;
      bench.board.advance(near ? 1000 : 100'000);
    }
  }
}

}  // namespace

void runRateTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_every_sample_of_an_imu_is_taken);
  RUN_TEST(test_a_device_much_faster_than_its_period_is_read_twice_as_often_at_most);
  RUN_TEST(test_a_reading_with_nan_or_infinity_is_none);
  RUN_TEST(test_a_reading_beyond_the_sensors_range_is_none_and_one_at_its_end_is_counted);
  RUN_TEST(test_a_sample_that_no_motion_can_give_is_left_out_and_four_in_a_row_are_believed);
  RUN_TEST(test_a_receiver_that_says_the_same_for_a_second_is_stuck_until_it_says_something_else);
  RUN_TEST(test_the_slower_sensors_keep_their_rates_too);
  RUN_TEST(test_a_device_slower_than_its_task_sets_the_rate_and_nothing_is_read_twice);
  RUN_TEST(test_a_reading_comes_through_as_it_was_measured_and_only_once);
  RUN_TEST(test_a_sensor_is_not_asked_before_half_its_period);
  RUN_TEST(test_a_silent_device_is_asked_again_in_every_pass_until_it_answers);
  RUN_TEST(test_after_a_silence_there_is_no_burst_of_readings_and_each_missed_one_is_counted);
  RUN_TEST(test_a_loop_too_slow_for_the_imu_counts_every_period_that_it_missed);
  RUN_TEST(test_a_sensor_never_heard_is_not_there);
  RUN_TEST(test_a_sensor_is_lost_when_its_silence_exceeds_the_limit_and_found_when_it_speaks);
  RUN_TEST(test_a_sensor_that_died_an_hour_ago_does_not_come_back_with_the_clock);
}
