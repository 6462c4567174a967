// The table of the command `sensors`: a good aircraft passes, each fault fails its own line and
// says what to do.
#include "CheckoutBench.h"
#include "suites.h"

using namespace strix;

namespace {

using Disturb = std::function<void(CheckoutBench&)>;

std::string measured(CheckoutBench& bench) {
  bench.begin();
  return bench.say("sensors", 5.1F);
}

void test_a_good_aircraft_passes_every_line() {
  CheckoutBench bench;
  const std::string text = measured(bench);
  assertHas(text, "25 PASS, 0 FAIL");
  assertHas(text, "1125 Hz, 1125 within 3 %");
  for (const std::string& line : linesOf(text)) TEST_ASSERT_LESS_OR_EQUAL_UINT32(80, line.size());
}

/// The table with this fault: exactly `failures` lines fail, among them the one with `line`, and
/// the advice has `advice`.
void expectFailure(const char* line, const char* advice, std::size_t failures,
                   const Disturb& disturb,
                   const SensorSet& found = {true, true, true, true, true}) {
  CheckoutBench bench;
  bench.board.found = found;
  bench.disturb = disturb;
  const std::string text = measured(bench);
  std::size_t count = 0;
  bool hasLine = false;
  const std::vector<std::string> lines = linesOf(text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].size() < 4 || lines[i].compare(lines[i].size() - 4, 4, "FAIL") != 0) continue;
    if (lines[i].find(" PASS, ") != std::string::npos) continue;  // the last line
    ++count;
    TEST_ASSERT_EQUAL_STRING("    -> ", lines[i + 1].substr(0, 7).c_str());
    if (lines[i].find(line) == std::string::npos) continue;
    hasLine = true;
    assertHas(lines[i + 1], advice);
  }
  TEST_ASSERT_TRUE_MESSAGE(hasLine, (std::string(line) + " does not fail:\n" + text).c_str());
  TEST_ASSERT_EQUAL_UINT32_MESSAGE(failures, count, text.c_str());
}

void test_an_absent_device_is_told_with_its_pins() {
  const auto silent = [](CheckoutBench& b) { b.board.imu.dead = true; };
  expectFailure("IMU           identity", "SDA to pin 18, SCL to pin 19", 1, silent,
                {false, true, true, true, true});
  expectFailure("magnetometer  identity", "SDA to pin 17, SCL to pin 16", 1, {},
                {true, false, true, true, true});
  expectFailure("altimeter     identity", "SDA to pin 17", 1, {}, {true, true, false, true, true});
  expectFailure("card          log file", "card is in", 1, {}, {true, true, true, true, false});
}

void test_an_absent_imu_on_spi_is_told_with_its_pins() {
  FakeBoard board;
  board.found.imu = false;
  CheckoutPins pins = kTestPins;
  pins.imuSda = 11;
  pins.imuScl = 13;
  pins.imuSelect = 10;
  pins.imuMiso = 12;
  Checkout<FakeBoard> checkout(board, benchConfig(), pins);
  checkout.begin();
  const std::string typed = "sensors\r";
  std::size_t sent = 0;
  std::string text;
  while (board.time() < 6'000'000) {
    checkout.step([&] { return sent < typed.size() ? typed[sent++] : -1; },
                  [&](const char* from, std::size_t count) {
                    text.append(from, count);
                    return count;
                  });
    board.advance(500);
  }
  assertHas(text, "SDA to pin 11, SCL to pin 13, CS to pin 10, SDO to pin 12");
  assertHasNot(text, "0x68");
}

void test_a_broken_data_ready_wire_is_told_with_its_pin() {
  expectFailure("IMU           rate", "check the wire from INT to pin 20", 1, [](CheckoutBench& b) {
    b.board.imu.period = 1000;
    ++b.board.faults[SensorFault::ImuLate];
  });
  // A loose one: the rate is right, but now and then an edge is missing.
  expectFailure("IMU           rate", "check the wire from INT to pin 20", 1, [](CheckoutBench& b) {
    if (b.board.time() % 1'000'000 < 300) ++b.board.faults[SensorFault::ImuLate];
  });
}

