/// The link to a ground station: MAVLink 2 over any stream of bytes. docs/telemetry.md.
#pragma once

#include "Commands.h"
#include "MissionProtocol.h"
#include "Outbox.h"
#include "ParameterProtocol.h"
#include "Schedule.h"
#include "Signing.h"
#include "Streams.h"
#include "Texts.h"

namespace strix {

/// Whether a port needs signatures where MAV_SIGNED asks for them, and may set their key.
enum class PortTrust : std::uint8_t {
  Radio,  ///< anybody may send
  Cable,  ///< whoever sends stands beside the aircraft: USB
};

/// Runs in passes without a control tick. A step takes at most kBytesAStep bytes and handles at
/// most one message or, if none has come to its end, sends at most one: so it computes at most one
/// signature. Nothing waits: what the port has no room for is sent later, or is not sent.
///
/// @tparam Flight  status(), command(), parameters(), texts(), mission(), saveParameters(),
///                 signingKey(), setSigningKey(): FlightSoftware
/// @tparam Port    std::size_t read(std::uint8_t*, std::size_t); std::size_t room();
///                 void write(const std::uint8_t*, std::size_t): never wait
template <class Flight, class Port>
class GroundLink {
 public:
  static constexpr std::size_t kBytesAStep = 64;

  GroundLink(Flight& flight, Port& port, PortTrust trust)
      : flight_(flight),
        port_(port),
        trust_(trust),
        out_(port),
        missions_(flight, texts_),
        parameters_(flight, texts_),
        commands_(flight, texts_, rates_) {}

  void step(Micros now) {
    now_ = now;
    if (system_ == 0) start();
    signing_.setKey(flight_.signingKey());
    signing_.advance(now);
    // Not twice in a row, or whoever sends without a pause would silence the aircraft.
    handled_ = !handled_ && receive();
    if (handled_) return;
    missions_.step(now);
    parameters_.step(now);
    const Parameters& p = flight_.parameters();
    out_.identify(system_, signing_.outgoing());
    if (out_.open(now, static_cast<std::uint32_t>(p.linkRate))) send();
  }

  /// A restart was asked for with the motors off, and its answer is on its way.
  [[nodiscard]] bool rebootAsked() const { return commands_.rebootAsked(); }

  /// Messages refused for their signature.
  [[nodiscard]] std::uint32_t refusedSignatures() const { return refusedSignatures_; }
  /// Frames whose checksum was wrong.
  [[nodiscard]] std::uint32_t damaged() const { return damaged_; }
  /// Answers and texts for which there was no room.
  [[nodiscard]] std::uint32_t lost() const {
    return commands_.lost() + parameters_.lost() + texts_.lost();
  }

 private:
  using Out = Outbox<Port>;

  /// At the first step, as the parameters were not loaded before. MAV_SYS_ID acts from here on.
  void start() {
    system_ = static_cast<std::uint8_t>(flight_.parameters().linkId);
    // Each with a phase of its own: all at once, the frequent ones would come late.
    constexpr Micros kApart = 1'000'000 / kStreamCount;
    for (std::size_t i = 0; i < kStreamCount; ++i) {
      const auto phase = static_cast<Micros>(i) * kApart;
      rates_.set(i, kStreams<Out>[i].period, now_ + phase);
    }
  }

  static constexpr const char* kUnsigned =
      "refused: commands have to be signed with this aircraft's key (MAV_SIGNED)";

  /// @return true when a message has come to its end
  bool receive() {
    for (std::size_t i = 0; i < kBytesAStep; ++i) {
      std::uint8_t byte = 0;
      if (port_.read(&byte, 1) == 0) return false;
      const std::uint8_t framing =
          mavlink_frame_char_buffer(&incoming_, &parser_, byte, nullptr, nullptr);
      if (framing == MAVLINK_FRAMING_BAD_CRC) ++damaged_;
      if (framing != MAVLINK_FRAMING_OK) continue;
      handle(incoming_);
      return true;
    }
    return false;
  }

