/// Turns the mission and the flight state into a moving reference, and tells what it has reached.
#pragma once

#include "Conditions.h"
#include "Mission.h"
#include "Parameters.h"
#include "PilotInput.h"
#include "ReferenceRamp.h"
#include "SetpointFlight.h"
#include "StandSequence.h"
#include "States.h"
#include "StickFlight.h"
#include "Trajectory.h"

namespace strix {

struct GuidanceConfig {
  /// Take-off and landing.
  RampLimits ramp{1.0F, 0.5F, 1.0F, 45.0F * kDegToRad, 90.0F * kDegToRad};
  TrajectoryLimits trajectory{};         ///< from place to place
  float arrivalRadius = 0.5F;            ///< m
  float arrivalSpeed = 0.4F;             ///< m/s
  float arrivalYaw = 10.0F * kDegToRad;  ///< rad
  /// After a path's end, ours: gusts and an estimate that settles are over by then.
  Micros patience = 10'000'000;
  float landingDepth = 100.0F;     ///< m below the start the landing ramp aims at
  float landingSlowHeight = 1.0F;  ///< m above the start, as PX4's MPC_LAND_ALT3: below it
  float landingSlowSpeed = 0.3F;   ///< m/s, as its MPC_LAND_CRWL
  /// m, ours: blown away, or with an estimate that jumps, it lands where it is instead of running
  /// sideways into the ground.
  float landingRadius = 0.3F;
  float returnHeight = 3.0F;  ///< m, ours: above people and fences on the way home
  float standThrust = 0.6F;   ///< of the weight, ours: near hover, and the stand holds it
};

class Guidance {
 public:
  /// @param weight  N, of which the stand's thrust is a share
  Guidance(const Mission& mission, const GuidanceConfig& config, float weight = 0.0F)
      : mission_(mission),
        config_(config),
        standThrust_(config.standThrust * weight),
        ramp_(config.ramp),
        trajectory_(config.trajectory),
        sticks_(weight) {}

  void configure(const Parameters& p) {
    config_.returnHeight = p.returnHeight;
    config_.trajectory.speedHorizontal = p.speedHorizontal;
    config_.trajectory.speedVertical = p.speedVertical;
    trajectory_.setLimits(config_.trajectory);
    sticks_.configure(p);
    setpoints_.configure(p);
  }

  /// What the pilot's sticks say now.
  /// @param position, height  whether the estimate has one to hold
  /// @param onGround  with the throttle down: the motors idle until it asks for lifting off
  void setPilot(const PilotInput& input, bool position, bool height, bool onGround) {
    input_ = input;
    mode_ = input.mode;
    if (mode_ == PilotMode::PositionHold && !position) mode_ = PilotMode::AltitudeHold;
    if (usesSticks(mode_) && !height) mode_ = PilotMode::Attitude;
    if (state_ == FlightState::Manual) {
      idles_ = (onGround || idles_) && !StickFlight::lifts(input, mode_);
    }
    const bool start = input.valid && input.start;
    if (start && !started_) resume();
    started_ = start;
  }

  /// Of the pilot's mode what can be flown now.
  [[nodiscard]] PilotMode effectiveMode() const { return mode_; }

  /// CommandKind::Setpoint, to be flown in GUIDED.
  void setSetpoint(const VehicleCommand& c, const Fence& fence) { setpoints_.take(c, fence); }

  /// Ends a hold that somebody asked for, or that has no mission begun.
  void resume() {
    if (state_ == FlightState::Hold && waits_) begun_ = true;
    waits_ = false;
  }

  /// The leg that is flown, from 1; 0: none yet.
  [[nodiscard]] std::uint8_t leg() const { return leg_; }

