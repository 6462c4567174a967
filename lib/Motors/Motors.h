/// Wrench to motor commands: allocation, limits, thrust curve, arming (DESIGN.md, 5).
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "Mathpk.h"
#include "Vehicle.h"

namespace strix {

/// Squared rotor speeds of M1..M4, in the vehicle's unit squared.
using SquaredSpeeds = std::array<float, kMotorCount>;

class Motors {
 public:
  explicit Motors(const Vehicle& vehicle)
      : vehicle_(vehicle),
        squareMin_(vehicle.speedFlightMin * vehicle.speedFlightMin),
        commandMin_(command(vehicle.speedFlightMin)),
        revolution_(std::string_view(vehicle.speedUnit) == "rad/s" ? 0.5F / kPi : 1.0F) {
    const float top = speedOf(vehicle.commandFlightMax);
    squareMax_ = top * top;
    // Force on a rotor at (x, y) is -z, so its moment (r x F) is -y about x and +x about y; a rotor
    // turning clockwise is held by the body, which is turned to the left, -z.
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      const Rotor& rotor = vehicle.rotors[i];
      effect_[kThrust][i] = vehicle.thrustConstant;
      effect_[kRoll][i] = -rotor.y * vehicle.thrustConstant;
      effect_[kPitch][i] = rotor.x * vehicle.thrustConstant;
      effect_[kYaw][i] = -static_cast<float>(rotor.spin) * vehicle.torqueConstant;
    }
    // The rows of an X layout are orthogonal (tested), so E E^T is diagonal and the pseudo-inverse
    // E^T (E E^T)^-1 is each row divided by its squared length, transposed.
    for (std::size_t row = 0; row < kAxes; ++row) {
      float square = 0.0F;
      for (const float e : effect_[row]) square += e * e;
      for (std::size_t i = 0; i < kMotorCount; ++i) inverse_[row][i] = effect_[row][i] / square;
    }
    disarm();
  }

  void arm() {
    armed_ = true;
    commandControl(Wrench::none());
  }

  /// Motors off at once: commands() and the next writeESC are off, whatever is commanded.
  void disarm() {
    armed_ = false;
    stop();
  }

  [[nodiscard]] bool armed() const { return armed_; }

