#include <Motors.h>
#include <unity.h>
#include <vehicles/Vehicles.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "Random.h"

using namespace strix;

void runAllocationTests();   // test_allocation.cpp
void runMotorConfigTests();  // test_motor_config.cpp
void runMotorVectorTests();  // test_motor_vectors.cpp

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

using Dense = Eigen::Matrix4d;

/// Thrust and torque of unit squared speeds, from moments r x F written out in double precision.
Dense denseEffect(const Vehicle& vehicle) {
  Dense effect;
  for (int i = 0; i < 4; ++i) {
    const Rotor& rotor = vehicle.rotors[static_cast<std::size_t>(i)];
    const double thrust = vehicle.thrustConstant;
    const double drag = vehicle.torqueConstant;
    effect.col(i) << thrust, -rotor.y * thrust, rotor.x * thrust,
        rotor.spin == Spin::Clockwise ? -drag : drag;
  }
  return effect;
}

Eigen::Vector4d stack(const Wrench& w) {
  return {w.thrust, w.torque.x(), w.torque.y(), w.torque.z()};
}

Eigen::Vector4d stack(const SquaredSpeeds& s) { return {s[0], s[1], s[2], s[3]}; }

Wrench wrench(double thrust, double roll, double pitch, double yaw) {
  return {static_cast<float>(thrust),
          {static_cast<float>(roll), static_cast<float>(pitch), static_cast<float>(yaw)}};
}

float weight(const Vehicle& vehicle) { return vehicle.mass * kGravity; }

/// Limits of the squared speeds, from the published curve.
struct Limits {
  explicit Limits(const Vehicle& v) {
    const double above = static_cast<double>(v.commandFlightMax) - v.command.offset;
    const double top = v.command.quadratic == 0.0F ? above / v.command.linear
                                                   : std::sqrt(above / v.command.quadratic);
    low = static_cast<double>(v.speedFlightMin) * v.speedFlightMin;
    high = top * top;
  }
  double low = 0.0;
  double high = 0.0;
};

/// Largest wrench on each axis that the rotors can give about the middle of their range.
Eigen::Vector4d authority(const Vehicle& vehicle) {
  const Limits limits(vehicle);
  return denseEffect(vehicle).cwiseAbs() *
         Eigen::Vector4d::Constant(0.5 * (limits.high - limits.low));
}

void test_more_thrust_on_the_left_rolls_right_in_front_pitches_up_and_against_the_spin_yaws() {
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    const Motors motors(vehicle);
    const float hover = weight(vehicle);
    const SquaredSpeeds roll = motors.allocateControl(wrench(hover, 0.02, 0.0, 0.0));
    const SquaredSpeeds pitch = motors.allocateControl(wrench(hover, 0.0, 0.02, 0.0));
    const SquaredSpeeds yaw = motors.allocateControl(wrench(hover, 0.0, 0.0, 0.01));
    const float even = motors.allocateControl(wrench(hover, 0.0, 0.0, 0.0))[0];
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      const Rotor& rotor = vehicle.rotors[i];
      TEST_ASSERT_EQUAL(rotor.y<0.0F, roll[i]> even);      // FRD: left is -y, right side down is +
      TEST_ASSERT_EQUAL(rotor.x > 0.0F, pitch[i] > even);  // front is +x, nose up is +
      TEST_ASSERT_EQUAL(rotor.spin == Spin::CounterClockwise, yaw[i] > even);  // nose right is +
    }
  }
}

