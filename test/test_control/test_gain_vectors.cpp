/// The committed gains against those that tools/matlab solves for on its own.
#include <Gains.h>
#include <unity.h>
#include <vehicles/Vehicles.h>

#include <cmath>
#include <string>

#include "VectorFile.h"
#include "suites.h"

using namespace strix;

namespace {

/// The headers hold six digits: half a unit of the sixth is 5e-6 at most. The vehicle files'
/// float32 numbers are off by 6e-8 each; the rest of the allowance is for them.
constexpr double kRounding = 5.5e-6;

void test_the_committed_gains_are_those_of_the_independent_design() {
  for (const Airframe& airframe : kAirframes) {
    const VectorFile file("gains/" + std::string(airframe.vehicle.name) + ".csv");
    needVectors(file);
    TEST_ASSERT_EQUAL(kControlCount, file.size());
    TEST_ASSERT_EQUAL(0, file.column("position_x"));
    TEST_ASSERT_EQUAL(kErrorCount - 1, file.column("rate_z"));
    for (std::size_t row = 0; row < kControlCount; ++row) {
      for (std::size_t column = 0; column < kErrorCount; ++column) {
        const double expected = file.row(row)[column];
        const auto found = static_cast<double>(airframe.gains.k[row][column]);
        TEST_ASSERT_DOUBLE_WITHIN(kRounding * std::abs(expected), expected, found);
      }
    }
  }
}

}  // namespace

void runGainVectorTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_committed_gains_are_those_of_the_independent_design);
}
