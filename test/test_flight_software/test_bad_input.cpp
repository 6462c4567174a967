// Nonsense from every side: whatever comes in, what goes out to the motors is sound.
#include "FakeFlight.h"
#include "Random.h"
#include "suites.h"

using namespace strix;

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A number that no sensor should give, or one it might.
float nonsense(Random& random) {
  constexpr float kBad[] = {kNaN, kInfinity, -kInfinity, 0.0F, 1e30F, -1e30F, 1e-40F, 3.4e38F};
  const std::uint32_t pick = random.below(12);
  return pick < 8 ? kBad[pick] : random.uniform(-1000.0F, 1000.0F);
}

std::int32_t nonsenseInteger(Random& random) {
  return static_cast<std::int32_t>((random.bits() << 8U) ^ random.bits());
}

void spoil(FakeBoard& board, Random& random) {
  const auto axis = static_cast<Eigen::Index>(random.below(3));
  switch (random.below(10)) {
    case 0:
      board.imu.reading.accel(axis) = nonsense(random);
      break;
    case 1:
      board.imu.reading.gyro(axis) = nonsense(random);
      break;
    case 2:
      board.mag.reading.field(axis) = nonsense(random);
      break;
    case 3:
      board.alt.reading.pressure = nonsense(random);
      break;
    case 4:
      board.gps.reading.latitude = nonsenseInteger(random);
      break;
    case 5:
      board.gps.reading.longitude = nonsenseInteger(random);
      break;
    case 6:
      board.gps.reading.speedKnots = nonsense(random);
      break;
    case 7:
      board.gps.reading.courseDeg = nonsense(random);
      break;
    case 8:
      board.gps.reading.hdop = nonsense(random);
      break;
    default:
      board.sd.refuses = !board.sd.refuses;
      break;
  }
}

void throwSwitches(PilotSwitches& pilot, Random& random) {
  if (random.chance(0.02F)) pilot.arm = !pilot.arm;
  if (random.chance(0.02F)) pilot.start = !pilot.start;
  if (random.chance(pilot.kill ? 0.1F : 0.002F)) pilot.kill = !pilot.kill;
}

/// One pass, after which whatever was written must fit the state that the aircraft is in.
void checkedPass(FakeFlight& flight) {
  const std::size_t before = flight.board.escWrites.size();
  flight.pass();
  for (std::size_t i = before; i < flight.board.escWrites.size(); ++i) {
    const EscCommands& commands = flight.board.escWrites[i].commands;
    const FlightState state = flight.state();
    const bool mayTurn =
        state != FlightState::Boot && state != FlightState::Idle && state != FlightState::Safe;
    TEST_ASSERT_TRUE(mayTurn ? areOn(commands) : areOff(commands));
  }
}

void test_whatever_the_sensors_say_each_command_is_off_or_within_its_limits() {
  Random random(70);
  for (int trial = 0; trial < 100; ++trial) {
    FakeFlight flight(random.bits() << 8U);
    flight.passTime = 1000;
    flight.getReady();
    flight.reach(kMotorStates[random.below(5)]);
    for (int i = 0; i < 500; ++i) {
      if (random.chance(0.02F)) spoil(flight.board, random);
      throwSwitches(flight.board.pilot, random);
      checkedPass(flight);
    }
  }
}

void test_nonsense_from_power_up_on_is_survived_on_the_ground() {
  Random random(71);
  for (int trial = 0; trial < 20; ++trial) {
    FakeFlight flight(random.bits() << 8U);
    flight.passTime = 1000;
    flight.software.setup();
    for (int i = 0; i < 5000; ++i) {
      if (random.chance(0.001F)) spoil(flight.board, random);
      if (random.chance(0.002F)) flight.board.hold(random.rotation());
      throwSwitches(flight.board.pilot, random);
      checkedPass(flight);
    }
  }
}

void test_passes_of_any_length_keep_the_commands_sound() {
  Random random(72);
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Hold);
  for (int i = 0; i < 5000; ++i) {
    flight.passTime = random.chance(0.01F) ? random.below(3'000'000) : random.below(3000);
    checkedPass(flight);
    if (flight.state() == FlightState::Safe || flight.state() == FlightState::Idle) {
      flight.board.pilot = {};
      flight.passTime = 500;
      flight.run(2.5F);  // until the last late pass is forgotten
      flight.reach(FlightState::Takeoff);
    }
  }
}

void test_bad_magnetometer_altimeter_and_gps_readings_leave_the_estimate_sound() {
  // Only the IMU moves the state by itself; a bad measurement is gated away.
  FakeFlight flight;
  flight.getReady();
  flight.reach(FlightState::Armed);
  flight.board.mag.reading.field = {kNaN, 1e30F, kInfinity};
  flight.board.alt.reading.pressure = kNaN;
  flight.board.gps.reading.speedKnots = kNaN;
  flight.board.gps.reading.latitude = -900'000'000;
  flight.run(5.0F);
  TEST_ASSERT_TRUE(flight.state() == FlightState::Armed);
  const VehicleState& s = flight.software.estimator().state();
  TEST_ASSERT_TRUE(flight.software.estimator().healthy());
  TEST_ASSERT_TRUE(cosTilt(s.attitude) > 0.999F);
}

}  // namespace

void runBadInputTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_whatever_the_sensors_say_each_command_is_off_or_within_its_limits);
  RUN_TEST(test_nonsense_from_power_up_on_is_survived_on_the_ground);
  RUN_TEST(test_passes_of_any_length_keep_the_commands_sound);
  RUN_TEST(test_bad_magnetometer_altimeter_and_gps_readings_leave_the_estimate_sound);
}
