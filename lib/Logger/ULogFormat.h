/// ULog's framing (docs.px4.io, "ULog File Format"): what goes between the topics' bytes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

namespace strix::ulog {

/// File start: magic, version 1, time of the log's start.
constexpr std::array<std::uint8_t, 8> kMagic = {'U', 'L', 'o', 'g', 0x01, 0x12, 0x35, 1};

/// Every message: uint16 size of what follows these three bytes, uint8 type.
constexpr std::size_t kMessageHeader = 3;

/// A data message adds uint16 msg_id before the topic's bytes.
constexpr std::size_t kDataHeader = kMessageHeader + 2;

/// No message is longer, so one always fits behind an unfinished sector.
constexpr std::size_t kMaxMessage = 256;

/// Severity of a text, as in syslog.
enum class LogLevel : char { Error = '3', Warning = '4', Notice = '5', Info = '6' };

/// One message, built field by field. What would exceed kMaxMessage is left out.
class Message {
 public:
  // Bytes behind size() are never read: they need not be cleared.
  explicit Message(char type) {  // NOLINT(cppcoreguidelines-pro-type-member-init)
    add(std::uint16_t{0});
    add(type);
  }

  template <class T>
  Message& add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T> && !std::is_pointer_v<T>);
    return addBytes(&value, sizeof value);
  }
  Message& addText(std::string_view text) { return addBytes(text.data(), text.size()); }

  [[nodiscard]] const std::uint8_t* data() const { return bytes_.data(); }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  Message& addBytes(const void* data, std::size_t size) {
    size = std::min(size, bytes_.size() - size_);
    std::memcpy(&bytes_[size_], data, size);
    size_ += size;
    if (size_ >= kMessageHeader) {
      const auto length = static_cast<std::uint16_t>(size_ - kMessageHeader);
      std::memcpy(bytes_.data(), &length, sizeof length);
    }
    return *this;
  }

  std::array<std::uint8_t, kMaxMessage> bytes_;
  std::size_t size_ = 0;
};

/// 'B': no optional feature of the format is used, nothing was appended.
[[nodiscard]] inline Message flagBits() { return Message('B').add(std::array<std::uint8_t, 40>{}); }

/// 'F': the fields of a topic.
[[nodiscard]] inline Message format(std::string_view text) { return Message('F').addText(text); }

/// 'A': gives one instance of a topic the id that its data messages carry.
[[nodiscard]] inline Message subscription(std::uint16_t id, std::uint8_t instance,
                                          std::string_view topicName) {
  return Message('A').add(instance).add(id).addText(topicName);
}

/// An info's key and value are cut at these lengths; kMaxInfo is the longest message then.
constexpr std::size_t kMaxInfoKey = 12;
constexpr std::size_t kMaxInfoValue = 40;  // a git commit
constexpr std::size_t kMaxInfo = kMessageHeader + 1 + 9 + kMaxInfoKey + kMaxInfoValue;

/// 'I': a text about the whole log. Its key carries the value's type: "char[5] sys_name".
[[nodiscard]] inline Message info(std::string_view key, std::string_view value) {
  key = key.substr(0, kMaxInfoKey);
  value = value.substr(0, kMaxInfoValue);
  const std::array<char, 2> digits = {static_cast<char>('0' + value.size() / 10),
                                      static_cast<char>('0' + value.size() % 10)};
  const std::string_view length(digits.data(), digits.size());
  const std::string_view shown = length.substr(length[0] == '0' ? 1 : 0);
  const auto keySize = static_cast<std::uint8_t>(5 + shown.size() + 2 + key.size());
  Message message('I');
  message.add(keySize).addText("char[").addText(shown).addText("] ").addText(key);
  return message.addText(value);
}

/// A parameter's name is cut at this length; kMaxParameter is the longest message then.
constexpr std::size_t kMaxParameterName = 16;
constexpr std::size_t kMaxParameter =
    kMessageHeader + 1 + std::string_view("float ").size() + kMaxParameterName + sizeof(float);

/// 'P': a value that was set before the log began.
[[nodiscard]] inline Message parameter(std::string_view name, float value) {
  constexpr std::string_view kType = "float ";
  name = name.substr(0, kMaxParameterName);
  Message message('P');
  message.add(static_cast<std::uint8_t>(kType.size() + name.size())).addText(kType).addText(name);
  return message.add(value);
}

}  // namespace strix::ulog
