/// The conditions the state machine acts on, and the checks before arming, one bit each.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace strix {

/// A set of conditions, or of pre-arm failures.
using ConditionSet = std::uint32_t;

namespace condition {
constexpr ConditionSet kNone = 0;
constexpr ConditionSet kCalibrated = 1U << 0U;           ///< start-up calibration is done
constexpr ConditionSet kArmEdge = 1U << 1U;              ///< arm switch went from off to on
constexpr ConditionSet kDisarm = 1U << 2U;               ///< arm switch is off
constexpr ConditionSet kPreArmFailure = 1U << 3U;        ///< any pre-arm check fails
constexpr ConditionSet kStart = 1U << 4U;                ///< start switch is on
constexpr ConditionSet kArmedTooLong = 1U << 5U;         ///< armed and nothing happened
constexpr ConditionSet kArrived = 1U << 6U;              ///< at the target of this leg
constexpr ConditionSet kHoldDone = 1U << 7U;             ///< held there as long as asked
constexpr ConditionSet kLegsRemain = 1U << 8U;           ///< the mission has another leg
constexpr ConditionSet kTouchDown = 1U << 9U;            ///< on the ground again
constexpr ConditionSet kKill = 1U << 10U;                ///< kill switch is on
constexpr ConditionSet kUpset = 1U << 11U;               ///< tilt past 90 deg
constexpr ConditionSet kOutsideFence = 1U << 12U;        ///< too far or too high
constexpr ConditionSet kImuLost = 1U << 13U;             ///< no IMU sample in time
constexpr ConditionSet kEstimatorUnhealthy = 1U << 14U;  ///< state or covariance not usable
constexpr ConditionSet kStandMission = 1U << 15U;        ///< the mission is the attitude stand's
constexpr ConditionSet kStandDone = 1U << 16U;           ///< its sequence has come to its end
constexpr ConditionSet kReturn = 1U << 17U;              ///< fly home
constexpr std::size_t kCount = 18;
}  // namespace condition

constexpr std::array<const char*, condition::kCount> kConditionNames{
    "Calibrated",   "ArmEdge",   "Disarm",       "PreArmFailure", "Start",
    "ArmedTooLong", "Arrived",   "HoldDone",     "LegsRemain",    "TouchDown",
    "Kill",         "Upset",     "OutsideFence", "ImuLost",       "EstimatorUnhealthy",
    "StandMission", "StandDone", "Return"};

/// Conditions that end a flight at once; on the attitude stand the fence does not count.
constexpr ConditionSet kCritical = condition::kKill | condition::kUpset | condition::kOutsideFence |
                                   condition::kImuLost | condition::kEstimatorUnhealthy;

/// One check before arming: when it fails, arming is refused with its sentence.
struct PreArmCheck {
  ConditionSet bit;
  const char* refusal;
};

namespace prearm {
constexpr ConditionSet kNotCalibrated = 1U << 0U;
constexpr ConditionSet kImu = 1U << 1U;
constexpr ConditionSet kMag = 1U << 2U;
constexpr ConditionSet kAlt = 1U << 3U;
constexpr ConditionSet kGps = 1U << 4U;
constexpr ConditionSet kOrigin = 1U << 5U;
constexpr ConditionSet kEstimator = 1U << 6U;
constexpr ConditionSet kTilt = 1U << 7U;
constexpr ConditionSet kMoving = 1U << 8U;
constexpr ConditionSet kKillSwitch = 1U << 9U;
constexpr ConditionSet kStartSwitch = 1U << 10U;
constexpr ConditionSet kLog = 1U << 11U;
constexpr ConditionSet kMounting = 1U << 12U;
constexpr ConditionSet kMission = 1U << 13U;
constexpr ConditionSet kFence = 1U << 14U;
constexpr ConditionSet kGyroFilter = 1U << 15U;
constexpr ConditionSet kLayout = 1U << 16U;
}  // namespace prearm

constexpr std::array<PreArmCheck, 17> kPreArmChecks{{
    {prearm::kImu, "IMU gives no data: check its wiring"},
    {prearm::kMag, "magnetometer gives no data: check its wiring"},
    {prearm::kAlt, "altimeter gives no data: check its wiring"},
    // After the devices without which it never ends.
    {prearm::kNotCalibrated, "start-up calibration is not done: let the aircraft stand still"},
    {prearm::kGps, "no usable GPS fix: wait, or go under open sky"},
    {prearm::kOrigin, "GPS origin is not averaged yet: wait 10 s"},
    {prearm::kEstimator, "estimator is not healthy: restart"},
    {prearm::kTilt, "aircraft is tilted more than 20 deg: set it level"},
    {prearm::kMoving, "aircraft is moving: let it stand still"},
    {prearm::kKillSwitch, "kill switch is on: release it"},
    {prearm::kStartSwitch, "start switch is on: turn it off first"},
    {prearm::kLog, "log card has failed or is missing: check the card"},
    {prearm::kMounting, "a mounting matrix in FlightConfig.h is not a rotation"},
    {prearm::kMission,
     "the mission cannot be flown: mend mission.txt on the card, or FlightConfig.h"},
    {prearm::kFence, "estimated position is outside the fence: restart where you want to fly"},
    {prearm::kLayout, "the rotors of the vehicle file cannot hold the aircraft level"},
    {prearm::kGyroFilter, "the gyro filter in FlightConfig.h is none: see docs/filtering.md"},
}};

/// The sentence of the first failing check; nullptr when none fails.
[[nodiscard]] constexpr const char* firstRefusal(ConditionSet failures) {
  for (const PreArmCheck& check : kPreArmChecks) {
    if ((failures & check.bit) != 0) return check.refusal;
  }
  return nullptr;
}

}  // namespace strix
