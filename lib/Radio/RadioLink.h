/// Whether the transmitter is heard, and what it said last.
#pragma once

#include "RadioChannels.h"
#include "Time.h"

namespace strix {

struct RadioLinkConfig {
  /// Without a good frame for so long the transmitter is lost: 35 frames of the slowest protocol.
  Micros silence = 500'000;
  std::uint8_t regain = 10;  ///< good frames in a row until a lost one is found again
};

/// Lost from the start, on silence, and at once when the receiver says so. While it is lost
/// channels() are those of before.
class RadioLink {
 public:
  explicit RadioLink(const RadioLinkConfig& config = {}) : config_(config) {}

  void configure(const RadioLinkConfig& config) { config_ = config; }

  void add(const RadioChannels& channels, Micros now) {
    (void)lost(now);
    if (channels.failsafe) lose();
    if (channels.failsafe || channels.frameLost) {
      good_ = 0;
      return;
    }
    lastGood_ = now;
    if (good_ < config_.regain) ++good_;
    if (lost_ && good_ < config_.regain) return;
    lost_ = false;
    channels_ = channels;
  }

  /// To be asked in every pass: a silence is noticed here.
  [[nodiscard]] bool lost(Micros now) {
    if (!lost_ && elapsed(now, lastGood_) > config_.silence) lose();
    if (lost_ && elapsed(now, lastGood_) > config_.silence) good_ = 0;
    return lost_;
  }

  [[nodiscard]] const RadioChannels& channels() const { return channels_; }
  [[nodiscard]] std::uint32_t losses() const { return losses_; }

 private:
  void lose() {
    if (!lost_) ++losses_;
    lost_ = true;
    good_ = 0;
  }

  RadioLinkConfig config_;
  RadioChannels channels_;
  Micros lastGood_ = 0;
  std::uint8_t good_ = 0;  ///< in a row
  bool lost_ = true;
  std::uint32_t losses_ = 0;
};

}  // namespace strix