void test_a_silent_bus_and_a_lost_plug_are_told_apart() {
  // Rate, readings; the IMU's noise, mean and the accelerometer's g go with its silence.
  expectFailure("magnetometer  rate", "the bus is held low", 4, [](CheckoutBench& b) {
    b.board.mag.dead = true;
    ++b.board.faults[SensorFault::SlowBusHeld];
    ++b.board.faults[SensorFault::MagSilent];
  });
  expectFailure("altimeter     rate", "stopped answering", 4, [](CheckoutBench& b) {
    b.board.alt.dead = true;
    ++b.board.faults[SensorFault::AltSilent];
  });
  expectFailure("GPS           rate", "TX to pin 7", 3,
                [](CheckoutBench& b) { b.board.gps.dead = true; });
  expectFailure("GPS           rate", "baud rate", 4, [](CheckoutBench& b) {
    b.board.gps.dead = true;
    ++b.board.faults[SensorFault::GpsRejected];
  });
}

void test_a_wrong_rate_fails_on_either_side_of_3_percent() {
  expectFailure("magnetometer  rate", "another rate", 1,
                [](CheckoutBench& b) { b.board.mag.period = 10'400; });
  expectFailure("magnetometer  rate", "another rate", 1,
                [](CheckoutBench& b) { b.board.mag.period = 9'600; });
  CheckoutBench bench;
  bench.disturb = [](CheckoutBench& b) { b.board.mag.period = 10'200; };
  assertHas(measured(bench), "0 FAIL");
}

void test_noise_beyond_twice_the_design_fails() {
  const auto on = [](auto&& add) {
    return [add, random = Random(3)](CheckoutBench& b) mutable { add(b, random); };
  };
  expectFailure("accel noise", "shakes", 1, on([](CheckoutBench& b, Random& r) {
                  b.board.imu.reading.accel.x() += r.uniform(-0.11F, 0.11F);
                }));
  expectFailure("gyro noise", "shakes", 1, on([](CheckoutBench& b, Random& r) {
                  b.board.imu.reading.gyro.z() += r.uniform(-0.012F, 0.012F);
                }));
  expectFailure("magnetometer  noise", "disturbs", 1, on([](CheckoutBench& b, Random& r) {
                  b.board.mag.reading.field.y() += r.uniform(-1.2F, 1.2F);
                }));
  expectFailure("altimeter     noise", "wind", 1, on([](CheckoutBench& b, Random& r) {
                  b.board.alt.reading.pressure += r.uniform(-8.0F, 8.0F);
                }));
}

void test_means_that_no_good_sensor_gives_fail() {
  expectFailure("mean accel", "calibrate", 1,
                [](CheckoutBench& b) { b.board.imu.reading.accel *= 1.04F; });
  // A bias that large is also a turn.
  expectFailure("gyro bias", "another sensor", 2,
                [](CheckoutBench& b) { b.board.imu.reading.gyro.x() += 0.21F; });
  expectFailure("magnetometer  field", "iron", 1,
                [](CheckoutBench& b) { b.board.mag.reading.field *= 1.5F; });
  expectFailure("altimeter     pressure", "another sensor", 1,
                [](CheckoutBench& b) { b.board.alt.reading.pressure -= 71'000.0F; });
  // 60 hPa less is 510 m more: beyond any weather where GPS says 40 m.
  expectFailure("altimeter     height", "weather", 1,
                [](CheckoutBench& b) { b.board.alt.reading.pressure -= 6'500.0F; });
  expectFailure("GPS           fix", "open sky", 1,
                [](CheckoutBench& b) { b.board.gps.reading.fix = 0; });
  expectFailure("GPS           HDOP", "sky", 1,
                [](CheckoutBench& b) { b.board.gps.reading.hdop = 3.0F; });
}

void test_a_sensor_that_repeats_itself_is_called_stuck() {
  expectFailure("magnetometer  readings", "repeats itself", 1, [](CheckoutBench& b) {
    b.board.mag.reading.field = b.board.magMounting * b.board.fieldNed;
  });
  expectFailure("IMU           readings", "repeats itself", 1,
                [](CheckoutBench& b) { b.board.faults[SensorFault::ImuStuck] += 20; });
}

void test_clipped_and_unsound_readings_are_counted() {
  // For 1.2 ms, one or two samples of the IMU, every 2.7 s.
  const auto now = [](CheckoutBench& b) { return b.board.time() % 2'700'000 < 1200; };
  // A blow also moves the aircraft, and adds noise.
  expectFailure("IMU           readings", "plugs", 3, [now](CheckoutBench& b) {
    if (now(b)) b.board.imu.reading.accel.x() = 32.0F * kGravity;
  });
  expectFailure("magnetometer  readings", "plugs", 1, [](CheckoutBench& b) {
    if (b.board.time() % 1'000'000 < 10'000) b.board.mag.reading.field.x() = kNaN;
  });
}

void test_an_aircraft_that_moves_is_not_measured_as_still() {
  expectFailure("aircraft      stood still", "touch nothing", 2, [](CheckoutBench& b) {
    if (b.board.time() > 4'000'000 && b.board.time() < 4'300'000) {
      b.board.imu.reading.gyro.z() += 0.3F;
    }
  });
}

void test_no_step_asks_two_of_the_slow_sensors() {
  // Together with the IMU that would take longer than from one IMU sample to the next.
  CheckoutBench bench;
  bench.begin();
  for (int i = 0; i < 300; ++i) {
    const std::uint32_t imu = bench.board.imu.asked;
    const std::uint32_t slow =
        bench.board.mag.asked + bench.board.alt.asked + bench.board.gps.asked;
    bench.step();
    TEST_ASSERT_EQUAL_UINT32(imu + 1, bench.board.imu.asked);
    TEST_ASSERT_EQUAL_UINT32(slow + 1,
                             bench.board.mag.asked + bench.board.alt.asked + bench.board.gps.asked);
  }
}

void test_each_sensor_can_be_watched_until_enter() {
  CheckoutBench bench;
  bench.begin();
  bench.noise = 0.0F;
  assertHas(bench.say("imu", 1.2F), "accel 0.00 0.00 -9.81 m/s^2");
  assertHas(bench.say("mag", 1.2F), "field 15.6 1.1 48.0 uT, 50.5 uT (body axes)");
  assertHas(bench.say("baro", 1.2F), "1008.00 hPa  25.0 degC");
  assertHas(bench.say("gps", 1.2F),
            "3D fix  11 satellites  HDOP 0.9  57.4200000 N 11.9700000 E  40.0 m");
  assertHas(bench.say("pilot", 1.2F), "arm off  kill off  start off");
  bench.board.pilot.kill = true;
  bench.output.clear();
  bench.run(0.6F);
  assertHas(bench.output, "kill ON");
  TEST_ASSERT_EQUAL_STRING("> ", bench.say("", 2.0F).c_str());
  bench.board.mag.dead = true;
  assertHas(bench.say("mag", 0.6F), "no data");
}

}  // namespace

void runSensorTests() {
  RUN_TEST(test_a_good_aircraft_passes_every_line);
  RUN_TEST(test_an_absent_device_is_told_with_its_pins);
  RUN_TEST(test_an_absent_imu_on_spi_is_told_with_its_pins);
  RUN_TEST(test_a_broken_data_ready_wire_is_told_with_its_pin);
  RUN_TEST(test_a_silent_bus_and_a_lost_plug_are_told_apart);
  RUN_TEST(test_a_wrong_rate_fails_on_either_side_of_3_percent);
  RUN_TEST(test_noise_beyond_twice_the_design_fails);
  RUN_TEST(test_means_that_no_good_sensor_gives_fail);
  RUN_TEST(test_a_sensor_that_repeats_itself_is_called_stuck);
  RUN_TEST(test_clipped_and_unsound_readings_are_counted);
  RUN_TEST(test_an_aircraft_that_moves_is_not_measured_as_still);
  RUN_TEST(test_no_step_asks_two_of_the_slow_sensors);
  RUN_TEST(test_each_sensor_can_be_watched_until_enter);
}
