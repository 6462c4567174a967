/// The conditions the state machine acts on, and the checks before arming, one bit each.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace strix {

/// A set of conditions.
using ConditionSet = std::uint64_t;
/// A set of pre-arm failures.
using PreArmSet = std::uint32_t;

/// Every condition once: its name in the code, and what it means. The log holds their places: new
/// ones go to the end.
#define STRIX_CONDITIONS(X)                                                  \
  X(Calibrated, "start-up calibration is done")                              \
  X(ArmEdge, "somebody has just asked for arming")                           \
  X(Disarm, "the arm switch is off, or disarming was asked for")             \
  X(PreArmFailure, "a pre-arm check fails")                                  \
  X(Start, "the mission shall begin")                                        \
  X(ArmedTooLong, "armed, and nothing happened")                             \
  X(Arrived, "at the target of this leg")                                    \
  X(HoldDone, "held there as long as asked")                                 \
  X(LegsRemain, "the mission has another leg")                               \
  X(TouchDown, "on the ground again")                                        \
  X(Kill, "the kill switch is on, or a kill was commanded")                  \
  X(Upset, "tilt past 90 deg")                                               \
  X(OutsideFence, "too far from the start, or too high")                     \
  X(ImuLost, "no IMU sample in time")                                        \
  X(EstimatorUnhealthy, "the estimated attitude cannot be flown with")       \
  X(StandMission, "the mission is the attitude stand's")                     \
  X(StandDone, "its sequence has come to its end")                           \
  X(Return, "fly home: asked for, or the mission's end")                     \
  X(LandAsked, "land here: asked for")                                       \
  X(HoldAsked, "stop and stay here: asked for")                              \
  X(Sticks, "the pilot's mode is one of the sticks, and his radio is heard") \
  X(SticksEdge, "he has just chosen it")                                     \
  X(ThrottleUp, "his throttle asks for taking off")                          \
  X(Guided, "positions come by telemetry, and are fresh")                    \
  X(TiltLimit, "tilted further than this state flies, for too long")         \
  X(FarOutsideFence, "beyond the fence by more than its margin")             \
  X(GpsLost, "no position from GPS for too long")                            \
  X(MagLost, "no heading from the magnetometer for too long")                \
  X(AltLost, "no height from the altimeter for too long")                    \
  X(ImuSaturated, "the IMU is at the end of its range for too long")         \
  X(BatteryLow, "enough to fly home")                                        \
  X(BatteryCritical, "enough to land")                                       \
  X(RadioLost, "the pilot's transmitter was heard and is no more")           \
  X(LinkLost, "the ground station that flew the aircraft is heard no more")  \
  X(Overrun, "the loop does not keep its rate")                              \
  X(LogFailed, "the log card takes no data any more")                        \
  X(MotorsSaturated, "a motor is at an end of its range for too long")       \
  X(FreeFall, "falls although the motors should carry it")                   \
  X(Crash, "has hit something")                                              \
  X(Failsafe, "a hazard has ended this flight: the state machine's own")     \
  X(BlindOver, "the time that can be flown without an IMU is over")          \
  X(OnGround, "stands on the ground with the throttle down")                 \
  X(ImuBack, "the IMU is heard again, and its estimate can be flown with")   \
  X(CalibrateAsked, "calibrate again: asked for")                            \
  X(MotorTestAsked, "turn one motor: asked for")                             \
  X(MotorTestDone, "it has turned as long as asked")                         \
  X(Astray, "the path has ended and the aircraft is not there, for too long")

namespace condition {
enum Place : std::uint8_t {
#define STRIX_PLACE(name, text) k##name##Place,
  STRIX_CONDITIONS(STRIX_PLACE)
#undef STRIX_PLACE
      kCount
};
constexpr ConditionSet kNone = 0;
#define STRIX_BIT(name, text) constexpr ConditionSet k##name = ConditionSet{1} << k##name##Place;
STRIX_CONDITIONS(STRIX_BIT)
#undef STRIX_BIT
static_assert(kCount <= 64);
}  // namespace condition

