/// The numbers of an airframe. Each vehicle is one constexpr value in include/vehicles/: the flight
/// code, the gain design and the simulator all read it from there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace strix {

constexpr std::size_t kMotorCount = 4;

/// M1..M4 in the vehicle's command unit (us of pulse width, or an int16 over I2C).
using EscCommands = std::array<float, kMotorCount>;

/// Which way a rotor turns, seen from above. Its reaction turns the body the other way.
enum class Spin : std::int8_t { CounterClockwise = -1, Clockwise = 1 };

/// One rotor's place in the body frame (FRD), thrust along -z.
struct Rotor {
  float x;  ///< m, forward of the centre of mass
  float y;  ///< m, right of the centre of mass
  Spin spin;
};

/// ESC command as a polynomial of rotor speed n: offset + linear n + quadratic n^2.
struct CommandCurve {
  float offset;
  float linear;
  float quadratic;
};

/// Largest acceptable values of each error and control: LQR weights are 1/x^2 (Bryson's rule).
struct BrysonWeights {
  float positionHorizontal;  ///< m
  float positionVertical;    ///< m
  float velocityHorizontal;  ///< m/s
  float velocityVertical;    ///< m/s
  float tilt;                ///< rad, roll and pitch
  float yaw;                 ///< rad
  float rate;                ///< rad/s, roll and pitch
  float yawRate;             ///< rad/s
  float thrust;              ///< N
  float torque;              ///< N m, roll and pitch
  float yawTorque;           ///< N m
  // Of the time integrals, for designs with integral action.
  float integralHorizontal;  ///< m s
  float integralVertical;    ///< m s
  float integralYaw;         ///< rad s
};

struct Vehicle {
  const char* name;
  float mass;                             ///< kg
  std::array<float, 3> inertia;           ///< kg m^2, diagonal, body axes
  std::array<Rotor, kMotorCount> rotors;  ///< M1..M4
  const char* speedUnit;                  ///< unit of rotor speed n in what follows
  float thrustConstant;                   ///< N / n^2
  float torqueConstant;                   ///< N m / n^2
  float motorTimeConstant;                ///< s
  CommandCurve command;                   ///< ESC command of rotor speed
  const char* commandUnit;
  float commandOff;           ///< motors stopped
  float commandMax;           ///< what the ESC accepts
  float commandFlightMax;     ///< cap in flight
  float speedFlightMin;       ///< n below which a motor never runs in flight
  float curveVoltage;         ///< V, battery voltage at which the command curve holds
  std::uint8_t batteryCells;  ///< in series
  BrysonWeights bryson;       ///< for designs that know the motor lag
  BrysonWeights brysonNoLag;  ///< for designs that do not: gentler
};

}  // namespace strix