  /// Called when the state machine has just entered `state`.
  /// @param asked  somebody asked for it: a hold then lasts until he resumes
  void enter(FlightState state, Micros now, const VehicleState& estimate, bool asked = false) {
    const FlightState before = state_;
    // A leg that was left on the way is flown again; a hold that no leg led to goes on only when
    // somebody says so, but for the pilot's who hands a mission back that has begun.
    const bool arrived = state == FlightState::Hold && !asked;
    if (before == FlightState::Waypoint && !arrived && leg_ > 0) --leg_;
    waits_ = state == FlightState::Hold &&
             (asked || before == FlightState::Guided || (before == FlightState::Manual && !begun_));
    state_ = state;
    entered_ = awayAt_ = now;
    idles_ = false;
    switch (state) {
      case FlightState::Takeoff:
        source_ = Source::Ramp;
        leg_ = 0;
        begun_ = true;
        holdTime_ = mission_.takeoffHoldTime;
        radius_ = config_.arrivalRadius;
        startYaw_ = yawOf(estimate.attitude);
        ramp_.setVerticalSpeed(config_.ramp.speedVertical);
        ramp_.reset(now, estimate);
        target_ = {0.0F, 0.0F, -mission_.takeoffHeight};
        targetYaw_ = startYaw_;
        ramp_.setTarget(target_, targetYaw_);
        break;
      case FlightState::Waypoint:
        if (leg_ < mission_.legCount) startLeg(mission_.legs[leg_++], now, estimate);
        break;
      case FlightState::Hold:
        if (waits_ || before == FlightState::Manual) {
          holdTime_ = 0;
          stop(now, estimate);
        }
        // From one attitude straight to the next; after the last one the aircraft is stopped.
        if (source_ == Source::Attitude && !nextIsAttitude()) stop(now, estimate);
        break;
      case FlightState::Return:
        startReturn(now, estimate);
        break;
      case FlightState::Land:
        if (before == FlightState::Blind) break;  // on its way down, fast: the IMU is back
        stop(now, estimate);
        if (trajectory_.arrived()) startDescent(now);
        break;
      case FlightState::Manual:
        if (before == FlightState::Armed) {
          leg_ = 0;
          begun_ = false;
          startYaw_ = yawOf(estimate.attitude);
        }
        source_ = Source::Sticks;
        sticks_.start(now, estimate);
        break;
      case FlightState::Guided:
        takeOver(now, estimate);
        setpoints_.start(now, trajectory_.reference());
        source_ = Source::Setpoint;
        break;
      case FlightState::Blind:
        setpoints_.start(now, motionOf(estimate));
        source_ = Source::Setpoint;
        break;
      case FlightState::AttitudeStand:
        source_ = Source::Stand;
        startYaw_ = yawOf(estimate.attitude);
        part_ = stand::kSteps + 2;  // none
        break;
      default:
        break;
    }
  }

  /// The reference at `now`.
  const Reference& update(Micros now, const VehicleState& estimate) {
    if (!hasTarget() || !pathEnded() || within(estimate.positionNed)) awayAt_ = now;
    switch (source_) {
      case Source::Sticks:
        if (idles_) sticks_.start(now, estimate);
        return sticks_.fly(now, input_, mode_, estimate);
      case Source::Setpoint:
        return state_ == FlightState::Guided
                   ? setpoints_.fly(now, estimate)
                   : setpoints_.descend(now, estimate, state_ == FlightState::Blind);
      case Source::Ramp:
        if (state_ == FlightState::Land) {
          if (-ramp_.reference().positionNed.z() < config_.landingSlowHeight) {
            ramp_.setVerticalSpeed(config_.landingSlowSpeed);
          }
          ramp_.stayNear(estimate.positionNed, config_.landingRadius);
        }
        return ramp_.update(now);
      case Source::Trajectory:
        trajectory_.update(now);
        if (trajectory_.arrived()) goOn(now);
        break;
      case Source::Attitude:
        updateAttitude(now);
        break;
      case Source::Stand:
        if (state_ == FlightState::AttitudeStand) updateStand(now);
        break;
    }
    return reference();
  }

  /// kArrived, kHoldDone, kLegsRemain, kReturn, kAstray, kStandMission and kStandDone as they are
  /// now.
  [[nodiscard]] ConditionSet conditions(Micros now, const VehicleState& estimate) const {
    ConditionSet set = condition::kNone;
    const Micros waited = elapsed(now, entered_);
    const bool legsRemain = leg_ < mission_.legCount;
    const bool holdDone = !waits_ && waited >= holdTime_ && !(stopping_ && !trajectory_.arrived());
    if (arrived(waited, estimate)) set |= condition::kArrived;
    if (holdDone) set |= condition::kHoldDone;
    if (legsRemain) set |= condition::kLegsRemain;
    if (elapsed(now, awayAt_) >= config_.patience) set |= condition::kAstray;
    if (state_ == FlightState::Hold && holdDone && !legsRemain &&
        mission_.end == MissionEnd::Home) {
      set |= condition::kReturn;
    }
    if (mission_.onStand()) set |= condition::kStandMission;
    if (state_ == FlightState::AttitudeStand && waited >= stand::kEnd) {
      set |= condition::kStandDone;
    }
    return set;
  }

