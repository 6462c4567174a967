/// The head of a log file: what a reader needs to know before the first record.
#pragma once

#include <array>
#include <string_view>
#include <tuple>
#include <utility>

#include "LogStreams.h"
#include "ULogFormat.h"

namespace strix {

/// A setting, as the header has it.
struct LogParameter {
  std::string_view name;
  float value = 0.0F;
};

/// Settings, kept by whoever begins the log.
struct LogParameters {
  std::size_t count = 0;  ///< kMost at most
  const LogParameter* first = nullptr;
  static constexpr std::size_t kMost = 64;
};

/// What the header says about the aircraft. Texts must outlive the logger; empty ones are left out.
struct LogIdentity {
  const char* vehicle = "";   ///< e.g. "Quad5in"
  const char* hardware = "";  ///< e.g. "Teensy41", "simulator"
  const char* version = "";   ///< of the software
  const char* git = "";       ///< commit it was built from, if known
  std::uint32_t bootId = 0;   ///< differs between two logs that may share a card
  LogParameters parameters{};
};

/// What the header says of a stream; its ULog msg_id is its place.
struct TopicRow {
  std::string_view name;
  std::string_view format;
  std::uint8_t instance;
};

template <class... Streams>
[[nodiscard]] constexpr auto topicRows(const std::tuple<Streams...>* /*types*/) {
  return std::array<TopicRow, sizeof...(Streams) + 1>{
      {{kTopicName<typename Streams::Topic>, TopicFormat<typename Streams::Topic>::kText,
        Streams::kInstance}...,
       {kTopicName<topic::LogBlock>, TopicFormat<topic::LogBlock>::kText, 0}}};
}

/// The table's streams, then log_block.
constexpr auto kTopicRows = topicRows(static_cast<const LogStreams*>(nullptr));
static_assert(kTopicRows.size() == kLogBlockId + std::size_t{1});

/// The header as kItems messages, made one at a time as the stream has room: no buffer holds it and
/// nothing waits for it.
class LogHeader {
 public:
  static constexpr std::size_t kInfos = 5;
  static constexpr std::size_t kItems = 1 + kInfos + LogParameters::kMost + 2 * kTopicRows.size();

  /// The file's first bytes: magic and the log's start, us.
  using FileStart = std::array<std::uint8_t, 16>;
  [[nodiscard]] static FileStart fileStart(LogTime begun) {
    FileStart bytes{};
    std::memcpy(bytes.data(), ulog::kMagic.data(), ulog::kMagic.size());
    std::memcpy(&bytes[ulog::kMagic.size()], &begun, sizeof begun);
    return bytes;
  }

  /// Calls `append` with message number `item`, or not at all if there is nothing to say.
  template <class Append>
  static void item(std::size_t item, const LogIdentity& identity, Append&& append) {
    if (item == 0) return append(ulog::flagBits());
    item -= 1;
    if (item < kInfos) return info(item, identity, append);
    item -= kInfos;
    if (item < LogParameters::kMost) {
      const LogParameters& parameters = identity.parameters;
      if (item >= parameters.count) return;
      const LogParameter& parameter = parameters.first[item];
      return append(ulog::parameter(parameter.name, parameter.value));
    }
    item -= LogParameters::kMost;
    if (item < kTopicRows.size()) {  // all formats stand before the first subscription
      const TopicRow& row = kTopicRows[item];
      if (row.instance == 0) append(ulog::format(row.format));  // instances share it
      return;
    }
    item -= kTopicRows.size();
    const TopicRow& row = kTopicRows[item];
    append(ulog::subscription(static_cast<std::uint16_t>(item), row.instance, row.name));
  }

  /// Bytes of the longest header.
  [[nodiscard]] static constexpr std::size_t maxSize() {
    constexpr std::size_t kSystem =
        ulog::kMessageHeader + 1 + std::string_view("char[5] sys_nameStrix").size();
    std::size_t size = sizeof(FileStart) + ulog::kMessageHeader + 40 + kSystem +
                       (kInfos - 1) * ulog::kMaxInfo + LogParameters::kMost * ulog::kMaxParameter;
    for (const TopicRow& row : kTopicRows) {
      if (row.instance == 0) size += ulog::kMessageHeader + row.format.size();
      size += ulog::kMessageHeader + 3 + row.name.size();
    }
    return size;
  }

 private:
  template <class Append>
  static void info(std::size_t which, const LogIdentity& identity, Append& append) {
    const std::array<std::pair<std::string_view, std::string_view>, kInfos> infos = {{
        {"sys_name", "Strix"},
        {"vehicle", identity.vehicle},
        {"ver_hw", identity.hardware},
        {"ver_sw", identity.version},
        {"ver_sw_git", identity.git},
    }};
    if (!infos[which].second.empty()) append(ulog::info(infos[which].first, infos[which].second));
  }
};

}  // namespace strix