void test_the_motors_stand_where_the_published_sign_tables_put_them() {
  struct Row {
    const Vehicle& vehicle;
    float roll[4];
    float pitch[4];
    float yaw[4];
  };
  const Row rows[] = {
      {kQuad5in, {1, -1, -1, 1}, {1, 1, -1, -1}, {-1, 1, -1, 1}},
      {kUgglanQ450, {-1, -1, 1, 1}, {1, -1, -1, 1}, {-1, 1, -1, 1}},
  };
  for (const Row& row : rows) {
    const Motors motors(row.vehicle);
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      SquaredSpeeds one{};
      one[i] = 1.0F;
      const Wrench given = motors.wrenchOf(one);
      TEST_ASSERT_TRUE(given.torque.x() * row.roll[i] > 0.0F);
      TEST_ASSERT_TRUE(given.torque.y() * row.pitch[i] > 0.0F);
      TEST_ASSERT_TRUE(given.torque.z() * row.yaw[i] > 0.0F);
    }
  }
}

void test_allocation_agrees_with_a_dense_solve_and_gives_back_the_wrench() {
  Random random(1);
  const auto part = [&] { return random.uniform(-0.2F, 0.2F); };  // keeps motors within limits
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    const Motors motors(vehicle);
    const Limits limits(vehicle);
    const Dense effect = denseEffect(vehicle);
    const Eigen::Vector4d most = authority(vehicle);
    const double middle = (effect * Eigen::Vector4d::Constant(0.5 * (limits.low + limits.high)))[0];
    for (int trial = 0; trial < 1000; ++trial) {
      const Wrench wanted =
          wrench(middle + part() * most[0], part() * most[1], part() * most[2], part() * most[3]);
      const SquaredSpeeds squares = motors.allocateControl(wanted);
      const Eigen::Vector4d expected = effect.fullPivLu().solve(stack(wanted));
      // A few float roundings of the largest term.
      TEST_ASSERT_TRUE((stack(squares) - expected).norm() < 1e-6 * expected.norm());
      const Eigen::Vector4d back = stack(motors.wrenchOf(squares)) - stack(wanted);
      TEST_ASSERT_TRUE((back.array().abs() < 2e-6 * most.array()).all());
    }
  }
}

/// Over a grid of wrenches from well within to far beyond what the rotors can give.
void test_a_saturated_aircraft_keeps_roll_and_pitch_then_thrust_then_yaw() {
  const double steps[] = {-3.0, -1.5, -1.0, -0.7, -0.4, -0.1, 0.0, 0.05, 0.3, 0.5, 0.8, 1.2, 4.0};
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    const Motors motors(vehicle);
    const Limits limits(vehicle);
    const Dense effect = denseEffect(vehicle);
    const Dense inverse = effect.inverse();
    const Eigen::Vector4d most = authority(vehicle);
    // Tolerances: float rounding of a squared speed, and of a wrench made of four of them.
    const double rounding = 2e-6 * limits.high;
    const Eigen::Vector4d slack = 8e-6 * most;

    for (double thrust : {-0.5, 0.0, 0.1, 0.3, 0.6, 0.9, 1.1, 1.5, 2.0, 3.0}) {
      for (double roll : steps) {
        for (double pitch : steps) {
          for (double yaw : steps) {
            const Wrench wanted =
                wrench(thrust * most[0], roll * most[1], pitch * most[2], yaw * most[3]);
            const SquaredSpeeds squares = motors.allocateControl(wanted);
            const Eigen::Vector4d s = stack(squares);
            const Eigen::Vector4d got = effect * s;
            const Eigen::Vector4d w = stack(wanted);

            TEST_ASSERT_TRUE(s.minCoeff() >= limits.low - rounding);
            TEST_ASSERT_TRUE(s.maxCoeff() <= limits.high + rounding);

            const Eigen::Vector4d tilting = inverse.col(1) * w[1] + inverse.col(2) * w[2];
            const double spread = tilting.maxCoeff() - tilting.minCoeff();
            const double room = limits.high - limits.low;
            const double kept = spread > room ? room / spread : 1.0;
            TEST_ASSERT_TRUE(std::abs(got[1] - kept * w[1]) < slack[1]);
            TEST_ASSERT_TRUE(std::abs(got[2] - kept * w[2]) < slack[2]);

            // Yaw keeps its sign and is never more than wanted.
            const double part = w[3] == 0.0 ? 0.0 : got[3] / w[3];
            TEST_ASSERT_TRUE(w[3] != 0.0 ? part > -1e-4 && part < 1.0 + 1e-4
                                         : std::abs(got[3]) < slack[3]);

            // No other part of the yaw torque brings the thrust nearer, and none larger fits.
            const double yawRounding = slack[3] / most[3];
            for (int k = 0; k <= 20; ++k) {
              const double f = k / 20.0;
              const Eigen::Vector4d shape = kept * tilting + f * inverse.col(3) * w[3];
              const double top = limits.high - shape.maxCoeff();
              const double bottom = limits.low - shape.minCoeff();
              if (top < bottom) continue;
              const double level = std::clamp(w[0] * inverse(0, 0), bottom, top);
              const double missed = std::abs(level / inverse(0, 0) - w[0]);
              TEST_ASSERT_TRUE(missed > std::abs(got[0] - w[0]) - slack[0]);
              const bool fits = got[0] * inverse(0, 0) > bottom + rounding &&
                                got[0] * inverse(0, 0) < top - rounding;
              if (fits)
                TEST_ASSERT_TRUE(got[3] * (w[3] < 0.0 ? -1.0 : 1.0) >
                                 (f - yawRounding) * std::abs(w[3]) - slack[3]);
            }
          }
        }
      }
    }
  }
}

