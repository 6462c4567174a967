// The command `axes`: right axes pass, every wrong one is found by some line.
#include "CheckoutBench.h"
#include "Hand.h"
#include "suites.h"

using namespace strix;

namespace {

std::string poses(const std::function<void(CheckoutBench&)>& disturb,
                  const FlightSoftwareConfig& config = benchConfig()) {
  CheckoutBench bench(0, config);
  bench.disturb = disturb;
  bench.board.magMounting = benchConfig().sensors.mag.sensorToBody.inverse();
  bench.begin();
  return fivePoses(bench);
}

void test_right_axes_pass() {
  const std::string text = poses({});
  assertHas(text, "axes: PASS");
  assertHasNot(text, "FAIL");
  assertHas(text, "accelerometer: nose down");
  assertHas(text, "gyro: turned 70 deg");
  assertHas(text, "magnetometer: heading grew by");
}

void test_an_imu_that_is_turned_on_its_mount_fails() {
  // Every right-angled mounting but the declared one: 23 of them.
  int turned = 0;
  for (int x = 0; x < 3; ++x) {
    for (int y = 0; y < 3; ++y) {
      for (int signs = 0; signs < 4; ++signs) {
        if (x == y) continue;
        Matrix3f mounting = Matrix3f::Zero();
        mounting(0, x) = (signs & 1) != 0 ? -1.0F : 1.0F;
        mounting(1, y) = (signs & 2) != 0 ? -1.0F : 1.0F;
        mounting.row(2) = mounting.row(0).cross(mounting.row(1));
        if (mounting == Matrix3f::Identity()) continue;
        ++turned;
        const std::string text = poses([mounting](CheckoutBench& b) {
          b.board.imu.reading.accel = mounting * b.board.imu.reading.accel;
          b.board.imu.reading.gyro = mounting * b.board.imu.reading.gyro;
        });
        assertHas(text, "FAIL accelerometer");
        assertHas(text, "sensorToBody of the IMU");
      }
    }
  }
  TEST_ASSERT_EQUAL_INT(23, turned);
}

void test_a_gyro_with_a_wrong_sign_fails() {
  for (int axis = 0; axis < 3; ++axis) {
    const std::string text = poses([axis](CheckoutBench& b) {
      b.board.imu.reading.gyro[axis] = -b.board.imu.reading.gyro[axis];
    });
    assertHas(text, "FAIL gyro");
    assertHasNot(text, "FAIL accelerometer");
    assertHas(text, "another sensor");
  }
}

void test_a_magnetometer_with_a_wrong_sign_fails() {
  for (int axis = 0; axis < 3; ++axis) {
    FlightSoftwareConfig config = benchConfig();
    config.sensors.mag.sensorToBody.row(axis) *= -1.0F;
    const std::string text = poses({}, config);
    assertHas(text, "FAIL magnetometer");
    assertHas(text, "magSensorToBody is not how it sits");
    assertHasNot(text, "FAIL gyro");
    bool verticalFails = false;  // in the pose that this axis measures it in
    for (const std::string& line : linesOf(text)) {
      const bool fails = line.find("FAIL magnetometer") != std::string::npos;
      verticalFails = verticalFails || (fails && line.find("uT down") != std::string::npos);
    }
    TEST_ASSERT_TRUE_MESSAGE(verticalFails, text.c_str());
    if (axis == 1) assertHas(text, "-> it falls where it must grow: the y axis");
  }
}

void test_the_pose_on_its_feet_has_to_be_still_and_stop_ends_the_check() {
  CheckoutBench bench;
  bench.begin();
  bench.hold(Quaternion{}, {0.0F, 0.0F, 0.5F});
  assertHas(bench.say("axes", 1.0F), "1 of 5");
  assertHas(bench.say(""), "it moves");
  assertHas(bench.say("stop"), "all motors are off");
  assertHasNot(bench.say(""), "of 5");
  bench.board.imu.dead = true;
  bench.say("axes", 1.0F);
  assertHas(bench.say(""), "the IMU gives no data");
}

}  // namespace

void runAxisTests() {
  RUN_TEST(test_right_axes_pass);
  RUN_TEST(test_an_imu_that_is_turned_on_its_mount_fails);
  RUN_TEST(test_a_gyro_with_a_wrong_sign_fails);
  RUN_TEST(test_a_magnetometer_with_a_wrong_sign_fails);
  RUN_TEST(test_the_pose_on_its_feet_has_to_be_still_and_stop_ends_the_check);
}
