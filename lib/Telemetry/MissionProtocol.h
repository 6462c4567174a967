/// Missions up and down: MISSION_COUNT, _REQUEST_INT, _ITEM_INT, _ACK, _REQUEST_LIST, _CLEAR_ALL.
/// https://mavlink.io/en/services/mission.html
#pragma once

#include "MissionItems.h"
#include "Outbox.h"
#include "Streams.h"
#include "Texts.h"

namespace strix {

/// The mission that is there stays until another has come as a whole. Downloads need no memory:
/// each request is answered from the mission itself.
template <class Flight>
class MissionProtocol {
 public:
  MissionProtocol(Flight& flight, Texts& texts) : flight_(flight), texts_(texts) {}

  /// @param allowed  this peer may change the mission
  void handle(const mavlink_message_t& message, bool allowed, Micros now) {
    now_ = now;
    peer_ = {message.sysid, message.compid};
    switch (message.msgid) {
      case MAVLINK_MSG_ID_MISSION_COUNT: {
        const auto m = decode<mavlink_mission_count_t>(message);
        if (mayChange(allowed, m.mission_type)) startUpload(m.count);
        break;
      }
      case MAVLINK_MSG_ID_MISSION_ITEM_INT: {
        const auto m = decode<mavlink_mission_item_int_t>(message);
        if (mayChange(allowed, m.mission_type)) takeItem(m);
        break;
      }
      case MAVLINK_MSG_ID_MISSION_CLEAR_ALL: {
        const auto m = decode<mavlink_mission_clear_all_t>(message);
        const bool all = m.mission_type == MAV_MISSION_TYPE_ALL;
        if (mayChange(allowed, all ? kMission : m.mission_type)) clear();
        break;
      }
      case MAVLINK_MSG_ID_MISSION_SET_CURRENT:
        texts_.tell("mission: it is flown from its first item on", now);
        break;
      case MAVLINK_MSG_ID_MISSION_REQUEST_LIST:
        if (isMission(decode<mavlink_mission_request_list_t>(message).mission_type)) list();
        break;
      case MAVLINK_MSG_ID_MISSION_REQUEST_INT:
        request(decode<mavlink_mission_request_int_t>(message).seq);
        break;
      case MAVLINK_MSG_ID_MISSION_REQUEST:  // the older word for the same
        request(decode<mavlink_mission_request_t>(message).seq);
        break;
      default:
        break;
    }
  }

  /// An upload that comes to a stop is asked for again, then given up.
  void step(Micros now) {
    if (!uploading_ || elapsed(now, heardAt_) < kPatience) return;
    heardAt_ = now;
    if (++tries_ <= kTries) {
      pending_ = Pending::Request;
      return;
    }
    now_ = now;
    peer_ = uploader_;
    answer({MAV_MISSION_OPERATION_CANCELLED, "mission: upload broke off; the one before is kept"});
  }

  /// @return false: there is nothing to send
  template <class Out>
  bool send(Out& out) {
    const Pending pending = pending_;
    pending_ = Pending::Nothing;
    switch (pending) {
      case Pending::Nothing:
        return false;
      case Pending::Ack:
        out.send(mavlink_msg_mission_ack_encode_status,
                 mavlink_mission_ack_t{peer_.system, peer_.component, result_, type_});
        return true;
      case Pending::Request:
        out.send(mavlink_msg_mission_request_int_encode_status,
                 mavlink_mission_request_int_t{next_, uploader_.system, uploader_.component,
                                               MAV_MISSION_TYPE_MISSION});
        return true;
      case Pending::Count:
        out.send(mavlink_msg_mission_count_encode_status,
                 mavlink_mission_count_t{missionItemCount(flight_.mission()), peer_.system,
                                         peer_.component, MAV_MISSION_TYPE_MISSION});
        return true;
      case Pending::Item:
        sendItem(out);
        return true;
    }
    return false;
  }

 private:
  static constexpr std::uint8_t kMission = MAV_MISSION_TYPE_MISSION;
  static constexpr Micros kPatience = 1'000'000;  // ours, below the 1.5 s that MAVLink suggests
  static constexpr int kTries = 5;                // as MAVLink suggests

  enum class Pending : std::uint8_t { Nothing, Ack, Request, Count, Item };

  void answer(const MissionVerdict& verdict) {
    uploading_ = false;
    result_ = verdict.result;
    pending_ = Pending::Ack;
    texts_.tell(verdict.why, now_);
  }

  [[nodiscard]] bool isMission(std::uint8_t type) {
    type_ = type;
    if (type == MAV_MISSION_TYPE_MISSION) return true;
    result_ = MAV_MISSION_UNSUPPORTED;  // fences and rally points: an upload goes on beside them
    pending_ = Pending::Ack;
    return false;
  }

