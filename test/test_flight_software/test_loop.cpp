// The loop's rates, its clock that wraps, and that it waits for nothing.
#include <cstring>
#include <limits>
#include <vector>

#include "FakeFlight.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr Micros before(Micros wrapAfter) { return 0U - wrapAfter; }

void test_the_escs_are_written_500_times_a_second() {
  for (const Micros pass :
       {Micros{100}, Micros{333}, Micros{500}, Micros{1000}, Micros{1400}, Micros{2000}}) {
    FakeFlight flight;
    flight.passTime = pass;
    flight.software.setup();
    flight.board.escWrites.clear();
    flight.run(10.0F);
    TEST_ASSERT_EQUAL_UINT32(5000, flight.board.escWrites.size());
    // In phase: the n-th write comes in the first pass at or after n periods.
    for (std::size_t i = 0; i < flight.board.escWrites.size(); ++i) {
      const std::uint64_t due = i * 2000;
      TEST_ASSERT_TRUE(flight.board.escWrites[i].time >= due);
      TEST_ASSERT_TRUE(flight.board.escWrites[i].time < due + pass);
    }
  }
}

void test_the_escs_are_told_off_before_the_first_pass() {
  FakeFlight flight;
  flight.software.setup();
  TEST_ASSERT_EQUAL_UINT32(1, flight.board.escWrites.size());
  TEST_ASSERT_TRUE(areOff(flight.board.esc()));
}

void test_the_clock_is_read_once_a_pass() {
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Hold);
  for (int i = 0; i < 1000; ++i) {
    const std::uint32_t reads = flight.board.clockReads;
    flight.pass();
    TEST_ASSERT_EQUAL_UINT32(reads + 1, flight.board.clockReads);
  }
}

/// The same flight whatever the clock shows at power-up. Readings move a little, so that a wrong
/// time step shows in the commands.
struct Script {
  std::vector<FakeBoard::EscWrite> writes;
  std::vector<FlightState> states;
  VehicleState estimate;
  std::uint32_t overruns = 0;
  std::uint32_t logBytes = 0;

  explicit Script(Micros start, Micros magOffset = 0) {
    FlightSoftwareConfig config = lowFlight();
    config.gpsSmoothing = 0.0F;  // these readings contradict GPS, which has to win
    FakeFlight flight(start, config);
    flight.board.mag.offset = magOffset;
    flight.software.setup();
    std::uint64_t step = 0;
    const auto runTo = [&](float seconds) {
      while (flight.board.time() < static_cast<std::uint64_t>(seconds * 1e6F)) {
        const float wobble = 0.02F * sine(static_cast<float>(step++ % 4000) * (kPi / 2000.0F));
        flight.board.hold(eulerToQuaternion({wobble, -wobble, 0.3F}), {wobble, wobble, 0.0F});
        flight.board.alt.reading.pressure = 100'800.0F + 50.0F * wobble;
        flight.pass();
        if (states.empty() || states.back() != flight.state()) states.push_back(flight.state());
      }
    };
    runTo(5.5F);
    flight.board.pilot.arm = true;
    runTo(6.5F);
    flight.board.pilot.start = true;
    runTo(18.0F);
    flight.board.gps.dead = true;
    runTo(20.0F);
    writes = flight.board.escWrites;
    estimate = flight.software.estimator().state();
    overruns = flight.software.overruns();
    logBytes = flight.software.logger().status(0).bytes;
  }
};

template <class T>
bool sameBits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof a) == 0;  // NOLINT(bugprone-suspicious-memory-comparison)
}

bool same(const Script& a, const Script& b) {
  if (a.states != b.states || a.overruns != b.overruns || a.logBytes != b.logBytes ||
      a.writes.size() != b.writes.size()) {
    return false;
  }
  for (std::size_t i = 0; i < a.writes.size(); ++i) {
    if (a.writes[i].time != b.writes[i].time ||
        !sameBits(a.writes[i].commands, b.writes[i].commands)) {
      return false;
    }
  }
  return sameBits(a.estimate.attitude, b.estimate.attitude) &&
         a.estimate.positionNed == b.estimate.positionNed &&
         a.estimate.velocityNed == b.estimate.velocityNed;
}

