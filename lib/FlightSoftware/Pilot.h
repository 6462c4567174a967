/// Whoever may arm, kill and steer, made one: the aircraft's own switches, the radio, and commands
/// by telemetry or console.
#pragma once

#include "Board.h"
#include "ChannelMap.h"
#include "Conditions.h"
#include "Parameters.h"
#include "RadioLink.h"
#include "VehicleCommand.h"

namespace strix {

/// Where channels are and what they mean, as the parameters have it.
[[nodiscard]] inline ChannelMapConfig channelMap(const Parameters& p) {
  const auto channel = [](float value) { return static_cast<std::uint8_t>(value - 1.0F); };
  const auto mode = [](float value) {
    return static_cast<PilotMode>(static_cast<std::uint8_t>(value));
  };
  ChannelMapConfig map;
  map.roll = channel(p.radioRoll);
  map.pitch = channel(p.radioPitch);
  map.throttle = channel(p.radioThrottle);
  map.yaw = channel(p.radioYaw);
  map.arm = channel(p.radioArm);
  map.kill = channel(p.radioKill);
  map.mode = channel(p.radioMode);
  map.start = channel(p.radioStart);
  map.modes = {mode(p.radioMode1), mode(p.radioMode2), mode(p.radioMode3)};
  map.reversed = static_cast<std::uint16_t>(p.radioReversed);
  return map;
}

class Pilot {
 public:
  static constexpr float kThrottleLow = 0.05F;  ///< of its way
  /// ours: taking off asks for more than the slack of a stick that is down, or, where the middle
  /// holds the height, for a climb.
  static constexpr float kTakeoffThrust = 0.15F;
  static constexpr float kTakeoffClimb = 0.6F;

  void configure(const Parameters& p) {
    usesRadio_ = p.radioProtocol > 0.0F;
    map_ = ChannelMap(channelMap(p));
    radio_.configure({toMicros(p.radioTimeout), RadioLinkConfig{}.regain});
  }

  /// A frame of the receiver.
  void add(const RadioChannels& channels, Micros now) { radio_.add(channels, now); }

  /// To be called in every control tick, with the aircraft's own switches.
  /// @return the conditions that somebody's wish makes
  ConditionSet update(Micros now, const PilotSwitches& switches, bool motorsOn) {
    listen(now);
    if (!motorsOn && flew_) {  // no wish outlives its flight
      startAsked_ = false;
      asked_ = condition::kNone;
    }
    flew_ = motorsOn;
    ConditionSet set = asked_;
    const auto setIf = [&set](bool present, ConditionSet bit) {
      set |= present ? bit : condition::kNone;
    };
    const bool wiredEdge = switches.arm && !wiredArm_;
    const bool radioEdge = input_.valid && input_.arm && !radioArm_;
    const bool switchedOff = (wiredArm_ && !switches.arm) ||
                             (input_.valid && radioArm_ && !input_.arm && radioArmHeard_);
    if (wiredEdge) armer_ = Armer::Switch;
    if (radioEdge) armer_ = Armer::Radio;
    if (armAsked_) armer_ = askedBy_ == CommandSource::Link ? Armer::Link : Armer::Console;
    setIf(wiredEdge || radioEdge || armAsked_, condition::kArmEdge);
    setIf(switchedOff || disarmAsked_ || (armer_ == Armer::Switch && !switches.arm) ||
              (armer_ == Armer::Radio && input_.valid && !input_.arm),
          condition::kDisarm);
    setIf(switches.kill || input_.kill || killAsked_, condition::kKill);
    const bool sticks = input_.valid && usesSticks(input_.mode);
    setIf(sticks, condition::kSticks);
    setIf(sticks && modeHeard_ && !usesSticks(mode_), condition::kSticksEdge);
    setIf(sticks && input_.throttle > takeoffThrottle(), condition::kThrottleUp);
    setIf(switches.start || (input_.valid && input_.start) || startAsked_, condition::kStart);
    wiredArm_ = switches.arm;
    // A switch held while the transmitter was not heard is no edge when it is heard again.
    radioArm_ = !input_.valid || input_.arm;
    radioArmHeard_ = input_.valid;
    modeHeard_ = input_.valid;
    mode_ = input_.mode;
    armAsked_ = disarmAsked_ = false;
    switches_ = switches;
    return set;
  }

  void askArm(CommandSource source) {
    armAsked_ = true;
    askedBy_ = source;
  }
  void askDisarm() { disarmAsked_ = true; }
  void askKill(bool on) { killAsked_ = on; }
  void askStart() { startAsked_ = true; }
  /// Land, return or hold: what was asked for last counts, until it has been done.
  void ask(ConditionSet wish) {
    asked_ = wish;
    flew_ = false;
  }
  void done(ConditionSet wish) { asked_ &= ~wish; }

  [[nodiscard]] const PilotInput& input() const { return input_; }
  [[nodiscard]] const PilotSwitches& switches() const { return switches_; }
  [[nodiscard]] bool usesRadio() const { return usesRadio_; }
  /// A transmitter was heard since power-up.
  [[nodiscard]] bool radioKnown() const { return radioKnown_; }
  [[nodiscard]] bool radioLost() const { return !input_.valid; }
  [[nodiscard]] bool throttleLow() const {
    return !input_.valid || input_.throttle <= kThrottleLow;
  }
  [[nodiscard]] bool killSwitch() const { return switches_.kill || input_.kill; }
  [[nodiscard]] bool killAsked() const { return killAsked_; }
  [[nodiscard]] bool starts() const {
    return switches_.start || (input_.valid && input_.start) || startAsked_;
  }
  /// The ground station has armed the aircraft: nobody else may be there to stop it.
  [[nodiscard]] bool linkArmed() const { return armer_ == Armer::Link; }

 private:
  enum class Armer : std::uint8_t { Nobody, Switch, Radio, Link, Console };

  void listen(Micros now) {
    const bool lost = radio_.lost(now);
    if (!lost) {
      input_ = map_.update(radio_.channels());
      radioKnown_ = radioKnown_ || input_.valid;
    }
    if (lost) input_.valid = false;  // what it said last of kill and arm stays
  }

  [[nodiscard]] float takeoffThrottle() const {
    return input_.mode == PilotMode::Attitude ? kTakeoffThrust : kTakeoffClimb;
  }

  RadioLink radio_;
  ChannelMap map_;
  PilotInput input_;
  PilotSwitches switches_;
  Armer armer_ = Armer::Nobody;
  CommandSource askedBy_ = CommandSource::Link;
  ConditionSet asked_ = condition::kNone;
  PilotMode mode_ = PilotMode::Mission;  ///< heard last
  bool modeHeard_ = false;
  bool usesRadio_ = false;
  bool radioKnown_ = false;
  bool wiredArm_ = true;  ///< so that a switch held through power-up is no edge
  bool radioArm_ = true;
  bool radioArmHeard_ = false;
  bool armAsked_ = false;
  bool disarmAsked_ = false;
  bool killAsked_ = false;
  bool startAsked_ = false;
  bool flew_ = false;  ///< the motors were on when these wishes were uttered
};

}  // namespace strix