  [[nodiscard]] bool mayChange(bool allowed, std::uint8_t type) {
    if (!isMission(type)) return false;
    if (allowed) return true;
    result_ = MAV_MISSION_DENIED;
    pending_ = Pending::Ack;
    return false;
  }

  [[nodiscard]] CommandRefusal command(CommandKind kind) {
    VehicleCommand c;
    c.kind = kind;
    return flight_.command(c);
  }

  void startUpload(std::uint16_t count) {
    if (count == 0) return clear();
    if (const CommandRefusal refusal = command(CommandKind::MissionClear)) {
      return answer({MAV_MISSION_DENIED, refusal});
    }
    reader_.begin(count);
    uploading_ = true;
    uploader_ = peer_;
    count_ = count;
    next_ = 0;
    askNext();
  }

  void askNext() {
    tries_ = 0;
    heardAt_ = now_;
    pending_ = Pending::Request;
  }

  void takeItem(const mavlink_mission_item_int_t& m) {
    if (!uploading_) {
      // The answer to the last item was lost: the same again. Any other belongs to nothing.
      if (m.seq + 1 != count_) result_ = MAV_MISSION_ERROR;
      pending_ = Pending::Ack;
      return;
    }
    if (m.seq != next_) {
      pending_ = Pending::Request;
      return;
    }
    MissionItem item;
    item.command = m.command;
    item.frame = m.frame;
    item.param = {m.param1, m.param2, m.param3, m.param4};
    item.x = m.x;
    item.y = m.y;
    item.z = m.z;
    const MissionVerdict verdict = reader_.take(flight_, item, frame());
    ++next_;
    if (verdict.result != MAV_MISSION_ACCEPTED || next_ == count_) return answer(verdict);
    askNext();
  }

  /// No mission is one without take-off: arming is refused until another has come.
  void clear() {
    count_ = 0;
    CommandRefusal refusal = command(CommandKind::MissionClear);
    if (refusal == nullptr) refusal = command(CommandKind::MissionDone);
    answer(
        {refusal == nullptr ? std::uint8_t{MAV_MISSION_ACCEPTED} : std::uint8_t{MAV_MISSION_DENIED},
         refusal});
  }

  void list() {
    if (const char* why = untellable(flight_.mission())) {
      result_ = MAV_MISSION_ERROR;
      pending_ = Pending::Ack;
      texts_.tell(why, now_);
      return;
    }
    pending_ = Pending::Count;
  }

  void request(std::uint16_t sequence) {
    if (untellable(flight_.mission()) != nullptr ||
        sequence >= missionItemCount(flight_.mission())) {
      result_ = MAV_MISSION_INVALID_SEQUENCE;
      type_ = MAV_MISSION_TYPE_MISSION;
      pending_ = Pending::Ack;
      return;
    }
    wanted_ = sequence;
    pending_ = Pending::Item;
  }

  [[nodiscard]] MissionFrame frame() const {
    const FlightStatus status = flight_.status();
    return {stream::originKnown(status), stream::localFrame(status)};
  }

  template <class Out>
  void sendItem(Out& out) {
    const MissionItem item = missionItem(flight_.mission(), wanted_, frame());
    mavlink_mission_item_int_t m{};
    m.param1 = item.param[0];
    m.param2 = item.param[1];
    m.param3 = item.param[2];
    m.param4 = item.param[3];
    m.x = item.x;
    m.y = item.y;
    m.z = item.z;
    m.seq = wanted_;
    m.command = item.command;
    m.target_system = peer_.system;
    m.target_component = peer_.component;
    m.frame = item.frame;
    m.autocontinue = 1;
    out.send(mavlink_msg_mission_item_int_encode_status, m);
  }

  Flight& flight_;
  Texts& texts_;
  MissionReader reader_;
  Peer peer_;      ///< heard last
  Peer uploader_;  ///< whose mission is coming
  Micros now_ = 0;
  Micros heardAt_ = 0;        ///< an item of the upload, or asked for it again
  std::uint16_t count_ = 0;   ///< of the upload
  std::uint16_t next_ = 0;    ///< item of the upload
  std::uint16_t wanted_ = 0;  ///< item of the download
  int tries_ = 0;
  std::uint8_t result_ = MAV_MISSION_ACCEPTED;
  std::uint8_t type_ = MAV_MISSION_TYPE_MISSION;
  Pending pending_ = Pending::Nothing;
  bool uploading_ = false;
};

}  // namespace strix
