/// At power-up: flight software or checkout?
#pragma once

#include "CommandLine.h"
#include "Time.h"

namespace strix {

/// A terminal that sends `checkout` and Enter within 5 s after it opened gets the checkout. No
/// terminal within 2 s of power-up, no such line in time, or a terminal that went away: the
/// aircraft flies. The choice is made once; motors get no pulses while it is open.
class PowerUpChoice {
 public:
  static constexpr Micros kTerminalWait = 2'000'000;
  static constexpr Micros kAnswerWait = 5'000'000;
  static constexpr const char* kQuestion =
      "\r\nStrix: type checkout and Enter within 5 s to check sensors and motors; "
      "else it gets ready to fly\r\n";

  enum class Answer { Open, Fly, Checkout };

  explicit PowerUpChoice(Micros now) : since_(now) {}

  /// @param terminal  a terminal program has the port open
  /// @param character  what it sent, -1 for nothing
  Answer update(Micros now, bool terminal, int character) {
    if (answer_ != Answer::Open) return answer_;
    if (terminal && !opened_) {
      opened_ = true;
      since_ = now;
    } else if (!terminal && opened_) {
      return answer_ = Answer::Fly;
    }
    if (elapsed(now, since_) >= (opened_ ? kAnswerWait : kTerminalWait)) {
      return answer_ = Answer::Fly;
    }
    if (opened_ && character >= 0 &&
        line_.take(static_cast<char>(character)) == CommandLine::Event::Line &&
        line_.text() == "checkout") {
      answer_ = Answer::Checkout;
    }
    return answer_;
  }

  /// True from when a terminal is there: the question can be asked.
  [[nodiscard]] bool opened() const { return opened_; }

 private:
  CommandLine line_;
  Micros since_;
  bool opened_ = false;
  Answer answer_ = Answer::Open;
};

}  // namespace strix
