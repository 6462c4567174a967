/// Two wires with pull-ups, and what hangs on them: an I2C bus at the level of edges. A line is low
/// when anything pulls it, so a held line, a missing acknowledge, a lost arbitration and the clocks
/// that free a device come out as they do on the table, not as cases of the model.
/// After NXP UM10204, "I2C-bus specification and user manual", section 3.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace strix {

struct Lines {
  bool sda = true;
  bool scl = true;
};

/// Anything that can pull a line low.
class I2cParty {
 public:
  I2cParty() = default;
  virtual ~I2cParty() = default;
  I2cParty(const I2cParty&) = delete;
  I2cParty& operator=(const I2cParty&) = delete;

  /// The levels changed from `was` to `is`.
  virtual void edge(Lines was, Lines is) = 0;

  bool pullsSda = false;
  bool pullsScl = false;
};

class FakeI2cWire {
 public:
  // Faults, set by the test; call update() behind it.
  bool sdaShorted = false;  ///< to ground
  bool sclShorted = false;

  void attach(I2cParty& party) { parties_.push_back(&party); }

  [[nodiscard]] Lines levels() const { return levels_; }

  /// To be called after a pull or a fault has changed: tells everybody, until nothing moves.
  void update() {
    if (updating_) return;  // a party changed its pull while it was told: the loop below sees it
    updating_ = true;
    while (true) {
      Lines is{!sdaShorted, !sclShorted};
      for (const I2cParty* party : parties_) {
        is.sda = is.sda && !party->pullsSda;
        is.scl = is.scl && !party->pullsScl;
      }
      if (is.sda == levels_.sda && is.scl == levels_.scl) break;
      const Lines was = levels_;
      levels_ = is;
      for (I2cParty* party : parties_) party->edge(was, is);
    }
    updating_ = false;
  }

  [[nodiscard]] static bool isStart(Lines was, Lines is) {
    return was.scl && is.scl && was.sda && !is.sda;
  }
  [[nodiscard]] static bool isStop(Lines was, Lines is) {
    return was.scl && is.scl && !was.sda && is.sda;
  }

 private:
  std::vector<I2cParty*> parties_;
  Lines levels_;
  bool updating_ = false;
};

/// The registers of one device.
class I2cChip {
 public:
  I2cChip() = default;
  virtual ~I2cChip() = default;
  I2cChip(const I2cChip&) = delete;
  I2cChip& operator=(const I2cChip&) = delete;

  [[nodiscard]] virtual std::uint8_t readRegister(std::uint8_t reg) = 0;
  virtual void writeRegister(std::uint8_t reg, std::uint8_t value) = 0;
  virtual void powerUp() = 0;

  /// True for a device whose longer writes are pairs of address and value (BMP390); false for one
  /// that counts the address up.
  [[nodiscard]] virtual bool writesInPairs() const { return false; }
};

/// The device's side of the bus: address, acknowledge, bytes.
class I2cTarget final : public I2cParty {
 public:
  I2cTarget(FakeI2cWire& wire, I2cChip& chip, std::uint8_t address)
      : wire_(wire), chip_(chip), address_(address) {
    wire.attach(*this);
  }

  // Faults, set by the test.
  bool garbage = false;           ///< every byte it sends is noise
  bool holdsClock = false;        ///< keeps SCL low from its next acknowledge on
  std::uint32_t starts = 0;       ///< start conditions addressed to it, read by the test
  std::uint32_t diesAfter = ~0U;  ///< unplugged at this start condition

  /// Its plug out: no acknowledge, and no line held.
  void unplug() {
    plugged_ = false;
    letGo();
  }
  /// Its plug in again, with the registers of a power-up.
  void plug() {
    plugged_ = true;
    diesAfter = ~0U;
    chip_.powerUp();
  }

  void edge(Lines was, Lines is) override {
    if (!plugged_) return;
    if (FakeI2cWire::isStart(was, is)) {
      state_ = State::Address;
      bits_ = shift_ = 0;
      pullsSda = acknowledging_ = false;
    } else if (FakeI2cWire::isStop(was, is)) {
      letGo();
    } else if (!was.scl && is.scl) {
      clockRises(is.sda);
    } else if (was.scl && !is.scl) {
      clockFalls();
    }
  }

 private:
  enum class State { Idle, Address, Receive, Send };

  void letGo() {
    state_ = State::Idle;
    pullsSda = pullsScl = acknowledging_ = false;
    wire_.update();
  }

  void clockRises(bool sda) {
    if (state_ == State::Idle || acknowledging_) return;
    if (state_ == State::Send) {
      if (bits_ == 8) acknowledged_ = !sda;
      return;
    }
    shift_ = (shift_ << 1U | (sda ? 1U : 0U)) & 0xFFU;
    ++bits_;
  }

  void clockFalls() {
    if (state_ == State::Idle) return;
    if (state_ == State::Send) {
      ++bits_;
      if (bits_ == 9) {
        acknowledged_ ? load() : letGo();
      } else {
        pullsSda = bits_ < 8 && (shift_ & (0x80U >> bits_)) == 0;
      }
    } else if (acknowledging_) {
      endAcknowledge();
    } else if (bits_ == 8) {
      take();
    }
  }

  /// A whole byte came in.
  void take() {
    if (state_ == State::Address) {
      if (shift_ >> 1U != address_) {
        state_ = State::Idle;
        return;
      }
      if (++starts > diesAfter) {
        unplug();
        return;
      }
      sends_ = (shift_ & 1U) != 0;
      if (!sends_) pointerKnown_ = false;
    } else if (!pointerKnown_) {
      pointer_ = static_cast<std::uint8_t>(shift_);
      pointerKnown_ = true;
    } else {
      chip_.writeRegister(pointer_, static_cast<std::uint8_t>(shift_));
      ++pointer_;
      if (chip_.writesInPairs()) pointerKnown_ = false;
    }
    acknowledging_ = pullsSda = true;
    pullsScl = holdsClock;
  }

  void endAcknowledge() {
    acknowledging_ = pullsSda = false;
    bits_ = shift_ = 0;
    if (state_ == State::Address) state_ = sends_ ? State::Send : State::Receive;
    if (state_ == State::Send) load();
  }

  void load() {
    shift_ = chip_.readRegister(pointer_);
    ++pointer_;
    if (garbage) {
      noise_ = noise_ * 1664525U + 1013904223U;  // Numerical Recipes, section 7.1
      shift_ = noise_ >> 24U;
    }
    bits_ = 0;
    acknowledged_ = false;
    pullsSda = (shift_ & 0x80U) == 0;
  }

  FakeI2cWire& wire_;
  I2cChip& chip_;
  std::uint8_t address_;
  bool plugged_ = true;
  State state_ = State::Idle;
  std::uint32_t bits_ = 0;
  std::uint32_t shift_ = 0;
  bool acknowledging_ = false;
  bool acknowledged_ = false;  ///< by the one who reads
  bool sends_ = false;
  bool pointerKnown_ = false;
  std::uint8_t pointer_ = 0;
  std::uint32_t noise_ = 1;
};

}  // namespace strix
