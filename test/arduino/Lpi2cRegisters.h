/// The registers of the two I2C masters under the core's names (imxrt.h): each reading or writing
/// takes its time and drives the model of the master. "i.MX RT1060 Processor Reference Manual",
/// chapter LPI2C, memory map.
#pragma once

#include <cstdint>

#include "FakeTeensy.h"

namespace strix {

/// One register: a pair of actions that looks like a volatile word.
class FakeRegister {
 public:
  using Read = std::uint32_t (*)(FakeLpi2c& master);
  using Write = void (*)(FakeLpi2c& master, std::uint32_t value);
  using Port = FakeI2cPort FakeTeensy::*;

  constexpr FakeRegister(Port port, Read read, Write write)
      : port_(port), read_(read), write_(write) {}

  operator std::uint32_t() const {  // NOLINT(google-explicit-constructor): as a word
    return read_(reached());
  }
  FakeRegister& operator=(std::uint32_t value) {
    write_(reached(), value);
    return *this;
  }
  FakeRegister& operator|=(std::uint32_t bits) {
    return *this = static_cast<std::uint32_t>(*this) | bits;
  }

 private:
  [[nodiscard]] FakeLpi2c& reached() const {
    fakeTeensy().clock.advance(FakeClock::kRegister);
    return (fakeTeensy().*port_).master;
  }

  Port port_;
  Read read_;
  Write write_;
};

}  // namespace strix

struct IMXRT_LPI2C_t {
  using Master = strix::FakeLpi2c;
  strix::FakeRegister::Port port;

  strix::FakeRegister MCR{port, [](Master& m) { return m.control(); },
                          [](Master& m, std::uint32_t value) { m.control(value); }};
  strix::FakeRegister MSR{port, [](Master& m) { return m.status(); },
                          [](Master& m, std::uint32_t ones) { m.clearFlags(ones); }};
  strix::FakeRegister MCFGR1{port, [](Master& m) { return m.prescale; },
                             [](Master& m, std::uint32_t value) { m.prescale = value; }};
  strix::FakeRegister MCFGR2{port, [](Master& m) { return m.timeouts; },
                             [](Master& m, std::uint32_t value) { m.timeouts = value; }};
  strix::FakeRegister MCFGR3{port, [](Master& m) { return m.pinLow; },
                             [](Master& m, std::uint32_t value) { m.pinLow = value; }};
  strix::FakeRegister MCCR0{port, [](Master& m) { return m.clockBits; },
                            [](Master& m, std::uint32_t value) { m.clockBits = value; }};
  strix::FakeRegister MFSR{port, [](Master& m) { return m.fifoCounts(); },
                           [](Master& /*m*/, std::uint32_t /*value*/) {}};
  strix::FakeRegister MTDR{port, [](Master& /*m*/) { return std::uint32_t{0}; },
                           [](Master& m, std::uint32_t word) { m.command(word); }};
  strix::FakeRegister MRDR{port, [](Master& m) { return m.receive(); },
                           [](Master& /*m*/, std::uint32_t /*value*/) {}};
};

inline IMXRT_LPI2C_t lpi2c1Registers{&strix::FakeTeensy::lpi2c1};
inline IMXRT_LPI2C_t lpi2c3Registers{&strix::FakeTeensy::lpi2c3};

// NOLINTBEGIN(cppcoreguidelines-macro-usage)
#define IMXRT_LPI2C1_ADDRESS (reinterpret_cast<std::uintptr_t>(&lpi2c1Registers))
#define IMXRT_LPI2C3_ADDRESS (reinterpret_cast<std::uintptr_t>(&lpi2c3Registers))

#define LPI2C_MCR_RRF (1U << 9U)
#define LPI2C_MCR_RTF (1U << 8U)
#define LPI2C_MCR_RST (1U << 1U)
#define LPI2C_MCR_MEN (1U << 0U)
#define LPI2C_MSR_BBF (1U << 25U)
#define LPI2C_MSR_MBF (1U << 24U)
#define LPI2C_MSR_DMF (1U << 14U)
#define LPI2C_MSR_PLTF (1U << 13U)
#define LPI2C_MSR_FEF (1U << 12U)
#define LPI2C_MSR_ALF (1U << 11U)
#define LPI2C_MSR_NDF (1U << 10U)
#define LPI2C_MSR_SDF (1U << 9U)
#define LPI2C_MSR_EPF (1U << 8U)
#define LPI2C_MTDR_CMD_TRANSMIT (0U << 8U)
#define LPI2C_MTDR_CMD_RECEIVE (1U << 8U)
#define LPI2C_MTDR_CMD_STOP (2U << 8U)
#define LPI2C_MTDR_CMD_START (4U << 8U)
// NOLINTEND(cppcoreguidelines-macro-usage)
