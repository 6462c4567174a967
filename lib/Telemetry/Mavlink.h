/// MAVLink 2 as pymavlink's generator writes it: build/mavlink, by tools/setup/mavlink.py. None of
/// its functions with memory of their own (channels) is called.
#pragma once

/// One for each system, component and link that signs: `Signing.h`.
#define MAVLINK_MAX_SIGNING_STREAMS 8

#include <common/mavlink.h>

#undef Maj  // the one macro of its SHA-256 that it leaves behind

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace strix {

constexpr std::uint8_t kAutopilot = MAV_COMP_ID_AUTOPILOT1;

/// The fields of a message, as the generator's packed structure; trailing zeros were not sent.
template <class Payload>
[[nodiscard]] Payload decode(const mavlink_message_t& message) {
  static_assert(sizeof(Payload) <= MAVLINK_MAX_PAYLOAD_LEN);
  Payload payload{};
  const std::size_t size = message.len < sizeof payload ? message.len : sizeof payload;
  std::memcpy(&payload, _MAV_PAYLOAD(&message), size);
  return payload;
}

/// True when the message is for everybody, or for this system's autopilot. MAVLink: zero, or no
/// such field, is everybody.
[[nodiscard]] inline bool isForUs(const mavlink_message_t& message, std::uint8_t system) {
  const mavlink_msg_entry_t* entry = mavlink_get_msg_entry(message.msgid);
  if (entry == nullptr) return false;
  const auto field = [&message](std::uint8_t offset) {
    return offset < message.len ? static_cast<std::uint8_t>(_MAV_PAYLOAD(&message)[offset]) : 0;
  };
  const bool hasSystem = (entry->flags & MAV_MSG_ENTRY_FLAG_HAVE_TARGET_SYSTEM) != 0;
  const bool hasComponent = (entry->flags & MAV_MSG_ENTRY_FLAG_HAVE_TARGET_COMPONENT) != 0;
  const int targetSystem = hasSystem ? field(entry->target_system_ofs) : 0;
  const int targetComponent = hasComponent ? field(entry->target_component_ofs) : 0;
  return (targetSystem == 0 || targetSystem == system) &&
         (targetComponent == 0 || targetComponent == kAutopilot);
}

}  // namespace strix
