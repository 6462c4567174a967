/// A long run of the flight filter in one call, beside the truth, for strix/consistency.py: what
/// the filter says of its own error (P, innovation variances) against the error it really makes.
///
/// The filter computes in float32 as on the aircraft; the judgement is in double.
#include <ESKF.h>
#include <nanobind/eigen/dense.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <limits>
#include <stdexcept>

#include "bind.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

template <int Columns>
using Rows = Eigen::Matrix<float, Eigen::Dynamic, Columns, Eigen::RowMajor>;
template <int Columns>
using RowsIn = const Eigen::Ref<const Rows<Columns>>&;

/// p, v (m, m/s, NED), attitude [w x y z], b_a, b_g, b_m
using Truths = Eigen::Matrix<double, Eigen::Dynamic, 19, Eigen::RowMajor>;
using TruthRow = Eigen::Matrix<double, 1, 19>;

struct Record {
  Eigen::MatrixXd error;       ///< true minus estimated error state, a row per truth
  Eigen::VectorXd nees;        ///< e^T P^-1 e; NaN where P has no Cholesky factor in double
  Eigen::VectorXd eigenvalue;  ///< smallest of the correlation matrix of P
  Rows<3> tiltNis, magNis;     ///< value^2 / variance of each scalar, a row per measurement
  Eigen::VectorXf altNis;
  Rows<4> gpsNis;
};

/// Readings that lie evenly among the samples, each after the last sample of its share.
class Share {
 public:
  Share(Eigen::Index samples, Eigen::Index readings) : every_(readings ? samples / readings : 0) {
    if (readings != 0 && readings * every_ != samples) {
      throw std::invalid_argument("the number of samples is no multiple of that of the readings");
    }
  }
  [[nodiscard]] bool due(Eigen::Index sample) const {
    return every_ != 0 && (sample + 1) % every_ == 0;
  }
  [[nodiscard]] Eigen::Index row(Eigen::Index sample) const { return sample / every_; }

 private:
  Eigen::Index every_;
};

template <int States>
class FilterRun {
 public:
  FilterRun(const strix::NavigationConfig& config, const Eigen::Vector4f& attitude,
            const strix::Vector3f& magReference, strix::Micros start)
      : filter_(config), now_(start) {
    filter_.initialize({{attitude(0), attitude(1), attitude(2), attitude(3)}, magReference},
                       config.gravity);
    filter_.predict(strix::Vector3f::Zero(), strix::Vector3f::Zero(), start);  // sets the time
  }

  Record run(strix::Micros step, RowsIn<3> accel, RowsIn<3> gyro, RowsIn<3> tilt, RowsIn<3> mag,
             const Eigen::Ref<const Eigen::VectorXf>& alt, RowsIn<4> gps,
             const Eigen::Ref<const Truths>& truth) {
    const Eigen::Index samples = accel.rows();
    if (gyro.rows() != samples) throw std::invalid_argument("as many gyro as accel samples");
    const Share tilts(samples, tilt.rows()), mags(samples, mag.rows()), alts(samples, alt.rows()),
        fixes(samples, gps.rows()), truths(samples, truth.rows());
    Record record{Eigen::MatrixXd(truth.rows(), States),
                  Eigen::VectorXd(truth.rows()),
                  Eigen::VectorXd(truth.rows()),
                  Rows<3>(tilt.rows(), 3),
                  Rows<3>(mag.rows(), 3),
                  Eigen::VectorXf(alt.rows()),
                  Rows<4>(gps.rows(), 4)};
    const auto keep = [](auto&& row, const strix::Innovation& innovation) {
      for (Eigen::Index i = 0; i < row.size(); ++i) {
        row(i) = innovation.nis[static_cast<std::size_t>(i)];
      }
    };
    for (Eigen::Index i = 0; i < samples; ++i) {  // one pass of the loop of DESIGN.md, 3
      now_ += step;
      filter_.predict(accel.row(i).transpose(), gyro.row(i).transpose(), now_);
      if (tilts.due(i)) {
        const Eigen::Index row = tilts.row(i);
        filter_.updateTiltMeas(tilt.row(row).transpose());
        keep(record.tiltNis.row(row), filter_.tiltInnovation());
      }
      if (mags.due(i)) {
        const Eigen::Index row = mags.row(i);
        filter_.updateMagMeas(mag.row(row).transpose(), now_);
        keep(record.magNis.row(row), filter_.magInnovation());
      }
      if (alts.due(i)) {
        const Eigen::Index row = alts.row(i);
        filter_.updateAltMeas(alt(row), now_);
        keep(record.altNis.row(row), filter_.altInnovation());
      }
      if (fixes.due(i)) {
        const Eigen::Index row = fixes.row(i);
        filter_.updateGPSMeas({gps(row, 0), gps(row, 1), 0.0F}, {gps(row, 2), gps(row, 3), 0.0F});
        keep(record.gpsNis.row(row), filter_.gpsInnovation());
      }
      filter_.injectError();
      if (truths.due(i)) judge(record, truths.row(i), truth.row(truths.row(i)));
    }
    return record;
  }

