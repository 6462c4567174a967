/// The I2C master of the i.MX RT1062 (LPI2C), as far as a polled transfer sees it: after the
/// "i.MX RT1060 Processor Reference Manual", chapter LPI2C: FIFOs of four words, commands, flags,
/// timing in cycles of 24 MHz, reset.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

#include "FakeClock.h"
#include "FakeI2cWire.h"

namespace strix {

class FakeLpi2c final : public I2cParty {
 public:
  using Nanos = FakeClock::Nanos;

  // Bits of the registers, numbered as in the manual.
  static constexpr std::uint32_t kBusBusy = 1U << 25U;
  static constexpr std::uint32_t kMasterBusy = 1U << 24U;
  static constexpr std::uint32_t kPinLowTimeout = 1U << 13U;
  static constexpr std::uint32_t kFifoError = 1U << 12U;
  static constexpr std::uint32_t kArbitrationLost = 1U << 11U;
  static constexpr std::uint32_t kNack = 1U << 10U;
  static constexpr std::uint32_t kStop = 1U << 9U;
  static constexpr std::uint32_t kEndOfPacket = 1U << 8U;
  static constexpr std::uint32_t kErrors = kPinLowTimeout | kFifoError | kArbitrationLost | kNack;
  static constexpr std::uint32_t kFlags = kErrors | kStop | kEndOfPacket;  // one written clears
  static constexpr std::size_t kFifoDepth = 4;

  FakeLpi2c(FakeClock& clock, FakeI2cWire& wire) : clock_(clock), wire_(wire) {
    wire.attach(*this);
  }

  /// Whether the pads belong to the master, by the pin multiplexer.
  void route(bool sda, bool scl) {
    routedSda_ = sda;
    routedScl_ = scl;
    drive();
  }

  /// Times that a command was written into a full FIFO, and so lost.
  [[nodiscard]] std::uint32_t overruns() const { return overruns_; }
  /// Bits that went over the wire.
  [[nodiscard]] std::uint32_t bits() const { return bits_; }

  [[nodiscard]] std::uint32_t status() {
    if (!seen().scl && clock_.now() - sclLowSince_ >= pinLowTimeout()) flags_ |= kPinLowTimeout;
    return flags_ | (busBusy() ? kBusBusy : 0U) | (owner_ ? kMasterBusy : 0U);
  }
  void clearFlags(std::uint32_t ones) {
    flags_ &= ~(ones & kFlags);
    wake();
  }

  void control(std::uint32_t value) {
    constexpr std::uint32_t kEnable = 1U;
    constexpr std::uint32_t kReset = 2U;
    constexpr std::uint32_t kResetTransmit = 1U << 8U;
    constexpr std::uint32_t kResetReceive = 1U << 9U;
    if ((value & kReset) != 0) reset();
    if ((value & kResetTransmit) != 0) commands_.clear();
    if ((value & kResetReceive) != 0) received_.clear();
    enabled_ = (value & kEnable) != 0 && (value & kReset) == 0;
    wake();
  }
  [[nodiscard]] std::uint32_t control() const { return enabled_ ? 1U : 0U; }

  [[nodiscard]] std::uint32_t fifoCounts() const {
    return static_cast<std::uint32_t>(received_.size() << 16U | commands_.size());
  }
  void command(std::uint32_t word) {
    if (commands_.size() == kFifoDepth) {
      ++overruns_;
    } else {
      commands_.push_back(word);
    }
    wake();
  }
  [[nodiscard]] std::uint32_t receive() {
    constexpr std::uint32_t kEmpty = 1U << 14U;
    if (received_.empty()) return kEmpty;
    const std::uint32_t value = received_.front();
    received_.pop_front();
    wake();
    return value;
  }

  // Timing registers.
  std::uint32_t prescale = 0;   ///< MCFGR1
  std::uint32_t timeouts = 0;   ///< MCFGR2: bus idle and glitch filters
  std::uint32_t pinLow = 0;     ///< MCFGR3
  std::uint32_t clockBits = 0;  ///< MCCR0

