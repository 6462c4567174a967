/// Commands at a battery's voltage and under a slew limit, beside what motors make of them.
#include <Motors.h>
#include <unity.h>
#include <vehicles/Vehicles.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "Random.h"

using namespace strix;

namespace {

/// Speed of a motor at this command and voltage, from the published curve, in double precision.
double turned(const Vehicle& vehicle, float command, double volts) {
  const CommandCurve& c = vehicle.command;
  const double above = static_cast<double>(command) - c.offset;
  const double n = c.quadratic == 0.0F ? above / c.linear : std::sqrt(above / c.quadratic);
  return n * volts / vehicle.curveVoltage;
}

/// Sum of thrusts, N.
double lifted(const Vehicle& vehicle, const EscCommands& commands, double volts) {
  double sum = 0.0;
  for (const float command : commands) {
    const double n = turned(vehicle, command, volts);
    sum += static_cast<double>(vehicle.thrustConstant) * n * n;
  }
  return sum;
}

float weight(const Vehicle& vehicle) { return vehicle.mass * kGravity; }

/// V, of a battery with this in each cell.
float battery(const Vehicle& vehicle, float cell) {
  return cell * static_cast<float>(vehicle.batteryCells);
}

constexpr float kCells[] = {3.3F, 3.5F, 3.8F, 4.0F, 4.2F};
/// Of the wrench: float rounding of a command, 1e-7 of it, where the curve is flat.
constexpr double kRounding = 2e-5;

void test_thrust_is_the_one_wanted_from_idle_to_the_cap_at_every_voltage() {
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    for (const float cell : kCells) {
      const float volts = battery(vehicle, cell);
      Motors motors(vehicle);
      motors.setBatteryVoltage(volts);
      motors.arm();
      const double idle = lifted(vehicle, motors.commands(), static_cast<double>(volts));
      motors.commandControl({1e5F, Vector3f::Zero()});
      const double cap = lifted(vehicle, motors.commands(), static_cast<double>(volts));
      TEST_ASSERT_TRUE(cap > 1.2 * static_cast<double>(weight(vehicle)));
      for (int part = 0; part <= 50; ++part) {
        const double wanted = idle + (cap - idle) * 0.02 * part;
        motors.commandControl({static_cast<float>(wanted), Vector3f::Zero()});
        const double got = lifted(vehicle, motors.commands(), static_cast<double>(volts));
        TEST_ASSERT_DOUBLE_WITHIN(kRounding * cap, wanted, got);
      }
    }
  }
}

void test_the_achieved_wrench_is_what_the_motors_give_at_their_voltage() {
  Random random(6);
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    for (const float cell : kCells) {
      const float volts = battery(vehicle, cell);
      Motors motors(vehicle);
      motors.setBatteryVoltage(volts);
      motors.arm();
      for (int trial = 0; trial < 200; ++trial) {
        motors.commandControl({random.uniform(-1.0F, 6.0F) * weight(vehicle), random.vector(1.0F)});
        SquaredSpeeds squares{};
        double sum = 0.0;
        for (std::size_t i = 0; i < kMotorCount; ++i) {
          const double n = turned(vehicle, motors.commands()[i], static_cast<double>(volts));
          squares[i] = static_cast<float>(n * n);
          sum += n;
          TEST_ASSERT_TRUE(motors.commands()[i] <= vehicle.commandFlightMax);
        }
        const Wrench given = motors.wrenchOf(squares);
        const float size = 4.0F * vehicle.thrustConstant * squares[0] + weight(vehicle);
        const float allowed = static_cast<float>(kRounding) * size;
        TEST_ASSERT_FLOAT_WITHIN(allowed, given.thrust, motors.achieved().thrust);
        for (int axis = 0; axis < 3; ++axis) {
          TEST_ASSERT_FLOAT_WITHIN(allowed, given.torque[axis], motors.achieved().torque[axis]);
        }
        const double unit = std::string_view(vehicle.speedUnit) == "rad/s" ? 6.283185307 : 1.0;
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * sum, 0.25 * sum / unit,
                                  static_cast<double>(motors.meanRevolutions()));
      }
    }
  }
}

