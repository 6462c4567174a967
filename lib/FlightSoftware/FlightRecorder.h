/// What is logged at its own rate beside the inputs and each control tick, and what is said to the
/// pilot: the one place that both the log and the link to the ground read from.
#pragma once

#include <string_view>

#include "FlightLog.h"
#include "Logger.h"
#include "Pilot.h"
#include "SensorFaults.h"
#include "TextHistory.h"
#include "Time.h"

namespace strix {

template <class Log>
class FlightRecorder {
 public:
  explicit FlightRecorder(Log& logger) : logger_(logger) {}

  /// Each task in a control tick of its own.
  void start(Micros now) {
    Micros phase = 0;
    for (PeriodicTask* task :
         {&switches_, &sticks_, &std_, &status_, &control_, &faults_, &faultRecord_}) {
      phase += periodFromHz(Controller::kRateHz);
      task->start(now + phase);
    }
  }

  void say(ulog::LogLevel level, LogTime time, std::string_view text) {
    logger_.logText(level, time, text);
    texts_.add(static_cast<std::uint8_t>(static_cast<char>(level) - '0'), text);
  }

  /// How sure the filter is, and in words what has just gone wrong with it.
  template <int States>
  void logNavigation(Micros now, LogTime time, const Navigation<States>& navigation) {
    const ESKF<States>& filter = navigation.filter();
    if (std_.run(now)) logger_.log(toStdRecord(time, filter));
    if (!status_.run(now)) return;
    logger_.log(toBiasRecord(time, filter));
    logger_.log(toRecord(time, navigation));
    const NavigationHealth begun = navigation.health() & ~health_;
    health_ = navigation.health();
    for (const HealthText& text : kHealthTexts) {
      if ((begun & text.bit) != 0) say(ulog::LogLevel::Warning, time, text.said);
    }
    if (navigation.readmissions() == readmissions_) return;
    readmissions_ = navigation.readmissions();
    say(ulog::LogLevel::Warning, time,
        "estimator: takes in again a sensor it had rejected for long");
  }

  void logControl(Micros now, LogTime time, const Controller& controller, const Motors& motors) {
    if (control_.run(now)) logger_.log(toRecord(time, controller, motors));
  }

  /// The aircraft's own switches, and what the radio says.
  void logPilot(Micros now, LogTime time, const Pilot& pilot, PilotMode effective) {
    const PilotSwitches& s = pilot.switches();
    const bool changed = s.arm != logged_.arm || s.kill != logged_.kill || s.start != logged_.start;
    if (changed || switches_.due(now)) {
      switches_.postpone(now);
      logged_ = s;
      logger_.log(toRecord(time, s));
    }
    if (sticks_.run(now) && pilot.radioKnown()) {
      logger_.log(toRecord(time, pilot.input(), effective));
    }
  }

  /// Nothing is decided by these counts: a reading that does not come is seen as that.
  /// @param count  fills in SensorFaultCounts
  template <class Count>
  void logFaults(Micros now, LogTime time, Count&& count) {
    if (!faults_.run(now)) return;
    SensorFaultCounts counts;
    count(counts);
    const std::uint32_t before = watch_.flags();
    const std::uint32_t begun = watch_.update(now, counts);
    for (std::size_t i = 0; i < kSensorFaultCount; ++i) {
      if ((begun >> i & 1U) == 0) continue;
      say(ulog::LogLevel::Warning, time, kSensorFaultTexts[i]);
    }
    if (watch_.flags() == before && !faultRecord_.due(now)) return;
    faultRecord_.postpone(now);
    logger_.log(topic::SensorFaults{time, watch_.flags(), counts.all()});
  }

  /// Begins to save all of the log, and says within kSaveDeadline whether that was done.
  void save(Micros now) {
    logger_.save();
    saving_ = true;
    saveBegan_ = now;
  }
  void watchSaving(Micros now, LogTime time) {
    if (!saving_) return;
    if (logger_.saved()) {
      say(ulog::LogLevel::Info, time, "log saved");
    } else if (elapsed(now, saveBegan_) >= kSaveDeadline) {
      say(ulog::LogLevel::Error, time, "log not saved: the card does not take it");
    } else {
      return;
    }
    saving_ = false;
  }

  [[nodiscard]] const TextHistory& texts() const { return texts_; }

 private:
  static constexpr Micros kSaveDeadline = 6'000'000;  ///< 4 s of stall were measured, and 2 s more

  Log& logger_;
  TextHistory texts_;
  PeriodicTask switches_{periodFromHz(1)};
  PeriodicTask sticks_{periodFromHz(50)};
  PeriodicTask std_{periodFromHz(50)};
  PeriodicTask status_{periodFromHz(10)};
  PeriodicTask control_{periodFromHz(50)};
  PeriodicTask faults_{periodFromHz(10)};
  PeriodicTask faultRecord_{periodFromHz(1)};
  SensorFaultWatch watch_;
  NavigationHealth health_ = health::kNone;
  std::uint32_t readmissions_ = 0;
  PilotSwitches logged_;
  Micros saveBegan_ = 0;
  bool saving_ = false;
};

}  // namespace strix
