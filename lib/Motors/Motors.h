/// Wrench to motor commands: limits, thrust curve, battery voltage, arming (DESIGN.md, 5).
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "Allocation.h"
#include "Mathpk.h"
#include "Vehicle.h"

namespace strix {

/// Squared rotor speeds of M1..M4, in the vehicle's unit squared.
using SquaredSpeeds = Allocation<kMotorCount>::Squares;

struct MotorConfig {
  /// The largest change of a rotor's speed, vehicle's unit per second; 0: no limit. Of speed, not
  /// of command: what it spares is the torque, and so the current, that speeds a rotor up, and the
  /// same step of the command is another step of speed on every curve and at every voltage. Where
  /// it limits, roll and pitch have no priority: each rotor goes its own way to its new speed.
  float slew = 0.0F;
  /// Whether commands follow the battery's voltage.
  bool voltageCompensation = true;
};

/// Thrust is linear in the wanted wrench: the allocation works in squared speeds, of which thrust
/// and torque are multiples, and the vehicle's command curve, which is the inverse of what a motor
/// makes of a command, turns a speed into a command. No other thrust curve is needed.
class Motors {
 public:
  static constexpr float kRateHz = 500.0F;  ///< of commandControl

  explicit Motors(const Vehicle& vehicle, const MotorConfig& config = {})
      : vehicle_(vehicle),
        config_(config),
        allocation_(vehicle.rotors, vehicle.thrustConstant, vehicle.torqueConstant),
        speedTop_(speedOf(vehicle.commandFlightMax)),
        step_(config.slew / kRateHz),
        revolution_(std::string_view(vehicle.speedUnit) == "rad/s" ? 0.5F / kPi : 1.0F) {
    compensate(1.0F);
    disarm();
  }

  /// False when this layout of rotors cannot fly (Allocation::valid): it never arms.
  [[nodiscard]] bool valid() const { return allocation_.valid(); }

  void arm() {
    if (!valid()) return;
    armed_ = true;
    speeds_.fill(speedMin_);  // from stopped to idle at once, whatever the slew limit
    commandControl(Wrench::none());
  }

  /// Motors off at once: commands() and the next writeESC are off, whatever is commanded.
  void disarm() {
    armed_ = false;
    stop();
  }

  [[nodiscard]] bool armed() const { return armed_; }

  /// Battery voltage for the commands to come, V; 0 or NaN while it is not known. At one command a
  /// motor's speed goes with the voltage: an ESC gives it that share of the voltage (back-EMF is
  /// speed over KV; the winding's own drop is left out, so that this is a little too much), and
  /// thrust with its square: ArduPilot's MOT_BAT_VOLT_MAX does the same with a curve that is wholly
  /// quadratic (AP_Motors_Thrust_Linearization, lift_max).
  void setBatteryVoltage(float volts) {
    if (volts == voltage_ || !config_.voltageCompensation) return;
    voltage_ = volts;
    const float factor = vehicle_.curveVoltage / volts;
    compensate(volts > 0.0F && factor > 0.0F ? clamp(factor, kFactorMin, kFactorMax) : 1.0F);
  }

  /// Mean speed that the ESCs are told, rev/s; 0 when off. The propellers shake at it.
  [[nodiscard]] float meanRevolutions() const {
    float sum = 0.0F;
    for (const float speed : speeds_) sum += speed;
    return sum * (revolution_ / static_cast<float>(kMotorCount));
  }

  /// Mean command between off and the ESC's maximum, 0 to 1; 0 when off. What the motors' current
  /// does to the magnetometer goes by it (MagCalibration::perThrottle).
  [[nodiscard]] float throttle() const {
    if (!armed_) return 0.0F;
    float sum = 0.0F;
    for (const float command : commands_) sum += command - vehicle_.commandOff;
    return sum / (static_cast<float>(kMotorCount) * (vehicle_.commandMax - vehicle_.commandOff));
  }

  /// Turns a wanted wrench into commands. A wrench with NaN, infinity or an absurd size counts as
  /// none.
  void commandControl(const Wrench& wanted) {
    if (!armed_) {
      stop();
      return;
    }
    const bool sane = plausible(wanted.thrust) && plausible(wanted.torque.x()) &&
                      plausible(wanted.torque.y()) && plausible(wanted.torque.z());
    if (!sane) ++invalid_;
    SquaredSpeeds squares = allocateControl(sane ? wanted : Wrench::none());
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      float speed = squareRoot(squares[i]);
      if (step_ > 0.0F) {
        const float next = clamp(speed, speeds_[i] - step_, speeds_[i] + step_);
        speed = clamp(next, speedMin_, speedMax_);  // which move with the voltage
        squares[i] = speed * speed;
      }
      speeds_[i] = speed;
      commands_[i] = clamp(command(speed * factor_), commandMin_, vehicle_.commandFlightMax);
    }
    achieved_ = allocation_.wrenchOf(squares);
  }

  /// One motor of an armed aircraft on the bench, the others off.
  /// @param share  0 to 1 of the ESC's range
  void commandOne(std::size_t motor, float share) {
    stop();
    if (!armed_ || motor >= kMotorCount || !(share > 0.0F)) return;
    const float range = vehicle_.commandMax - vehicle_.commandOff;
    commands_[motor] =
        clamp(vehicle_.commandOff + share * range, vehicle_.commandOff, vehicle_.commandFlightMax);
  }

