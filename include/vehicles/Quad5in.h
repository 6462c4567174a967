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
    // ours: the ratios are what counts, tuned with `strix gains` for a position step that settles
    // within 10 s without overshoot and for 45 deg and 6 dB with the motor lag, which the design
    // does not know: a small acceptable torque keeps the rate loop, 11 rad/s, below the motors' 25.
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
        3.0F,   // m s, integral of position, horizontal
        3.0F,   // m s, integral of position, vertical
        1.0F,   // rad s, integral of yaw
    },
    // ours: for designs that do not know the lag.
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
        3.0F,   // m s, integral of position, horizontal
        3.0F,   // m s, integral of position, vertical
        1.0F,   // rad s, integral of yaw
    },
};

}  // namespace strix