  void edge(Lines /*was*/, Lines /*is*/) override {
    const Lines is = seen();
    const Lines was = seen_;
    seen_ = is;
    if (FakeI2cWire::isStart(was, is)) startSeen_ = true;
    if (FakeI2cWire::isStop(was, is)) {
      startSeen_ = false;
      if (owner_) flags_ |= kStop | kEndOfPacket;
    }
    if (was.scl && !is.scl) sclLowSince_ = clock_.now();
    if (is.scl && is.sda && !(was.scl && was.sda)) idleSince_ = clock_.now();
    if (stretched_ && is.scl) wake();
  }

 private:
  enum class Do { Sda, Scl, ClockHigh, Pause, Compare, Sample, Acknowledged, Store, Own, Leave };
  struct Step {
    Do what;
    Nanos value = 0;
  };

  [[nodiscard]] Nanos cycles(std::uint32_t count) const {
    return (static_cast<Nanos>(count) << (prescale & 7U)) * 1000U / 24U;
  }
  [[nodiscard]] Nanos low() const { return cycles((clockBits & 0x3FU) + 1U); }
  [[nodiscard]] Nanos high() const {
    const std::uint32_t filter = timeouts >> 16U & 0xFU;
    return cycles((clockBits >> 8U & 0x3FU) + 1U + ((2U + filter) >> (prescale & 7U)));
  }
  [[nodiscard]] Nanos hold() const { return cycles((clockBits >> 16U & 0x3FU) + 1U); }
  [[nodiscard]] Nanos busIdle() const { return cycles(timeouts & 0xFFFU); }
  [[nodiscard]] Nanos pinLowTimeout() const {
    const std::uint32_t count = pinLow >> 8U & 0xFFFU;
    return count == 0 ? ~Nanos{0} : cycles(count * 256U);
  }

  /// What the master's inputs show: a pad that belongs to the GPIO reads as high.
  [[nodiscard]] Lines seen() const {
    return {!routedSda_ || wire_.levels().sda, !routedScl_ || wire_.levels().scl};
  }
  [[nodiscard]] bool busBusy() const {
    if (!seen().sda || !seen().scl) return true;
    return startSeen_ && clock_.now() - idleSince_ < busIdle();
  }

  void drive() {
    pullsSda = routedSda_ && wantsSdaLow_;
    pullsScl = routedScl_ && wantsSclLow_;
    wire_.update();
    edge({}, {});
  }

  void reset() {
    ++generation_;
    pausedUntil_ = 0;
    stretched_ = false;
    commands_.clear();
    received_.clear();
    steps_.clear();
    flags_ = 0;
    toReceive_ = 0;
    owner_ = startSeen_ = wantsSdaLow_ = wantsSclLow_ = false;
    drive();
  }

  /// Goes on, as soon as the caller is done.
  void wake() { runAfter(0); }

  void pause(Nanos duration) {
    pausedUntil_ = clock_.now() + duration;
    runAfter(duration);
  }

  void runAfter(Nanos delay) {
    clock_.after(delay, [this, generation = generation_] {
      if (generation == generation_) run();
    });
  }

  void run() {
    while (enabled_ && clock_.now() >= pausedUntil_) {
      if (steps_.empty() && !nextCommand()) return;
      if (!steps_.empty() && !perform(steps_.front())) return;
    }
  }

  /// False: to be tried again when something has changed.
  bool perform(const Step step) {
    stretched_ = step.what == Do::ClockHigh && !seen().scl;
    if (stretched_) return false;
    if (step.what == Do::Store && received_.size() == kFifoDepth) return false;
    steps_.pop_front();
    switch (step.what) {
      case Do::Sda:
        wantsSdaLow_ = step.value == 0;
        drive();
        return true;
      case Do::Scl:
        wantsSclLow_ = step.value == 0;
        drive();
        return true;
      case Do::Pause:
        pause(step.value);
        return true;
      case Do::Compare:  // what we send against what is on the line
        ++bits_;
        if (step.value != 0 && !seen().sda) lose();
        return true;
      case Do::Sample:
        ++bits_;
        shift_ = (shift_ << 1U | (seen().sda ? 1U : 0U)) & 0xFFU;
        return true;
      case Do::Acknowledged:
        ++bits_;
        if (seen().sda) flags_ |= kNack;
        return true;
      case Do::Store:
        received_.push_back(shift_);
        return true;
      case Do::Own:
        owner_ = true;
        return true;
      case Do::Leave:
        owner_ = false;
        return true;
      case Do::ClockHigh:
        return true;
    }
    return true;
  }