  /// The motors shall idle although the state has the controller on: the stand's first seconds.
  [[nodiscard]] bool idles() const { return idles_; }

  [[nodiscard]] const Reference& reference() const {
    if (source_ == Source::Ramp) return ramp_.reference();
    if (source_ == Source::Sticks) return sticks_.reference();
    if (source_ == Source::Setpoint) return setpoints_.reference();
    return source_ == Source::Trajectory ? trajectory_.reference() : tilted_;
  }

 private:
  enum class Source : std::uint8_t { Ramp, Trajectory, Attitude, Stand, Sticks, Setpoint };

  [[nodiscard]] static Reference motionOf(const VehicleState& estimate) {
    Reference motion;
    motion.positionNed = estimate.positionNed;
    motion.velocityNed = estimate.velocityNed;
    motion.yaw = yawOf(estimate.attitude);
    return motion;
  }

  void setTarget(const Vector3f& positionNed, float yaw) {
    target_ = positionNed;
    targetYaw_ = wrapAngle(yaw);
    trajectory_.setTarget(target_, targetYaw_);
  }

  /// Goes on by trajectory from the motion that is there: of the reference, or of the aircraft
  /// where the reference had no place.
  void takeOver(Micros now, const VehicleState& estimate) {
    if (source_ != Source::Trajectory) {
      Reference from = reference();
      if (source_ == Source::Stand) from = motionOf(estimate);
      if (source_ == Source::Sticks) from = sticks_.motion(estimate);
      if (source_ == Source::Attitude) {
        from.positionNed.head<2>() = estimate.positionNed.head<2>();
        from.velocityNed.head<2>() = estimate.velocityNed.head<2>();
        from.accelerationNed.head<2>().setZero();
      }
      trajectory_.reset(now, from);
    }
    source_ = Source::Trajectory;
    stopping_ = false;
    radius_ = config_.arrivalRadius;
  }

  /// Comes to rest and stays there.
  void stop(Micros now, const VehicleState& estimate) {
    takeOver(now, estimate);
    if (!trajectory_.arrived()) trajectory_.halt();
    target_ = trajectory_.target();
    targetYaw_ = trajectory_.targetYaw();
    stopping_ = true;
  }

  void startLeg(const Leg& leg, Micros now, const VehicleState& estimate) {
    if (leg.kind == LegKind::Attitude) {
      const float yaw = wrapAngle(reference().yaw + leg.turn);
      if (source_ != Source::Attitude) takeOver(now, estimate);
      source_ = Source::Attitude;
      tilted_ = trajectory_.reference();
      tilted_.mode = ReferenceMode::AttitudeHeight;
      tilted_.attitude = eulerToQuaternion({leg.roll, leg.pitch, yaw});
      tilted_.yaw = yaw;
      tilted_.yawRate = 0.0F;
      attitudeTime_ = leg.holdTime;
      holdTime_ = 0;
      return;
    }
    takeOver(now, estimate);
    holdTime_ = leg.holdTime;
    if (leg.radius > 0.0F) radius_ = leg.radius;
    trajectory_.setSpeed(leg.speed);
    setTarget({leg.north, leg.east, -leg.height}, startYaw_ + leg.turn);
  }

  /// First up, where that is needed, then over the start.
  void startReturn(Micros now, const VehicleState& estimate) {
    stop(now, estimate);
    stopping_ = false;
    trajectory_.setSpeed(0.0F);
    climbing_ = -target_.z() < config_.returnHeight;
    if (climbing_) {
      setTarget({target_.x(), target_.y(), -config_.returnHeight}, targetYaw_);
    } else {
      setTarget({0.0F, 0.0F, target_.z()}, targetYaw_);
    }
  }

  /// What follows when a trajectory has come to its end.
  void goOn(Micros now) {
    if (state_ == FlightState::Land) startDescent(now);
    if (state_ == FlightState::Return && climbing_) {
      climbing_ = false;
      setTarget({0.0F, 0.0F, target_.z()}, targetYaw_);
    }
  }

  /// Below the ground, so that the descent goes on until touch-down whatever the altimeter says.
  void startDescent(Micros now) {
    source_ = Source::Ramp;
    ramp_.setVerticalSpeed(config_.ramp.speedVertical);
    ramp_.reset(now, target_, targetYaw_);
    target_.z() = config_.landingDepth;
    ramp_.setTarget(target_, targetYaw_);
  }

