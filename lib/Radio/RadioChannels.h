/// What every radio receiver tells, whatever its protocol.
#pragma once

#include <array>
#include <cstdint>

namespace strix {

/// One frame of a receiver.
struct RadioChannels {
  static constexpr std::size_t kMost = 16;

  std::array<std::uint16_t, kMost> pulse{};  ///< us, as a servo's: 1000 to 2000, 1500 the middle
  std::uint8_t count = 0;                    ///< channels that the protocol has
  bool frameLost = false;  ///< the receiver repeats what it heard before: not a new word
  bool failsafe = false;   ///< the receiver has lost its transmitter: its channels mean nothing
};

}  // namespace strix