void test_a_low_battery_leaves_less_thrust_and_the_wrench_that_is_left_has_the_same_priorities() {
  const Vehicle& vehicle = kQuad5in;
  Motors motors(vehicle);
  motors.arm();
  const Wrench much{1e3F, {0.3F, -0.2F, 0.0F}};
  motors.commandControl(much);
  const float full = motors.achieved().thrust;
  motors.setBatteryVoltage(battery(vehicle, 3.3F));
  motors.commandControl(much);
  TEST_ASSERT_TRUE(motors.achieved().thrust < 0.85F * full);
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, 0.3F, motors.achieved().torque.x());
  TEST_ASSERT_FLOAT_WITHIN(1e-4F, -0.2F, motors.achieved().torque.y());
}

void test_no_voltage_makes_the_idle_command_smaller() {
  // An ESC stops its motor at a command: idling below that in flight is a motor lost.
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    Motors motors(vehicle);
    const float idle = motors.command(vehicle.speedFlightMin);
    for (float cell = 2.0F; cell < 5.0F; cell += 0.05F) {
      motors.setBatteryVoltage(battery(vehicle, cell));
      motors.arm();
      for (const float command : motors.commands()) TEST_ASSERT_TRUE(command >= idle);
      for (const float thrust : {-100.0F, 0.0F, 0.5F, 5.0F}) {
        motors.commandControl({thrust, {0.05F, 0.1F, -0.02F}});
        for (const float command : motors.commands()) TEST_ASSERT_TRUE(command >= idle);
      }
      // And the motors never turn slower than their flight idle.
      if (cell < 2.9F) continue;  // beyond what is compensated
      motors.commandControl({-100.0F, Vector3f::Zero()});
      const double volts = static_cast<double>(battery(vehicle, cell));
      const double n = turned(vehicle, motors.commands()[0], volts);
      TEST_ASSERT_TRUE(n >= static_cast<double>(vehicle.speedFlightMin) * (1.0 - 1e-5));
    }
  }
}

void test_a_voltage_that_is_not_known_changes_nothing_and_a_wrong_one_little() {
  const Vehicle& vehicle = kQuad5in;
  const Wrench hover{weight(vehicle), Vector3f::Zero()};
  Motors motors(vehicle);
  motors.arm();
  motors.commandControl(hover);
  const float usual = motors.commands()[0];
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float unknown : {0.0F, kNaN, -20.0F, kInfinity, -kInfinity}) {
    motors.setBatteryVoltage(19.0F);
    motors.commandControl(hover);
    TEST_ASSERT_TRUE(motors.commands()[0] > usual + 10.0F);
    motors.setBatteryVoltage(unknown);
    motors.commandControl(hover);
    TEST_ASSERT_EQUAL_FLOAT(usual, motors.commands()[0]);
  }
  const float speed = motors.speedOf(usual);
  motors.setBatteryVoltage(1e-38F);
  motors.commandControl(hover);
  TEST_ASSERT_FLOAT_WITHIN(0.1F, 1.35F * speed, motors.speedOf(motors.commands()[0]));
  motors.setBatteryVoltage(1e30F);
  motors.commandControl(hover);
  TEST_ASSERT_FLOAT_WITHIN(0.1F, 0.85F * speed, motors.speedOf(motors.commands()[0]));
}

void test_compensation_can_be_switched_off() {
  MotorConfig config;
  config.voltageCompensation = false;
  Motors plain(kQuad5in, config);
  Motors usual(kQuad5in);
  plain.arm();
  usual.arm();
  plain.setBatteryVoltage(19.0F);
  const Wrench hover{weight(kQuad5in), Vector3f::Zero()};
  plain.commandControl(hover);
  usual.commandControl(hover);
  TEST_ASSERT_EQUAL_FLOAT(usual.commands()[0], plain.commands()[0]);
}

