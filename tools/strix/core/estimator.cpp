/// Python's view of the navigation: the same Navigation.h the aircraft runs, its tuning and its
/// alignment. Quaternions are arrays [w x y z]; everything else has the unit the header gives it.
#include <Geodesy.h>
#include <Navigation.h>

#include "bind.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Vector4f = Eigen::Matrix<float, 4, 1>;

Vector4f toArray(const strix::Quaternion& q) { return {q.w, q.x, q.y, q.z}; }

void bindPolicies(nb::module_& m) {
  using strix::ComplementaryConfig;
  using strix::FieldTrackerConfig;
  using strix::MagFusion;
  using strix::MotorState;
  using strix::StandstillConfig;
  using strix::TiltFusion;
  using strix::WithMotors;

  nb::enum_<TiltFusion>(m, "TiltFusion", "What the accelerometer may say about gravity's direction")
      .value("Off", TiltFusion::Off)
      .value("Gated", TiltFusion::Gated)
      .value("Vibration", TiltFusion::Vibration);
  nb::enum_<MagFusion>(m, "MagFusion", "What a magnetometer may correct")
      .value("ThreeAxis", MagFusion::ThreeAxis)
      .value("HeadingOnly", MagFusion::HeadingOnly);
  nb::enum_<WithMotors>(m, "WithMotors", "When a sensor that running motors disturb is used")
      .value("On", WithMotors::On)
      .value("Inflated", WithMotors::Inflated)
      .value("HoverOnly", WithMotors::HoverOnly)
      .value("Off", WithMotors::Off);
  nb::enum_<MotorState>(m, "MotorState", "What the motors do to the sensors")
      .value("Stopped", MotorState::Stopped)
      .value("Hover", MotorState::Hover)
      .value("Disturbed", MotorState::Disturbed);
  nb::class_<FieldTrackerConfig>(m, "FieldTrackerConfig", "When a field is the earth's")
      .def_rw("norm", &FieldTrackerConfig::norm)
      .def_rw("dip", &FieldTrackerConfig::dip)
      .def_rw("track", &FieldTrackerConfig::track)
      .def_rw("motion", &FieldTrackerConfig::motion)
      .def_rw("adopt", &FieldTrackerConfig::adopt);
  nb::class_<StandstillConfig>(m, "StandstillConfig", "When the sensors lie still")
      .def_rw("rate", &StandstillConfig::rate)
      .def_rw("acceleration", &StandstillConfig::acceleration)
      .def_rw("meanRate", &StandstillConfig::meanRate)
      .def_rw("meanForce", &StandstillConfig::meanForce)
      .def_rw("lowPass", &StandstillConfig::lowPass)
      .def_rw("duration", &StandstillConfig::duration);
  nb::class_<ComplementaryConfig>(m, "ComplementaryConfig", "Times of the complementary filter")
      .def_rw("tiltTime", &ComplementaryConfig::tiltTime)
      .def_rw("headingTime", &ComplementaryConfig::headingTime)
      .def_rw("biasTime", &ComplementaryConfig::biasTime)
      .def_rw("gate", &ComplementaryConfig::gate);
}

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
      .def_rw("accelNoiseUnaided", &NavigationConfig::accelNoiseUnaided)
      .def_rw("headingRate", &NavigationConfig::headingRate)
      .def_rw("outageVelocityFactor", &NavigationConfig::outageVelocityFactor)
      .def_rw("gyroScaleNoise", &NavigationConfig::gyroScaleNoise)
      .def_rw("gyroNoiseUnaided", &NavigationConfig::gyroNoiseUnaided)
      .def_rw("accelBiasWalk", &NavigationConfig::accelBiasWalk)
      .def_rw("gyroBiasWalk", &NavigationConfig::gyroBiasWalk)
      .def_rw("magBiasWalk", &NavigationConfig::magBiasWalk)
      .def_rw("tiltFusion", &NavigationConfig::tiltFusion)
      .def_rw("tilt", &NavigationConfig::tilt)
      .def_rw("tiltGate", &NavigationConfig::tiltGate)
      .def_rw("tiltVibration", &NavigationConfig::tiltVibration)
      .def_rw("magFusion", &NavigationConfig::magFusion)
      .def_rw("mag", &NavigationConfig::mag)
      .def_rw("heading", &NavigationConfig::heading)
      .def_rw("trackField", &NavigationConfig::trackField)
      .def_rw("field", &NavigationConfig::field)
      .def_rw("alt", &NavigationConfig::alt)
      .def_rw("altDelay", &NavigationConfig::altDelay)
      .def_rw("gpsPositionSigma", &NavigationConfig::gpsPositionSigma)
      .def_rw("gpsVelocitySigma", &NavigationConfig::gpsVelocitySigma)
      .def_rw("gpsDelay", &NavigationConfig::gpsDelay)
      .def_rw("tiltWithMotors", &NavigationConfig::tiltWithMotors)
      .def_rw("magWithMotors", &NavigationConfig::magWithMotors)
      .def_rw("disturbedFactor", &NavigationConfig::disturbedFactor)
      .def_rw("magHoverOffset", &NavigationConfig::magHoverOffset)
      .def_rw("standstillAid", &NavigationConfig::standstillAid)
      .def_rw("standstill", &NavigationConfig::standstill)
      .def_rw("standstillSigma", &NavigationConfig::standstillSigma)
      .def_rw("standstillRateSigma", &NavigationConfig::standstillRateSigma)
      .def_rw("boundedMotion", &NavigationConfig::boundedMotion)
      .def_rw("boundedPositionSigma", &NavigationConfig::boundedPositionSigma)
      .def_rw("boundedVelocitySigma", &NavigationConfig::boundedVelocitySigma)
      .def_rw("outageVelocitySigma", &NavigationConfig::outageVelocitySigma)
      .def_rw("gpsAidTime", &NavigationConfig::gpsAidTime)
      .def_rw("nisGate", &NavigationConfig::nisGate)
      .def_rw("readmitAfter", &NavigationConfig::readmitAfter)
      .def_rw("gpsTimeout", &NavigationConfig::gpsTimeout)
      .def_rw("altTimeout", &NavigationConfig::altTimeout)
      .def_rw("magTimeout", &NavigationConfig::magTimeout)
      .def_rw("disagreement", &NavigationConfig::disagreement)
      .def_rw("disagreementTime", &NavigationConfig::disagreementTime)
      .def_rw("complementary", &NavigationConfig::complementary)
      .def_rw("positionSigma0", &NavigationConfig::positionSigma0)
      .def_rw("velocitySigma0", &NavigationConfig::velocitySigma0)
      .def_rw("tiltSigma0", &NavigationConfig::tiltSigma0)
      .def_rw("headingSigma0", &NavigationConfig::headingSigma0)
      .def_rw("accelBiasSigma0", &NavigationConfig::accelBiasSigma0)
      .def_rw("gyroBiasSigma0", &NavigationConfig::gyroBiasSigma0)
      .def_rw("magBiasSigma0", &NavigationConfig::magBiasSigma0);
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
      .def_ro("accepted", &Innovation::accepted)
      .def_ro("readmissions", &Innovation::readmissions);
}

