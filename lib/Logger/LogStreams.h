/// What is logged, how often and how long it can wait for the card: one table, one ring a row.
#pragma once

#include <tuple>

#include "DataTypes.h"
#include "RingBuffer.h"
#include "ULogFormat.h"

namespace strix {

constexpr std::uint32_t kLogWriteRateHz = 20;  ///< the rings are emptied this often
constexpr std::uint32_t kLogSyncRateHz = 2;    ///< and made durable this often

/// One instance of one topic, with its ring of ULog data messages.
/// @tparam RateHz    how often it is offered
/// @tparam KeepOneIn thins it out: the first of every so many is logged
/// @tparam BufferMs  how long a stall of the card it survives
template <class TopicT, std::uint8_t Instance, std::size_t RateHz, std::size_t KeepOneIn,
          std::size_t BufferMs>
class LogStream {
 public:
  using Topic = TopicT;
  static constexpr std::uint8_t kInstance = Instance;
  static constexpr std::size_t kMessageSize = ulog::kDataHeader + kPayloadSize<Topic>;
  static constexpr std::size_t kLogged = RateHz * BufferMs / 1000 / KeepOneIn;
  static constexpr std::size_t kRecords = kLogged < 8 ? 8 : kLogged;  // room for a burst
  static constexpr std::size_t kBytesPerSecond = RateHz * kMessageSize / KeepOneIn;

  static_assert(kMessageSize <= ulog::kMaxMessage);
  static_assert(ulog::kMessageHeader + TopicFormat<Topic>::kText.size() <= ulog::kMaxMessage);

  void clear() {
    ring.clear();
    skip_ = 0;
  }

  /// @param id  the ULog msg_id of this stream
  void push(std::uint16_t id, const Topic& topic) {
    if (skip_ != 0) {
      --skip_;
      return;
    }
    skip_ = KeepOneIn - 1;
    constexpr std::uint16_t kSize = kMessageSize - ulog::kMessageHeader;
    std::uint8_t* const record = ring.add();
    if (record == nullptr) return;
    std::memcpy(record, &kSize, sizeof kSize);
    record[2] = 'D';
    std::memcpy(record + 3, &id, sizeof id);
    std::memcpy(record + ulog::kDataHeader, &topic, kPayloadSize<Topic>);
  }

  RingBuffer<kMessageSize, kRecords> ring;

 private:
  std::size_t skip_ = 0;
};

// Every input of the flight code at its full rate: replay needs all of them. A card that stalls for
// 2 s loses nothing. What replay can recompute is thinned: 100 Hz shows it as well.
// clang-format off
using LogStreams = std::tuple<
    //        topic                   instance  rate Hz  keep 1 in  buffer ms
    LogStream<topic::SensorCombined,         0,    1125,         1,      2000>,
    LogStream<topic::SensorMag,              0,     100,         1,      2000>,
    LogStream<topic::SensorBaro,             0,      50,         1,      2000>,
    LogStream<topic::VehicleGpsPosition,     0,      10,         1,      2000>,
    LogStream<topic::BatteryStatus,          0,      10,         1,      2000>,
    LogStream<topic::EscStatus,              0,       5,         1,      2000>,
    LogStream<topic::ManualControlSwitches,  0,       1,         1,     16000>,  // and on change
    LogStream<topic::InputRc,                0,     143,         1,      2000>,  // iBUS: each 7 ms
    LogStream<topic::VehicleCommand,         0,      20,         1,      2000>,
    LogStream<topic::FlightConfig,           0,       1,         1,      8000>,  // once
    LogStream<topic::MissionLeg,             0,       1,         1,     32000>,  // 32 at most, once
    LogStream<topic::VehicleAttitude,        0,     500,         1,      2000>,
    LogStream<topic::VehicleAngularVelocity, 0,     500,         1,      2000>,
    LogStream<topic::VehicleLocalPosition,   0,     500,         5,      2000>,
    LogStream<topic::EstimatorStd,           0,      50,         1,      2000>,
    LogStream<topic::EstimatorSensorBias,    0,      10,         1,      2000>,
    LogStream<topic::EstimatorHealth,        0,      10,         1,      2000>,
    LogStream<topic::EstimatorAidSource,     0,    1125,        10,      2000>,  // tilt
    LogStream<topic::EstimatorAidSource,     1,     100,         1,      2000>,  // magnetometer
    LogStream<topic::EstimatorAidSource,     2,      50,         1,      2000>,  // altimeter
    LogStream<topic::EstimatorAidSource,     3,      10,         1,      2000>,  // GPS
    LogStream<topic::EstimatorStart,         0,       1,         1,      8000>,  // once
    LogStream<topic::TrajectorySetpoint,     0,     500,         5,      2000>,
    LogStream<topic::VehicleAttitudeSetpoint,0,     500,         5,      2000>,
    LogStream<topic::WrenchSetpoint,         0,     500,         1,      2000>,
    LogStream<topic::WrenchAchieved,         0,     500,         1,      2000>,
    LogStream<topic::ControllerStatus,       0,      50,         1,      2000>,
    LogStream<topic::ActuatorOutputs,        0,     500,         1,      2000>,
    LogStream<topic::FlightState,            0,      10,         1,      4000>,  // and on change
    LogStream<topic::ManualControlSetpoint,  0,      50,         1,      2000>,
    LogStream<topic::ControlTick,            0,     500,         1,      2000>,
    LogStream<topic::SensorFaults,           0,       1,         1,      8000>,  // and on change
    LogStream<topic::LogStatus,              0,       2,         1,      4000>>;
// clang-format on

constexpr std::size_t kLogStreamCount = std::tuple_size_v<LogStreams>;
static_assert(std::tuple_size_v<decltype(topic::LogStatus::dropped_by_id)> == kLogStreamCount);
static_assert(sizeof(LogStreams) < std::size_t{400} * 1024,
              "the rings share the Teensy's 512 KB RAM2");

/// log_block goes into the stream without a ring, under the id after the last stream's.
constexpr auto kLogBlockId = static_cast<std::uint16_t>(kLogStreamCount);

/// The ULog msg_id of a topic's instance: its row in the table.
template <class Topic, std::uint8_t Instance, std::size_t Row = 0>
constexpr std::size_t logStreamId() {
  static_assert(Row < kLogStreamCount, "no such row in LogStreams");
  using Stream = std::tuple_element_t<Row, LogStreams>;
  if constexpr (std::is_same_v<typename Stream::Topic, Topic> && Stream::kInstance == Instance) {
    return Row;
  } else {
    return logStreamId<Topic, Instance, Row + 1>();
  }
}

}  // namespace strix