  /// At the height that the last trajectory gives.
  void updateAttitude(Micros now) {
    const Reference& level = trajectory_.update(now);
    tilted_.positionNed = level.positionNed;
    tilted_.velocityNed = level.velocityNed;
    tilted_.accelerationNed = level.accelerationNed;
  }

  void updateStand(Micros now) {
    const Micros part = stand::partAt(elapsed(now, entered_));
    idles_ = part == 0;
    if (part == part_) return;
    part_ = part;
    EulerAngles wanted = stand::attitudeIn(part, mission_.standAngle);
    wanted.yaw = wrapAngle(startYaw_ + wanted.yaw);
    tilted_ = {};
    tilted_.mode = ReferenceMode::Attitude;
    tilted_.attitude = eulerToQuaternion(wanted);
    tilted_.yaw = wanted.yaw;
    tilted_.thrust = idles_ ? 0.0F : standThrust_;
  }

  [[nodiscard]] bool nextIsAttitude() const {
    return leg_ < mission_.legCount && mission_.legs[leg_].kind == LegKind::Attitude;
  }

  /// @param waited  us in this state
  [[nodiscard]] bool arrived(Micros waited, const VehicleState& estimate) const {
    switch (source_) {
      case Source::Ramp:
        return ramp_.arrived() && near(estimate);
      case Source::Attitude:
        return waited >= attitudeTime_;
      case Source::Trajectory:
        if (state_ == FlightState::Return && climbing_) return false;
        // Through, without a stop: the next leg takes the motion over.
        if (state_ == FlightState::Waypoint && holdTime_ == 0 && leg_ < mission_.legCount) {
          return within(estimate.positionNed) && within(reference().positionNed);
        }
        return trajectory_.arrived() && near(estimate);
      case Source::Stand:
      case Source::Sticks:
      case Source::Setpoint:
        break;
    }
    return false;
  }

  /// Flies to a place, where something waits for its arrival.
  [[nodiscard]] bool hasTarget() const {
    return state_ == FlightState::Takeoff || state_ == FlightState::Waypoint ||
           state_ == FlightState::Return;
  }

  [[nodiscard]] bool pathEnded() const {
    return (source_ == Source::Ramp && ramp_.arrived()) ||
           (source_ == Source::Trajectory && trajectory_.arrived());
  }

  [[nodiscard]] bool within(const Vector3f& positionNed) const {
    return (positionNed - target_).squaredNorm() < radius_ * radius_;
  }

  [[nodiscard]] bool near(const VehicleState& estimate) const {
    const float yawError = wrapAngle(yawOf(estimate.attitude) - targetYaw_);
    return within(estimate.positionNed) && estimate.velocityNed.norm() < config_.arrivalSpeed &&
           yawError < config_.arrivalYaw && yawError > -config_.arrivalYaw;
  }

  Mission mission_;
  GuidanceConfig config_;
  float standThrust_;  ///< N
  ReferenceRamp ramp_;
  Trajectory trajectory_;
  StickFlight sticks_;
  SetpointFlight setpoints_;
  PilotInput input_;
  PilotMode mode_ = PilotMode::Mission;
  bool started_ = false;  ///< his start switch was on
  bool begun_ = false;    ///< the mission: handed back, it goes on
  bool waits_ = false;    ///< in HOLD until somebody resumes
  Reference tilted_;      ///< that of an attitude leg or of the stand
  Source source_ = Source::Ramp;
  FlightState state_ = FlightState::Boot;
  Vector3f target_ = Vector3f::Zero();
  float targetYaw_ = 0.0F;
  float radius_ = 0.0F;  ///< m, this near is there
  float startYaw_ = 0.0F;
  Micros entered_ = 0;
  Micros awayAt_ = 0;  ///< since then the path has ended, and the aircraft is not there
  Micros holdTime_ = 0;
  Micros attitudeTime_ = 0;  ///< of an attitude leg
  Micros part_ = 0;          ///< of the stand's sequence
  bool climbing_ = false;    ///< to the return height
  bool stopping_ = false;    ///< a hold is not done before the reference rests
  bool idles_ = false;
  std::uint8_t leg_ = 0;  ///< the next one
};

}  // namespace strix
