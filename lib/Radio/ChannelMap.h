/// What the pilot's channels mean.
#pragma once

#include "PilotInput.h"
#include "RadioChannels.h"

namespace strix {

/// Channels count from 0. The sticks are in the order of most transmitters: aileron, elevator,
/// throttle, rudder; right, forward and up are the longer pulses.
struct ChannelMapConfig {
  std::uint8_t roll = 0;
  std::uint8_t pitch = 1;
  std::uint8_t throttle = 2;
  std::uint8_t yaw = 3;
  std::uint8_t arm = 4;
  std::uint8_t kill = 5;
  std::uint8_t mode = 6;   ///< a switch of three positions
  std::uint8_t start = 7;  ///< begin the mission
  std::array<PilotMode, 3> modes{PilotMode::Attitude, PilotMode::PositionHold, PilotMode::Mission};
  std::uint16_t reversed = 0;  ///< bit n: channel n counts the other way

  std::uint16_t low = 1000;     ///< us, ends of the sticks
  std::uint16_t high = 2000;    ///< us
  std::uint16_t deadband = 10;  ///< us around the middle that are the middle
  /// us: no transmitter sends pulses beyond these, a broken link does.
  std::uint16_t shortest = 800;
  std::uint16_t longest = 2200;
};

/// Sticks are scaled; switches have a width that they must be moved by.
class ChannelMap {
 public:
  explicit ChannelMap(const ChannelMapConfig& config = {}) : config_(config) {}

  /// @return an input that is not valid, with the switches as they were, when a channel is missing
  /// or its pulse cannot be
  const PilotInput& update(const RadioChannels& channels) {
    const ChannelMapConfig& c = config_;
    PilotInput next = input_;
    next.valid = true;
    float arm = 0.0F;
    float kill = 0.0F;
    float start = 0.0F;
    float mode = 0.0F;
    const std::array<Wire, 8> wires{{{c.roll, &next.roll},
                                     {c.pitch, &next.pitch},
                                     {c.throttle, &next.throttle},
                                     {c.yaw, &next.yaw},
                                     {c.arm, &arm},
                                     {c.kill, &kill},
                                     {c.start, &start},
                                     {c.mode, &mode}}};
    for (const Wire& wire : wires) {
      if (!read(channels, wire)) {
        input_.valid = false;
        return input_;
      }
    }
    next.roll = withoutMiddle(next.roll);
    next.pitch = -withoutMiddle(next.pitch);
    next.yaw = withoutMiddle(next.yaw);
    next.throttle = 0.5F * (next.throttle + 1.0F);
    next.arm = switched(arm, input_.arm);
    next.kill = switched(kill, input_.kill);
    next.start = switched(start, input_.start);
    // Thirds of the range, and the position of before in between.
    if (mode < -0.4F) position_ = 0;
    if (mode > -0.2F && mode < 0.2F) position_ = 1;
    if (mode > 0.4F) position_ = 2;
    next.mode = c.modes[position_];
    input_ = next;
    return input_;
  }

  [[nodiscard]] const PilotInput& input() const { return input_; }

 private:
  struct Wire {
    std::uint8_t channel;
    float* value;
  };

  /// -1 to 1 of one channel.
  [[nodiscard]] bool read(const RadioChannels& channels, const Wire& wire) const {
    if (wire.channel >= channels.count || wire.channel >= RadioChannels::kMost) return false;
    const std::uint16_t pulse = channels.pulse[wire.channel];
    if (pulse < config_.shortest || pulse > config_.longest) return false;
    const float middle = 0.5F * static_cast<float>(config_.low + config_.high);
    const float half = 0.5F * static_cast<float>(config_.high - config_.low);
    float value = (static_cast<float>(pulse) - middle) / half;
    if (((config_.reversed >> wire.channel) & 1U) != 0) value = -value;
    if (value > 1.0F) value = 1.0F;
    if (value < -1.0F) value = -1.0F;
    *wire.value = value;
    return true;
  }

  /// The deadband taken out, so that the stick begins to act at 0 and still ends at 1.
  [[nodiscard]] float withoutMiddle(float value) const {
    const float band = static_cast<float>(config_.deadband) /
                       (0.5F * static_cast<float>(config_.high - config_.low));
    const float size = value < 0.0F ? -value : value;
    if (size <= band) return 0.0F;
    const float rest = (size - band) / (1.0F - band);
    return value < 0.0F ? -rest : rest;
  }

  /// On above 1650 us, off below 1350 us: a switch of three positions keeps in its middle.
  [[nodiscard]] static bool switched(float value, bool before) {
    return before ? value > -0.3F : value > 0.3F;
  }

  ChannelMapConfig config_;
  PilotInput input_;
  std::size_t position_ = 0;  ///< of the mode switch
};

}  // namespace strix
