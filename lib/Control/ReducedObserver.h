/// Attitude control by state feedback with a reduced observer of the torque: Ugglan's law.
///
/// On each axis a rotor's lag stands between the torque asked for and the torque there is:
///
///     angle' = x_v        x_v' = c x_a,  c = 1/J        x_a' = (u - x_a)/tau
///
/// Angle and rate are measured; x_a, the torque about the axis, is not. A gyro's derivative would
/// show it, but noisily: the observer weighs it against the motor model. With e = x_v' - c x_a,
/// which is zero when the estimate is right,
///
///     x_a' = (u - x_a)/tau + a e,     and with z = x_a - a x_v, which needs no derivative,
///     z'   = (u - x_a)/tau - a c x_a            (its pole: -(1/tau + a c))
///
/// a = 0 trusts the motor model alone, a large a the gyro alone. By backward difference over dt,
///
///     x_a[k] = b1 (x_a[k-1] - a x_v[k-1]) + (b2 + a) x_v[k] + b3 u[k]
///     b4 = tau + dt (1 + a tau c)   b1 = tau/b4   b2 = -a dt (1 + a tau c)/b4   b3 = dt/b4
///     u[k] = -(l0 x0 + l1 x1 + l2 x_v + l3 x_a[k]),  x0 the integral of the reference's error,
///
/// and since x_a[k] contains u[k], solved for it.
///
/// The published page (Ugglan, doc/source/drone.rst of January 2021, "Force and Torque Estimation"
/// and "Discretized Feedback"; the observer is from the thesis behind it, diva2:857660, 4.2.3) has
/// two slips. Its recursion has b2 x_v[k], which is z[k], where x_a[k] = z[k] + a x_v[k]; and its
/// feedback keeps u[k-1] where x_a[k-1] belongs. test_reduced_observer.cpp flies both: the first is
/// unstable at 50 Hz, the second at 500 Hz.
#pragma once

#include <cstdint>

#include "Mathpk.h"
#include "Vehicle.h"

namespace strix {

/// Of one axis; u is a torque in N m.
struct ObserverAxisGains {
  float integral;  ///< l0, N m/(rad s) of roll and pitch; N m/rad of yaw, x0 = integral of rate
  float angle;     ///< l1, N m/rad; 0 of yaw: there is no angle in rate control
  float rate;      ///< l2, N m/(rad/s)
  float torque;    ///< l3, N m/(N m)
  float observer;  ///< a, N m/(rad/s)
  float integralLimit;  ///< anti-windup: of |x0|, rad s or rad
};

/// Values are generated: include/gains/, by `strix gains --controller ugglan`.
struct ObserverGains {
  const char* design;  ///< vehicle and method, for the log
  ObserverAxisGains roll;
  ObserverAxisGains pitch;
  ObserverAxisGains yaw;
  float heading;  ///< 1/s: rate asked for by a heading error, where a heading is wanted
};

/// One axis at a fixed period.
class ReducedObserverAxis {
 public:
  /// @param inertia  kg m^2    @param motorTimeConstant  s    @param period  s
  ReducedObserverAxis(const ObserverAxisGains& gains, float inertia, float motorTimeConstant,
                      float period)
      : gains_(gains), period_(period) {
    const float a = gains.observer;
    const float stiffness = 1.0F + a * motorTimeConstant / inertia;  // 1 + a tau c
    const float b4 = motorTimeConstant + period * stiffness;
    b1_ = motorTimeConstant / b4;
    b2_ = -a * period * stiffness / b4;
    const float b3 = period / b4;
    b3_ = b3;
    share_ = 1.0F / (1.0F + gains.torque * b3);
  }

  void reset() {
    integral_ = torque_ = rate_ = control_ = excess_ = 0.0F;
    fresh_ = true;
  }

  /// One step of roll or pitch: keeps an angle.
  /// @param angle  x1: estimate minus reference, rad
  /// @param rate   x_v, rad/s
  /// @return u, N m
  float holdAngle(float angle, float rate) { return step(angle, angle, rate, rate); }

  /// One step of yaw: keeps a rate. The reference is taken off the rate in the feedback only: the
  /// observer looks at how the body turns, and a step of the reference is no torque.
  float holdRate(float rate, float reference) {
    return step(rate - reference, 0.0F, rate - reference, rate);
  }

  /// Reports what the motors can give of u: the estimate goes by that, and while they cannot give
  /// it all the integral does not grow into the limit.
  void setAchieved(float achieved) {
    excess_ = control_ - achieved;
    torque_ -= b3_ * excess_;  // the recursion is linear in u
    control_ = achieved;
  }

