/// Reads the topics of a flight log back into the structs they were written from.
#pragma once

#include <DataTypes.h>
#include <LogStreams.h>
#include <ULogFormat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <deque>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

namespace strix {

/// The records of some topics, instance 0, each in the order of the file. A log whose definition of
/// a topic is not this software's is refused: its records would be read wrongly.
template <class... Topics>
class LogReader {
 public:
  /// Throws std::invalid_argument with a sentence that names the file.
  explicit LogReader(const std::string& path) : path_(path) {
    const std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "rb"));
    if (file == nullptr) refuse("a file that can be read", std::strerror(errno));
    std::array<std::uint8_t, 16> start{};
    if (std::fread(start.data(), 1, start.size(), file.get()) != start.size() ||
        !std::equal(ulog::kMagic.begin(), ulog::kMagic.end() - 1, start.begin())) {
      refuse("a ULog file", "another one");
    }
    std::array<std::uint8_t, ulog::kMessageHeader> header{};
    std::vector<std::uint8_t> body;
    while (std::fread(header.data(), 1, header.size(), file.get()) == header.size()) {
      std::uint16_t size = 0;
      std::memcpy(&size, header.data(), sizeof size);
      if (size == 0) break;  // zeros behind the last message of a card's file
      body.resize(size);
      if (std::fread(body.data(), 1, size, file.get()) != size) break;  // cut
      take(static_cast<char>(header[2]), body);
    }
  }

  template <class Topic>
  [[nodiscard]] const std::deque<Topic>& records() const {
    return std::get<std::deque<Topic>>(records_);
  }
  /// An info of the header, such as "vehicle"; empty if there is none.
  [[nodiscard]] std::string info(const std::string& key) const {
    const auto found = infos_.find(key);
    return found == infos_.end() ? std::string() : found->second;
  }
  /// A parameter of the header; nullptr if there is none.
  [[nodiscard]] const float* parameter(const std::string& name) const {
    const auto found = parameters_.find(name);
    return found == parameters_.end() ? nullptr : &found->second;
  }
  [[nodiscard]] const std::string& path() const { return path_; }

  [[noreturn]] void refuse(const std::string& expected, const std::string& found) const {
    throw std::invalid_argument(path_ + ": expected " + expected + ", found " + found);
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  using Body = std::vector<std::uint8_t>;

  void take(char type, const Body& body) {
    if (type == 'D') return takeData(body);
    const std::string text(body.begin(), body.end());
    if (type == 'F') {
      formats_[text.substr(0, text.find(':'))] = text;
    } else if (type == 'I' && body[0] < body.size()) {  // key length, "char[4] key", value
      const std::string key = text.substr(1, body[0]);
      infos_[key.substr(key.find(' ') + 1)] = text.substr(1U + body[0]);
    } else if (type == 'P' && body[0] + 1U + sizeof(float) == body.size()) {  // as 'I', a float
      const std::string key = text.substr(1, body[0]);
      std::memcpy(&parameters_[key.substr(key.find(' ') + 1)], &body[body[0] + 1U], sizeof(float));
    } else if (type == 'A' && body.size() > 3) {  // instance, id, name
      std::uint16_t id = 0;
      std::memcpy(&id, &body[1], sizeof id);
      if (body[0] == 0) (subscribe<Topics>(id, text.substr(3)), ...);
    }
  }

  template <class Topic>
  void subscribe(std::uint16_t id, const std::string& name) {
    if (name != kTopicName<Topic> || id >= takers_.size()) return;
    if (formats_[name] != TopicFormat<Topic>::kText) {
      refuse("the topic " + name + " as this software writes it (" +
                 std::string(TopicFormat<Topic>::kText) + ")",
             "one of another version (" + formats_[name] + ")");
    }
    takers_[id] = [](LogReader& reader, const Body& body) {
      if (body.size() != 2 + kPayloadSize<Topic>) return;
      Topic record{};
      std::memcpy(static_cast<void*>(&record), &body[2], kPayloadSize<Topic>);
      std::get<std::deque<Topic>>(reader.records_).push_back(record);
    };
  }

  void takeData(const Body& body) {
    if (body.size() < 2) return;
    std::uint16_t id = 0;
    std::memcpy(&id, body.data(), sizeof id);
    if (id < takers_.size() && takers_[id] != nullptr) takers_[id](*this, body);
  }

  using Taker = void (*)(LogReader&, const Body&);

  std::string path_;
  std::tuple<std::deque<Topics>...> records_;  // no spare room: read on a 16 MB machine too
  std::map<std::string, std::string> formats_;
  std::map<std::string, std::string> infos_;
  std::map<std::string, float> parameters_;
  std::array<Taker, kLogStreamCount + 16> takers_{};
};

/// The first field in which two records differ, bit by bit, as "topic.field"; empty if none does.
template <class Topic>
[[nodiscard]] std::string firstDifference(const Topic& logged, const Topic& replayed) {
  const auto* a = reinterpret_cast<const std::uint8_t*>(&logged);
  const auto* b = reinterpret_cast<const std::uint8_t*>(&replayed);
  std::string fields(TopicFormat<Topic>::kText);
  fields.erase(0, fields.find(':') + 1);
  for (const FieldPlace& place : TopicLayout<Topic>::kFields) {
    const std::string field = fields.substr(0, fields.find(';'));
    fields.erase(0, field.size() + 1);
    if (std::memcmp(a + place.offset, b + place.offset, place.size) != 0) {
      return std::string(kTopicName<Topic>) + "." + field.substr(field.find(' ') + 1);
    }
  }
  return {};
}

}  // namespace strix
