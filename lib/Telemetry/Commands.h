/// COMMAND_LONG and COMMAND_INT, and their answers. https://mavlink.io/en/services/command.html
#pragma once

#include "Outbox.h"
#include "Schedule.h"
#include "Streams.h"
#include "Texts.h"
#include "VehicleCommand.h"

namespace strix {

/// One command, whichever message it came in.
struct CommandRequest {
  std::uint16_t command = 0;
  std::array<float, 7> param{};  ///< from param1 on
  Peer peer;
};

/// What only reads counts from everybody; all others have to come from one who may command.
[[nodiscard]] constexpr bool onlyReads(std::uint16_t command) {
  return command == MAV_CMD_REQUEST_MESSAGE || command == MAV_CMD_SET_MESSAGE_INTERVAL ||
         command == MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES || command == MAV_CMD_RUN_PREARM_CHECKS;
}

/// @tparam Out  Outbox
template <class Flight, class Out>
class Commands {
 public:
  using Rates = Schedule<kStreamCount>;

  Commands(Flight& flight, Texts& texts, Rates& rates)
      : flight_(flight), texts_(texts), rates_(rates) {}

  void handle(const CommandRequest& request, bool allowed, Micros now) {
    now_ = now;
    const std::uint8_t result =
        allowed || onlyReads(request.command) ? obey(request) : std::uint8_t{MAV_RESULT_DENIED};
    if (waiting_ == acks_.size()) {  // whoever commands again gets another answer
      ++lost_;
      for (std::size_t i = 1; i < waiting_; ++i) acks_[i - 1] = acks_[i];
      --waiting_;
    }
    acks_[waiting_++] = {request.command,       result, 0, 0, request.peer.system,
                         request.peer.component};
  }

  /// @return false: there is no answer to send
  bool send(Out& out) {
    if (waiting_ == 0) return false;
    out.send(mavlink_msg_command_ack_encode_status, acks_[0]);
    --waiting_;
    for (std::size_t i = 0; i < waiting_; ++i) acks_[i] = acks_[i + 1];
    return true;
  }

  [[nodiscard]] bool rebootAsked() const { return rebootAsked_ && waiting_ == 0; }
  [[nodiscard]] std::uint32_t lost() const { return lost_; }

 private:
  static constexpr float kForce = 21196.0F;  // COMPONENT_ARM_DISARM's magic number
  /// Bounds of what may be asked for: a stream faster than 50 Hz shows nothing more.
  static constexpr float kShortestInterval = 20'000.0F;     // us
  static constexpr float kLongestInterval = 60'000'000.0F;  // us

  std::uint8_t obey(const CommandRequest& r) {
    const std::array<float, 7>& p = r.param;
    switch (r.command) {
      case MAV_CMD_COMPONENT_ARM_DISARM:
        return armOrDisarm(p[0], p[1]);
      case MAV_CMD_NAV_TAKEOFF:
      case MAV_CMD_MISSION_START:
        return ask(CommandKind::Start);
      case MAV_CMD_NAV_LAND:
        return ask(CommandKind::Land);
      case MAV_CMD_NAV_RETURN_TO_LAUNCH:
        return ask(CommandKind::Return);
      case MAV_CMD_DO_PAUSE_CONTINUE:
        return askEither(p[0], CommandKind::Resume, CommandKind::Hold);
      case MAV_CMD_DO_FLIGHTTERMINATION:
        return ask(p[0] > 0.5F ? CommandKind::Kill : CommandKind::KillOff);
      case MAV_CMD_PREFLIGHT_CALIBRATION:
        return calibrate(p);
      case MAV_CMD_PREFLIGHT_STORAGE:
        if (p[0] != PARAM_WRITE_PERSISTENT) return deny("parameters can be written only");
        return refused(flight_.saveParameters());
      case MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
        return reboot(p);
      case MAV_CMD_RUN_PREARM_CHECKS:
        return runChecks();
      case MAV_CMD_REQUEST_MESSAGE:
        return request(p[0]);
      case MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES:
        return request(MAVLINK_MSG_ID_AUTOPILOT_VERSION);
      case MAV_CMD_SET_MESSAGE_INTERVAL:
        return setInterval(p[0], p[1]);
      default:
        return MAV_RESULT_UNSUPPORTED;
    }
  }