/// A navigation that Python feeds; copy.copy() gives one that goes on from the same state.
template <int States>
void bindNavigation(nb::module_& m, const char* name, const char* doc) {
  using Navigation = strix::Navigation<States>;

  nb::class_<Navigation>(m, name, doc)
      .def(nb::init<const strix::NavigationConfig&>(), "config"_a)
      .def("__copy__", [](const Navigation& n) { return Navigation(n); })
      .def("initialize", &Navigation::initialize, "alignment"_a, "gravity"_a, "now"_a)
      .def("setMotors", &Navigation::setMotors, "motors"_a)
      .def("predict", &Navigation::predict, "accel"_a, "gyro"_a, "now"_a)
      .def("updateTiltMeas", &Navigation::updateTiltMeas, "accel"_a)
      .def("updateMagMeas", &Navigation::updateMagMeas, "mag"_a, "now"_a)
      .def("updateAltMeas", &Navigation::updateAltMeas, "height"_a, "now"_a)
      .def("updateGPSMeas", &Navigation::updateGPSMeas, "positionNed"_a, "velocityNed"_a, "now"_a)
      .def("finishPass", &Navigation::finishPass, "now"_a)
      .def("healthy", &Navigation::healthy)
      .def("health", &Navigation::health)
      .def("standsStill", &Navigation::standsStill)
      .def("restarts", &Navigation::restarts)
      .def("vibration", &Navigation::vibration)
      .def("covariance", [](const Navigation& n) { return n.filter().covariance(); })
      .def("tiltInnovation", [](const Navigation& n) { return n.filter().tiltInnovation(); })
      .def("magInnovation", [](const Navigation& n) { return n.filter().magInnovation(); })
      .def("altInnovation", [](const Navigation& n) { return n.filter().altInnovation(); })
      .def("gpsInnovation", [](const Navigation& n) { return n.filter().gpsInnovation(); })
      .def_prop_ro("attitude", [](const Navigation& n) { return toArray(n.state().attitude); })
      .def_prop_ro("positionNed", [](const Navigation& n) { return n.state().positionNed; })
      .def_prop_ro("velocityNed", [](const Navigation& n) { return n.state().velocityNed; })
      .def_prop_ro("gyroBias", [](const Navigation& n) { return n.filter().gyroBias(); })
      .def_prop_ro("accelBias", [](const Navigation& n) { return n.filter().accelBias(); })
      .def_prop_ro("magBias", [](const Navigation& n) { return n.filter().magBias(); })
      .def_prop_ro("complementaryAttitude",
                   [](const Navigation& n) { return toArray(n.complementary().attitude()); });
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
  bindPolicies(m);
  bindConfig(m);
  bindAlignment(m);
  bindInnovation(m);
  bindNavigation<9>(m, "Navigation9", "The flight navigation with 9 states");
  bindNavigation<18>(m, "Navigation18", "The flight navigation with 18 states");
  bindGeodesy(m);
}
