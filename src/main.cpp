/// The firmware: one board, and on it the flight software or, when a terminal asks, the checkout.
#include <algorithm>
#include <cstddef>
#include <cstring>
#include <new>
#include <string_view>

#include "Checkout.h"
#include "Console.h"
#include "FlightConfig.h"
#include "FlightSoftware.h"
#include "GroundLink.h"
#include "PowerUpChoice.h"

#include "board/Faults.h"
#include "board/SerialPort.h"
#include "board/TeensyBoard.h"

// The board's ESCs are driven by pulse width; for ESCs on I2C the board needs EscI2c in place of
// EscPwm: docs/board.md.
static_assert(std::string_view(strix::kFlown.vehicle.commandUnit) == "us");

// The flight software expects the sensors at the rates that the adapters set.
static_assert(strix::kImuPeriod == strix::ImuIcm20649::kPeriod);
static_assert(strix::SensorConfig::kMagPeriod == strix::MagLis2mdl::kPeriod);
static_assert(strix::SensorConfig::kAltPeriod == strix::BaroBmp390::kPeriod);
static_assert(strix::SensorConfig::kGpsPeriod == strix::GpsMtk3333::kPeriod);

namespace {

using Flight = strix::FlightSoftware<strix::TeensyBoard>;

strix::TeensyBoard board;
strix::SerialPort radioModem(Serial8);
strix::UsbPort usb;

/// The flight software, and who speaks with it.
struct Aircraft {
  Flight flight{board, strix::flightConfig()};
  strix::GroundLink<Flight, strix::SerialPort> link{flight, radioModem, strix::PortTrust::Radio};
  strix::Console<Flight, strix::UsbPort, strix::TeensyBoard> console{flight, usb, board};
};

/// The log's rings want most of the 512 KB of RAM2, which leaves RAM1 to code and stack. The
/// start-up code does not clear RAM2 as it clears RAM1, hence no plain static object there: its
/// memory is cleared here, then it is built in place.
alignas(Aircraft) DMAMEM std::byte memory[sizeof(Aircraft)];

Aircraft& aircraft = *new (std::memset(memory, 0, sizeof memory)) Aircraft;

constexpr strix::CheckoutPins checkoutPins() {
  namespace pins = strix::pins;
  strix::CheckoutPins p{pins::kImuDataReady, pins::kImuBus.sda,  pins::kImuBus.scl,
                        pins::kSlowBus.sda,  pins::kSlowBus.scl, pins::kGpsRx,
                        pins::kGpsTx,        pins::kArmSwitch,   pins::kKillSwitch,
                        pins::kStartSwitch};
  if (strix::ImuIcm20649::kOnSpi) {
    p.imuSda = 11;  // MOSI and clock: the Teensy's
    p.imuScl = 13;
    p.imuSelect = strix::SpiDevice::kChipSelect;
    p.imuMiso = strix::SpiDevice::kMiso;
  }
  return p;
}

strix::Checkout<strix::TeensyBoard> checkout(board, strix::flightConfig(), checkoutPins());

bool flying = true;

/// Bound: 2 s without a terminal, 5 s more with one. No pulse goes to the ESCs meanwhile.
bool terminalAsksForCheckout() {
  strix::PowerUpChoice choice(::micros());
  bool asked = false;
  for (;;) {
    const auto answer = choice.update(::micros(), static_cast<bool>(Serial), Serial.read());
    if (choice.opened() && !asked) {
      asked = true;
      Serial.print(strix::PowerUpChoice::kQuestion);
    }
    if (answer != strix::PowerUpChoice::Answer::Open) {
      return answer == strix::PowerUpChoice::Answer::Checkout;
    }
  }
}

/// Never more than there is room for: the core's write waits up to 120 ms for a full buffer.
std::size_t toTerminal(const char* text, std::size_t count) {
  const auto room = static_cast<std::size_t>(std::max(Serial.availableForWrite(), 0));
  return room == 0 ? 0 : Serial.write(text, std::min(count, room));
}

}  // namespace

void setup() {
  flying = !terminalAsksForCheckout();
  if (flying) {
    aircraft.flight.setup();
    radioModem.begin(57'600);
  } else {
    if (CrashReport) Serial.print(CrashReport);  // of a fault before this start; told once
    checkout.begin();
  }
}

void loop() {
  if (flying) {
    aircraft.flight.loop();
    if (!aircraft.flight.ticked()) {  // a control tick has its pass for itself
      const strix::Micros now = board.micros();
      aircraft.link.step(now);
      aircraft.console.step(now);
    }
    if (aircraft.link.rebootAsked() || aircraft.console.rebootAsked()) strix::restart();
    return;
  }
  checkout.step([] { return Serial.read(); }, toTerminal);
  board.feedWatchdog();
  if (checkout.rebootAsked()) strix::restart();
}

/// Called by the core after each pass and by libraries that wait: nothing of it is used here.
void yield() {}
