/// Allocation for layouts that no vehicle of ours has, beside dense solves in double precision.
#include <Allocation.h>
#include <unity.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "Random.h"

using namespace strix;

namespace {

constexpr float kThrustConstant = 6.583e-5F;  // Quad5in's
constexpr float kTorqueConstant = 7.51e-7F;
constexpr float kLow = 3600.0F;
constexpr float kHigh = 107000.0F;
constexpr Spin kCw = Spin::Clockwise;
constexpr Spin kCcw = Spin::CounterClockwise;

template <std::size_t N>
struct Layout {
  const char* name;
  std::array<Rotor, N> rotors;
  /// Of the highest squared speed: float32 rounding, 6e-8, enlarged by how far the rows of E are
  /// from being at right angles.
  double rounding;
};

const Layout<4> kX{
    "X",
    {{{0.08F, -0.08F, kCw}, {0.08F, 0.08F, kCcw}, {-0.08F, 0.08F, kCw}, {-0.08F, -0.08F, kCcw}}},
    1e-6};
const Layout<4> kH{
    "H",
    {{{0.12F, -0.06F, kCw}, {0.12F, 0.06F, kCcw}, {-0.12F, 0.06F, kCw}, {-0.12F, -0.06F, kCcw}}},
    1e-6};
const Layout<4> kPlus{
    "+", {{{0.1F, 0.0F, kCw}, {0.0F, 0.1F, kCcw}, {-0.1F, 0.0F, kCw}, {0.0F, -0.1F, kCcw}}}, 1e-6};
const Layout<4> kLopsided{
    "lopsided",
    {{{0.1F, -0.12F, kCw}, {0.14F, 0.09F, kCcw}, {-0.11F, 0.13F, kCw}, {-0.07F, -0.08F, kCcw}}},
    5e-5};

template <std::size_t N>
Layout<N> ring(const char* name, double radius) {
  Layout<N> layout{name, {}, 2e-6};
  for (std::size_t i = 0; i < N; ++i) {
    const double angle = 2.0 * 3.14159265358979 * (static_cast<double>(i) + 0.5) / N;
    layout.rotors[i] = {static_cast<float>(radius * std::cos(angle)),
                        static_cast<float>(radius * std::sin(angle)), i % 2 == 0 ? kCw : kCcw};
  }
  return layout;
}

template <std::size_t N>
Allocation<N> made(const std::array<Rotor, N>& rotors) {
  Allocation<N> allocation(rotors, kThrustConstant, kTorqueConstant);
  allocation.setLimits(kLow, kHigh);
  return allocation;
}

/// Wrench per squared speed, from moments r x F.
template <std::size_t N>
Eigen::Matrix<double, 4, N> effectOf(const std::array<Rotor, N>& rotors) {
  Eigen::Matrix<double, 4, N> effect;
  for (std::size_t i = 0; i < N; ++i) {
    const double thrust = static_cast<double>(kThrustConstant);
    const double drag = static_cast<double>(kTorqueConstant);
    effect.col(static_cast<Eigen::Index>(i)) << thrust, -rotors[i].y * thrust, rotors[i].x * thrust,
        rotors[i].spin == kCw ? -drag : drag;
  }
  return effect;
}

Wrench toWrench(const Eigen::Vector4d& w) {
  return {static_cast<float>(w[0]),
          {static_cast<float>(w[1]), static_cast<float>(w[2]), static_cast<float>(w[3])}};
}
Eigen::Vector4d toVector(const Wrench& w) {
  return {w.thrust, w.torque.x(), w.torque.y(), w.torque.z()};
}
template <std::size_t N>
Eigen::Matrix<double, N, 1> toVector(const std::array<float, N>& squares) {
  return Eigen::Map<const Eigen::Matrix<float, N, 1>>(squares.data()).template cast<double>();
}

template <class Check>
void forEachLayout(Check check) {
  check(kX);
  check(kH);
  check(kPlus);
  check(kLopsided);
  check(ring<6>("hexa", 0.2));
  check(ring<8>("octo", 0.25));
}

void test_any_layout_s_squared_speeds_are_those_of_a_dense_least_squares_solve() {
  forEachLayout([](const auto& layout) {
    constexpr std::size_t kRotors = std::tuple_size_v<std::decay_t<decltype(layout.rotors)>>;
    const Allocation<kRotors> allocation = made(layout.rotors);
    TEST_ASSERT_TRUE_MESSAGE(allocation.valid(), layout.name);
    const auto effect = effectOf(layout.rotors);
    // The smallest squared speeds that give the wrench, by complete orthogonal decomposition.
    const Eigen::CompleteOrthogonalDecomposition<Eigen::Matrix<double, 4, kRotors>> dense(effect);
    Random random(3);
    int inside = 0;
    for (int trial = 0; trial < 5000; ++trial) {
      Eigen::Matrix<double, kRotors, 1> start;
      for (Eigen::Index i = 0; i < start.size(); ++i) {
        start[i] = static_cast<double>(random.uniform(kLow, kHigh));
      }
      const Wrench wanted = toWrench(effect * start);
      const Eigen::Matrix<double, kRotors, 1> expected = dense.solve(toVector(wanted));
      if (expected.minCoeff() < kLow || expected.maxCoeff() > kHigh) continue;
      ++inside;
      const auto squares = allocation.solve(wanted);
      const double apart = (toVector(squares) - expected).cwiseAbs().maxCoeff();
      TEST_ASSERT_TRUE_MESSAGE(apart < layout.rounding * kHigh, layout.name);
      const Eigen::Vector4d most = effect.cwiseAbs().rowwise().sum() * kHigh;
      const Eigen::Vector4d back = toVector(allocation.wrenchOf(squares)) - toVector(wanted);
      TEST_ASSERT_TRUE_MESSAGE((back.array().abs() < 1e-6 * most.array()).all(), layout.name);
    }
    TEST_ASSERT_TRUE_MESSAGE(inside > 1000, layout.name);
  });
}

/// Parts of what the layout has, from none to far too much.
Eigen::Vector4d anyWrench(Random& random, const Eigen::Vector4d& most) {
  const auto part = [&random] {
    const double size = std::pow(10.0, static_cast<double>(random.uniform(-2.5F, 1.5F)));
    return random.chance(0.15F) ? 0.0 : random.chance(0.5F) ? size : -size;
  };
  return {part() * most[0], part() * most[1], part() * most[2], part() * most[3]};
}

/// Beside a search over thrusts and parts of the yaw torque, whose steps are coarse: none that it
/// finds may give more roll and pitch torque or a nearer thrust.
void test_any_layout_keeps_its_limits_every_sign_and_roll_and_pitch_while_they_can_be_had() {
  forEachLayout([](const auto& layout) {
    constexpr std::size_t kRotors = std::tuple_size_v<std::decay_t<decltype(layout.rotors)>>;
    using Column = Eigen::Matrix<double, kRotors, 1>;
    const Allocation<kRotors> allocation = made(layout.rotors);
    const auto effect = effectOf(layout.rotors);
    const Eigen::Matrix<double, kRotors, 4> inverse =
        effect.completeOrthogonalDecomposition().pseudoInverse();
    const Eigen::Vector4d most = 0.5 * kHigh * effect.cwiseAbs().rowwise().sum();
    const Eigen::Vector4d slack = 2.0 * layout.rounding * most;
    Random random(4);
    for (int trial = 0; trial < 4000; ++trial) {
      const Wrench wanted = toWrench(anyWrench(random, most));
      const Eigen::Vector4d w = toVector(wanted);
      const Column squares = toVector(allocation.solve(wanted));
      const Eigen::Vector4d got = effect * squares;
      TEST_ASSERT_TRUE_MESSAGE(squares.minCoeff() >= kLow, layout.name);
      TEST_ASSERT_TRUE_MESSAGE(squares.maxCoeff() <= kHigh, layout.name);
      for (Eigen::Index axis = 1; axis < 4; ++axis) {
        const double along = w[axis] < 0.0 ? -got[axis] : got[axis];
        TEST_ASSERT_TRUE_MESSAGE(along > -slack[axis], layout.name);
        TEST_ASSERT_TRUE_MESSAGE(along < std::abs(w[axis]) + slack[axis], layout.name);
      }
      // One part of the roll and of the pitch torque: the direction stays.
      const double across =
          (got[1] * w[2] - got[2] * w[1]) / std::max(w.segment<2>(1).norm(), 1e-9);
      TEST_ASSERT_TRUE_MESSAGE(std::abs(across) < slack.segment<2>(1).norm(), layout.name);

      const double missed = (got - w).segment<2>(1).norm();
      const bool kept = missed < slack.segment<2>(1).norm();
      for (int f = 0; f <= 4; ++f) {
        const Column shape =
            inverse.col(1) * w[1] + inverse.col(2) * w[2] + 0.25 * f * inverse.col(3) * w[3];
        const double top = ((kHigh - shape.array()) / inverse.col(0).array()).minCoeff();
        const double bottom = ((kLow - shape.array()) / inverse.col(0).array()).maxCoeff();
        if (top < bottom) continue;
        TEST_ASSERT_TRUE_MESSAGE(kept, layout.name);
        const double nearest = std::clamp(w[0], bottom, top);
        TEST_ASSERT_TRUE_MESSAGE(std::abs(got[0] - w[0]) < std::abs(nearest - w[0]) + slack[0],
                                 layout.name);
        const bool fits = w[0] > bottom + slack[0] && w[0] < top - slack[0];
        if (fits) TEST_ASSERT_TRUE(std::abs(got[3]) > 0.25 * f * std::abs(w[3]) - slack[3]);
      }
    }
  });
}

/// With four rotors every wrench has one set of squared speeds: whatever within the limits gives a
/// pair of roll and pitch torques shows that they can be had, with part of that yaw or all of it.
void test_roll_and_pitch_are_exact_whenever_any_speeds_of_four_rotors_give_them() {
  for (const Layout<4>& layout : {kX, kH, kPlus, kLopsided}) {
    const Allocation<4> allocation = made(layout.rotors);
    const auto effect = effectOf(layout.rotors);
    const Eigen::Vector4d most = 0.5 * kHigh * effect.cwiseAbs().rowwise().sum();
    Random random(5);
    for (int trial = 0; trial < 20000; ++trial) {
      Eigen::Vector4d squares;
      for (double& s : squares) {
        s = static_cast<double>(random.chance(0.5F) ? random.chance(0.5F) ? kLow : kHigh
                                                    : random.uniform(kLow, kHigh));
      }
      Eigen::Vector4d w = effect * squares;
      w[0] = static_cast<double>(random.uniform(-1.0F, 4.0F)) * most[0];  // whatever the thrust
      w[3] *= static_cast<double>(random.uniform(1.0F, 5.0F));            // or the rest of the yaw
      const Eigen::Vector4d got = effect * toVector(allocation.solve(toWrench(w)));
      for (Eigen::Index axis = 1; axis < 3; ++axis) {
        TEST_ASSERT_TRUE_MESSAGE(std::abs(got[axis] - w[axis]) < 2.0 * layout.rounding * most[axis],
                                 layout.name);
      }
    }
  }
}

void test_a_layout_that_cannot_fly_is_refused() {
  std::array<Rotor, 4> rotors = kX.rotors;
  for (Rotor& rotor : rotors) rotor.spin = kCw;  // yaw comes with thrust
  TEST_ASSERT_FALSE(made(rotors).valid());
  rotors = kX.rotors;
  for (Rotor& rotor : rotors) rotor.y = 0.0F;  // no roll
  TEST_ASSERT_FALSE(made(rotors).valid());
  rotors = kX.rotors;
  for (Rotor& rotor : rotors) rotor.y = 2.0F * rotor.x;  // roll comes with pitch
  TEST_ASSERT_FALSE(made(rotors).valid());
  rotors = kX.rotors;
  for (Rotor& rotor : rotors) rotor.x += 0.1F;  // the centre of mass behind all rotors
  TEST_ASSERT_FALSE(made(rotors).valid());
  rotors = kX.rotors;
  std::swap(rotors[0].spin, rotors[1].spin);  // left turns with left: yaw comes with pitch or roll
  TEST_ASSERT_FALSE(made(rotors).valid());
  rotors = kX.rotors;
  rotors[2].x = std::numeric_limits<float>::quiet_NaN();
  TEST_ASSERT_FALSE(made(rotors).valid());
  rotors = kX.rotors;
  for (Rotor& rotor : rotors) rotor.x += 0.074F;  // 26 times the square in front of that behind
  TEST_ASSERT_TRUE(made(rotors).valid());
  Allocation<4> allocation(rotors, kThrustConstant, kTorqueConstant);
  allocation.setLimits(0.1F * kHigh, kHigh);  // and the limits give ten
  TEST_ASSERT_FALSE(allocation.valid());
  std::array<Rotor, 6> six = ring<6>("hexa", 0.2).rotors;
  TEST_ASSERT_TRUE(made(six).valid());
  for (Rotor& rotor : six) rotor.spin = kCcw;
  TEST_ASSERT_FALSE(made(six).valid());
}

}  // namespace

void runAllocationTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_any_layout_s_squared_speeds_are_those_of_a_dense_least_squares_solve);
  RUN_TEST(test_any_layout_keeps_its_limits_every_sign_and_roll_and_pitch_while_they_can_be_had);
  RUN_TEST(test_roll_and_pitch_are_exact_whenever_any_speeds_of_four_rotors_give_them);
  RUN_TEST(test_a_layout_that_cannot_fly_is_refused);
}
