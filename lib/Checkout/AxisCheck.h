/// A person turns the aircraft, and sees whether the sensors' axes are the body's (FRD).
#pragma once

#include <array>
#include <string_view>

#include "MotionWatch.h"
#include "TextOut.h"

namespace strix {

/// The side of the aircraft that points down, from the specific force at rest, which points up:
/// nose down is -x. nullptr between two sides.
[[nodiscard]] inline const char* sideDown(const Vector3f& accel) {
  const float most = accel.cwiseAbs().maxCoeff();
  if (!(most > 0.85F * accel.norm())) return nullptr;  // 32 deg from an axis
  if (accel.x() == -most) return "nose down";
  if (accel.x() == most) return "nose up";
  if (accel.y() == most) return "left side down";
  if (accel.y() == -most) return "right side down";
  return accel.z() == -most ? "level" : "upside down";
}

/// Heading of the body x axis from magnetic north, rad, of an aircraft at rest in any attitude but
/// nose up or down. @param accel  m/s^2, body    @param field  uT, body
[[nodiscard]] inline float magneticHeading(const Vector3f& accel, const Vector3f& field) {
  const Vector3f down = -accel / accel.norm();
  const Vector3f east = down.cross(field);
  return arcTangent2(east.x(), east.cross(down).x());
}

/// Five poses, each confirmed with Enter. In each the accelerometer must name the side that is
/// down; the gyro must have seen the turn from the pose before; the vertical part of the earth's
/// field must stay the same. Which is enough: an exchanged axis or a wrong sign in sensorToBody
/// fails at least one of them, and a gyro that turns the other way fails where the accelerometer
/// does not.
class AxisCheck {
 public:
  explicit AxisCheck(TextOut& out) : out_(out) {}

  void start() {
    pose_ = 0;
    failed_.fill(false);
    hasField_ = false;
    out_ << "Hold each pose and press Enter. The command stop ends it.\n";
    ask();
  }

  [[nodiscard]] bool active() const { return pose_ < kPoses; }
  void stop() { pose_ = kPoses; }

  /// @param gyro  rad/s, body, bias and all    @param dt  since the last one, s
  void addGyro(const Vector3f& gyro, float dt) {
    if (!isFinite(gyro)) return;
    turned_ = normalized(turned_ * quaternionExp((gyro - gyroBias_) * dt));
  }
  /// @param field  uT, body, calibrated
  void addField(const Vector3f& field) {
    if (!isFinite(field)) return;
    field_ = hasField_ ? Vector3f(field_ + kFieldSmoothing * (field - field_)) : field;
    hasField_ = true;
  }

  /// Enter was pressed: the aircraft is in the pose that was asked for.
  void confirm(const MotionWatch& motion) {
    if (!motion.alive()) {
      out_ << "the IMU gives no data: see the command sensors\n";
      stop();
      return;
    }
    if (pose_ == 0 && !motion.still()) {  // the gyro's bias is taken here
      out_ << "it moves: let it stand still for a second, then press Enter\n";
      return;
    }
    judge(motion.accel());
    if (pose_ == 0) gyroBias_ = motion.gyro();
    accel_ = motion.accel();
    heading_ = hasField_ ? magneticHeading(accel_, field_) : 0.0F;
    turned_ = Quaternion{};
    ++pose_;
    if (active()) {
      ask();
    } else {
      conclude();
    }
  }

 private:
  struct Pose {
    const char* question;
    const char* side;
  };
  static constexpr std::size_t kPoses = 5;
  static constexpr std::array<Pose, kPoses> kAsked{{
      {"1 of 5: on its feet, level", "level"},
      {"2 of 5: nose straight down", "nose down"},
      {"3 of 5: left side down", "left side down"},
      {"4 of 5: level, nose to magnetic north", "level"},
      {"5 of 5: level, turned a quarter clockwise seen from above, nose to the east", "level"},
  }};
  static constexpr std::size_t kNorth = 3;
  static constexpr std::size_t kEast = 4;
  static constexpr float kFieldSmoothing = 0.1F;          // of 100 Hz: 0.1 s
  static constexpr float kByHand = 35.0F * kDegToRad;     // how well a person points it
  static constexpr float kGyroError = 25.0F * kDegToRad;  // a minute of 0.4 deg/s
  static constexpr float kVerticalChange = 0.5F;          // of the field; a wrong sign is 1 to 2

  enum Sensor : std::size_t { kAccelerometer, kGyro, kMagnetometer, kSensors };

  void ask() { out_ << kAsked[pose_].question << ", Enter\n"; }

