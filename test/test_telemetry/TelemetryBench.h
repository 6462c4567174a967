/// The link before a flight that takes note of what it is asked, with a ground station that a test
/// speaks for.
#pragma once

#include <unity.h>

#include <algorithm>
#include <string>
#include <vector>

#include "GroundLink.h"

namespace strix {

/// Says yes, or `refusal`; keeps parameters and missions as the flight software does.
struct FakeFlight {
  FlightStatus now;
  Parameters values;
  TextHistory history;
  Mission flown;
  SigningKey key{};
  const char* refusal = nullptr;
  const char* legRefusal = nullptr;
  std::vector<VehicleCommand> asked;
  int saved = 0;

  [[nodiscard]] FlightStatus status() const { return now; }
  [[nodiscard]] const Parameters& parameters() const { return values; }
  [[nodiscard]] const TextHistory& texts() const { return history; }
  [[nodiscard]] const Mission& mission() const { return flown; }
  [[nodiscard]] const SigningKey& signingKey() const { return key; }
  void setSigningKey(const SigningKey& newKey) { key = newKey; }
  const char* saveParameters() {
    ++saved;
    return refusal;
  }
  CommandRefusal command(const VehicleCommand& c) {
    asked.push_back(c);
    if (c.kind == CommandKind::SetParameter) {
      const char* wrong = checkParameter(c.index, c.values[0], now.motorsOn);
      if (wrong == nullptr) setParameter(values, c.index, c.values[0]);
      return wrong;
    }
    if (refusal != nullptr) return refusal;
    if (c.kind == CommandKind::MissionClear) upload = {};
    if (c.kind == CommandKind::MissionLeg) {
      if (legRefusal != nullptr) return legRefusal;
      TEST_ASSERT_EQUAL(upload.legCount, c.index);
      Leg& leg = upload.legs[upload.legCount++];
      leg = {c.values[0], c.values[1], c.values[2], c.values[3], c.time};
      leg.radius = c.values[4];
      leg.speed = c.values[5];
    }
    if (c.kind == CommandKind::MissionDone) {
      TEST_ASSERT_EQUAL(upload.legCount, c.index);
      flown = upload;
      flown.takeoffHeight = c.values[0];
      flown.takeoffHoldTime = c.time;
      flown.end = static_cast<MissionEnd>(c.detail);
    }
    return nullptr;
  }

  Mission upload;

  /// How often it was asked for that.
  [[nodiscard]] std::size_t count(CommandKind kind) const {
    return static_cast<std::size_t>(std::count_if(
        asked.begin(), asked.end(), [kind](const VehicleCommand& c) { return c.kind == kind; }));
  }
};

struct FakePort {
  struct Sent {
    Micros at;
    std::size_t size;
  };
  std::vector<std::uint8_t> input;
  std::size_t taken = 0;
  std::vector<std::uint8_t> output;
  std::vector<Sent> sent;
  std::size_t free = 10'000;
  Micros now = 0;
  std::size_t readsAStep = 0;

  std::size_t read(std::uint8_t* out, std::size_t most) {
    std::size_t size = 0;
    while (size < most && taken < input.size()) out[size++] = input[taken++];
    readsAStep += size;
    return size;
  }
  [[nodiscard]] std::size_t room() const { return free; }
  void write(const std::uint8_t* data, std::size_t size) {
    TEST_ASSERT_LESS_OR_EQUAL_size_t(free, size);
    output.insert(output.end(), data, data + size);
    sent.push_back({now, size});
  }
};

constexpr std::uint8_t kStation = 255;  ///< the ground station's system id, as QGroundControl's

class TelemetryBench {
 public:
  using Link = GroundLink<FakeFlight, FakePort>;

  FakeFlight flight;
  FakePort port;
  Link link;
  Micros now = 0xFFFFFFFFU - 3'000'000U;  ///< so that the clock wraps on the way
  Micros pass = 1000;                     ///< us
  Micros start = now;
  std::uint8_t station = kStation;
  std::vector<mavlink_message_t> heard;  ///< by the ground station

  explicit TelemetryBench(PortTrust trust = PortTrust::Radio) : link(flight, port, trust) {
    flight.now.originLatitude = 593'500'000;
    flight.now.originLongitude = 180'600'000;
    flight.now.originAltitude = 30'000;
    flight.now.positionValid = true;
  }

  void run(float seconds) {
    const auto end = static_cast<std::uint64_t>(seconds * 1e6F);
    for (std::uint64_t gone = 0; gone < end; gone += pass) {
      port.now = now;
      port.readsAStep = 0;
      const std::size_t commands = flight.asked.size();
      const std::size_t frames = port.sent.size();
      link.step(now);
      // What a step may cost at most, whatever comes in.
      TEST_ASSERT_LESS_OR_EQUAL_size_t(Link::kBytesAStep, port.readsAStep);
      TEST_ASSERT_LESS_OR_EQUAL_size_t(1, port.sent.size() - frames);
      TEST_ASSERT_LESS_OR_EQUAL_size_t(2, flight.asked.size() - commands);
      now += pass;
      flight.now.time += pass;
    }
    listen();
  }