  /// Squared speeds for a finite wrench: exact when they can be within the limits; otherwise roll
  /// and pitch torque are kept first, then thrust, then yaw torque; no torque changes its sign.
  [[nodiscard]] SquaredSpeeds allocateControl(const Wrench& wanted) const {
    return allocation_.solve(wanted);
  }

  /// Wrench of rotors at these squared speeds.
  [[nodiscard]] Wrench wrenchOf(const SquaredSpeeds& squares) const {
    return allocation_.wrenchOf(squares);
  }

  /// ESC command of rotor speed n at the voltage of the command curve.
  [[nodiscard]] float command(float n) const {
    const CommandCurve& c = vehicle_.command;
    return c.offset + (c.linear + c.quadratic * n) * n;
  }

  /// Rotor speed of an ESC command: the inverse of command(), 0 at and below its offset.
  [[nodiscard]] float speedOf(float escCommand) const {
    const CommandCurve& c = vehicle_.command;
    const float above = escCommand - c.offset;
    if (!(above > 0.0F)) return 0.0F;
    // The form of the quadratic's root that also holds when either coefficient is zero.
    return 2.0F * above / (c.linear + squareRoot(c.linear * c.linear + 4.0F * c.quadratic * above));
  }

  /// Hands the commands to the ESCs. A disarmed aircraft always sends off.
  template <class Board>
  void writeESC(Board& board) const {
    board.writeEsc(commands_);
  }

  /// M1..M4 in the vehicle's command unit.
  [[nodiscard]] const EscCommands& commands() const { return commands_; }

  /// The wrench these commands give, at the battery voltage last told, when the motors have
  /// settled.
  [[nodiscard]] const Wrench& achieved() const { return achieved_; }

  /// Factor on a rotor's speed in its command: above 1 with a battery below the command curve's.
  [[nodiscard]] float supply() const { return factor_; }

  /// Of one motor's command: 0 off, 1 the ESC's maximum.
  [[nodiscard]] float shareOf(std::size_t motor) const {
    return (commands_[motor] - vehicle_.commandOff) / (vehicle_.commandMax - vehicle_.commandOff);
  }

  /// Of the slowest and the fastest motor: 0 at the lowest command of flight, 1 at its cap.
  [[nodiscard]] float lowestShare() const {
    float lowest = commands_[0];
    for (const float command : commands_) lowest = smaller(lowest, command);
    return share(lowest);
  }
  [[nodiscard]] float highestShare() const {
    float highest = commands_[0];
    for (const float command : commands_) highest = larger(highest, command);
    return share(highest);
  }

  /// Wrenches that were not plausible, since the start.
  [[nodiscard]] std::uint32_t invalid() const { return invalid_; }

 private:
  // ours: the factors of 4.5 and 2.8 V a cell where the curve holds at 3.8: whoever says more or
  // less does not know, and a wrong voltage costs no more thrust than that.
  static constexpr float kFactorMin = 0.85F;
  static constexpr float kFactorMax = 1.35F;

  /// False for NaN and beyond any sense (N or N m); what is left overflows nowhere.
  [[nodiscard]] static bool plausible(float value) { return value > -1e6F && value < 1e6F; }

  [[nodiscard]] float share(float command) const {
    return (command - commandMin_) / (vehicle_.commandFlightMax - commandMin_);
  }
  [[nodiscard]] static float smaller(float a, float b) { return b < a ? b : a; }
  [[nodiscard]] static float larger(float a, float b) { return b > a ? b : a; }
  [[nodiscard]] static float clamp(float v, float low, float high) {
    return smaller(larger(v, low), high);
  }

  /// From now on a speed n needs the command of factor n. The cap is one of the command: with a low
  /// battery it is a lower speed. Idle is never a lower command than on the curve, because an ESC
  /// stops its motor at a command, not at a speed: with a full battery it is a faster idle.
  void compensate(float factor) {
    factor_ = factor;
    const float idle = vehicle_.speedFlightMin * larger(factor, 1.0F);
    commandMin_ = command(idle);
    speedMin_ = idle / factor;
    speedMax_ = speedTop_ / factor;
    allocation_.setLimits(speedMin_ * speedMin_, speedMax_ * speedMax_);
  }

  void stop() {
    commands_.fill(vehicle_.commandOff);
    speeds_.fill(0.0F);
    achieved_ = Wrench::none();
  }

  const Vehicle& vehicle_;
  MotorConfig config_;
  Allocation<kMotorCount> allocation_;
  float speedTop_;    ///< of the cap in flight on the command curve
  float step_;        ///< most that a speed changes from one command to the next; 0: no limit
  float revolution_;  ///< of one unit of the vehicle's rotor speed, rev/s
  float voltage_ = 0.0F;
  float factor_ = 1.0F;  ///< voltage of the command curve over that of the battery
  float commandMin_ = 0.0F;
  float speedMin_ = 0.0F;
  float speedMax_ = 0.0F;
  bool armed_ = false;
  EscCommands commands_{};
  std::array<float, kMotorCount> speeds_{};  ///< that the commands give, settled
  Wrench achieved_;
  std::uint32_t invalid_ = 0;
};

}  // namespace strix