  void handle(const mavlink_message_t& message) {
    if (message.sysid == system_ || !isForUs(message, system_)) return;
    const Signature signature = signing_.check(message);
    if (signature == Signature::Wrong) {
      ++refusedSignatures_;
      texts_.tell("a message was refused: its signature is wrong, or was heard before", now_);
      return;
    }
    const bool needed = trust_ == PortTrust::Radio && flight_.parameters().linkSigned > 0.0F;
    const bool allowed = !needed || signature == Signature::Good;
    switch (message.msgid) {
      case MAVLINK_MSG_ID_HEARTBEAT:
        hearPeer(message, allowed);
        break;
      case MAVLINK_MSG_ID_COMMAND_LONG: {
        const auto m = decode<mavlink_command_long_t>(message);
        takeCommand({m.command,
                     {m.param1, m.param2, m.param3, m.param4, m.param5, m.param6, m.param7},
                     {message.sysid, message.compid}},
                    allowed);
        break;
      }
      case MAVLINK_MSG_ID_COMMAND_INT: {
        const auto m = decode<mavlink_command_int_t>(message);
        takeCommand({m.command,
                     {m.param1, m.param2, m.param3, m.param4, static_cast<float>(m.x),
                      static_cast<float>(m.y), m.z},
                     {message.sysid, message.compid}},
                    allowed);
        break;
      }
      case MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED:
        if (mayCommand(message, allowed)) {
          takeSetpoint(decode<mavlink_set_position_target_local_ned_t>(message));
        }
        break;
      case MAVLINK_MSG_ID_PARAM_SET:
        parameters_.handle(message, mayCommand(message, allowed), now_);
        break;
      case MAVLINK_MSG_ID_PARAM_REQUEST_LIST:
      case MAVLINK_MSG_ID_PARAM_REQUEST_READ:
        parameters_.handle(message, allowed, now_);
        break;
      case MAVLINK_MSG_ID_MISSION_COUNT:
      case MAVLINK_MSG_ID_MISSION_ITEM_INT:
      case MAVLINK_MSG_ID_MISSION_CLEAR_ALL:
        missions_.handle(message, mayCommand(message, allowed), now_);
        break;
      case MAVLINK_MSG_ID_MISSION_SET_CURRENT:
      case MAVLINK_MSG_ID_MISSION_REQUEST_LIST:
      case MAVLINK_MSG_ID_MISSION_REQUEST_INT:
      case MAVLINK_MSG_ID_MISSION_REQUEST:
        missions_.handle(message, allowed, now_);
        break;
      case MAVLINK_MSG_ID_TIMESYNC:
        takeTimesync(decode<mavlink_timesync_t>(message));
        break;
      case MAVLINK_MSG_ID_SETUP_SIGNING:
        takeKey(decode<mavlink_setup_signing_t>(message));
        break;
      default:
        break;
    }
  }

  /// A message that moves or changes the aircraft.
  bool mayCommand(const mavlink_message_t& message, bool allowed) {
    if (allowed) {
      commander_ = message.sysid;
    } else {
      texts_.tell(kUnsigned, now_);
    }
    return allowed;
  }

  void takeCommand(const CommandRequest& request, bool allowed) {
    if (!onlyReads(request.command)) {
      if (allowed) {
        commander_ = request.peer.system;
      } else {
        texts_.tell(kUnsigned, now_);
      }
    }
    commands_.handle(request, allowed, now_);
  }

  /// The ground station that commands is alive. One that only watches does not matter.
  void hearPeer(const mavlink_message_t& message, bool allowed) {
    const auto m = decode<mavlink_heartbeat_t>(message);
    if (m.type != MAV_TYPE_GCS || message.sysid != commander_ || !allowed) return;
    (void)flight_.command(VehicleCommand{});
  }

