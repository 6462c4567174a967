/// FlySky's iBUS: 115200 baud, a frame of 14 channels each 7 ms.
#pragma once

#include "FrameFinder.h"
#include "RadioChannels.h"

namespace strix {

/// 0x20 (the length) 0x40 (servo command), 14 channels in us, little-endian, and a checksum,
/// little-endian: 0xFFFF less the bytes before it.
struct IbusProtocol {
  static constexpr std::size_t kLongest = 32;
  static constexpr std::uint8_t kChannels = 14;

  [[nodiscard]] static std::size_t length(const std::uint8_t* bytes, std::size_t count) {
    const bool begins = bytes[0] == 0x20 && (count < 2 || bytes[1] == 0x40);
    return begins ? kLongest : 0;
  }

  [[nodiscard]] static bool intact(const std::uint8_t* frame, std::size_t length) {
    std::uint16_t sum = 0xFFFF;
    for (std::size_t i = 0; i + 2 < length; ++i) sum = static_cast<std::uint16_t>(sum - frame[i]);
    return frame[length - 2] == (sum & 0xFFU) && frame[length - 1] == (sum >> 8U);
  }
};

/// iBUS has no word for a lost transmitter: the receiver goes silent, or sends what it was told to.
class Ibus {
 public:
  /// @return true when `channels` are new
  bool add(std::uint8_t byte, RadioChannels& channels) {
    const std::uint8_t* const frame = finder_.add(byte);
    if (frame == nullptr) return false;
    channels = {};
    channels.count = IbusProtocol::kChannels;
    for (std::size_t i = 0; i < IbusProtocol::kChannels; ++i) {
      // The four bits above are those of channels 15 to 18 in some receivers.
      const unsigned value = frame[2 + 2 * i] + 256U * (frame[3 + 2 * i] & 0x0FU);
      channels.pulse[i] = static_cast<std::uint16_t>(value);
    }
    return true;
  }

  [[nodiscard]] const FrameFinder<IbusProtocol>& finder() const { return finder_; }

 private:
  FrameFinder<IbusProtocol> finder_;
};

}  // namespace strix