void test_commands_stay_between_flight_idle_and_flight_cap_whatever_is_asked() {
  Random random(2);
  const auto any = [&] {
    const float size = std::pow(10.0F, random.uniform(-3.0F, 6.5F));
    return random.chance(0.5F) ? size : -size;
  };
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    Motors motors(vehicle);
    motors.arm();
    const float idle = motors.command(vehicle.speedFlightMin);
    TEST_ASSERT_TRUE(idle > vehicle.commandOff);
    TEST_ASSERT_TRUE(vehicle.commandFlightMax <= vehicle.commandMax);
    for (int trial = 0; trial < 20000; ++trial) {
      motors.commandControl({any(), {any(), any(), any()}});
      for (const float command : motors.commands()) {
        TEST_ASSERT_TRUE(command >= idle && command <= vehicle.commandFlightMax);
      }
    }
    motors.commandControl({1e5F, Vector3f::Zero()});
    for (const float command : motors.commands()) {
      TEST_ASSERT_EQUAL_FLOAT(vehicle.commandFlightMax, command);
    }
  }
}

void test_an_armed_aircraft_asked_for_nothing_idles() {
  for (const Airframe& airframe : kAirframes) {
    Motors motors(airframe.vehicle);
    motors.arm();
    const float idle = motors.command(airframe.vehicle.speedFlightMin);
    for (const float command : motors.commands()) TEST_ASSERT_EQUAL_FLOAT(idle, command);
    motors.commandControl(Wrench::none());
    for (const float command : motors.commands()) TEST_ASSERT_EQUAL_FLOAT(idle, command);
    // It says what idling gives, so that the controller knows it is not nothing.
    const float idleThrust = 4.0F * airframe.vehicle.thrustConstant *
                             airframe.vehicle.speedFlightMin * airframe.vehicle.speedFlightMin;
    TEST_ASSERT_FLOAT_WITHIN(1e-5F, idleThrust, motors.achieved().thrust);
  }
}

void test_a_disarmed_aircraft_sends_off_whatever_is_asked() {
  struct RecordingBoard {
    EscCommands sent{};
    void writeEsc(const EscCommands& commands) { sent = commands; }
  };
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    Motors motors(vehicle);
    RecordingBoard board;
    const auto assertOff = [&] {
      motors.writeESC(board);
      for (const float command : board.sent) TEST_ASSERT_EQUAL_FLOAT(vehicle.commandOff, command);
      TEST_ASSERT_EQUAL_FLOAT(0.0F, motors.achieved().thrust);
    };
    assertOff();  // from the start
    motors.commandControl(wrench(weight(vehicle), 0.1, 0.1, 0.0));
    assertOff();

    motors.arm();
    motors.commandControl(wrench(weight(vehicle), 0.0, 0.0, 0.0));
    motors.writeESC(board);
    for (const float command : board.sent) TEST_ASSERT_TRUE(command > vehicle.commandOff);

    motors.disarm();
    assertOff();  // at once, without a new command
    motors.commandControl(wrench(2.0 * weight(vehicle), 0.0, 0.0, 0.0));
    assertOff();
    TEST_ASSERT_FALSE(motors.armed());
  }
}

