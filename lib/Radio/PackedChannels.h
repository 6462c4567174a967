/// Sixteen channels of 11 bits, the lowest bit first, as SBUS and CRSF send them.
#pragma once

#include "RadioChannels.h"

namespace strix {

constexpr std::size_t kPackedBytes = 22;

/// Both protocols count 172 for 988 us, 992 for 1500 us and 1811 for 2012 us: 5/8 us a step.
/// (crsf-wg wiki, CRSF_FRAMETYPE_RC_CHANNELS_PACKED; Betaflight's sbus_channels.c has the same.)
[[nodiscard]] inline RadioChannels unpackChannels(const std::uint8_t* bytes) {
  RadioChannels channels;
  channels.count = RadioChannels::kMost;
  std::uint32_t bits = 0;
  unsigned held = 0;
  for (std::uint16_t& pulse : channels.pulse) {
    while (held < 11) {
      bits |= static_cast<std::uint32_t>(*bytes++) << held;
      held += 8;
    }
    pulse = static_cast<std::uint16_t>((5U * (bits & 0x7FFU) + 4U) / 8U + 880U);
    bits >>= 11U;
    held -= 11;
  }
  return channels;
}

}  // namespace strix
