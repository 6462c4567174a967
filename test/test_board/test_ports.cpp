// Ports of telemetry and console: they never wait.
#include <unity.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "../../src/board/SerialPort.h"
#include "suites.h"

using namespace strix;

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes counted(std::size_t size) {
  Bytes bytes(size);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

struct UartBench {
  UartBench() {
    powerUpTeensy();
    port.begin(57'600);
  }
  HardwareSerialIMXRT uart;
  SerialPort port{uart};
};

void test_a_uart_takes_what_it_has_room_for_and_counts_the_rest() {
  UartBench bench;
  const std::size_t room = bench.port.room();
  TEST_ASSERT_GREATER_OR_EQUAL_UINT32(2 * 280, room);  // MAVLink's longest message, twice
  const Bytes text = counted(5000);
  const std::uint32_t start = micros();
  bench.port.write(text.data(), text.size());
  TEST_ASSERT_LESS_THAN_UINT32(500, micros() - start);  // 5000 bytes are 0.87 s of the line
  TEST_ASSERT_EQUAL_UINT32(text.size() - room, bench.port.dropped());
  TEST_ASSERT_LESS_OR_EQUAL_UINT32(1, bench.port.room());
  delay(1000);
  TEST_ASSERT_EQUAL_UINT32(room, bench.uart.sent.size());
  TEST_ASSERT_TRUE(std::equal(bench.uart.sent.begin(), bench.uart.sent.end(), text.begin()));
  TEST_ASSERT_EQUAL_UINT32(room, bench.port.room());
}

void test_a_uart_that_is_given_its_room_drops_nothing() {
  UartBench bench;
  const Bytes text = counted(20'000);
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t part = std::min(bench.port.room(), text.size() - at);
    bench.port.write(&text[at], part);
    at += part;
    delay(2);
  }
  delay(200);
  TEST_ASSERT_TRUE(bench.uart.sent == text);
  TEST_ASSERT_EQUAL_UINT32(0, bench.port.dropped());
}

void test_a_uart_gives_no_more_than_asked_for_and_nothing_twice() {
  UartBench bench;
  const Bytes text = counted(300);
  for (std::size_t i = 0; i < text.size(); ++i) {
    bench.uart.line.push_back({micros() + 174ULL * (i + 1), text[i], 57'600});
  }
  delay(60);
  Bytes heard;
  std::uint8_t part[64];
  while (const std::size_t count = bench.port.read(part, sizeof part)) {
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(sizeof part, count);
    heard.insert(heard.end(), part, part + count);
  }
  TEST_ASSERT_TRUE(heard == text);
}

void test_usb_without_a_terminal_goes_to_nowhere() {
  powerUpTeensy();
  Serial = FakeUsbSerial{};
  UsbPort port;
  const Bytes text = counted(100);
  for (int i = 0; i < 1000; ++i) {
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(text.size(), port.room());
    port.write(text.data(), text.size());
  }
  Serial.terminal = true;  // who opens one sees nothing old
  TEST_ASSERT_EQUAL_UINT32(0, Serial.shown.size());
  TEST_ASSERT_EQUAL_UINT32(0, port.dropped());
  port.write(text.data(), text.size());
  TEST_ASSERT_TRUE(Serial.shown == text);
}

void test_usb_never_waits_for_a_terminal_that_takes_nothing() {
  powerUpTeensy();
  Serial = FakeUsbSerial{};
  Serial.terminal = true;
  Serial.space = 2048;
  UsbPort port;
  const Bytes text = counted(5000);
  port.write(text.data(), text.size());
  port.write(text.data(), text.size());
  TEST_ASSERT_EQUAL_UINT32(0, Serial.waits);
  TEST_ASSERT_EQUAL_UINT32(2048, Serial.shown.size());
  TEST_ASSERT_EQUAL_UINT32(10'000 - 2048, port.dropped());
  TEST_ASSERT_EQUAL_UINT32(0, port.room());
}

void test_usb_gives_what_was_typed() {
  powerUpTeensy();
  Serial = FakeUsbSerial{};
  UsbPort port;
  Serial.typed = {'h', 'e', 'l', 'p', '\n'};
  std::uint8_t part[3];
  TEST_ASSERT_EQUAL_UINT32(3, port.read(part, 3));
  TEST_ASSERT_EQUAL_UINT8('l', part[2]);
  TEST_ASSERT_EQUAL_UINT32(2, port.read(part, 3));
  TEST_ASSERT_EQUAL_UINT8('\n', part[1]);
  TEST_ASSERT_EQUAL_UINT32(0, port.read(part, 3));
}

}  // namespace

void runPortTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_uart_takes_what_it_has_room_for_and_counts_the_rest);
  RUN_TEST(test_a_uart_that_is_given_its_room_drops_nothing);
  RUN_TEST(test_a_uart_gives_no_more_than_asked_for_and_nothing_twice);
  RUN_TEST(test_usb_without_a_terminal_goes_to_nowhere);
  RUN_TEST(test_usb_never_waits_for_a_terminal_that_takes_nothing);
  RUN_TEST(test_usb_gives_what_was_typed);
}
