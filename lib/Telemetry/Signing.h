/// MAVLink 2 message signing: who may command, and nobody twice with the same packet.
/// https://mavlink.io/en/guide/message_signing.html
#pragma once

#include <cstring>

#include "Mavlink.h"
#include "ParameterStore.h"
#include "Time.h"

namespace strix {

enum class Signature : std::uint8_t {
  None,   ///< not signed, or there is no key to check it with
  Good,   ///< by our key, and newer than all before it
  Wrong,  ///< another key, changed on the way, or heard before
};

/// A time stamp in a signature counts 10 us since 2015. This aircraft has no such clock: its own
/// begins with zero, goes with the loop's and is never behind one that it has heard.
class Signing {
 public:
  Signing() { state_.flags = MAVLINK_SIGNING_FLAG_SIGN_OUTGOING; }

  /// All zero: none. Another key forgets whom the one before has heard.
  void setKey(const SigningKey& key) {
    if (std::memcmp(key.data(), state_.secret_key, key.size()) == 0) return;
    std::memcpy(state_.secret_key, key.data(), key.size());
    heard_ = {};
    hasKey_ = key != SigningKey{};
  }

  /// To be called at least every 71 min.
  void advance(Micros now) {
    const Micros ticks = elapsed(now, last_) / kTick;
    state_.timestamp += ticks;
    last_ += ticks * kTick;
  }

  /// Costs a SHA-256 of at most 306 bytes, which are five blocks.
  [[nodiscard]] Signature check(const mavlink_message_t& message) {
    if (!hasKey_ || (message.incompat_flags & MAVLINK_IFLAG_SIGNED) == 0) return Signature::None;
    return mavlink_signature_check(&state_, &heard_, &message) ? Signature::Good : Signature::Wrong;
  }

  /// For Outbox::identify. One stamp a frame: no two are the same.
  [[nodiscard]] mavlink_signing_t* outgoing() { return hasKey_ ? &state_ : nullptr; }

 private:
  static constexpr Micros kTick = 10;

  mavlink_signing_t state_{};
  mavlink_signing_streams_t heard_{};
  Micros last_ = 0;
  bool hasKey_ = false;
};

}  // namespace strix
