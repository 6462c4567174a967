/// The flight software and nothing else: what it takes of code, constants, RAM and stack, and what
/// it calls, is read from what the compiler and the linker make of this (footprint.py). It is never
/// run. STATES is the navigation filter's: 18 or 9.
#include <cstddef>
#include <cstdint>
#include <new>

#include "FlightConfig.h"
#include "FlightSoftware.h"

namespace {

/// A value of which the compiler knows nothing, as it knows nothing of what a device will say.
template <class Value>
[[nodiscard]] Value anything() {
  Value value{};
  asm volatile("" : "+m"(value));
  return value;
}

/// Takes a value where the compiler cannot see it go.
template <class Value>
void takeAway(const Value& value) {
  asm volatile("" : : "m"(value));
}

/// A Board without a single device of its own, so that the image is flight code.
class BareBoard {
 public:
  struct Card {
    [[nodiscard]] static bool busy() { return anything<bool>(); }
    [[nodiscard]] static bool writeSector(std::uint32_t index,
                                          const std::uint8_t (&data)[strix::kSectorSize]) {
      takeAway(index);
      takeAway(data);
      return anything<bool>();
    }
    [[nodiscard]] static bool sync(std::uint32_t length) {
      takeAway(length);
      return anything<bool>();
    }
  };
  static constexpr const char* kName = "none";

  [[nodiscard]] static std::uint32_t bootId() { return anything<std::uint32_t>(); }
  [[nodiscard]] static strix::Micros micros() { return anything<strix::Micros>(); }
  [[nodiscard]] static strix::SensorSet begin() { return anything<strix::SensorSet>(); }
  [[nodiscard]] static bool readImu(strix::ImuRaw& out) { return read(out); }
  [[nodiscard]] static bool readMag(strix::MagRaw& out) { return read(out); }
  [[nodiscard]] static bool readAlt(strix::AltRaw& out) { return read(out); }
  [[nodiscard]] static bool readGps(strix::GpsRaw& out) { return read(out); }
  [[nodiscard]] static bool readBattery(strix::BatteryRaw& out) { return read(out); }
  [[nodiscard]] static bool readEscStatus(strix::EscRaw& out) { return read(out); }
  [[nodiscard]] static std::string_view missionText() { return anything<std::string_view>(); }
  static void countFaults(strix::SensorFaultCounts& out) {
    out = anything<strix::SensorFaultCounts>();
  }
  [[nodiscard]] static strix::PilotSwitches readPilot() { return anything<strix::PilotSwitches>(); }
  static void beginRadio(strix::RadioProtocol protocol) { takeAway(protocol); }
  [[nodiscard]] static bool readRadio(strix::RadioChannels& out) { return read(out); }
  static void feedWatchdog() { takeAway(0); }
  [[nodiscard]] static strix::ResetStatus resetStatus() { return anything<strix::ResetStatus>(); }
  static void rememberMotors(bool on) { takeAway(on); }
  static constexpr std::size_t kStorageBytes = 4216;  // as the Teensy's
  static void readStorage(std::size_t offset, std::uint8_t* data, std::size_t size) {
    takeAway(offset);
    for (std::size_t i = 0; i < size; ++i) data[i] = anything<std::uint8_t>();
  }
  [[nodiscard]] static bool writeStorage(std::size_t offset, const std::uint8_t* data,
                                         std::size_t size) {
    takeAway(offset);
    for (std::size_t i = 0; i < size; ++i) takeAway(data[i]);
    return anything<bool>();
  }
  static void writeEsc(const strix::EscCommands& commands) { takeAway(commands); }
  [[nodiscard]] Card& card() { return card_; }

 private:
  template <class Reading>
  [[nodiscard]] static bool read(Reading& out) {
    out = anything<Reading>();
    return anything<bool>();
  }

  Card card_;
};

using Flight = strix::FlightSoftware<BareBoard, STATES>;

BareBoard board;
alignas(Flight) std::byte memory[sizeof(Flight)];
Flight* flight;

}  // namespace

extern "C" {

// What src/main.cpp does, and the roots of the image.
void construct() { flight = new (memory) Flight(board, strix::flightConfig()); }
void setup() { flight->setup(); }
void loop() { flight->loop(); }

// As long as the libraries' parts of FlightSoftware. Nothing refers to them, so they are not
// linked: footprint.py reads their lengths from the object file.
std::byte partOfSensors[sizeof(strix::Sensors<BareBoard>) + sizeof(strix::StartCalibration) +
                        sizeof(strix::OriginAverage)];
std::byte partOfNavigation[sizeof(strix::Navigation<STATES>)];
std::byte partOfFiniteStateMachine[sizeof(strix::FiniteStateMachine)];
std::byte partOfControl[sizeof(strix::Controller)];
std::byte partOfMotors[sizeof(strix::Motors)];
std::byte partOfLogger[sizeof(strix::Logger<BareBoard::Card>)];

}  // extern "C"
