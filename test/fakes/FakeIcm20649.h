/// An ICM20649 as its registers show it: a Device for the driver, with a clock that the test moves.
///
/// Written from the register map, not from the driver: its addresses, ranges and scales stand here
/// once more, in double precision, so a slip in the driver's is seen. It measures what the test
/// says in m/s^2, rad/s and degC and turns that into counts by the range its own registers are set
/// to.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "Random.h"

namespace strix {

class FakeIcm20649 {
 public:
  using Axes = std::array<double, 3>;

  struct Transfer {
    bool write;
    unsigned bank;
    unsigned reg;
    std::size_t count;
  };

  // What it measures. Set by the test.
  Axes accel{0.0, 0.0, -9.80665};  ///< m/s^2
  Axes gyro{};                     ///< rad/s
  double temperature = 25.0;       ///< degC
  double noise = 1.5;              ///< counts, most on either side; 0: the same bytes each time
  double clockError = 0.0;         ///< 0.01: its samples come 1 % too often
  std::array<std::uint8_t, 3> gyroCodes{90, 91, 92};  ///< factory self-test
  std::array<std::uint8_t, 3> accelCodes{120, 121, 122};
  Axes gyroSelfTest{1.0, 1.0, 1.0};  ///< response over the factory's
  Axes accelSelfTest{1.0, 1.0, 1.0};

  // Faults. Set by the test.
  bool absent = false;    ///< no acknowledge
  bool undriven = false;  ///< as absent on SPI: transfers succeed, all bits are one
  double diesAt = 1e30;   ///< us; absent from then on
  std::pair<std::size_t, std::size_t> cut{};  ///< numbers of failing transfers: from, to before
  bool cutLate =
      false;  ///< a failing transfer has its effect, or the first part of it, all the same
  bool garbage = false;  ///< random bytes
  bool stuck = false;    ///< data-ready comes, the data do not change
  std::uint8_t identity = 0xE1;
  bool resetNeverEnds = false;
  std::pair<unsigned, unsigned> refuses{99, 0};  ///< bank and register that takes no value
  bool tearsFifo = false;                        ///< one byte of the next sample gets lost
  bool slowFifo = false;                         ///< takes 60 us to write the second half
  bool clocked = false;                          ///< transfers take their time at 400 kHz

  // Read by the test.
  std::vector<Transfer> transfers;
  std::uint32_t edges = 0;          ///< of data-ready
  std::uint32_t edgeTime = 0;       ///< us, of the newest
  std::vector<double> sampleTimes;  ///< us, exact, of every sample since data-ready is on
  std::uint64_t samples = 0;

  [[nodiscard]] double now() const { return now_; }
  [[nodiscard]] unsigned bank() const { return bank_; }
  [[nodiscard]] std::uint8_t registerValue(unsigned bank, unsigned reg) const {
    return registers_[bank][reg];
  }

  FakeIcm20649() { restoreDefaults(); }

  void advance(double us) {
    const double end = now_ + us;
    while (true) {
      const double next = lastSample_ + period();
      if (next > end) break;
      now_ = next;
      lastSample_ = next;
      if (isAwake()) measure();
    }
    now_ = end;
    if (now_ >= resetDone_ && !resetNeverEnds) registers_[0][0x06] &= 0x7F;
  }

  // A Device.
  bool read(std::uint8_t reg, std::uint8_t* data, std::size_t count) {
    const bool arrives = begin({false, bank_, reg, count});
    // The FIFO is one register; other addresses count up.
    const bool isFifo = bank_ == 0 && reg == 0x72;
    for (std::size_t i = 0; (arrives || cutLate) && i < count; ++i) {
      data[i] = isFifo ? popFifo() : valueOf(reg + static_cast<unsigned>(i));
      if (garbage) data[i] = static_cast<std::uint8_t>(random_.below(256));
      if (undriven) data[i] = 0xFF;
      if (!arrives && i == 4) break;
    }
    end(count + 3);
    return arrives;
  }

  bool write(std::uint8_t reg, std::uint8_t value) {
    const bool arrives = begin({true, bank_, reg, 1});
    if ((arrives || cutLate) && !undriven) {
      if (reg == 0x7F) {
        bank_ = (value >> 4) & 3U;
      } else if (refuses != std::pair<unsigned, unsigned>{bank_, reg}) {
        take(reg, value);
      }
    }
    end(3);
    return arrives;
  }

 private:
  static constexpr std::size_t kFifoSize = 512;

  bool begin(const Transfer& transfer) {
    const std::size_t number = transfers.size();
    transfers.push_back(transfer);
    if (clocked) advance(50.0);  // address and register
    if (now_ >= lastSample_ + 60.0) finishFifo();
    const bool isCut = number >= cut.first && number < cut.second;
    return !absent && !isCut && now_ < diesAt;
  }

  void end(std::size_t wireBytes) {
    if (clocked) advance(static_cast<double>(wireBytes * 9 + 3) * 2.5 - 50.0);
  }

  void restoreDefaults() {
    registers_ = {};
    registers_[0][0x06] = 0x41;
    registers_[0][0x05] = 0x40;
    registers_[2][0x01] = 0x01;
    registers_[2][0x14] = 0x01;
    bank_ = 0;
    fifo_.clear();
    unwritten_.clear();
  }