  template <class Payload>
  using Encode = std::uint16_t (*)(std::uint8_t, std::uint8_t, mavlink_status_t*,
                                   mavlink_message_t*, const Payload*);

  /// One message of the ground station's, as bytes.
  template <class Payload>
  std::vector<std::uint8_t> frame(Encode<Payload> encode, const Payload& payload) {
    mavlink_message_t message{};
    encode(station, MAV_COMP_ID_MISSIONPLANNER, &status_, &message, &payload);
    std::vector<std::uint8_t> bytes(MAVLINK_MAX_PACKET_LEN);
    bytes.resize(mavlink_msg_to_send_buffer(bytes.data(), &message));
    return bytes;
  }
  void put(const std::vector<std::uint8_t>& bytes) {
    port.input.insert(port.input.end(), bytes.begin(), bytes.end());
  }
  template <class Payload>
  void say(Encode<Payload> encode, const Payload& payload) {
    put(frame(encode, payload));
  }

  static mavlink_command_long_t longCommand(std::uint16_t command, std::array<float, 7> p = {},
                                            std::uint8_t system = 1,
                                            std::uint8_t component = kAutopilot) {
    return {p[0], p[1], p[2], p[3], p[4], p[5], p[6], command, system, component, 0};
  }

  /// Sends the command; its answer's MAV_RESULT, or -1 when none comes.
  int command(std::uint16_t command, std::array<float, 7> p = {}) {
    heard.clear();
    say(mavlink_msg_command_long_encode_status, longCommand(command, p));
    run(0.3F);  // at 2 kB/s and behind what else is sent
    for (const auto& ack : all<mavlink_command_ack_t>(MAVLINK_MSG_ID_COMMAND_ACK)) {
      TEST_ASSERT_EQUAL(kStation, ack.target_system);
      if (ack.command == command) return ack.result;
    }
    return -1;
  }

  /// Every message of that kind heard since `heard` was cleared.
  template <class Payload>
  std::vector<Payload> all(std::uint32_t id) const {
    std::vector<Payload> found;
    for (const mavlink_message_t& message : heard) {
      if (message.msgid == id) found.push_back(decode<Payload>(message));
    }
    return found;
  }
  /// The last of them.
  template <class Payload>
  Payload last(std::uint32_t id) const {
    const std::vector<Payload> found = all<Payload>(id);
    if (found.empty()) TEST_FAIL_MESSAGE(("none heard of message " + std::to_string(id)).c_str());
    return found.back();
  }
  [[nodiscard]] std::size_t count(std::uint32_t id) const {
    return all<mavlink_heartbeat_t>(id).size();
  }

  /// The texts heard, put together again.
  [[nodiscard]] std::vector<std::string> texts() const {
    std::vector<std::string> found;
    for (const auto& m : all<mavlink_statustext_t>(MAVLINK_MSG_ID_STATUSTEXT)) {
      const std::string part(m.text, strnlen(m.text, sizeof m.text));
      if (m.chunk_seq == 0) {
        found.push_back(part);
      } else {
        found.back() += part;
      }
    }
    return found;
  }
  [[nodiscard]] bool told(const std::string& part) const {
    for (const std::string& text : texts()) {
      if (text.find(part) != std::string::npos) return true;
    }
    return false;
  }

  /// From here on the station signs with that key, at that time (10 us since 2015).
  void sign(const SigningKey& key, std::uint64_t timestamp, std::uint8_t linkId = 0) {
    signing_ = {};
    signing_.flags = MAVLINK_SIGNING_FLAG_SIGN_OUTGOING;
    signing_.link_id = linkId;
    signing_.timestamp = timestamp;
    std::memcpy(signing_.secret_key, key.data(), key.size());
    status_.signing = &signing_;
  }
  void signNoMore() { status_.signing = nullptr; }

 private:
  void listen() {
    for (const std::uint8_t byte : port.output) {
      const int framing = mavlink_frame_char_buffer(&incoming_, &parser_, byte, nullptr, nullptr);
      TEST_ASSERT_NOT_EQUAL(MAVLINK_FRAMING_BAD_CRC, framing);
      if (framing == MAVLINK_FRAMING_OK) heard.push_back(incoming_);
    }
    port.output.clear();
  }

  mavlink_status_t status_{};
  mavlink_signing_t signing_{};
  mavlink_status_t parser_{};
  mavlink_message_t incoming_{};
};

inline void assertTold(const TelemetryBench& bench, const char* part) {
  if (bench.told(part)) return;
  std::string found = std::string("no text with \"") + part + "\" but:";
  for (const std::string& text : bench.texts()) found += "\n" + text;
  TEST_FAIL_MESSAGE(found.c_str());
}

}  // namespace strix