  /// x_a: the torque about the axis now, as estimated, N m.
  [[nodiscard]] float torqueNow() const { return torque_; }
  /// x0, rad s or rad.
  [[nodiscard]] float integral() const { return integral_; }

 private:
  /// N m. A share that allocation's rounding leaves is no saturation.
  static constexpr float kSaturation = 1e-3F;

  float step(float integrand, float angle, float rateError, float rate) {
    // A positive integrand lowers u: it deepens an excess below zero, and the other way round.
    const bool deepens =
        (excess_ > kSaturation && integrand < 0.0F) || (excess_ < -kSaturation && integrand > 0.0F);
    if (!deepens) integral_ += period_ * integrand;
    if (integral_ > gains_.integralLimit) integral_ = gains_.integralLimit;
    if (integral_ < -gains_.integralLimit) integral_ = -gains_.integralLimit;

    if (fresh_) rate_ = rate;  // a turn that began before the law did is no torque
    fresh_ = false;
    const float a = gains_.observer;
    const float known = b1_ * (torque_ - a * rate_) + (b2_ + a) * rate;  // x_a[k] - b3 u[k]
    control_ = -share_ * (gains_.integral * integral_ + gains_.angle * angle +
                          gains_.rate * rateError + gains_.torque * known);
    torque_ = known + b3_ * control_;
    rate_ = rate;
    excess_ = 0.0F;
    return control_;
  }

  ObserverAxisGains gains_;
  float period_;  ///< s
  float b1_;
  float b2_;
  float b3_;
  float share_;            ///< 1/(1 + l3 b3)
  float integral_ = 0.0F;  ///< x0
  float torque_ = 0.0F;    ///< x_a[k-1], N m
  float rate_ = 0.0F;      ///< x_v[k-1], rad/s
  float control_ = 0.0F;   ///< u[k-1], N m
  float excess_ = 0.0F;    ///< N m that were asked for and not given
  bool fresh_ = true;
};

/// The three axes. The caller steps it once a period.
class ReducedObserverController {
 public:
  /// @param period  s
  ReducedObserverController(const Vehicle& vehicle, const ObserverGains& gains, float period)
      : heading_(gains.heading),
        roll_(gains.roll, vehicle.inertia[0], vehicle.motorTimeConstant, period),
        pitch_(gains.pitch, vehicle.inertia[1], vehicle.motorTimeConstant, period),
        yaw_(gains.yaw, vehicle.inertia[2], vehicle.motorTimeConstant, period) {}

  void reset() {
    roll_.reset();
    pitch_.reset();
    yaw_.reset();
  }

  /// One step. NaN or infinity in any argument: no torque, and nothing of it is remembered.
  /// @param alpha  attitude of the estimate relative to the one wanted, rad; positive rolled right,
  ///               nose up, nose right. Roll and pitch only: yaw is controlled by its rate
  /// @param rate   rad/s, body
  /// @param yawRateReference  rad/s; headingRate() where a heading is wanted
  /// @return torque about the body axes, N m
  Vector3f update(const Vector3f& alpha, const Vector3f& rate, float yawRateReference) {
    if (!isFinite(alpha) || !isFinite(rate) || !isFinite(yawRateReference)) {
      ++invalid_;
      return Vector3f::Zero();
    }
    return {roll_.holdAngle(alpha.x(), rate.x()), pitch_.holdAngle(alpha.y(), rate.y()),
            yaw_.holdRate(rate.z(), yawRateReference)};
  }

  /// The yaw rate that also brings the nose back to a wanted heading.
  /// @param alphaZ  rad, estimate minus wanted, positive nose right    @param yawRate  rad/s
  [[nodiscard]] float headingRate(float alphaZ, float yawRate) const {
    return yawRate - heading_ * alphaZ;
  }

  /// Reports what the motors made of the torque, N m; once after each update.
  void setAchieved(const Vector3f& torque) {
    if (!isFinite(torque)) return;
    roll_.setAchieved(torque.x());
    pitch_.setAchieved(torque.y());
    yaw_.setAchieved(torque.z());
  }

  /// The torque on the body now, as estimated, N m.
  [[nodiscard]] Vector3f torqueNow() const {
    return {roll_.torqueNow(), pitch_.torqueNow(), yaw_.torqueNow()};
  }
  /// rad s, rad s, rad
  [[nodiscard]] Vector3f integral() const {
    return {roll_.integral(), pitch_.integral(), yaw_.integral()};
  }
  /// Steps with NaN or infinity in them.
  [[nodiscard]] std::uint32_t invalid() const { return invalid_; }

 private:
  float heading_;
  ReducedObserverAxis roll_;
  ReducedObserverAxis pitch_;
  ReducedObserverAxis yaw_;
  std::uint32_t invalid_ = 0;
};

}  // namespace strix
