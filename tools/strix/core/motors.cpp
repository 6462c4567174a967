/// Python's view of the allocation of a wrench to rotors.
#include <Allocation.h>
#include <nanobind/eigen/dense.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>
#include <tuple>
#include <vector>

#include "bind.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Numbers = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Places = std::vector<std::tuple<float, float, int>>;

template <std::size_t Count>
Numbers allocated(const Places& places, float thrustConstant, float torqueConstant, float low,
                  float high, const Numbers& wrenches) {
  std::array<strix::Rotor, Count> rotors{};
  for (std::size_t i = 0; i < Count; ++i) {
    const auto [x, y, spin] = places[i];
    rotors[i] = {x, y, spin > 0 ? strix::Spin::Clockwise : strix::Spin::CounterClockwise};
  }
  strix::Allocation<Count> allocation(rotors, thrustConstant, torqueConstant);
  allocation.setLimits(low, high);
  if (!allocation.valid()) throw std::invalid_argument("this layout of rotors cannot fly");
  Numbers squares(wrenches.rows(), static_cast<Eigen::Index>(Count));
  for (Eigen::Index row = 0; row < wrenches.rows(); ++row) {
    const strix::Wrench wanted{wrenches(row, 0),
                               {wrenches(row, 1), wrenches(row, 2), wrenches(row, 3)}};
    const auto found = allocation.solve(wanted);
    for (std::size_t i = 0; i < Count; ++i) squares(row, static_cast<Eigen::Index>(i)) = found[i];
  }
  return squares;
}

Numbers allocate(const Places& places, float thrustConstant, float torqueConstant, float low,
                 float high, const Numbers& wrenches) {
  if (wrenches.cols() != 4) throw std::invalid_argument("a wrench has 4 numbers");
  switch (places.size()) {
    case 4:
      return allocated<4>(places, thrustConstant, torqueConstant, low, high, wrenches);
    case 6:
      return allocated<6>(places, thrustConstant, torqueConstant, low, high, wrenches);
    case 8:
      return allocated<8>(places, thrustConstant, torqueConstant, low, high, wrenches);
    default:
      throw std::invalid_argument("4, 6 or 8 rotors are expected");
  }
}

}  // namespace

void bindMotors(nb::module_& m) {
  m.def("allocate", &allocate, "rotors"_a, "thrust_constant"_a, "torque_constant"_a, "low"_a,
        "high"_a, "wrenches"_a,
        "Squared speeds, a row for each row of wrenches (thrust N, torques N m), with each between "
        "low and high; a rotor is x m, y m (FRD) and its spin, +1 clockwise seen from above");
}
