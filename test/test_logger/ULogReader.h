/// A ULog reader written from the format's description alone (docs.px4.io): it includes nothing of
/// lib/Logger, so that a mistake there is not repeated here.
#pragma once

#include <unity.h>

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

struct ULogFile {
  struct Field {
    std::string type;
    std::size_t count = 0;
    std::size_t offset = 0;
  };
  struct Format {
    std::map<std::string, Field> fields;
    std::size_t size = 0;
  };
  struct Subscription {
    std::string topic;
    int instance = 0;
  };
  struct Record {
    std::uint16_t id;
    std::size_t messageStart;  // in the file
    std::size_t size;          // bytes of its data
  };
  struct Text {
    char level;
    std::uint64_t time;
    std::string text;
  };

  std::string error;  ///< empty: the file is sound
  std::uint64_t start = 0;
  std::map<std::string, std::string> infos;
  std::map<std::string, float> parameters;  ///< of the header
  std::map<std::string, Format> formats;
  std::map<std::uint16_t, Subscription> subscriptions;
  std::vector<Record> records;
  std::vector<Text> texts;

  explicit ULogFile(std::vector<std::uint8_t> bytes) : bytes_(std::move(bytes)) { read(bytes_); }

  [[nodiscard]] const std::uint8_t* data(const Record& record) const {
    return &bytes_[record.messageStart + kDataHead];
  }

  /// All records of one instance of a topic, in the file's order.
  std::vector<Record> of(const std::string& topic, int instance = 0) const {
    std::vector<Record> found;
    for (const Record& record : records) {
      const Subscription& s = subscriptions.at(record.id);
      if (s.topic == topic && s.instance == instance) found.push_back(record);
    }
    return found;
  }

  template <class T>
  T value(const Record& record, const std::string& field, std::size_t index = 0) const {
    T out{};
    const Field& f = formats.at(subscriptions.at(record.id).topic).fields.at(field);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(typeOf(T{}), f.type.c_str(), field.c_str());
    TEST_ASSERT_TRUE_MESSAGE(index < f.count, field.c_str());
    std::memcpy(&out, data(record) + f.offset + index * sizeof(T), sizeof(T));
    return out;
  }

 private:
  static constexpr std::size_t kDataHead = 5;  // size, type and id before a record's data

  static const char* typeOf(std::uint64_t) { return "uint64_t"; }
  static const char* typeOf(std::uint32_t) { return "uint32_t"; }
  static const char* typeOf(std::int32_t) { return "int32_t"; }
  static const char* typeOf(std::uint16_t) { return "uint16_t"; }
  static const char* typeOf(std::uint8_t) { return "uint8_t"; }
  static const char* typeOf(float) { return "float"; }

  static std::size_t sizeOf(const std::string& type) {
    if (type == "uint64_t") return 8;
    if (type == "uint32_t" || type == "int32_t" || type == "float") return 4;
    if (type == "uint16_t") return 2;
    if (type == "uint8_t") return 1;
    return 0;
  }

  void read(const std::vector<std::uint8_t>& b) {
    const std::uint8_t magic[] = {0x55, 0x4c, 0x6f, 0x67, 0x01, 0x12, 0x35};
    if (b.size() < 16 || std::memcmp(b.data(), magic, sizeof magic) != 0) {
      error = "no magic";
      return;
    }
    std::memcpy(&start, &b[8], sizeof start);
    bool inData = false;
    for (std::size_t at = 16; at < b.size() && error.empty();) {
      if (at + 3 > b.size()) return fail(at, "message head cut off");
      const std::size_t size = b[at] + 256U * b[at + 1];
      const char type = static_cast<char>(b[at + 2]);
      if (at + 3 + size > b.size()) return fail(at, "message cut off");
      const std::vector<std::uint8_t> body(&b[at] + 3, &b[at] + 3 + size);
      if (type == 'A' || type == 'L' || type == 'D') inData = true;
      if (at == 16 && (type != 'B' || size != 40))
        return fail(at, "flags are not the first message");
      if (inData && (type == 'F' || type == 'B')) return fail(at, "definition among the data");
      switch (type) {
        case 'B':
          break;
        case 'I':
          info(at, body);
          break;
        case 'P':
          parameter(at, body);
          break;
        case 'F':
          format(at, std::string(body.begin(), body.end()));
          break;
        case 'A':
          subscription(at, body);
          break;
        case 'D':
          record(at, body);
          break;
        case 'L':
          text(at, body);
          break;
        default:
          return fail(at, std::string("unknown type ") + type);
      }
      at += 3 + size;
    }
  }

