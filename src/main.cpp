/// The firmware: one board, and the flight software on it.
#include <cstddef>
#include <cstring>
#include <new>
#include <string_view>

#include "FlightConfig.h"
#include "FlightSoftware.h"

#include "board/TeensyBoard.h"

// The board's ESCs are driven by pulse width; an airframe with other ESCs needs another EscPwm.
static_assert(std::string_view(strix::kFlown.vehicle.commandUnit) == "us");

namespace {

using Flight = strix::FlightSoftware<strix::TeensyBoard>;

strix::TeensyBoard board;

/// The log's rings want most of the 512 KB of RAM2, which leaves RAM1 to code and stack. The
/// start-up code does not clear RAM2 as it clears RAM1, hence no plain static object there: its
/// memory is cleared here, then it is built in place.
alignas(Flight) DMAMEM std::byte memory[sizeof(Flight)];

Flight& flight = *new (std::memset(memory, 0, sizeof memory)) Flight(board, strix::flightConfig());

}  // namespace

void setup() { flight.setup(); }

void loop() { flight.loop(); }

/// Called by the core after each pass and by libraries that wait: nothing of it is used here.
void yield() {}