struct ConditionText {
  const char* name;
  const char* meaning;
};
#define STRIX_TEXT(name, text) {#name, text},
constexpr std::array<ConditionText, condition::kCount> kConditionTexts{
    {STRIX_CONDITIONS(STRIX_TEXT)}};
#undef STRIX_TEXT
#undef STRIX_CONDITIONS

/// Conditions that stop the motors in the same tick, wherever they may turn.
constexpr ConditionSet kCritical =
    condition::kKill | condition::kUpset | condition::kEstimatorUnhealthy | condition::kTiltLimit;

/// One check before arming: when it fails, arming is refused with its sentence.
struct PreArmCheck {
  PreArmSet bit;
  const char* refusal;
};

namespace prearm {
constexpr PreArmSet kNotCalibrated = 1U << 0U;
constexpr PreArmSet kImu = 1U << 1U;
constexpr PreArmSet kMag = 1U << 2U;
constexpr PreArmSet kAlt = 1U << 3U;
constexpr PreArmSet kGps = 1U << 4U;
constexpr PreArmSet kOrigin = 1U << 5U;
constexpr PreArmSet kEstimator = 1U << 6U;
constexpr PreArmSet kTilt = 1U << 7U;
constexpr PreArmSet kMoving = 1U << 8U;
constexpr PreArmSet kKillSwitch = 1U << 9U;
constexpr PreArmSet kStartSwitch = 1U << 10U;
constexpr PreArmSet kLog = 1U << 11U;
constexpr PreArmSet kMounting = 1U << 12U;
constexpr PreArmSet kMission = 1U << 13U;
constexpr PreArmSet kFence = 1U << 14U;
constexpr PreArmSet kGyroFilter = 1U << 15U;
constexpr PreArmSet kLayout = 1U << 16U;
constexpr PreArmSet kRadio = 1U << 17U;
constexpr PreArmSet kThrottle = 1U << 18U;
constexpr PreArmSet kBattery = 1U << 19U;
constexpr PreArmSet kRestarted = 1U << 20U;
constexpr PreArmSet kParameters = 1U << 21U;
constexpr PreArmSet kOverrun = 1U << 22U;
constexpr PreArmSet kKillCommand = 1U << 23U;
}  // namespace prearm

constexpr std::array<PreArmCheck, 24> kPreArmChecks{{
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
    {prearm::kRestarted,
     "restarted while its motors were on: look it over, then switch the power off and on"},
    {prearm::kBattery, "battery is low: charge it"},
    {prearm::kRadio, "no radio is heard: switch the transmitter on"},
    {prearm::kThrottle, "throttle is not low: pull it down"},
    {prearm::kKillCommand, "a kill was commanded: take it back"},
    {prearm::kParameters, "a stored parameter was damaged: look at them, then save them"},
    {prearm::kOverrun, "the loop does not keep its rate: see overruns in the log"},
    {prearm::kLog, "log card has failed or is missing: check the card"},
    {prearm::kMounting, "a mounting matrix in FlightConfig.h is not a rotation"},
    {prearm::kMission,
     "the mission cannot be flown: mend mission.txt on the card, or FlightConfig.h"},
    {prearm::kFence, "estimated position is outside the fence: restart where you want to fly"},
    {prearm::kLayout, "the rotors of the vehicle file cannot hold the aircraft level"},
    {prearm::kGyroFilter, "the gyro filter in FlightConfig.h is none: see docs/filtering.md"},
}};

/// The sentence of the first failing check; nullptr when none fails.
[[nodiscard]] constexpr const char* firstRefusal(PreArmSet failures) {
  for (const PreArmCheck& check : kPreArmChecks) {
    if ((failures & check.bit) != 0) return check.refusal;
  }
  return nullptr;
}

}  // namespace strix
