/// The way out: messages become bytes, within a budget, and never wait for the port.
#pragma once

#include <array>

#include "Mavlink.h"
#include "Time.h"

namespace strix {

/// How many bytes may go out: a bucket of one largest frame that fills up at a rate.
class ByteBudget {
 public:
  static constexpr std::uint32_t kBurst = 128;

  /// In no second, wherever it begins, more than `perSecond` bytes are spent: the burst is part of
  /// that, so the bucket fills that much slower.
  void refill(Micros now, std::uint32_t perSecond) {
    const std::uint64_t rate = perSecond > kBurst ? perSecond - kBurst : 0;
    microBytes_ += elapsed(now, last_) * rate;
    constexpr std::uint64_t kFull = kBurst * 1'000'000ULL;
    if (microBytes_ > kFull) microBytes_ = kFull;
    last_ = now;
  }

  [[nodiscard]] bool full() const { return microBytes_ >= kBurst * 1'000'000ULL; }
  [[nodiscard]] bool has(std::size_t bytes) const { return microBytes_ >= bytes * 1'000'000ULL; }
  void spend(std::size_t bytes) { microBytes_ -= bytes * 1'000'000ULL; }

 private:
  std::uint64_t microBytes_ = 0;
  Micros last_ = 0;
};

/// Where a message came from, and where its answer goes.
struct Peer {
  std::uint8_t system = 0;
  std::uint8_t component = 0;
};

template <class Port>
class Outbox {
 public:
  /// Of all frames that are sent, signed: AUTOPILOT_VERSION has 103 bytes. A port that never has
  /// room for so much never gets anything.
  static constexpr std::size_t kLargestFrame = 110;
  static_assert(kLargestFrame <= ByteBudget::kBurst);

  explicit Outbox(Port& port) : port_(port) {}

  /// @param signing  nullptr: frames are not signed
  void identify(std::uint8_t system, mavlink_signing_t* signing) {
    system_ = system;
    status_.signing = signing;
  }

  /// True when any one message may be sent now.
  [[nodiscard]] bool open(Micros now, std::uint32_t bytesPerSecond) {
    budget_.refill(now, bytesPerSecond);
    return budget_.has(kLargestFrame) && port_.room() >= kLargestFrame;
  }

  /// MAVLink's functions mavlink_msg_..._encode_status.
  template <class Payload>
  using Encode = std::uint16_t (*)(std::uint8_t system, std::uint8_t component, mavlink_status_t*,
                                   mavlink_message_t*, const Payload*);

  /// One message, after open().
  template <class Payload>
  void send(Encode<Payload> encode, const Payload& payload) {
    static_assert(sizeof(Payload) + MAVLINK_NUM_NON_PAYLOAD_BYTES + MAVLINK_SIGNATURE_BLOCK_LEN <=
                  kLargestFrame);
    encode(system_, kAutopilot, &status_, &message_, &payload);
    std::array<std::uint8_t, kLargestFrame> frame{};
    const std::size_t size = mavlink_msg_to_send_buffer(frame.data(), &message_);
    port_.write(frame.data(), size);
    budget_.spend(size);
  }

 private:
  Port& port_;
  ByteBudget budget_;
  mavlink_status_t status_{};  ///< of what is sent: its sequence number
  mavlink_message_t message_{};
  std::uint8_t system_ = 1;
};

}  // namespace strix
