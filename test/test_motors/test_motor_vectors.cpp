/// Allocation and command curves against the reference of tools/matlab, in double precision.
#include <Motors.h>
#include <unity.h>
#include <vehicles/Vehicles.h>

#include <cmath>
#include <string>

#include "VectorFile.h"

using namespace strix;

namespace {

/// Squared speeds are the sum of four shares. For wrenches within the limits each share is at most
/// the largest squared speed, and it is rounded about six times: constants, row, square of its
/// length, quotient, product, sum. 4 x 6 x 2^-24 = 1.5e-6.
constexpr double kShares = 1.5e-6;

double commandSlope(const Vehicle& vehicle, double squared) {
  const double linear = static_cast<double>(vehicle.command.linear);
  return static_cast<double>(vehicle.command.quadratic) + linear / (2.0 * std::sqrt(squared));
}

void test_squared_speeds_and_commands_are_those_of_the_pseudo_inverse() {
  for (const Airframe& airframe : kAirframes) {
    const VectorFile file("allocation/" + std::string(airframe.vehicle.name) + ".csv");
    needVectors(file);
    const std::size_t thrust = file.column("thrust");
    const std::size_t torque = file.column("tau_x");
    const std::size_t squared = file.column("n2_1");
    const std::size_t command = file.column("command_1");
    Motors motors(airframe.vehicle);
    motors.arm();
    const double top = static_cast<double>(motors.speedOf(airframe.vehicle.commandFlightMax));
    const double tolerance = kShares * top * top;
    for (std::size_t i = 0; i < file.size(); ++i) {
      const std::vector<double>& row = file.row(i);
      const auto number = [&row](std::size_t at) { return static_cast<float>(row[at]); };
      const Wrench wanted{number(thrust), {number(torque), number(torque + 1), number(torque + 2)}};
      const SquaredSpeeds found = motors.allocateControl(wanted);
      motors.commandControl(wanted);
      for (std::size_t m = 0; m < kMotorCount; ++m) {
        const double n2 = row[squared + m];
        const double pulse = row[command + m];
        TEST_ASSERT_DOUBLE_WITHIN(tolerance, n2, static_cast<double>(found[m]));
        // The same through the curve, and the command's own rounding: its offset and three sums.
        const double allowed = commandSlope(airframe.vehicle, n2) * tolerance +
                               4.0 * std::ldexp(1.0, -24) * (std::abs(pulse) + 1e4);
        TEST_ASSERT_DOUBLE_WITHIN(allowed, pulse, static_cast<double>(motors.commands()[m]));
      }
    }
  }
}

}  // namespace

void runMotorVectorTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_squared_speeds_and_commands_are_those_of_the_pseudo_inverse);
}
