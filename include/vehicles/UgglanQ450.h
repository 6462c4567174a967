/// UgglanQ450: Q450 frame, 10 inch propellers, I2C ESCs (DESIGN.md, 5).
/// Values marked 'ours' are not published; the reason stands beside them.
#pragma once

#include "Vehicle.h"

namespace strix {

constexpr Vehicle kUgglanQ450{
    "UgglanQ450",
    1.058F,                    // kg
    {0.014F, 0.014F, 0.026F},  // kg m^2
    // X layout, 0.23 m from motor to centre: 0.163 m to the roll and to the pitch axis. tau_z
    // (- + - +): a clockwise rotor turns the body to the left, -z, so M1 and M3 turn clockwise.
    {{{0.163F, 0.163F, Spin::Clockwise},            // M1 front right
      {-0.163F, 0.163F, Spin::CounterClockwise},    // M2 rear right
      {-0.163F, -0.163F, Spin::Clockwise},          // M3 rear left
      {0.163F, -0.163F, Spin::CounterClockwise}}},  // M4 front left
    "rad/s",
    8.37e-6F,                 // N/(rad/s)^2
    8.37e-6F / 50.0F,         // N m/(rad/s)^2
    0.08F,                    // s
    {-9675.0F, 57.0F, 0.0F},  // int16 = 57 w - 9675
    "int16",
    0.0F,      // off: the ESC takes everything below 200 rad/s for this; no reverse
    32767.0F,  // int16
    31000.0F,  // ours: 714 rad/s, 1.6 weights; the rest is kept for a sagging battery
    220.0F,    // ours: 10 % above the 200 rad/s at which the motor stops
    11.4F,     // ours: V, 3.8 a cell, half full
    3,
    // ours: as for Quad5in, and slower, because the motors lag twice as long: roll and pitch rise
    // in 0.33 s. The yaw step asks for 0.07 of 0.13 N m.
    {
        2.5F,   // m, position, horizontal
        0.7F,   // m, position, vertical
        1.5F,   // m/s, velocity, horizontal
        1.0F,   // m/s, velocity, vertical
        0.3F,   // rad, tilt
        0.25F,  // rad, yaw
        0.8F,   // rad/s, roll and pitch rate
        0.7F,   // rad/s, yaw rate
        2.0F,   // N, thrust
        0.13F,  // N m, roll and pitch torque
        0.03F,  // N m, yaw torque
        2.5F,   // m s, integral of position, horizontal
        0.7F,   // m s, integral of position, vertical
        1.5F,   // rad s, integral of yaw
    },
    // ours: for the designs that do not know the lag; the rate loop at 5 rad/s, the motors at 12.5.
    {
        2.5F,    // m, position, horizontal
        1.0F,    // m, position, vertical
        1.6F,    // m/s, velocity, horizontal
        1.0F,    // m/s, velocity, vertical
        0.5F,    // rad, tilt
        0.3F,    // rad, yaw
        0.2F,    // rad/s, roll and pitch rate
        0.4F,    // rad/s, yaw rate
        2.0F,    // N, thrust
        0.008F,  // N m, roll and pitch torque
        0.05F,   // N m, yaw torque
        5.0F,    // m s, integral of position, horizontal
        2.0F,    // m s, integral of position, vertical
        0.7F,    // rad s, integral of yaw
    },
};

}  // namespace strix
