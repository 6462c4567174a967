/// The console before a flight that only takes note, with a terminal that a test types at and
/// reads.
#pragma once

#include <unity.h>

#include <string>
#include <vector>

#include "Console.h"

namespace strix {

/// Says yes, or `refusal`, and keeps what it was asked.
struct FakeFlight {
  struct Store {
    SaveState now = SaveState::Idle;
    [[nodiscard]] SaveState state() const { return now; }
  };
  struct MotorAsked {
    int motor;
    float throttle;
    Micros duration;
  };

  FlightStatus now;
  Parameters values;
  TextHistory history;
  Store saving;
  const char* refusal = nullptr;
  std::vector<VehicleCommand> asked;
  std::vector<MotorAsked> motors;

  [[nodiscard]] FlightStatus status() const { return now; }
  [[nodiscard]] const Parameters& parameters() const { return values; }
  [[nodiscard]] const TextHistory& texts() const { return history; }
  [[nodiscard]] const Store& store() const { return saving; }
  CommandRefusal command(const VehicleCommand& command) {
    asked.push_back(command);
    if (command.kind != CommandKind::SetParameter) return refusal;
    const char* wrong = checkParameter(command.index, command.values[0], now.motorsOn);
    if (wrong == nullptr) setParameter(values, command.index, command.values[0]);
    return wrong;
  }
  const char* saveParameters() {
    if (refusal == nullptr) saving.now = SaveState::Saving;
    return refusal;
  }
  const char* testMotor(int motor, float throttle, Micros duration) {
    motors.push_back({motor, throttle, duration});
    return refusal;
  }
};

struct FakePort {
  std::string input;   ///< not read yet
  std::string output;  ///< as it was written
  std::size_t free = 1'000'000;
  std::size_t mostAtOnce = 0;

  std::size_t read(std::uint8_t* out, std::size_t most) {
    const std::size_t size = std::min(most, input.size());
    for (std::size_t i = 0; i < size; ++i) out[i] = static_cast<std::uint8_t>(input[i]);
    input.erase(0, size);
    return size;
  }
  [[nodiscard]] std::size_t room() const { return free; }
  void write(const std::uint8_t* data, std::size_t size) {
    TEST_ASSERT_LESS_OR_EQUAL_size_t(free, size);
    output.append(reinterpret_cast<const char*>(data), size);
    mostAtOnce = std::max(mostAtOnce, size);
  }
};

/// Logs by number, some bytes each that are like no other's.
struct FakeLogs {
  std::vector<std::pair<std::uint32_t, std::string>> logs;
  bool silent = false;

  std::size_t logCount() { return logs.size(); }
  bool logInfo(std::size_t i, std::uint32_t& number, std::uint32_t& bytes) {
    number = logs.at(i).first;
    bytes = static_cast<std::uint32_t>(logs.at(i).second.size());
    return true;
  }
  std::size_t readLog(std::uint32_t number, std::uint32_t offset, std::uint8_t* out,
                      std::size_t most) {
    if (silent) return 0;
    for (const auto& [itsNumber, bytes] : logs) {
      if (itsNumber != number) continue;
      const std::size_t size = std::min<std::size_t>(most, bytes.size() - offset);
      for (std::size_t i = 0; i < size; ++i) {
        out[i] = static_cast<std::uint8_t>(bytes[offset + i]);
      }
      return size;
    }
    return 0;
  }
};

class ConsoleBench {
 public:
  FakeFlight flight;
  FakePort port;
  FakeLogs card;
  Console<FakeFlight, FakePort, FakeLogs> console{flight, port, card};
  Micros now = 0xFFFFFFFFU - 3'000'000U;  ///< so that the clock wraps on the way
  Micros pass = 1000;                     ///< us

  void run(float seconds) {
    const auto end = static_cast<std::uint64_t>(seconds * 1e6F);
    for (std::uint64_t gone = 0; gone < end; gone += pass) {
      console.step(now);
      now += pass;
    }
  }

  /// Types; what is printed in the next `seconds`, without carriage returns.
  std::string type(const std::string& keys, float seconds = 0.1F) {
    port.output.clear();
    port.input += keys;
    run(seconds);
    std::string text;
    for (const char c : port.output) {
      if (c != '\r') text += c;
    }
    return text;
  }

  /// As a script does: the lines of the answer.
  std::vector<std::string> say(const std::string& line, float seconds = 0.1F) {
    if (!quiet_) {
      quiet_ = true;
      type("echo off\r");
    }
    std::vector<std::string> lines(1);
    for (const char c : type(line + "\n", seconds)) {
      if (c == '\n') {
        lines.emplace_back();
      } else {
        lines.back() += c;
      }
    }
    TEST_ASSERT_EQUAL_STRING("", lines.back().c_str());  // an answer is whole lines
    lines.pop_back();
    return lines;
  }

  /// The last line of the answer, "" while there is none.
  std::string outcome(const std::string& line, float seconds = 0.1F) {
    const std::vector<std::string> lines = say(line, seconds);
    return lines.empty() ? "" : lines.back();
  }

  void setMotors(bool on) { flight.now.motorsOn = on; }

 private:
  bool quiet_ = false;
};

inline void assertHas(const std::string& text, const char* part) {
  if (text.find(part) == std::string::npos) {
    TEST_FAIL_MESSAGE(("no \"" + std::string(part) + "\" in:\n" + text).c_str());
  }
}
inline void assertIs(const char* expected, const std::string& found) {
  TEST_ASSERT_EQUAL_STRING(expected, found.c_str());
}
[[nodiscard]] inline std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace strix
