/// Python's view of the flight filter: the same ESKF.h the aircraft runs, its tuning and its
/// alignment. Quaternions are arrays [w x y z]; everything else has the unit the header gives it.
#include <ESKF.h>
#include <Geodesy.h>

#include "bind.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Vector4f = Eigen::Matrix<float, 4, 1>;

Vector4f toArray(const strix::Quaternion& q) { return {q.w, q.x, q.y, q.z}; }

void bindConfig(nb::module_& m) {
  using strix::MeasurementNoise;
  using strix::NavigationConfig;

  nb::class_<MeasurementNoise>(m, "MeasurementNoise",
                               "variance = sigma^2 + density^2 / time since the last measurement")
      .def(nb::init<float, float>(), "sigma"_a, "density"_a)
      .def_rw("sigma", &MeasurementNoise::sigma)
      .def_rw("density", &MeasurementNoise::density)
      .def("variance", &MeasurementNoise::variance, "dt"_a);

  nb::class_<NavigationConfig>(m, "NavigationConfig",
                               "Tuning of the filter; starts as the defaults")
      .def(nb::init<>())
      .def_rw("gravity", &NavigationConfig::gravity)
      .def_rw("accelNoise", &NavigationConfig::accelNoise)
      .def_rw("gyroNoise", &NavigationConfig::gyroNoise)
      .def_rw("tilt", &NavigationConfig::tilt)
      .def_rw("tiltGate", &NavigationConfig::tiltGate)
      .def_rw("mag", &NavigationConfig::mag)
      .def_rw("alt", &NavigationConfig::alt)
      .def_rw("gpsPositionSigma", &NavigationConfig::gpsPositionSigma)
      .def_rw("gpsVelocitySigma", &NavigationConfig::gpsVelocitySigma)
      .def_rw("standstillSigma", &NavigationConfig::standstillSigma)
      .def_rw("gpsDelay", &NavigationConfig::gpsDelay)
      .def_rw("nisGate", &NavigationConfig::nisGate)
      .def_rw("positionSigma0", &NavigationConfig::positionSigma0)
      .def_rw("velocitySigma0", &NavigationConfig::velocitySigma0)
      .def_rw("tiltSigma0", &NavigationConfig::tiltSigma0)
      .def_rw("headingSigma0", &NavigationConfig::headingSigma0);
}

void bindAlignment(nb::module_& m) {
  using strix::Alignment;

  nb::class_<Alignment>(m, "Alignment", "Attitude and magnetic reference from a still start")
      .def_prop_ro("attitude", [](const Alignment& a) { return toArray(a.attitude); })
      .def_ro("magReference", &Alignment::magReference);
  m.def("alignStill", &strix::alignStill, "accel"_a, "mag"_a, "declination"_a,
        "Roll and pitch from the mean specific force, heading from the mean field");
}

void bindInnovation(nb::module_& m) {
  using strix::Innovation;

  nb::class_<Innovation>(m, "Innovation", "What the last measurement of a sensor told the filter")
      .def_ro("value", &Innovation::value)
      .def_ro("variance", &Innovation::variance)
      .def_ro("nis", &Innovation::nis)
      .def_ro("count", &Innovation::count)
      .def_ro("rejected", &Innovation::rejected)
      .def_ro("rejections", &Innovation::rejections)
      .def_ro("accepted", &Innovation::accepted);
}

void bindFilter(nb::module_& m) {
  using strix::ESKF;

  nb::class_<ESKF>(m, "ESKF", "The 9-state error-state Kalman filter of lib/Navigation")
      .def(nb::init<const strix::NavigationConfig&>(), "config"_a)
      .def("initialize", &ESKF::initialize, "alignment"_a, "gravity"_a)
      .def("predict", &ESKF::predict, "accel"_a, "gyro"_a, "now"_a)
      .def("updateTiltMeas", &ESKF::updateTiltMeas, "accel"_a)
      .def("updateMagMeas", &ESKF::updateMagMeas, "mag"_a, "now"_a)
      .def("updateAltMeas", &ESKF::updateAltMeas, "height"_a, "now"_a)
      .def("updateGPSMeas", &ESKF::updateGPSMeas, "positionNed"_a, "velocityNed"_a)
      .def("updateStandstill", &ESKF::updateStandstill)
      .def("injectError", &ESKF::injectError)
      .def("healthy", &ESKF::healthy)
      .def("covariance", [](const ESKF& f) { return f.covariance(); })
      .def("tiltInnovation", [](const ESKF& f) { return f.tiltInnovation(); })
      .def("magInnovation", [](const ESKF& f) { return f.magInnovation(); })
      .def("altInnovation", [](const ESKF& f) { return f.altInnovation(); })
      .def("gpsInnovation", [](const ESKF& f) { return f.gpsInnovation(); })
      .def_prop_ro("attitude", [](const ESKF& f) { return toArray(f.state().attitude); })
      .def_prop_ro("positionNed", [](const ESKF& f) { return f.state().positionNed; })
      .def_prop_ro("velocityNed", [](const ESKF& f) { return f.state().velocityNed; });
}

void bindGeodesy(nb::module_& m) {
  using strix::GeoPoint;
  using strix::LocalFrame;

  nb::class_<GeoPoint>(m, "GeoPoint", "Latitude and longitude in 1e-7 deg, altitude in mm")
      .def(nb::init<std::int32_t, std::int32_t, std::int32_t>(), "latitude"_a, "longitude"_a,
           "altitude"_a);
  nb::class_<LocalFrame>(m, "LocalFrame", "The local tangent plane at an origin")
      .def(nb::init<const GeoPoint&>(), "origin"_a)
      .def("toNed", &LocalFrame::toNed, "point"_a);
}

}  // namespace

void bindEstimator(nb::module_& m) {
  bindConfig(m);
  bindAlignment(m);
  bindInnovation(m);
  bindFilter(m);
  bindGeodesy(m);
}