  void lose() {
    flags_ |= kArbitrationLost;
    steps_.clear();
    owner_ = wantsSdaLow_ = wantsSclLow_ = false;
    drive();
  }

  void clockOneBit(Step step) {
    steps_.insert(steps_.end(), {{Do::Pause, low()},
                                 {Do::Scl, 1},
                                 {Do::ClockHigh},
                                 {Do::Pause, high()},
                                 step,
                                 {Do::Scl, 0}});
  }

  void sendByte(std::uint32_t byte) {
    for (std::uint32_t bit = 8; bit-- > 0;) {
      const Nanos level = byte >> bit & 1U;
      steps_.push_back({Do::Sda, level});
      clockOneBit({Do::Compare, level});
    }
    steps_.push_back({Do::Sda, 1});
    clockOneBit({Do::Acknowledged});
  }

  void receiveByte() {
    --toReceive_;
    steps_.push_back({Do::Sda, 1});
    for (int bit = 0; bit < 8; ++bit) clockOneBit({Do::Sample});
    steps_.push_back({Do::Store});
    const Nanos nack = toReceive_ == 0 ? 1 : 0;
    steps_.push_back({Do::Sda, nack});
    clockOneBit({Do::Compare, 0});
  }

  bool nextCommand() {
    if (toReceive_ > 0) {
      receiveByte();
      return true;
    }
    if (commands_.empty()) return false;
    const std::uint32_t word = commands_.front();
    const std::uint32_t kind = word >> 8U & 7U;
    const bool stop = kind == 2;
    if ((flags_ & kErrors) != 0 && !stop) return false;
    if (kind == 4 && !owner_ && busBusy()) {
      pause(nanosFromMicros(1));  // looks again
      return false;
    }
    commands_.pop_front();
    if (kind == 4) {
      start(word & 0xFFU);
    } else if (!owner_) {
      if (!stop) flags_ |= kFifoError;
    } else if (kind == 0) {
      sendByte(word & 0xFFU);
    } else if (kind == 1) {
      toReceive_ = (word & 0xFFU) + 1;
    } else if (stop) {
      steps_.insert(steps_.end(), {{Do::Sda, 0},
                                   {Do::Pause, low()},
                                   {Do::Scl, 1},
                                   {Do::ClockHigh},
                                   {Do::Pause, hold()},
                                   {Do::Sda, 1},
                                   {Do::Pause, hold()},
                                   {Do::Leave}});
    }
    return true;
  }

  void start(std::uint32_t addressByte) {
    if (owner_) {  // a repeated one
      flags_ |= kEndOfPacket;
      steps_.insert(
          steps_.end(),
          {{Do::Sda, 1}, {Do::Pause, low()}, {Do::Scl, 1}, {Do::ClockHigh}, {Do::Pause, hold()}});
    }
    steps_.insert(steps_.end(), {{Do::Own}, {Do::Sda, 0}, {Do::Pause, hold()}, {Do::Scl, 0}});
    sendByte(addressByte);
  }

  FakeClock& clock_;
  FakeI2cWire& wire_;
  bool routedSda_ = false;
  bool routedScl_ = false;
  bool wantsSdaLow_ = false;
  bool wantsSclLow_ = false;
  bool enabled_ = false;
  bool owner_ = false;      ///< between our start and our stop
  bool startSeen_ = false;  ///< by anybody, and no stop since
  Lines seen_;
  Nanos sclLowSince_ = 0;
  Nanos idleSince_ = 0;
  std::uint32_t flags_ = 0;
  std::deque<std::uint32_t> commands_;
  std::deque<std::uint32_t> received_;
  std::deque<Step> steps_;
  std::uint32_t toReceive_ = 0;
  std::uint32_t shift_ = 0;
  std::uint32_t overruns_ = 0;
  std::uint32_t bits_ = 0;
  Nanos pausedUntil_ = 0;
  bool stretched_ = false;        ///< waits for SCL to rise
  std::uint32_t generation_ = 0;  ///< what was planned before a reset is void
};

}  // namespace strix
