/// The head of a log file: what a reader needs to know before the first record.
#pragma once

#include <array>
#include <string_view>
#include <tuple>
#include <utility>

#include "LogStreams.h"
#include "ULogFormat.h"

namespace strix {

/// What the header says about the aircraft. Texts must outlive the logger; empty ones are left out.
struct LogIdentity {
  const char* vehicle = "";   ///< e.g. "Quad5in"
  const char* hardware = "";  ///< e.g. "Teensy41", "simulator"
  const char* version = "";   ///< of the software
  const char* git = "";       ///< commit it was built from, if known
  std::uint32_t bootId = 0;   ///< differs between two logs that may share a card
};

/// The header as kItems messages, made one at a time as the stream has room: no buffer holds it and
/// nothing waits for it. log_block stands after the table's topics.
class LogHeader {
 public:
  static constexpr std::size_t kInfos = 5;
  static constexpr std::size_t kTopics = kLogStreamCount + 1;
  static constexpr std::size_t kItems = 1 + kInfos + 2 * kTopics;

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
    const bool subscribing = item >= kTopics;  // all formats stand before the first subscription
    topic(subscribing ? item - kTopics : item, subscribing, append);
  }

  /// Bytes of the longest header.
  [[nodiscard]] static constexpr std::size_t maxSize() {
    return sizeof(FileStart) + kInfos * ulog::kMaxInfo + ulog::kMessageHeader + 40 +
           topicsSize(std::make_index_sequence<kLogStreamCount>{}) +
           topicSize<topic::LogBlock, 0>();
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

  template <class Append>
  static void topic(std::size_t row, bool subscribing, Append& append) {
    if (row == kLogBlockId) return message<topic::LogBlock, 0>(row, subscribing, append);
    topicOfRow(row, subscribing, append, std::make_index_sequence<kLogStreamCount>{});
  }

  template <class Append, std::size_t... Row>
  static void topicOfRow(std::size_t row, bool subscribing, Append& append,
                         std::index_sequence<Row...> /*rows*/) {
    ((row == Row ? message<RowTopic<Row>, Stream<Row>::kInstance>(row, subscribing, append)
                 : void()),
     ...);
  }

  template <class Topic, std::uint8_t Instance, class Append>
  static void message(std::size_t row, bool subscribing, Append& append) {
    if (subscribing) {
      append(ulog::subscription(static_cast<std::uint16_t>(row), Instance, kTopicName<Topic>));
    } else if (Instance == 0) {  // the instances of a topic share its format
      append(ulog::format(TopicFormat<Topic>::kText));
    }
  }

  template <class Topic, std::uint8_t Instance>
  [[nodiscard]] static constexpr std::size_t topicSize() {
    const std::size_t subscription = ulog::kMessageHeader + 3 + kTopicName<Topic>.size();
    if (Instance != 0) return subscription;
    return subscription + ulog::kMessageHeader + TopicFormat<Topic>::kText.size();
  }

  template <std::size_t Row>
  using Stream = std::tuple_element_t<Row, LogStreams>;
  template <std::size_t Row>
  using RowTopic = typename Stream<Row>::Topic;

  template <std::size_t... Row>
  [[nodiscard]] static constexpr std::size_t topicsSize(std::index_sequence<Row...> /*rows*/) {
    return (topicSize<RowTopic<Row>, Stream<Row>::kInstance>() + ...);
  }
};

}  // namespace strix
