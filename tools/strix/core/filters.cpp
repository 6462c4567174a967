/// Python's view of the filter between gyro and rate control.
#include <GyroFilter.h>
#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>

#include <array>

#include "bind.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Rows = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Numbers = std::array<float, 5>;

Numbers toNumbers(const strix::BiquadCoefficients& c) { return {c.b0, c.b1, c.b2, c.a1, c.a2}; }

Numbers lowPass(float cutoff, float sampleHz) {
  return toNumbers(strix::lowPass(cutoff, sampleHz));
}

Numbers notch(float centre, float q, float sampleHz) {
  return toNumbers(strix::notch(centre, q, sampleHz));
}

Rows update(strix::GyroFilter& filter, const Eigen::Ref<const Rows>& gyro) {
  Rows filtered(gyro.rows(), 3);
  for (Eigen::Index i = 0; i < gyro.rows(); ++i) {
    filtered.row(i) = filter.update(gyro.row(i).transpose()).transpose();
  }
  return filtered;
}

}  // namespace

void bindFilters(nb::module_& m) {
  m.def("low_pass", &lowPass, "cutoff"_a, "sample_hz"_a, "b0 b1 b2 a1 a2 of the Butterworth");
  m.def("notch", &notch, "centre"_a, "q"_a, "sample_hz"_a, "b0 b1 b2 a1 a2");
  using Config = strix::GyroFilterConfig;
  nb::class_<Config>(m, "GyroFilterConfig", "Frequencies in Hz; all off as made")
      .def(nb::init<>())
      .def_rw("lowPass", &Config::lowPass)
      .def_rw("notchMin", &Config::notchMin)
      .def_rw("notchMax", &Config::notchMax)
      .def_rw("notchQ", &Config::notchQ)
      .def_rw("notchHarmonics", &Config::notchHarmonics);
  nb::class_<strix::GyroFilter>(m, "GyroFilter", "The filter between gyro and rate control")
      .def(nb::init<const Config&, float, float, float>(), "config"_a, "sample_hz"_a,
           "control_hz"_a, "motor_time_constant"_a)
      .def_prop_ro("valid", &strix::GyroFilter::valid)
      .def_prop_ro("notchCentre", &strix::GyroFilter::notchCentre)
      .def("setMotorSpeed", &strix::GyroFilter::setMotorSpeed, "commanded"_a, "rev/s, mean")
      .def("update", &update, "gyro"_a, "Filters the next samples, rad/s, a row each");
}