  /// Mean speed that the ESCs are told, rev/s; 0 when off. The propellers shake at it.
  [[nodiscard]] float meanRevolutions() const {
    if (!armed_) return 0.0F;
    float sum = 0.0F;
    for (const float command : commands_) sum += speedOf(command);
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
    const bool valid = plausible(wanted.thrust) && plausible(wanted.torque.x()) &&
                       plausible(wanted.torque.y()) && plausible(wanted.torque.z());
    if (!valid) ++invalid_;
    const SquaredSpeeds squares = allocateControl(valid ? wanted : Wrench::none());
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      commands_[i] = clamp(command(squareRoot(squares[i])), commandMin_, vehicle_.commandFlightMax);
    }
    achieved_ = wrenchOf(squares);
  }

  /// Squared speeds for a finite wrench: exact when they can be within the limits; otherwise roll
  /// and pitch torque are kept first, then thrust, then yaw torque; no torque changes its sign.
  [[nodiscard]] SquaredSpeeds allocateControl(const Wrench& wanted) const {
    SquaredSpeeds tilting{};  // share of roll and pitch torque
    SquaredSpeeds turning{};  // share of yaw torque
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      tilting[i] = inverse_[kRoll][i] * wanted.torque.x() + inverse_[kPitch][i] * wanted.torque.y();
      turning[i] = inverse_[kYaw][i] * wanted.torque.z();
    }

    // Roll and pitch: all of it when the spread fits between the limits. The motor that gives most
    // and the one that gives least stand opposite and spin alike, so yaw cannot make more room.
    const Range spread = rangeOf(tilting);
    const float room = squareMax_ - squareMin_;
    if (spread.high - spread.low > room) {
      const float scale = room / (spread.high - spread.low);
      for (float& share : tilting) share *= scale;
    }

    // Thrust: the nearest that some part f of the yaw torque, 0 <= f <= 1, allows.
    const float mostThrust = squareMax_ - lowestPeak(tilting, turning, 1.0F);
    const float leastThrust = squareMin_ + lowestPeak(tilting, turning, -1.0F);
    const float level = clamp(inverse_[kThrust][0] * wanted.thrust, leastThrust, mostThrust);

    // Yaw: the largest part that keeps every motor within its limits.
    float part = 1.0F;
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      const float base = level + tilting[i];
      const float up = turning[i];
      if (base + up > squareMax_ && up > 0.0F) part = smaller(part, (squareMax_ - base) / up);
      if (base + up < squareMin_ && up < 0.0F) part = smaller(part, (squareMin_ - base) / up);
    }
    if (part < 0.0F) part = 0.0F;

    SquaredSpeeds squares{};
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      squares[i] = clamp(level + tilting[i] + part * turning[i], squareMin_, squareMax_);
    }
    return squares;
  }

  /// Wrench of rotors at these squared speeds.
  [[nodiscard]] Wrench wrenchOf(const SquaredSpeeds& squares) const {
    std::array<float, kAxes> sum{};
    for (std::size_t row = 0; row < kAxes; ++row) {
      for (std::size_t i = 0; i < kMotorCount; ++i) sum[row] += effect_[row][i] * squares[i];
    }
    return {sum[kThrust], {sum[kRoll], sum[kPitch], sum[kYaw]}};
  }

  /// ESC command of rotor speed n.
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

  /// The wrench these commands give when the motors have settled.
  [[nodiscard]] const Wrench& achieved() const { return achieved_; }

  /// Wrenches that were not plausible, since the start.
  [[nodiscard]] std::uint32_t invalid() const { return invalid_; }

 private:
  enum Axis : std::size_t { kThrust, kRoll, kPitch, kYaw, kAxes };
  static constexpr float kBeyondAny = 1e30F;  ///< squared speed

  struct Range {
    float low;
    float high;
  };

  /// False for NaN and beyond any sense (N or N m); what is left overflows nowhere.
  [[nodiscard]] static bool plausible(float value) { return value > -1e6F && value < 1e6F; }

  [[nodiscard]] static float smaller(float a, float b) { return b < a ? b : a; }
  [[nodiscard]] static float larger(float a, float b) { return b > a ? b : a; }
  [[nodiscard]] static float clamp(float v, float low, float high) {
    return smaller(larger(v, low), high);
  }

  [[nodiscard]] static Range rangeOf(const SquaredSpeeds& s) {
    return {smaller(smaller(s[0], s[1]), smaller(s[2], s[3])),
            larger(larger(s[0], s[1]), larger(s[2], s[3]))};
  }

  /// Smallest over 0 <= f <= 1 of the largest side (tilting + f turning), side +1 or -1: with the
  /// best part of the yaw torque, how far above (+1) or below (-1) the mean a motor must reach.
  /// Yaw lifts one pair of rotors and lowers the other alike: the best f levels the pairs' peaks.
  [[nodiscard]] static float lowestPeak(const SquaredSpeeds& tilting, const SquaredSpeeds& turning,
                                        float side) {
    float step = 0.0F;
    float lifted = -kBeyondAny;   // peak of the pair that yaw lifts
    float lowered = -kBeyondAny;  // peak of the other
    for (std::size_t i = 0; i < kMotorCount; ++i) {
      const float share = side * tilting[i];
      const float turn = side * turning[i];
      if (turn > 0.0F) {
        step = turn;
        lifted = larger(lifted, share);
      } else {
        lowered = larger(lowered, share);
      }
    }
    const float lift = clamp(0.5F * (lowered - lifted), 0.0F, step);
    return larger(lifted + lift, lowered - lift);
  }

  void stop() {
    commands_.fill(vehicle_.commandOff);
    achieved_ = Wrench::none();
  }

  const Vehicle& vehicle_;
  std::array<std::array<float, kMotorCount>, kAxes> effect_{};   ///< wrench per squared speed
  std::array<std::array<float, kMotorCount>, kAxes> inverse_{};  ///< its pseudo-inverse, transposed
  float squareMin_;
  float squareMax_ = 0.0F;
  float commandMin_;
  float revolution_;  ///< of one unit of the vehicle's rotor speed, rev/s
  bool armed_ = false;
  EscCommands commands_{};
  Wrench achieved_;
  std::uint32_t invalid_ = 0;
};

}  // namespace strix
