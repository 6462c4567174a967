/// Quad5in: 5 inch racing frame, 6S, 1800 KV, 5x4x3 propellers (DESIGN.md, 5).
/// Values marked 'ours' are not published; the reason stands beside them.
#pragma once

#include "Vehicle.h"

namespace strix {

constexpr Vehicle kQuad5in{
    "Quad5in",
    0.83F,                     // kg
    {0.003F, 0.004F, 0.005F},  // kg m^2
    // 0.08 m to the roll and to the pitch axis. tau_z (- + - +): a clockwise rotor turns the body
    // to the left, -z, so M1 and M3 turn clockwise.
    {{{0.08F, -0.08F, Spin::Clockwise},            // M1 front left
      {0.08F, 0.08F, Spin::CounterClockwise},      // M2 front right
      {-0.08F, 0.08F, Spin::Clockwise},            // M3 rear right
      {-0.08F, -0.08F, Spin::CounterClockwise}}},  // M4 rear left
    "rev/s",
    6.583e-5F,                            // N/(rev/s)^2
    7.51e-7F,                             // N m/(rev/s)^2
    0.04F,                                // s, DESIGN.md's stand-in for an unpublished value
    {1195.0F, 0.0F, 755.0F / 160000.0F},  // us = 1195 + n^2 / 160000 x 755
    "us",
    1150.0F,  // off
    1950.0F,  // most the ESC accepts
    1700.0F,  // flight cap: 69 % of 1150..1950, 327 rev/s, 3.5 weights
    60.0F,    // ours: 3600 rev/min, 12 % of the weight; slow enough to sink, too fast to lose sync
    22.8F,    // ours: V, 3.8 a cell, half full
    6,
    // ours, tuned with `strix gains`: a 30 deg step of roll or pitch rises in 0.18 s with 45 deg of
    // phase margin left and asks for 0.46 of the 0.57 N m that the motors have at hover; the yaw
    // step asks for half of their 0.08 N m. A steady wind's offset is gone 5 s after it began;
    // yaw's integral is slower, so that a bare 30 deg step stays within 3 deg with it, too.
    {
        1.5F,    // m, position, horizontal
        0.7F,    // m, position, vertical
        1.0F,    // m/s, velocity, horizontal
        1.0F,    // m/s, velocity, vertical
        0.15F,   // rad, tilt
        0.25F,   // rad, yaw
        1.25F,   // rad/s, roll and pitch rate
        1.0F,    // rad/s, yaw rate
        2.0F,    // N, thrust
        0.085F,  // N m, roll and pitch torque
        0.02F,   // N m, yaw torque
        1.0F,    // m s, integral of position, horizontal
        0.7F,    // m s, integral of position, vertical
        1.2F,    // rad s, integral of yaw
    },
    // ours: a small acceptable torque keeps the rate loop, 11 rad/s, below the motors' 25 rad/s,
    // which these designs do not know, so that 45 deg are left all the same.
    {
        1.0F,   // m, position, horizontal
        1.0F,   // m, position, vertical
        1.3F,   // m/s, velocity, horizontal
        1.0F,   // m/s, velocity, vertical
        0.5F,   // rad, tilt
        0.3F,   // rad, yaw
        0.4F,   // rad/s, roll and pitch rate
        0.6F,   // rad/s, yaw rate
        2.0F,   // N, thrust
        0.01F,  // N m, roll and pitch torque
        0.02F,  // N m, yaw torque
        2.0F,   // m s, integral of position, horizontal
        2.0F,   // m s, integral of position, vertical
        0.7F,   // rad s, integral of yaw
    },
};

}  // namespace strix