void test_a_clock_that_wraps_in_flight_changes_no_bit_of_it() {
  const Script reference(0);
  // The reference itself flew, through all states.
  const std::vector<FlightState> expected{
      FlightState::Boot,    FlightState::Idle,   FlightState::Armed,
      FlightState::Takeoff, FlightState::Hold,   FlightState::Waypoint,
      FlightState::Hold,    FlightState::Return, FlightState::Land};
  TEST_ASSERT_TRUE(reference.states.size() >= expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    TEST_ASSERT_TRUE(reference.states[i] == expected[i]);
  }
  TEST_ASSERT_TRUE(same(reference, Script(before(10'000'000))));  // while it flies
  for (std::uint32_t tenth = 1; tenth < 200; tenth += 11) {       // in every state
    TEST_ASSERT_TRUE(same(reference, Script(before(tenth * 100'000))));
  }
  TEST_ASSERT_TRUE(same(reference, Script(0x80000000U)));  // where a signed clock would wrap
}

void test_a_clock_that_wraps_as_the_calibration_ends_changes_no_bit_either() {
  // There the filter takes its first measurements, and no older time of any is known.
  for (const Micros magOffset : {Micros{0}, Micros{800}, Micros{1300}, Micros{1800}}) {
    const Script reference(0, magOffset);
    for (Micros wrapAfter = 2'000'000; wrapAfter < 2'003'000; wrapAfter += 500) {
      TEST_ASSERT_TRUE(same(reference, Script(before(wrapAfter), magOffset)));
    }
  }
}

void test_without_any_device_the_loop_keeps_running_and_the_motors_are_off() {
  FakeFlight flight;
  flight.board.found = {};
  flight.board.imu.dead = flight.board.mag.dead = true;
  flight.board.alt.dead = flight.board.gps.dead = true;
  flight.board.sd.refuses = true;
  flight.software.setup();
  flight.board.escWrites.clear();
  flight.board.pilot.arm = true;
  flight.run(5.0F);
  flight.board.pilot.start = true;
  flight.run(2.0F);
  TEST_ASSERT_FALSE(flight.arm());
  flight.run(3.0F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Boot);
  TEST_ASSERT_UINT32_WITHIN(2, 5000, flight.board.escWrites.size());
  for (const auto& write : flight.board.escWrites) TEST_ASSERT_TRUE(areOff(write.commands));
}

void test_a_loop_of_1400_us_flies_the_same_mission() {
  FakeFlight flight;
  flight.passTime = 1400;
  flight.getReady();
  flight.reach(FlightState::Land);
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Idle, 5.0F));
  // 1.4 ms are too long for the IMU's 1 ms, and that is counted.
  TEST_ASSERT_TRUE(flight.software.overruns() > 100);
}

void test_a_loop_fast_enough_counts_no_overrun() {
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Land);
  TEST_ASSERT_EQUAL_UINT32(0, flight.software.overruns());
}

void test_one_slow_pass_is_an_overrun_and_not_a_fall() {
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Hold);
  flight.board.advance(15'000);
  flight.run(0.1F);
  TEST_ASSERT_TRUE(flight.software.overruns() > 0);
  TEST_ASSERT_FALSE(flight.state() == FlightState::Safe);
  TEST_ASSERT_TRUE(areOn(flight.board.esc()));
}

void test_the_origin_stands_still_once_the_motors_are_armed() {
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Armed);
  const GeoPoint origin = flight.software.sensors().origin();
  TEST_ASSERT_EQUAL_INT32(flight.board.gps.reading.latitude, origin.latitude);
  TEST_ASSERT_EQUAL_INT32(flight.board.gps.reading.longitude, origin.longitude);
  flight.board.gps.reading.latitude += 100;
  flight.run(2.0F);
  TEST_ASSERT_EQUAL_INT32(origin.latitude, flight.software.sensors().origin().latitude);
}

void test_the_origin_stays_where_it_was_after_landing_somewhere_else() {
  // Or home would wander to the landing place while the aircraft waits there.
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Land);
  const GeoPoint origin = flight.software.sensors().origin();
  flight.board.gps.reading.latitude += 200;  // 2 m north
  TEST_ASSERT_TRUE(flight.runUntil(FlightState::Idle, 5.0F));
  flight.run(10.0F);
  TEST_ASSERT_EQUAL_INT32(origin.latitude, flight.software.sensors().origin().latitude);
}

void test_a_fix_that_is_not_on_earth_does_not_move_the_origin() {
  FakeFlight flight;
  flight.software.setup();
  flight.run(3.0F);
  const GpsRaw good = flight.board.gps.reading;
  flight.board.gps.reading.latitude = -1'686'134'375;
  flight.run(0.3F);
  flight.board.gps.reading = good;
  flight.board.gps.reading.longitude = 2'000'000'000;
  flight.run(0.3F);
  flight.board.gps.reading = good;
  flight.board.gps.reading.altitude = std::numeric_limits<std::int32_t>::min();
  flight.run(0.3F);
  TEST_ASSERT_EQUAL_INT32(good.latitude, flight.software.sensors().origin().latitude);
  TEST_ASSERT_EQUAL_INT32(good.longitude, flight.software.sensors().origin().longitude);
  TEST_ASSERT_EQUAL_INT32(good.altitude, flight.software.sensors().origin().altitude);
}

}  // namespace

void runLoopTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_escs_are_written_500_times_a_second);
  RUN_TEST(test_the_escs_are_told_off_before_the_first_pass);
  RUN_TEST(test_the_clock_is_read_once_a_pass);
  RUN_TEST(test_a_clock_that_wraps_in_flight_changes_no_bit_of_it);
  RUN_TEST(test_a_clock_that_wraps_as_the_calibration_ends_changes_no_bit_either);
  RUN_TEST(test_without_any_device_the_loop_keeps_running_and_the_motors_are_off);
  RUN_TEST(test_a_loop_of_1400_us_flies_the_same_mission);
  RUN_TEST(test_a_loop_fast_enough_counts_no_overrun);
  RUN_TEST(test_one_slow_pass_is_an_overrun_and_not_a_fall);
  RUN_TEST(test_the_origin_stands_still_once_the_motors_are_armed);
  RUN_TEST(test_the_origin_stays_where_it_was_after_landing_somewhere_else);
  RUN_TEST(test_a_fix_that_is_not_on_earth_does_not_move_the_origin);
}