  void take(unsigned reg, std::uint8_t value) {
    if (bank_ == 0 && reg == 0x06 && (value & 0x80) != 0) {
      restoreDefaults();
      registers_[0][0x06] = 0xC1;  // still at it
      resetDone_ = now_ + 30'000.0;
    } else if (bank_ == 0 && reg == 0x68 && (value & 0x1F) != 0) {
      fifo_.clear();
      unwritten_.clear();
      registers_[0][reg] = value;
    } else if (bank_ != 1) {
      registers_[bank_][reg] = value;
    }
  }

  [[nodiscard]] std::uint8_t valueOf(unsigned reg) const {
    if (bank_ == 0 && reg == 0x00) return identity;
    if (bank_ == 0 && reg == 0x70) return static_cast<std::uint8_t>(fifo_.size() >> 8U);
    if (bank_ == 0 && reg == 0x71) return static_cast<std::uint8_t>(fifo_.size() & 0xFFU);
    if (bank_ == 1 && reg >= 0x02 && reg <= 0x04) return gyroCodes[reg - 0x02];
    if (bank_ == 1 && reg >= 0x0E && reg <= 0x10) return accelCodes[reg - 0x0E];
    return registers_[bank_][reg & 0x7FU];
  }

  std::uint8_t popFifo() {
    if (fifo_.empty()) return 0xFF;
    const std::uint8_t value = fifo_.front();
    fifo_.pop_front();
    return value;
  }

  [[nodiscard]] bool isAwake() const { return (registers_[0][0x06] & 0xC0U) == 0; }

  /// us between two samples: 1125 Hz over the divider, the filters being on.
  [[nodiscard]] double period() const {
    return 1e6 / 1125.0 * (1.0 + registers_[2][0x00]) / (1.0 + clockError);
  }

  void measure() {
    const unsigned accelRange = (registers_[2][0x14] >> 1U) & 3U;
    const unsigned gyroRange = (registers_[2][0x01] >> 1U) & 3U;
    static constexpr double kPerG[] = {8192.0, 4096.0, 2048.0, 1024.0};
    static constexpr double kPerDps[] = {65.5, 32.8, 16.4, 8.2};
    constexpr double kRadian = 57.295779513082321;
    ++samples;
    if (!stuck) {
      for (unsigned i = 0; i < 3; ++i) {
        double a = accel[i] / 9.80665 * kPerG[accelRange];
        double g = gyro[i] * kRadian * kPerDps[gyroRange];
        if ((registers_[2][0x15] & (0x10U >> i)) != 0) {
          a += response(accelCodes[i], accelRange) * accelSelfTest[i];
        }
        if ((registers_[2][0x02] & (0x20U >> i)) != 0) {
          g += response(gyroCodes[i], gyroRange) * gyroSelfTest[i];
        }
        store(0x2D + 2 * i, a + jitter());
        store(0x33 + 2 * i, g + jitter());
      }
      store(0x39, (temperature - 21.0) * 333.87);
    }
    const bool fifoHeld = (registers_[0][0x68] & 0x1FU) != 0;  // in reset
    const bool fifoOn = (registers_[0][0x03] & 0x40U) != 0 && registers_[0][0x67] == 0x1F;
    if (fifoOn && !fifoHeld) pushFifo();
    if ((registers_[0][0x11] & 1U) != 0) {
      ++edges;
      edgeTime = static_cast<std::uint32_t>(now_);
      sampleTimes.push_back(now_);
    }
  }

  /// Counts that the factory saw, by range: half of those with half the range.
  [[nodiscard]] static double response(std::uint8_t code, unsigned range) {
    return 1310.0 / static_cast<double>(1U << range) * std::pow(1.01, code - 1.0);
  }

  [[nodiscard]] double jitter() {
    return noise * static_cast<double>(random_.uniform(-1.0F, 1.0F));
  }

  void store(unsigned reg, double counts) {
    const double held = std::fmin(std::fmax(std::round(counts), -32768.0), 32767.0);
    const auto bits = static_cast<std::uint16_t>(static_cast<std::int16_t>(held));
    registers_[0][reg] = static_cast<std::uint8_t>(bits >> 8U);
    registers_[0][reg + 1] = static_cast<std::uint8_t>(bits & 0xFFU);
  }

  void pushFifo() {
    finishFifo();
    for (unsigned i = 0; i < 14; ++i) {
      if (i == 5 && tearsFifo) continue;
      auto& to = slowFifo && i >= 7 ? unwritten_ : fifo_;
      to.push_back(registers_[0][0x2D + i]);
    }
    tearsFifo = false;
    while (fifo_.size() > kFifoSize) fifo_.pop_front();
  }

  void finishFifo() {
    fifo_.insert(fifo_.end(), unwritten_.begin(), unwritten_.end());
    unwritten_.clear();
  }

  std::array<std::array<std::uint8_t, 128>, 4> registers_{};
  unsigned bank_ = 0;
  std::deque<std::uint8_t> fifo_;
  std::deque<std::uint8_t> unwritten_;
  double now_ = 0.0;         // us
  double lastSample_ = 0.0;  // us
  double resetDone_ = 0.0;   // us
  Random random_{649};
};

}  // namespace strix
