/// STATUSTEXT: what the flight software says, and what telemetry itself has to say of a command.
#pragma once

#include <array>
#include <string_view>

#include "Conditions.h"
#include "Mavlink.h"
#include "TextHistory.h"
#include "Time.h"

namespace strix {

class Texts {
 public:
  /// A sentence of telemetry's own: one with a life as long as the program's. Said again within a
  /// few seconds it is left out, so that what comes at a rate does not fill the link.
  void tell(const char* sentence, Micros now) {
    if (sentence == nullptr) return;
    if (sentence == lastTold_ && elapsed(now, toldAt_) < kRepeat) return;
    if (waiting_ == own_.size()) {
      ++lost_;
      return;
    }
    own_[waiting_++] = sentence;
    lastTold_ = sentence;
    toldAt_ = now;
  }

  /// All that is in the way of arming, one after the other.
  void tellChecks(PreArmSet failing) { checks_ |= failing; }

  [[nodiscard]] std::uint32_t lost() const { return lost_; }

  /// @return false: there was nothing to say
  template <class Out>
  bool send(Out& out, const TextHistory& history) {
    if (size_ == 0 && !take(history)) return false;
    // MAVLink: a text of more than one part has a number, and ends with the part that has a zero.
    mavlink_statustext_t m{};
    constexpr std::size_t kPart = sizeof m.text;
    const std::size_t from = part_ * kPart;
    const std::size_t count = size_ - from < kPart ? size_ - from : kPart;
    std::memcpy(m.text, &letters_[from], count);
    m.severity = severity_;
    m.id = size_ > kPart ? number_ : std::uint16_t{0};
    m.chunk_seq = part_++;
    out.send(mavlink_msg_statustext_encode_status, m);
    if (count < kPart || size_ == kPart) size_ = 0;
    return true;
  }

 private:
  static constexpr Micros kRepeat = 5'000'000;  // ours

  bool take(const TextHistory& history) {
    part_ = 0;
    if (++number_ == 0) ++number_;
    if (waiting_ != 0) {
      load(own_[0], MAV_SEVERITY_WARNING);
      --waiting_;
      for (std::size_t i = 0; i < waiting_; ++i) own_[i] = own_[i + 1];
      return true;
    }
    if (const TextHistory::Text* text = history.next(place_)) {
      load(text->text(), text->severity);
      return size_ != 0;
    }
    for (const PreArmCheck& check : kPreArmChecks) {
      if ((checks_ & check.bit) == 0) continue;
      checks_ &= ~check.bit;
      load(check.refusal, MAV_SEVERITY_WARNING);
      return true;
    }
    return false;
  }

  void load(std::string_view text, std::uint8_t severity) {
    size_ = text.size() < letters_.size() ? text.size() : letters_.size();
    std::memcpy(letters_.data(), text.data(), size_);
    severity_ = severity;
  }

  std::array<const char*, 6> own_{};
  std::size_t waiting_ = 0;  ///< of own_
  const char* lastTold_ = nullptr;
  Micros toldAt_ = 0;
  std::uint32_t place_ = 0;  ///< in the aircraft's texts
  std::uint32_t lost_ = 0;
  PreArmSet checks_ = 0;
  std::array<char, TextHistory::kLength> letters_{};  ///< being sent
  std::size_t size_ = 0;                              ///< zero: nothing is
  std::uint16_t number_ = 0;
  std::uint8_t part_ = 0;
  std::uint8_t severity_ = MAV_SEVERITY_INFO;
};

}  // namespace strix
