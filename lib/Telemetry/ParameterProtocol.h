/// Parameters: PARAM_REQUEST_LIST, PARAM_REQUEST_READ, PARAM_SET, PARAM_VALUE.
/// https://mavlink.io/en/services/parameter.html
#pragma once

#include "Outbox.h"
#include "Parameters.h"
#include "Texts.h"
#include "VehicleCommand.h"

namespace strix {

template <class Flight>
class ParameterProtocol {
 public:
  ParameterProtocol(Flight& flight, Texts& texts) : flight_(flight), texts_(texts) {}

  /// @param allowed  this peer may change parameters
  void handle(const mavlink_message_t& message, bool allowed, Micros now) {
    switch (message.msgid) {
      case MAVLINK_MSG_ID_PARAM_REQUEST_LIST:
        listed_ = 0;
        break;
      case MAVLINK_MSG_ID_PARAM_REQUEST_READ: {
        const auto m = decode<mavlink_param_request_read_t>(message);
        reply(m.param_index < 0 ? findParameter(nameIn(m.param_id))
                                : static_cast<std::size_t>(m.param_index));
        break;
      }
      case MAVLINK_MSG_ID_PARAM_SET:
        set(decode<mavlink_param_set_t>(message), allowed, now);
        break;
      default:
        break;
    }
  }

  /// What was set is kept, as MAVLink asks for, but not one value at a time: a little after the
  /// last, and with the motors off.
  void step(Micros now) {
    if (!unsaved_ || elapsed(now, changedAt_) < kSaveAfter) return;
    changedAt_ = now;  // try again after another such time
    if (flight_.status().motorsOn) return;
    unsaved_ = flight_.saveParameters() != nullptr;
  }

  /// Something beside the values, the key, has changed that is stored with them.
  void saveSoon(Micros now) {
    unsaved_ = true;
    changedAt_ = now;
  }

  /// An answer to a question, or to a change.
  /// @return false: there is none to send
  template <class Out>
  bool sendReply(Out& out) {
    if (waiting_ == 0) return false;
    sendValue(out, replies_[0]);
    --waiting_;
    for (std::size_t i = 0; i < waiting_; ++i) replies_[i] = replies_[i + 1];
    return true;
  }

  /// The next of the list.
  template <class Out>
  bool sendListed(Out& out) {
    if (listed_ >= kParameterCount) return false;
    sendValue(out, listed_++);
    return true;
  }

  [[nodiscard]] std::uint32_t lost() const { return lost_; }

 private:
  static constexpr Micros kSaveAfter = 2'000'000;  // ours

  /// 16 letters, or fewer and a zero.
  [[nodiscard]] static std::string_view nameIn(const char (&id)[kParameterNameLength]) {
    std::size_t size = 0;
    while (size < sizeof id && id[size] != '\0') ++size;
    return {id, size};
  }

  void reply(std::size_t index) {
    if (index >= kParameterCount) return;
    if (waiting_ == replies_.size()) {
      ++lost_;  // whoever asked asks again
      return;
    }
    replies_[waiting_++] = index;
  }

  void set(const mavlink_param_set_t& m, bool allowed, Micros now) {
    const std::size_t index = findParameter(nameIn(m.param_id));
    if (index == kParameterCount) {
      texts_.tell("there is no parameter of that name", now);
      return;
    }
    reply(index);  // the value that then holds: the new one or, refused, the old one
    if (!allowed) return;
    if (m.param_type != MAV_PARAM_TYPE_REAL32) {
      texts_.tell("parameters are of type REAL32", now);
      return;
    }
    VehicleCommand c;
    c.kind = CommandKind::SetParameter;
    c.index = static_cast<std::uint16_t>(index);
    c.values[0] = m.param_value;
    if (const CommandRefusal refusal = flight_.command(c)) {
      texts_.tell(refusal, now);
    } else {
      saveSoon(now);
    }
  }

  template <class Out>
  void sendValue(Out& out, std::size_t index) {
    const std::string_view name = kParameterTable[index].name;
    mavlink_param_value_t m{};
    std::memcpy(m.param_id, name.data(), name.size());
    m.param_value = getParameter(flight_.parameters(), index);
    m.param_type = MAV_PARAM_TYPE_REAL32;
    m.param_count = static_cast<std::uint16_t>(kParameterCount);
    m.param_index = static_cast<std::uint16_t>(index);
    out.send(mavlink_msg_param_value_encode_status, m);
  }

  Flight& flight_;
  Texts& texts_;
  std::array<std::size_t, 8> replies_{};
  std::size_t waiting_ = 0;  ///< of replies_
  std::size_t listed_ = kParameterCount;
  std::uint32_t lost_ = 0;
  Micros changedAt_ = 0;
  bool unsaved_ = false;
};

}  // namespace strix