void test_a_wrench_that_is_not_a_number_never_reaches_an_esc_and_is_counted() {
  Motors motors(kQuad5in);
  motors.arm();
  const Wrench bad[] = {
      {kNaN, Vector3f::Zero()},        {8.0F, {kNaN, 0.0F, 0.0F}},
      {8.0F, {0.0F, kNaN, 0.0F}},      {8.0F, {0.0F, 0.0F, kNaN}},
      {kInfinity, Vector3f::Zero()},   {-kInfinity, Vector3f::Zero()},
      {8.0F, {0.0F, kInfinity, 0.0F}}, {std::numeric_limits<float>::max(), {0.0F, 0.0F, 0.0F}},
  };
  std::uint32_t count = 0;
  for (const Wrench& wanted : bad) {
    motors.commandControl(wrench(8.0, 0.0, 0.0, 0.0));
    motors.commandControl(wanted);
    TEST_ASSERT_EQUAL_UINT32(++count, motors.invalid());
    for (const float command : motors.commands()) {
      TEST_ASSERT_EQUAL_FLOAT(motors.command(kQuad5in.speedFlightMin), command);
    }
  }
}

void test_the_command_curves_are_the_published_ones() {
  const Motors quad(kQuad5in);
  TEST_ASSERT_EQUAL_FLOAT(1195.0F, quad.command(0.0F));
  TEST_ASSERT_EQUAL_FLOAT(1950.0F, quad.command(400.0F));  // 1195 + 160000 / 160000 x 755
  TEST_ASSERT_EQUAL_FLOAT(1383.75F, quad.command(200.0F));

  const Motors ugglan(kUgglanQ450);
  TEST_ASSERT_EQUAL_FLOAT(18825.0F, ugglan.command(500.0F));  // 57 x 500 - 9675
  TEST_ASSERT_TRUE(kUgglanQ450.speedFlightMin > 200.0F);      // below it the ESC stops the motor

  for (const Airframe& airframe : kAirframes) {
    const Motors motors(airframe.vehicle);
    for (float n = airframe.vehicle.speedFlightMin; n < 700.0F; n += 1.0F) {
      // One ulp of a command over the slope at the slowest speed: 1e-4 us / 0.6 us s.
      TEST_ASSERT_FLOAT_WITHIN(1e-3F, n, motors.speedOf(motors.command(n)));
    }
    TEST_ASSERT_EQUAL_FLOAT(0.0F, motors.speedOf(airframe.vehicle.commandOff - 20000.0F));
  }
}

void test_the_weight_is_carried_at_hover() {
  // 0.83 kg x 9.80665 / (4 x 6.583e-5) = 175.82^2 (rev/s)^2: 1195 + 30911 / 160000 x 755 = 1340.9
  // us
  Motors quad(kQuad5in);
  quad.arm();
  quad.commandControl(wrench(weight(kQuad5in), 0.0, 0.0, 0.0));
  for (const float command : quad.commands()) TEST_ASSERT_FLOAT_WITHIN(0.1F, 1340.86F, command);
  // 1.058 x 9.80665 / (4 x 8.37e-6) = 556.69^2 (rad/s)^2: 57 x 556.69 - 9675 = 22056
  Motors ugglan(kUgglanQ450);
  ugglan.arm();
  ugglan.commandControl(wrench(weight(kUgglanQ450), 0.0, 0.0, 0.0));
  for (const float command : ugglan.commands()) TEST_ASSERT_FLOAT_WITHIN(2.0F, 22056.2F, command);
}

