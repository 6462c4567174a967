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

constexpr std::size_t kColumns = kErrorCount + 2;  ///< and the gains of the lag and the integral

double gainOf(const Gains& gains, std::size_t row, std::size_t column) {
  if (column < kErrorCount) return static_cast<double>(gains.k[row][column]);
  return static_cast<double>(column == kErrorCount ? gains.lag[row] : gains.integral[row]);
}

void test_the_committed_gains_are_those_of_the_independent_design() {
  for (const Airframe& airframe : kAirframes) {
    const VectorFile file("gains/" + std::string(airframe.vehicle.name) + ".csv");
    needVectors(file);
    TEST_ASSERT_EQUAL(airframe.designs.size() * kControlCount, file.size());
    TEST_ASSERT_EQUAL(0, file.column("position_x"));
    TEST_ASSERT_EQUAL(kErrorCount - 1, file.column("rate_z"));
    TEST_ASSERT_EQUAL(kErrorCount, file.column("lag"));
    TEST_ASSERT_EQUAL(kErrorCount + 1, file.column("integral"));
    for (std::size_t i = 0; i < file.size(); ++i) {
      const Gains& gains = *airframe.designs[i / kControlCount];
      for (std::size_t column = 0; column < kColumns; ++column) {
        const double expected = file.row(i)[column];
        const double found = gainOf(gains, i % kControlCount, column);
        TEST_ASSERT_DOUBLE_WITHIN(kRounding * std::abs(expected), expected, found);
      }
    }
  }
}

void test_the_first_design_flies() {
  for (const Airframe& airframe : kAirframes) {
    TEST_ASSERT_EQUAL_PTR(&airframe.gains, airframe.designs[0]);
  }
}

}  // namespace

void runGainVectorTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_committed_gains_are_those_of_the_independent_design);
  RUN_TEST(test_the_first_design_flies);
}