  /// The command is as it should be, but not now.
  std::uint8_t refused(CommandRefusal refusal) {
    texts_.tell(refusal, now_);
    return refusal == nullptr ? MAV_RESULT_ACCEPTED : MAV_RESULT_TEMPORARILY_REJECTED;
  }
  /// It never is.
  std::uint8_t deny(const char* why) {
    texts_.tell(why, now_);
    return MAV_RESULT_DENIED;
  }

  [[nodiscard]] CommandRefusal command(CommandKind kind) {
    VehicleCommand c;
    c.kind = kind;
    return flight_.command(c);
  }
  std::uint8_t ask(CommandKind kind) { return refused(command(kind)); }

  std::uint8_t askEither(float choice, CommandKind one, CommandKind zero) {
    if (choice != 0.0F && choice != 1.0F) return deny("param1 is 0 or 1");
    return ask(choice == 1.0F ? one : zero);
  }

  /// Forced disarming is the kill; forced arming is arming: every check counts.
  std::uint8_t armOrDisarm(float arm, float force) {
    if (arm == 0.0F && force == kForce) return ask(CommandKind::Kill);
    if (arm == 0.0F) return ask(CommandKind::Disarm);
    if (arm != 1.0F) return deny("param1 is 0 or 1");
    const FlightStatus before = flight_.status();
    const CommandRefusal refusal = command(CommandKind::Arm);
    if (refusal == nullptr) return MAV_RESULT_ACCEPTED;
    if (before.motorsOn || before.preArm == 0) return refused(refusal);
    // The flight software itself says the first; here are the others.
    PreArmSet others = before.preArm;
    for (const PreArmCheck& check : kPreArmChecks) {
      if ((others & check.bit) == 0) continue;
      others &= ~check.bit;
      break;
    }
    texts_.tellChecks(others);
    return MAV_RESULT_TEMPORARILY_REJECTED;
  }

  std::uint8_t calibrate(const std::array<float, 7>& p) {
    const bool gyro = p[0] == 1.0F;
    const bool pressure = p[2] == 1.0F;
    bool others = p[1] != 0.0F;
    for (std::size_t i = 3; i < p.size(); ++i) others = others || (p[i] != 0.0F && p[i] == p[i]);
    if (others || !(gyro || pressure)) {
      return deny("gyro and pressure are calibrated here: strix calibrate does the others");
    }
    return ask(CommandKind::Calibrate);
  }

  std::uint8_t reboot(const std::array<float, 7>& p) {
    if (p[0] != 1.0F) return deny("the autopilot can be restarted, and nothing else");
    if (flight_.status().motorsOn) return refused("the motors are on: disarm first");
    rebootAsked_ = true;
    return MAV_RESULT_ACCEPTED;
  }

  std::uint8_t runChecks() {
    const FlightStatus status = flight_.status();
    texts_.tellChecks(status.preArm);
    if (status.preArm == 0) texts_.tell("every check before arming passes", now_);
    return MAV_RESULT_ACCEPTED;
  }

  [[nodiscard]] static std::size_t find(float id) {
    std::size_t i = 0;
    while (i < kStreamCount && static_cast<float>(kStreams<Out>[i].id) != id) ++i;
    return i;
  }

  std::uint8_t request(float id) {
    const std::size_t index = find(id);
    if (index == kStreamCount) return MAV_RESULT_UNSUPPORTED;
    rates_.ask(index);
    return MAV_RESULT_ACCEPTED;
  }

  /// @param interval  us; 0: as usual; -1: never
  std::uint8_t setInterval(float id, float interval) {
    const std::size_t index = find(id);
    if (index == kStreamCount) return MAV_RESULT_UNSUPPORTED;
    const Micros usual = kStreams<Out>[index].period;
    if (usual == 0 || kStreams<Out>[index].id == MAVLINK_MSG_ID_HEARTBEAT) return MAV_RESULT_DENIED;
    if (interval == 0.0F || interval == -1.0F) {
      rates_.set(index, interval == 0.0F ? usual : 0, now_);
      return MAV_RESULT_ACCEPTED;
    }
    if (!(interval >= kShortestInterval && interval <= kLongestInterval)) {
      return deny("a message comes every 20000 to 60000000 us");
    }
    rates_.set(index, static_cast<Micros>(interval), now_);
    return MAV_RESULT_ACCEPTED;
  }

  Flight& flight_;
  Texts& texts_;
  Rates& rates_;
  std::array<mavlink_command_ack_t, 8> acks_{};
  std::size_t waiting_ = 0;  ///< of acks_
  std::uint32_t lost_ = 0;
  Micros now_ = 0;
  bool rebootAsked_ = false;
};

}  // namespace strix
