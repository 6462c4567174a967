/// The battery's voltage, smoothed, from a divider on the board or from ESCs that answer; and the
/// current, where the board measures it.
#pragma once

#include "Mathpk.h"
#include "RawSamples.h"

namespace strix {

class BatteryMonitor {
 public:
  /// @param cells  in series
  explicit BatteryMonitor(std::uint8_t cells) : cells_(static_cast<float>(cells)) {}

  void add(const BatteryRaw& raw) {
    measured_ = true;
    take(raw.voltage);
    if (raw.current > 0.0F && raw.current < kMostCurrent) {
      current_ = current_ > 0.0F ? current_ + kNewShare * (raw.current - current_) : raw.current;
    }
  }

  /// The mean of what the ESCs see, while nothing measures the battery itself.
  void add(const EscRaw& raw) {
    if (measured_) return;
    float sum = 0.0F;
    float count = 0.0F;
    for (const float voltage : raw.voltage) {
      if (!isFinite(voltage)) continue;
      sum += voltage;
      count += 1.0F;
    }
    if (count > 0.0F) take(sum / count);
  }

  /// V; 0 while it is not known. A board that falls silent leaves the last one: a battery falls
  /// slowly.
  [[nodiscard]] float voltage() const { return voltage_; }

  /// A; 0 where it is not measured.
  [[nodiscard]] float current() const { return current_; }

  [[nodiscard]] std::uint8_t cells() const { return static_cast<std::uint8_t>(cells_); }

  /// Readings that no LiPo of this many cells can give.
  [[nodiscard]] std::uint32_t invalid() const { return invalid_; }

 private:
  // A cell holds 2.5 V when it is ruined and 4.35 V when it is a high-voltage one and full.
  static constexpr float kCellMin = 2.5F;        ///< V
  static constexpr float kCellMax = 4.5F;        ///< V
  static constexpr float kMostCurrent = 300.0F;  ///< A, ours: more than any shunt of this size
  static constexpr float kNewShare = 0.2F;       ///< of a new reading: 0.5 s at 10 Hz

  void take(float voltage) {
    if (!(voltage > kCellMin * cells_ && voltage < kCellMax * cells_)) {
      ++invalid_;
      return;
    }
    voltage_ = voltage_ > 0.0F ? voltage_ + kNewShare * (voltage - voltage_) : voltage;
  }

  float cells_;
  float voltage_ = 0.0F;
  float current_ = 0.0F;
  bool measured_ = false;
  std::uint32_t invalid_ = 0;
};

}  // namespace strix
