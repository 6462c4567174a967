/// The other end, for tests and the simulator: what a pilot does with his transmitter as frames of
/// a receiver. The inverse of ChannelMap.
#pragma once

#include "ChannelMap.h"

namespace strix {

/// The frame that ChannelMap reads these wishes from; a mode that no position has is the first.
[[nodiscard]] inline RadioChannels frameOf(const PilotInput& input,
                                           const ChannelMapConfig& map = {}) {
  RadioChannels frame;
  frame.count = RadioChannels::kMost;
  frame.pulse.fill(1500);
  // The pulses around the middle are the middle: what is wanted begins behind them.
  const auto stick = [&map](float value) {
    const float band = static_cast<float>(map.deadband);
    const float pulse =
        value == 0.0F ? 0.0F : value * (500.0F - band) + (value > 0.0F ? band : -band);
    return static_cast<std::uint16_t>(1500.5F + pulse);
  };
  const auto switched = [](bool on) { return static_cast<std::uint16_t>(on ? 2000 : 1000); };
  frame.pulse[map.roll] = stick(input.roll);
  frame.pulse[map.pitch] = stick(-input.pitch);
  frame.pulse[map.yaw] = stick(input.yaw);
  frame.pulse[map.throttle] = static_cast<std::uint16_t>(1000.5F + 1000.0F * input.throttle);
  frame.pulse[map.arm] = switched(input.arm);
  frame.pulse[map.kill] = switched(input.kill);
  frame.pulse[map.start] = switched(input.start);
  frame.pulse[map.mode] = 1000;
  for (std::size_t i = 0; i < map.modes.size(); ++i) {
    if (map.modes[i] == input.mode)
      frame.pulse[map.mode] = static_cast<std::uint16_t>(1000 + 500 * i);
  }
  frame.failsafe = !input.valid;
  return frame;
}

}  // namespace strix
