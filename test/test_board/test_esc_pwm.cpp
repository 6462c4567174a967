/// Which pulse comes out of a pin for a command, with the core's own arithmetic in between.
#include <unity.h>

#include <cmath>
#include <limits>

#include "../../src/board/EscPwm.h"

#include "suites.h"

using namespace strix;

namespace {

template <EscProtocol Protocol>
class EscBench {
 public:
  EscBench() {
    flexPwm() = FakeFlexPwm{};
    esc_.begin();
  }

  void write(const EscCommands& commands) { esc_.write(commands); }

  /// us on M1's pin for this command to all four
  double sent(float command) {
    EscCommands commands{};
    commands.fill(command);
    esc_.write(commands);
    return flexPwm().pulse(pins::kEsc[0]);
  }

 private:
  EscPulses<Protocol> esc_;
};

/// @param shorter  how much shorter than a PWM pulse
template <EscProtocol Protocol>
void assertEveryCommand(double period_us, double shorter) {
  EscBench<Protocol> bench;
  for (const std::uint8_t pin : pins::kEsc) {
    TEST_ASSERT_TRUE(flexPwm().pulsing(pin));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, period_us, flexPwm().period(pin));
    TEST_ASSERT_DOUBLE_WITHIN(0.04, 1150.0 / shorter, flexPwm().pulse(pin));
  }
  // Half a count by rounding, and a float's worth on either side of the half.
  const double count = flexPwm().tick(pins::kEsc[0]) * 1e6;
  TEST_ASSERT_TRUE(count * shorter < 0.11);  // 7500 steps and more from off to full
  double last = 0.0;
  for (int i = 0; i <= 80000; ++i) {
    const float command = 1150.0F + 0.01F * static_cast<float>(i);
    const double pulse = bench.sent(command);
    TEST_ASSERT_DOUBLE_WITHIN(0.51 * count, static_cast<double>(command) / shorter, pulse);
    TEST_ASSERT_TRUE(pulse >= last);
    last = pulse;
  }
  TEST_ASSERT_TRUE(last < 0.98 * period_us);  // the line falls before the next pulse begins
}

void test_a_pwm_pulse_is_the_command_to_one_count_500_times_a_second() {
  assertEveryCommand<EscProtocol::Pwm>(2000.0, 1.0);
}

void test_a_oneshot125_pulse_is_an_eighth_of_the_command_2000_times_a_second() {
  assertEveryCommand<EscProtocol::OneShot125>(500.0, 8.0);
}

template <EscProtocol Protocol>
void assertOff(double off_us, double full_us) {
  EscBench<Protocol> bench;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  for (const float command :
       {std::numeric_limits<float>::quiet_NaN(), -kInfinity, kInfinity, -32768.0F, -1.0F, 0.0F,
        1.0F, 999.0F, 1149.99F, 2200.5F, 2865.0F, 16000.0F, 32767.0F, 1e30F}) {
    TEST_ASSERT_DOUBLE_WITHIN(0.04, full_us, bench.sent(1950.0F));
    TEST_ASSERT_DOUBLE_WITHIN(0.04, off_us, bench.sent(command));
  }
  // Above the range, but a pulse width: full.
  for (const float command : {1950.01F, 1999.0F, 2100.0F, 2200.0F}) {
    TEST_ASSERT_DOUBLE_WITHIN(0.04, full_us, bench.sent(command));
  }
}

void test_what_cannot_be_meant_as_a_pulse_is_off_and_too_much_is_full() {
  assertOff<EscProtocol::Pwm>(1150.0, 1950.0);
  assertOff<EscProtocol::OneShot125>(143.75, 243.75);
}

void test_each_motor_has_its_own_pin_although_two_share_a_counter() {
  EscBench<EscProtocol::Pwm> bench;
  bench.write({1200.0F, 1300.0F, 1400.0F, 1500.0F});
  const std::uint8_t pins[] = {28, 37, 29, 36};  // M1..M4, DESIGN.md 5
  for (int i = 0; i < 4; ++i) {
    TEST_ASSERT_DOUBLE_WITHIN(0.04, 1200.0 + 100.0 * i, flexPwm().pulse(pins[i]));
  }
}

void test_no_pin_pulses_before_the_start_and_the_flown_protocol_is_pwm() {
  flexPwm() = FakeFlexPwm{};
  EscPwm esc;
  for (const std::uint8_t pin : pins::kEsc) TEST_ASSERT_FALSE(flexPwm().pulsing(pin));
  esc.begin();
  for (const std::uint8_t pin : pins::kEsc) {
    TEST_ASSERT_DOUBLE_WITHIN(0.04, 1150.0, flexPwm().pulse(pin));
  }
}

void test_any_motor_above_off_is_turning_and_nonsense_is_not() {
  flexPwm() = FakeFlexPwm{};
  EscPwm esc;
  esc.begin();
  TEST_ASSERT_FALSE(esc.turning());
  for (std::size_t i = 0; i < kMotorCount; ++i) {
    EscCommands commands{1150.0F, 0.0F, std::numeric_limits<float>::quiet_NaN(), 2865.0F};
    esc.write(commands);
    TEST_ASSERT_FALSE(esc.turning());
    commands[i] = 1150.1F;
    esc.write(commands);
    TEST_ASSERT_TRUE(esc.turning());
  }
  esc.stop();
  TEST_ASSERT_FALSE(esc.turning());
}

}  // namespace

void runEscPwmTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_a_pwm_pulse_is_the_command_to_one_count_500_times_a_second);
  RUN_TEST(test_a_oneshot125_pulse_is_an_eighth_of_the_command_2000_times_a_second);
  RUN_TEST(test_what_cannot_be_meant_as_a_pulse_is_off_and_too_much_is_full);
  RUN_TEST(test_each_motor_has_its_own_pin_although_two_share_a_counter);
  RUN_TEST(test_no_pin_pulses_before_the_start_and_the_flown_protocol_is_pwm);
  RUN_TEST(test_any_motor_above_off_is_turning_and_nonsense_is_not);
}