  void judge(const Vector3f& accel) {
    const char* found = sideDown(accel);
    line(kAccelerometer, found == std::string_view(kAsked[pose_].side))
        << (found == nullptr ? "between two sides" : found) << ", " << Fixed3{accel, 1}
        << " m/s^2\n";
    if (pose_ > 0) judgeGyro(accel);
    if (!hasField_) {
      line(kMagnetometer, false) << "no data: see the command sensors\n";
      return;
    }
    judgeVertical(accel);
    if (pose_ == kNorth) {
      const float heading = magneticHeading(accel, field_);
      northSeen_ = near(heading, 0.0F, kByHand);
      line(kMagnetometer, northSeen_)
          << "heading " << Fixed{heading * kRadToDeg, 0} << " deg, 0 within 35\n";
    }
    if (pose_ == kEast) judgeTurn(accel);
  }

  /// The turn that the gyro saw takes the old up to the new up.
  void judgeGyro(const Vector3f& accel) {
    const Vector3f expected = rotateToBody(turned_, accel_);
    const float angle = arcTangent2(expected.cross(accel).norm(), expected.dot(accel));
    line(kGyro, angle < kGyroError)
        << Fixed{angle * kRadToDeg, 0} << " deg beside the accelerometer, at most 25\n";
  }

  void judgeVertical(const Vector3f& accel) {
    const float vertical = -field_.dot(accel) / accel.norm();
    if (pose_ == 0) {
      vertical_ = vertical;
      return;
    }
    const float change = vertical - vertical_;
    line(kMagnetometer, change * change < kVerticalChange * kVerticalChange * field_.squaredNorm())
        << Fixed{vertical, 0} << " uT down, " << Fixed{vertical_, 0} << " on its feet\n";
  }

  void judgeTurn(const Vector3f& accel) {
    const float byGyro = yawOf(turned_);
    line(kGyro, near(byGyro, kHalfPi, kByHand))
        << "turned " << Fixed{byGyro * kRadToDeg, 0} << " deg, 90 within 35\n";
    const float byField = wrapped(magneticHeading(accel, field_) - heading_);
    line(kMagnetometer, near(byField, kHalfPi, kByHand))
        << "heading grew by " << Fixed{byField * kRadToDeg, 0} << " deg, 90 within 35\n";
    if (byField < 0.0F && northSeen_ && near(byGyro, kHalfPi, kByHand)) {
      out_ << "    -> it falls where it must grow: the y axis has the wrong sign in "
              "magSensorToBody (include/FlightConfig.h)\n";
    }
  }

  TextOut& line(Sensor sensor, bool good) {
    constexpr const char* kNames[kSensors] = {"accelerometer", "gyro", "magnetometer"};
    if (!good) failed_[sensor] = true;
    return out_ << "  " << (good ? "PASS " : "FAIL ") << kNames[sensor] << ": ";
  }

  /// The accelerometer says which way is up, so its fault shows in the others, too: it comes first.
  void conclude() {
    if (failed_[kAccelerometer]) {
      out_ << "axes: FAIL\n    -> were the poses right? then sensorToBody of the IMU is not how it "
              "sits (docs/sensor-checks.md)\n";
    } else if (failed_[kGyro]) {
      out_ << "axes: FAIL\n    -> did it turn as asked? then the gyro's axes are not the "
              "accelerometer's: another sensor\n";
    } else if (failed_[kMagnetometer]) {
      out_
          << "axes: FAIL\n    -> no iron near? calibrated? then magSensorToBody is not how it sits "
             "(docs/sensor-checks.md)\n";
    } else {
      out_ << "axes: PASS\n";
    }
  }

  [[nodiscard]] static float wrapped(float angle) {
    if (angle > kPi) return angle - 2.0F * kPi;
    return angle <= -kPi ? angle + 2.0F * kPi : angle;
  }
  [[nodiscard]] static bool near(float angle, float wanted, float tolerance) {
    const float off = wrapped(angle - wanted);
    return off > -tolerance && off < tolerance;
  }

  TextOut& out_;
  std::size_t pose_ = kPoses;
  std::array<bool, kSensors> failed_{};
  Quaternion turned_;  ///< since the pose before
  Vector3f gyroBias_ = Vector3f::Zero();
  Vector3f accel_ = Vector3f::Zero();  ///< m/s^2, of the pose before
  Vector3f field_ = Vector3f::Zero();
  float heading_ = 0.0F;   ///< rad, of the pose before
  float vertical_ = 0.0F;  ///< uT, downwards, on its feet
  bool hasField_ = false;
  bool northSeen_ = false;
};

}  // namespace strix
