/// Crossfire's and ExpressLRS's CRSF: 420000 baud, 16 channels and the state of the link.
#pragma once

#include "FrameFinder.h"
#include "PackedChannels.h"

namespace strix {

/// 0xC8, length of what follows, type, payload, CRC-8 of type and payload (polynomial 0xD5);
/// github.com/tbs-fpv/tbs-crsf-spec.
struct CrsfProtocol {
  static constexpr std::size_t kLongest = 64;
  static constexpr std::uint8_t kAddress = 0xC8;  ///< a flight controller's
  static constexpr std::uint8_t kLinkStatistics = 0x14;
  static constexpr std::uint8_t kChannelsPacked = 0x16;

  [[nodiscard]] static std::size_t length(const std::uint8_t* bytes, std::size_t count) {
    if (bytes[0] != kAddress) return 0;
    if (count < 2) return kLongest;
    const std::size_t length = bytes[1] + 2U;
    return length >= 4 && length <= kLongest ? length : 0;
  }

  [[nodiscard]] static bool intact(const std::uint8_t* frame, std::size_t length) {
    return crc(frame + 2, length - 3) == frame[length - 1];
  }

  [[nodiscard]] static std::uint8_t crc(const std::uint8_t* bytes, std::size_t count) {
    unsigned crc = 0;
    for (std::size_t i = 0; i < count; ++i) {
      crc ^= bytes[i];
      for (int bit = 0; bit < 8; ++bit) crc = (crc << 1U) ^ ((crc & 0x80U) != 0 ? 0xD5U : 0U);
    }
    return static_cast<std::uint8_t>(crc);
  }
};

/// How well the receiver hears its transmitter.
struct CrsfLink {
  std::uint8_t quality = 0;  ///< % of the frames sent that were heard
  std::uint8_t rssi = 0;     ///< -dBm of the antenna in use
};

/// A receiver that has lost its transmitter sends no channels, and a quality of 0.
class Crsf {
 public:
  /// @return true when `channels` are new; frames of other types pass
  bool add(std::uint8_t byte, RadioChannels& channels) {
    const std::uint8_t* const frame = finder_.add(byte);
    if (frame == nullptr) return false;
    const std::size_t payload = finder_.length() - 4;
    if (frame[2] == CrsfProtocol::kLinkStatistics && payload >= 10) {
      // Uplink: RSSI of two antennas, quality, SNR, antenna in use.
      link_ = {frame[5], frame[7] == 0 ? frame[3] : frame[4]};
      linkKnown_ = true;
      return false;
    }
    if (frame[2] != CrsfProtocol::kChannelsPacked || payload != kPackedBytes) return false;
    channels = unpackChannels(frame + 3);
    channels.failsafe = linkKnown_ && link_.quality == 0;
    return true;
  }

  [[nodiscard]] const CrsfLink& link() const { return link_; }
  [[nodiscard]] const FrameFinder<CrsfProtocol>& finder() const { return finder_; }

 private:
  FrameFinder<CrsfProtocol> finder_;
  CrsfLink link_;
  bool linkKnown_ = false;
};

}  // namespace strix