void test_a_slew_limit_bounds_each_motor_s_change_and_the_achieved_wrench_says_so() {
  Random random(7);
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    MotorConfig config;
    config.slew = 5.0F * vehicle.speedFlightMin;  // a step of 1 % of idle
    Motors motors(vehicle, config);
    motors.arm();
    const float step = config.slew / Motors::kRateHz;
    EscCommands last = motors.commands();
    bool limited = false;
    for (int trial = 0; trial < 5000; ++trial) {
      if (trial % 500 == 0) motors.setBatteryVoltage(vehicle.curveVoltage);
      const Wrench wanted{random.uniform(0.0F, 4.0F) * weight(vehicle), random.vector(0.3F)};
      for (int held = 0; held < 5; ++held) {
        motors.commandControl(wanted);
        SquaredSpeeds squares{};
        for (std::size_t i = 0; i < kMotorCount; ++i) {
          const float n = motors.speedOf(motors.commands()[i]);
          // A command is rounded by 1e-7 of it: 1e-4 us at 0.6 us a rev/s.
          TEST_ASSERT_TRUE(std::abs(n - motors.speedOf(last[i])) < step + 2e-3F);
          squares[i] = n * n;
        }
        last = motors.commands();
        const Wrench given = motors.wrenchOf(squares);
        TEST_ASSERT_FLOAT_WITHIN(1e-3F * weight(vehicle), given.thrust, motors.achieved().thrust);
        limited = limited || given.thrust < 0.9F * wanted.thrust;
      }
    }
    TEST_ASSERT_TRUE(limited);
  }
}

void test_a_slewed_motor_arrives_and_neither_arming_nor_disarming_waits() {
  const Vehicle& vehicle = kQuad5in;
  MotorConfig config;
  config.slew = 1000.0F;  // rev/s^2: 58 steps of 2 rev/s from idle to hover
  Motors motors(vehicle, config);
  Motors free(vehicle);
  const Wrench hover{weight(vehicle), {0.02F, 0.01F, 0.005F}};
  motors.arm();
  free.arm();
  for (const float command : motors.commands()) {
    TEST_ASSERT_EQUAL_FLOAT(motors.command(vehicle.speedFlightMin), command);
  }
  free.commandControl(hover);
  int steps = 0;
  while (motors.commands() != free.commands() && steps < 200) {
    motors.commandControl(hover);
    ++steps;
  }
  TEST_ASSERT_TRUE(steps > 50 && steps < 70);
  motors.disarm();
  for (const float command : motors.commands()) {
    TEST_ASSERT_EQUAL_FLOAT(vehicle.commandOff, command);
  }
  TEST_ASSERT_EQUAL_FLOAT(0.0F, motors.meanRevolutions());
}

void test_a_vehicle_whose_rotors_cannot_fly_never_arms() {
  Vehicle vehicle = kQuad5in;
  TEST_ASSERT_TRUE(Motors(vehicle).valid());
  for (Rotor& rotor : vehicle.rotors) rotor.spin = Spin::Clockwise;
  Motors motors(vehicle);
  TEST_ASSERT_FALSE(motors.valid());
  motors.arm();
  TEST_ASSERT_FALSE(motors.armed());
  motors.commandControl({weight(vehicle), Vector3f::Zero()});
  for (const float command : motors.commands()) {
    TEST_ASSERT_EQUAL_FLOAT(vehicle.commandOff, command);
  }
}

}  // namespace

void runMotorConfigTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_thrust_is_the_one_wanted_from_idle_to_the_cap_at_every_voltage);
  RUN_TEST(test_the_achieved_wrench_is_what_the_motors_give_at_their_voltage);
  RUN_TEST(
      test_a_low_battery_leaves_less_thrust_and_the_wrench_that_is_left_has_the_same_priorities);
  RUN_TEST(test_no_voltage_makes_the_idle_command_smaller);
  RUN_TEST(test_a_voltage_that_is_not_known_changes_nothing_and_a_wrong_one_little);
  RUN_TEST(test_compensation_can_be_switched_off);
  RUN_TEST(test_a_slew_limit_bounds_each_motor_s_change_and_the_achieved_wrench_says_so);
  RUN_TEST(test_a_slewed_motor_arrives_and_neither_arming_nor_disarming_waits);
  RUN_TEST(test_a_vehicle_whose_rotors_cannot_fly_never_arms);
}