  void takeSetpoint(const mavlink_set_position_target_local_ned_t& m) {
    constexpr unsigned kAcceleration = POSITION_TARGET_TYPEMASK_AX_IGNORE |
                                       POSITION_TARGET_TYPEMASK_AY_IGNORE |
                                       POSITION_TARGET_TYPEMASK_AZ_IGNORE;
    if (m.coordinate_frame != MAV_FRAME_LOCAL_NED) {
      return texts_.tell("setpoints are understood in the local frame only (LOCAL_NED)", now_);
    }
    if ((m.type_mask & kAcceleration) != kAcceleration) {
      return texts_.tell("setpoints of acceleration are not flown", now_);
    }
    const std::array<std::pair<unsigned, float>, 8> fields{{
        {POSITION_TARGET_TYPEMASK_X_IGNORE, m.x},
        {POSITION_TARGET_TYPEMASK_Y_IGNORE, m.y},
        {POSITION_TARGET_TYPEMASK_Z_IGNORE, -m.z},
        {POSITION_TARGET_TYPEMASK_YAW_IGNORE, m.yaw},
        {POSITION_TARGET_TYPEMASK_VX_IGNORE, m.vx},
        {POSITION_TARGET_TYPEMASK_VY_IGNORE, m.vy},
        {POSITION_TARGET_TYPEMASK_VZ_IGNORE, -m.vz},
        {POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE, m.yaw_rate},
    }};
    VehicleCommand c;
    c.kind = CommandKind::Setpoint;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if ((m.type_mask & fields[i].first) != 0) continue;
      c.index = static_cast<std::uint16_t>(c.index | (1U << i));
      c.values[i] = fields[i].second;
    }
    texts_.tell(flight_.command(c), now_);
  }

  /// Somebody asks what time it is here.
  void takeTimesync(const mavlink_timesync_t& m) {
    if (m.tc1 != 0) return;  // an answer, to nobody: this aircraft never asks
    theirTime_ = m.ts1;
    timeAsked_ = true;
  }

  /// An all zero key ends signing.
  void takeKey(const mavlink_setup_signing_t& m) {
    if (trust_ != PortTrust::Cable) {
      return texts_.tell("the signing key can be set by cable only (USB)", now_);
    }
    SigningKey key{};
    std::memcpy(key.data(), m.secret_key, key.size());
    flight_.setSigningKey(key);
    parameters_.saveSoon(now_);
  }

  /// Answers first, but not for ever: after three of them the streams have one.
  void send() {
    if (urgent_ < kUrgentInARow && sendUrgent()) {
      ++urgent_;
      return;
    }
    urgent_ = 0;
    if (listsTurn_ && parameters_.sendListed(out_)) {
      listsTurn_ = false;
      return;
    }
    listsTurn_ = true;
    if (sendStream() || parameters_.sendListed(out_)) return;
    (void)sendUrgent();
  }

  bool sendUrgent() {
    return commands_.send(out_) || sendTime() || texts_.send(out_, flight_.texts()) ||
           missions_.send(out_) || parameters_.sendReply(out_);
  }

  bool sendTime() {
    if (!timeAsked_) return false;
    timeAsked_ = false;
    const auto here = static_cast<std::int64_t>(flight_.status().time) * 1000;
    out_.send(mavlink_msg_timesync_encode_status, mavlink_timesync_t{here, theirTime_});
    return true;
  }

  bool sendStream() {
    const std::size_t index = rates_.next(now_);
    if (index == rates_.kNone) return false;
    rates_.done(index, now_);
    return kStreams<Out>[index].send(out_, flight_.status());
  }

  static constexpr int kUrgentInARow = 3;

  Flight& flight_;
  Port& port_;
  PortTrust trust_;
  Out out_;
  Texts texts_;
  Schedule<kStreamCount> rates_;
  MissionProtocol<Flight> missions_;
  ParameterProtocol<Flight> parameters_;
  Commands<Flight, Out> commands_;
  Signing signing_;
  mavlink_message_t incoming_{};
  mavlink_status_t parser_{};
  std::int64_t theirTime_ = 0;  ///< ns, to be answered
  Micros now_ = 0;
  std::uint32_t refusedSignatures_ = 0;
  std::uint32_t damaged_ = 0;
  int urgent_ = 0;              ///< answers sent in a row
  std::uint8_t system_ = 0;     ///< MAV_SYS_ID; zero: not started
  std::uint8_t commander_ = 0;  ///< system id of who commands; zero: nobody yet
  bool handled_ = false;        ///< by the step before
  bool listsTurn_ = false;
  bool timeAsked_ = false;
};

}  // namespace strix
