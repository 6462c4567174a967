/// libFuzzer against the NMEA parser; `make fuzz` runs it for five minutes.
///
/// Random changes seldom keep a checksum right, so the first byte of an input decides: even, the
/// bytes come as they are; odd, each line is given '$' and the checksum that it needs, which lets
/// the fuzzer reach the fields.
#include <cstdio>
#include <cstdlib>

#include "NmeaOracle.h"

namespace {

void push(strix::NmeaOracle& oracle, std::uint8_t byte) {
  if (const char* wrong = oracle.push(byte)) {
    std::fprintf(stderr, "%s\n", wrong);
    std::abort();
  }
}

void pushClosed(strix::NmeaOracle& oracle, const std::string& line) {
  unsigned sum = 0;
  for (const char c : line) sum ^= static_cast<unsigned char>(c);
  char tail[8];
  std::snprintf(tail, sizeof(tail), "*%02X\r\n", sum & 0xFFU);
  for (const char c : "$" + line + tail) push(oracle, static_cast<std::uint8_t>(c));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  strix::NmeaOracle oracle;
  const bool closed = (data[0] & 1U) != 0;
  std::string line;
  for (std::size_t i = 1; i < size; ++i) {
    if (!closed) {
      push(oracle, data[i]);
    } else if (data[i] == '\n') {
      pushClosed(oracle, line);
      line.clear();
    } else {
      line += static_cast<char>(data[i]);
    }
  }
  return 0;
}
