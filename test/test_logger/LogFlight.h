/// Feeds a logger as the flight software does, at full rate, and keeps count of what it gave.
#pragma once

#include <unity.h>

#include <map>
#include <string>
#include <utility>

#include "FakeCard.h"
#include "Logger.h"
#include "ULogReader.h"

namespace strix {

class LogFlight {
 public:
  using Key = std::pair<std::string, int>;  // topic, instance

  FakeCard card;
  Logger<FakeCard> logger{card};
  LogTime now = 0;                     ///< us
  std::map<Key, std::uint32_t> given;  ///< records that are to be in the log

  void begin(LogTime start) {
    card = FakeCard();
    given.clear();
    now = card.now = start;
    pass_ = 0;
    logger.begin(now, {"Quad5in", "test", "1.2.3", "cafe123", 77});
  }

  /// One loop pass of 1 ms, with everything that is due in it.
  void pass() {
    feed();
    logger.write(now);
    logger.flush(now);
    advance(1000);
  }

  /// A pass with nothing to log.
  void idlePass() {
    logger.write(now);
    logger.flush(now);
    advance(1000);
  }

  /// us
  void advance(LogTime step) {
    now += step;
    card.now = now;
  }

  /// Everything to the card, on the card's clock.
  bool finish(Micros budget) {
    return logger.forceWriteAndFlush(
        [this] {
          advance(10);
          return static_cast<Micros>(now);
        },
        budget);
  }

  /// The file as the last sync left it, which is a sound one.
  ULogFile readDurable() {
    ULogFile file(card.durableFile());
    TEST_ASSERT_EQUAL_STRING("", file.error.c_str());
    return file;
  }

  /// Every record given is in the file, in order, or counted as dropped by the very stream.
  void assertNothingIsMissing(const ULogFile& file) {
    const topic::LogStatus status = logger.status(now);
    for (const auto& [id, subscription] : file.subscriptions) {
      if (id >= kLogStreamCount || subscription.topic == "log_status") continue;
      const auto records = file.of(subscription.topic, subscription.instance);
      const std::uint32_t expected = given[{subscription.topic, subscription.instance}];
      TEST_ASSERT_EQUAL_UINT32_MESSAGE(expected - status.dropped_by_id[id], records.size(),
                                       subscription.topic.c_str());
      for (std::size_t i = 1; i < records.size(); ++i) {
        TEST_ASSERT_TRUE_MESSAGE(file.value<std::uint64_t>(records[i - 1], "timestamp") <
                                     file.value<std::uint64_t>(records[i], "timestamp"),
                                 subscription.topic.c_str());
      }
    }
  }

 private:
  template <class Topic, std::uint8_t Instance = 0>
  void give(std::uint32_t keepOneIn = 1) {
    Topic record;
    record.timestamp = now;
    logger.template log<Instance>(record);
    const Key key{std::string(kTopicName<Topic>), Instance};
    if (offered_[key]++ % keepOneIn == 0) ++given[key];
  }

  void feed() {
    if (pass_ == 0) offered_.clear();
    give<topic::SensorCombined>();
    give<topic::EstimatorAidSource, 0>(10);
    if (pass_ % 2 == 0) {  // logGNC, record by record
      give<topic::VehicleAttitude>();
      give<topic::VehicleAngularVelocity>();
      give<topic::VehicleLocalPosition>(5);
      give<topic::TrajectorySetpoint>(5);
      give<topic::VehicleAttitudeSetpoint>(5);
      give<topic::WrenchSetpoint>();
      give<topic::WrenchAchieved>();
      give<topic::ActuatorOutputs>();
      give<topic::ControlTick>();
    }
    if (pass_ % 10 == 0) {
      give<topic::SensorMag>();
      give<topic::EstimatorAidSource, 1>();
    }
    if (pass_ % 20 == 0) {
      give<topic::SensorBaro>();
      give<topic::EstimatorStd>();
      give<topic::EstimatorAidSource, 2>();
    }
    if (pass_ % 100 == 0) {
      give<topic::VehicleGpsPosition>();
      give<topic::EstimatorAidSource, 3>();
      give<topic::FlightState>();
    }
    if (pass_ % 1000 == 0) give<topic::ManualControlSwitches>();
    ++pass_;
  }

  std::uint32_t pass_ = 0;
  std::map<Key, std::uint32_t> offered_;
};

}  // namespace strix
