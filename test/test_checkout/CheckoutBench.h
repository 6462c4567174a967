/// The checkout on a fake board, with a terminal that a test types at and reads.
#pragma once

#include <unity.h>

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "Checkout.h"
#include "FakeBoard.h"
#include "FlightConfig.h"
#include "Random.h"

namespace strix {

constexpr CheckoutPins kTestPins{20, 18, 19, 17, 16, 7, 8, 30, 31, 32};

[[nodiscard]] inline FlightSoftwareConfig benchConfig(const Airframe& airframe = kFlown) {
  return flightConfig(airframe.vehicle, airframe.gains, kFirstFlight,
                      Parameters{}.declination * kDegToRad);
}

class CheckoutBench {
 public:
  explicit CheckoutBench(Micros start = 0, const FlightSoftwareConfig& config = benchConfig())
      : board(start), vehicle(config.vehicle), checkout(board, config, kTestPins) {
    board.magMounting = config.sensors.mag.sensorToBody.inverse();
    hold(Quaternion{});
  }

  FakeBoard board;
  const Vehicle& vehicle;
  Checkout<FakeBoard> checkout;
  std::string input;   ///< not read yet
  std::string output;  ///< without carriage returns
  bool terminalTakes = true;
  Micros stepTime = 300;  ///< us
  float noise = 1.0F;     ///< of what DESIGN.md, 5 states; 0: every reading is the same
  float highest = 0.0F;   ///< ESC command of all steps
  std::function<void(CheckoutBench&)> disturb;  ///< called before each step

  void begin() {
    checkout.begin();
    run(1.5F);
  }

  void hold(const Quaternion& attitude, const Vector3f& rate = Vector3f::Zero()) {
    board.hold(attitude, rate);
    truth_ = {board.imu.reading.accel, board.imu.reading.gyro, board.mag.reading.field};
    pressure_ = board.alt.reading.pressure;
  }

  void setPressure(float pressure) { pressure_ = pressure; }

  void step() {
    addNoise();
    if (disturb) disturb(*this);
    checkout.step([this] { return next(); },
                  [this](const char* text, std::size_t count) { return print(text, count); });
    for (const auto& write : board.escWrites) {
      for (const float command : write.commands) highest = std::max(highest, command);
    }
    commands = board.esc();
    board.escWrites.clear();
    board.advance(stepTime);
  }

  void run(float seconds) {
    const auto end = board.time() + static_cast<std::uint64_t>(seconds * 1e6F);
    while (board.time() < end) step();
  }

  /// Types a line; what is printed in the next `seconds`.
  std::string say(const std::string& line, float seconds = 0.01F) {
    output.clear();
    input += line + "\r";
    run(seconds);
    return output;
  }

  EscCommands commands{};  ///< of the last step

  [[nodiscard]] bool allOff() const {
    return std::all_of(commands.begin(), commands.end(),
                       [this](float command) { return command == vehicle.commandOff; });
  }

 private:
  int next() {
    if (input.empty()) return -1;
    const auto c = static_cast<unsigned char>(input.front());
    input.erase(0, 1);
    return c;
  }

  std::size_t print(const char* text, std::size_t count) {
    if (!terminalTakes) return 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (text[i] != '\r') output += text[i];
    }
    return count;
  }

  void addNoise() {
    constexpr float kSide = 1.732F;  // half the width of a uniform distribution with sigma 1
    const auto spread = [this](float sigma) { return random_.vector(kSide * sigma * noise); };
    board.imu.reading.accel = truth_[0] + spread(0.028F);
    board.imu.reading.gyro = truth_[1] + spread(0.0031F);
    board.mag.reading.field = truth_[2] + spread(0.3F);
    board.alt.reading.pressure = pressure_ + spread(2.0F).x();
  }

  Random random_{5};
  std::array<Vector3f, 3> truth_{};
  float pressure_ = 0.0F;
};

inline void assertHas(const std::string& text, const char* part) {
  if (text.find(part) == std::string::npos) {
    TEST_FAIL_MESSAGE(("no \"" + std::string(part) + "\" in:\n" + text).c_str());
  }
}
inline void assertHasNot(const std::string& text, const char* part) {
  if (text.find(part) != std::string::npos) {
    TEST_FAIL_MESSAGE(("\"" + std::string(part) + "\" in:\n" + text).c_str());
  }
}

inline std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char c : text) {
    if (c == '\n') {
      lines.emplace_back();
    } else {
      lines.back() += c;
    }
  }
  return lines;
}

}  // namespace strix