 private:
  using VectorD = Eigen::Matrix<double, States, 1>;
  using MatrixD = Eigen::Matrix<double, States, States>;

  void judge(Record& record, Eigen::Index row, const TruthRow& truth) const {
    const VectorD error = errorFrom(truth);
    const MatrixD p = filter_.covariance().template cast<double>();
    const Eigen::LLT<MatrixD> cholesky(p);
    record.error.row(row) = error.transpose();
    record.nees(row) = cholesky.info() == Eigen::Success
                           ? cholesky.matrixL().solve(error).squaredNorm()
                           : std::numeric_limits<double>::quiet_NaN();
    const VectorD scale = p.diagonal().cwiseSqrt().cwiseInverse();
    const MatrixD correlation = scale.asDiagonal() * p * scale.asDiagonal();
    record.eigenvalue(row) =
        Eigen::SelfAdjointEigenSolver<MatrixD>(correlation, Eigen::EigenvaluesOnly)
            .eigenvalues()
            .minCoeff();
  }

  /// The error state that would lead from the estimate to the truth. alpha = 2 vec(q_hat* (x) q),
  /// the sign chosen so that w >= 0; written out, because Math's quaternions are float32.
  VectorD errorFrom(const TruthRow& truth) const {
    const strix::VehicleState& state = filter_.state();
    const auto difference = [&truth](int column, const strix::Vector3f& estimate) {
      return Eigen::Vector3d(truth.segment<3>(column).transpose() - estimate.cast<double>());
    };
    VectorD error;
    error.template segment<3>(strix::kPosition) = difference(0, state.positionNed);
    error.template segment<3>(strix::kVelocity) = difference(3, state.velocityNed);
    const strix::Quaternion& q = state.attitude;
    const Eigen::Vector3d estimate = q.vec().cast<double>();
    const double w = static_cast<double>(q.w);
    const double trueW = truth(6);
    const Eigen::Vector3d trueVec = truth.segment<3>(7).transpose();
    const double sign = w * trueW + estimate.dot(trueVec) < 0.0 ? -2.0 : 2.0;
    error.template segment<3>(strix::kAlpha) =
        sign * (w * trueVec - trueW * estimate - estimate.cross(trueVec));
    if constexpr (States == 18) {
      error.template segment<3>(strix::kAccelBias) = difference(10, filter_.accelBias());
      error.template segment<3>(strix::kGyroBias) = difference(13, filter_.gyroBias());
      error.template segment<3>(strix::kMagBias) = difference(16, filter_.magBias());
    }
    return error;
  }

  strix::ESKF<States> filter_;
  strix::Micros now_;
};

template <int States>
void bindRun(nb::module_& m, const char* name) {
  using Run = FilterRun<States>;
  nb::class_<Run>(m, name, "The flight filter over many samples, beside the truth")
      .def(nb::init<const strix::NavigationConfig&, const Eigen::Vector4f&, const strix::Vector3f&,
                    strix::Micros>(),
           "config"_a, "attitude"_a, "magReference"_a, "start"_a)
      .def("run", &Run::run, "step"_a, "accel"_a, "gyro"_a, "tilt"_a, "mag"_a, "alt"_a, "gps"_a,
           "truth"_a,
           "Go on by these samples, `step` us apart; readings and truths lie evenly among them.\n"
           "gps: p_n p_e v_n v_e. truth: p, v, q, b_a, b_g, b_m.");
}

}  // namespace

void bindConsistency(nb::module_& m) {
  nb::class_<Record>(m, "ConsistencyRecord", "What a run of the filter was worth")
      .def_ro("error", &Record::error)
      .def_ro("nees", &Record::nees)
      .def_ro("eigenvalue", &Record::eigenvalue)
      .def_ro("tiltNis", &Record::tiltNis)
      .def_ro("magNis", &Record::magNis)
      .def_ro("altNis", &Record::altNis)
      .def_ro("gpsNis", &Record::gpsNis);
  bindRun<9>(m, "FilterRun9");
  bindRun<18>(m, "FilterRun18");
}