  void fail(std::size_t at, const std::string& what) {
    if (error.empty()) error = what + " at byte " + std::to_string(at);
  }

  void info(std::size_t at, const std::vector<std::uint8_t>& body) {
    const std::string key(body.begin() + 1, body.begin() + 1 + body[0]);
    const std::string value(body.begin() + 1 + body[0], body.end());
    const std::size_t space = key.find(' ');
    if (key.substr(0, space) != "char[" + std::to_string(value.size()) + "]") {
      return fail(at, "type of info " + key);
    }
    infos[key.substr(space + 1)] = value;
  }

  void parameter(std::size_t at, const std::vector<std::uint8_t>& body) {
    const std::string key(body.begin() + 1, body.begin() + 1 + body[0]);
    if (key.substr(0, 6) != "float " || body.size() != 1U + body[0] + sizeof(float)) {
      return fail(at, "parameter " + key);
    }
    std::memcpy(&parameters[key.substr(6)], &body[1U + body[0]], sizeof(float));
  }

  void format(std::size_t at, const std::string& text) {
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos) return fail(at, "format without a name");
    if (formats.count(text.substr(0, colon)) != 0) return fail(at, "format given twice");
    Format& f = formats[text.substr(0, colon)];
    for (std::size_t p = colon + 1; p < text.size();) {
      const std::size_t space = text.find(' ', p);
      const std::size_t end = text.find(';', p);
      if (space > end || end == std::string::npos) return fail(at, "format " + text);
      std::string type = text.substr(p, space - p);
      std::size_t count = 1;
      const std::size_t bracket = type.find('[');
      if (bracket != std::string::npos) {
        count = std::stoul(type.substr(bracket + 1));
        type = type.substr(0, bracket);
      }
      if (sizeOf(type) == 0) return fail(at, "type " + type);
      f.fields[text.substr(space + 1, end - space - 1)] = {type, count, f.size};
      f.size += count * sizeOf(type);
      p = end + 1;
    }
  }

  void subscription(std::size_t at, const std::vector<std::uint8_t>& body) {
    const auto id = static_cast<std::uint16_t>(body[1] + 256U * body[2]);
    const std::string topic(body.begin() + 3, body.end());
    if (formats.count(topic) == 0) return fail(at, "no format of " + topic);
    if (subscriptions.count(id) != 0) return fail(at, "id given twice");
    subscriptions[id] = {topic, body[0]};
  }

  void record(std::size_t at, const std::vector<std::uint8_t>& body) {
    const auto id = static_cast<std::uint16_t>(body[0] + 256U * body[1]);
    if (subscriptions.count(id) == 0) return fail(at, "data of an unknown id");
    const std::string& topic = subscriptions[id].topic;
    if (body.size() - 2 != formats[topic].size) return fail(at, "size of " + topic);
    records.push_back({id, at, body.size() - 2});
  }

  void text(std::size_t at, const std::vector<std::uint8_t>& body) {
    if (body.size() < 9) return fail(at, "text without a time");
    Text t{static_cast<char>(body[0]), 0, std::string(body.begin() + 9, body.end())};
    std::memcpy(&t.time, &body[1], sizeof t.time);
    texts.push_back(t);
  }

  std::vector<std::uint8_t> bytes_;
};
