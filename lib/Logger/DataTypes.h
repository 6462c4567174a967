/// The log's records as plain structs, and what ULog needs to know of each: format text and size.
/// All of it is made from Topics.def, where a field is written once, with its unit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "Quaternion.h"
#include "Vector3f.h"

namespace strix {

/// Log time: us in 64 bits, from LogClock (Time.h). Its low 32 bits are the loop's Micros.
using LogTime = std::uint64_t;

/// One struct a topic, e.g. topic::VehicleAttitude{now, {w, x, y, z}}. Arrays are std::array.
namespace topic {

using std::int32_t;
using std::uint16_t;
using std::uint32_t;
using std::uint64_t;
using std::uint8_t;

// clang-format off
#define TOPIC(Type, name) struct Type {
#define FIELD(type, name) type name = {};
// NOLINTNEXTLINE(bugprone-macro-parentheses): a type in parentheses is no type
#define ARRAY(type, length, name) std::array<type, length> name = {};
#define END_TOPIC };
#include "Topics.def"
// clang-format on

}  // namespace topic

/// ULog format text of a topic, "vehicle_attitude:uint64_t timestamp;float[4] q;".
template <class Topic>
struct TopicFormat;

// clang-format off
#define TOPIC(Type, name) \
  template <> struct TopicFormat<topic::Type> { static constexpr std::string_view kText = #name ":"
#define FIELD(type, name) #type " " #name ";"
#define ARRAY(type, length, name) #type "[" #length "] " #name ";"
#define END_TOPIC ; };
#include "Topics.def"
// clang-format on

/// A field's place in its struct, bytes.
struct FieldPlace {
  std::size_t offset;
  std::size_t size;
};

template <class Topic>
struct TopicLayout;

// clang-format off
#define TOPIC(Type, name) \
  template <> struct TopicLayout<topic::Type> { \
    using Self = topic::Type; \
    static constexpr FieldPlace kFields[] = {
#define FIELD(type, name) {offsetof(Self, name), sizeof(Self::name)},
#define ARRAY(type, length, name) {offsetof(Self, name), sizeof(Self::name)},
#define END_TOPIC }; };
#include "Topics.def"
// clang-format on

/// The topic's name in the log, "vehicle_attitude".
template <class Topic>
constexpr std::string_view kTopicName =
    TopicFormat<Topic>::kText.substr(0, TopicFormat<Topic>::kText.find(':'));

/// Bytes of a topic in the log: the struct without the padding at its end.
template <class Topic>
constexpr std::size_t kPayloadSize = [] {
  std::size_t end = 0;
  for (const FieldPlace& field : TopicLayout<Topic>::kFields) end = field.offset + field.size;
  return end;
}();

/// True when the struct's bytes are ULog's bytes: no gap between fields, time stamp first.
template <class Topic>
constexpr bool kMatchesULog = [] {
  std::size_t end = 0;
  for (const FieldPlace& field : TopicLayout<Topic>::kFields) {
    if (field.offset != end) return false;
    end += field.size;
  }
  const std::string_view format = TopicFormat<Topic>::kText;
  return std::is_trivially_copyable_v<Topic> &&
         format.substr(kTopicName<Topic>.size() + 1, 19) == "uint64_t timestamp;";
}();

#define TOPIC(Type, name) static_assert(kMatchesULog<topic::Type>, "order the fields of " #name);
#define FIELD(type, name)
#define ARRAY(type, length, name)
#define END_TOPIC
#include "Topics.def"

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "ULog is little-endian");

/// Instances (ULog multi_id) of estimator_aid_source.
enum class AidSource : std::uint8_t { Tilt = 0, Magnetometer = 1, Altimeter = 2, Gps = 3 };

/// A switch as manual_control_switches has it.
[[nodiscard]] constexpr std::uint8_t switchPosition(bool on) {
  return on ? std::uint8_t{1} : std::uint8_t{3};
}

[[nodiscard]] inline std::array<float, 3> toArray(const Vector3f& v) {
  return {v.x(), v.y(), v.z()};
}
[[nodiscard]] inline std::array<float, 4> toArray(const Quaternion& q) {
  return {q.w, q.x, q.y, q.z};
}

/// What one control tick logs.
struct GncRecords {
  topic::VehicleAttitude attitude;
  topic::VehicleAngularVelocity rate;
  topic::VehicleLocalPosition position;
  topic::TrajectorySetpoint trajectorySetpoint;
  topic::VehicleAttitudeSetpoint attitudeSetpoint;
  topic::WrenchSetpoint wrenchSetpoint;
  topic::WrenchAchieved wrenchAchieved;
  topic::ActuatorOutputs outputs;
  topic::ControlTick tick;
};

}  // namespace strix