void test_the_achieved_wrench_is_what_the_commands_give() {
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    const Dense effect = denseEffect(vehicle);
    const Eigen::Vector4d most = authority(vehicle);
    Motors motors(vehicle);
    motors.arm();
    for (const double size : {0.1, 0.5, 1.0, 3.0}) {
      motors.commandControl(
          wrench(size * most[0], -0.5 * size * most[1], 0.3 * size * most[2], size * most[3]));
      Eigen::Vector4d squares;
      for (int i = 0; i < 4; ++i) {
        const double n = motors.speedOf(motors.commands()[static_cast<std::size_t>(i)]);
        squares[i] = n * n;
      }
      // Float rounding of a command, 1e-7 of it, weighs most where the curve is flat: 1e-5.
      const Eigen::Vector4d missed = effect * squares - stack(motors.achieved());
      TEST_ASSERT_TRUE((missed.array().abs() < 1e-5 * most.array()).all());
    }
  }
}

void test_throttle_goes_from_off_to_the_esc_s_maximum() {
  for (const Airframe& airframe : kAirframes) {
    const Vehicle& vehicle = airframe.vehicle;
    Motors motors(vehicle);
    motors.commandControl(wrench(100.0 * weight(vehicle), 0.0, 0.0, 0.0));
    TEST_ASSERT_EQUAL_FLOAT(0.0F, motors.throttle());  // not armed
    motors.arm();
    const float idle = motors.throttle();
    TEST_ASSERT_TRUE(idle >= 0.0F && idle < 0.35F);  // UgglanQ450 idles at 200 of 760 rad/s
    float last = idle;
    for (int part = 1; part <= 10; ++part) {
      motors.commandControl(wrench(0.3 * part * weight(vehicle), 0.0, 0.0, 0.0));
      TEST_ASSERT_TRUE(motors.throttle() >= last);
      last = motors.throttle();
    }
    motors.commandControl(wrench(100.0 * weight(vehicle), 0.0, 0.0, 0.0));
    const float cap =
        (vehicle.commandFlightMax - vehicle.commandOff) / (vehicle.commandMax - vehicle.commandOff);
    TEST_ASSERT_FLOAT_WITHIN(1e-6F, cap, motors.throttle());
    motors.disarm();
    TEST_ASSERT_EQUAL_FLOAT(0.0F, motors.throttle());
  }
}

}  // namespace

void setUp() {}
void tearDown() {}

int main() {
  UNITY_BEGIN();
  RUN_TEST(test_more_thrust_on_the_left_rolls_right_in_front_pitches_up_and_against_the_spin_yaws);
  RUN_TEST(test_the_motors_stand_where_the_published_sign_tables_put_them);
  RUN_TEST(test_allocation_agrees_with_a_dense_solve_and_gives_back_the_wrench);
  RUN_TEST(test_a_saturated_aircraft_keeps_roll_and_pitch_then_thrust_then_yaw);
  RUN_TEST(test_commands_stay_between_flight_idle_and_flight_cap_whatever_is_asked);
  RUN_TEST(test_an_armed_aircraft_asked_for_nothing_idles);
  RUN_TEST(test_a_disarmed_aircraft_sends_off_whatever_is_asked);
  RUN_TEST(test_a_wrench_that_is_not_a_number_never_reaches_an_esc_and_is_counted);
  RUN_TEST(test_the_command_curves_are_the_published_ones);
  RUN_TEST(test_the_weight_is_carried_at_hover);
  RUN_TEST(test_the_achieved_wrench_is_what_the_commands_give);
  RUN_TEST(test_throttle_goes_from_off_to_the_esc_s_maximum);
  runAllocationTests();
  runMotorConfigTests();
  runMotorVectorTests();
  UNITY_END();
  return 0;
}
