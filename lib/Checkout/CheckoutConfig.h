/// What the checkout has to know of the board, and what it takes for good.
#pragma once

#include <cstdint>

#include "Vector3f.h"

namespace strix {

/// Pins, for its advice. main.cpp fills them from src/board/Pins.h.
struct CheckoutPins {
  std::uint8_t imuDataReady;
  std::uint8_t imuSda;   ///< on SPI: MOSI
  std::uint8_t imuScl;   ///< on SPI: clock
  std::uint8_t slowSda;  ///< magnetometer and altimeter
  std::uint8_t slowScl;
  std::uint8_t gpsRx;  ///< of the Teensy
  std::uint8_t gpsTx;
  std::uint8_t arm;
  std::uint8_t kill;
  std::uint8_t start;
  std::uint8_t imuSelect = 0;  ///< these two on SPI only: 0 when the IMU is on I2C
  std::uint8_t imuMiso = 0;
};

/// Readings a second that the board sets its devices to.
struct CheckoutRates {
  float imu = 1125.0F;  ///< Hz
  float mag = 100.0F;
  float alt = 50.0F;
  float gps = 10.0F;
};

/// What a good sensor gives while the aircraft stands still. Noise is that of DESIGN.md, 5, one
/// sigma, times kMargin: parts differ, and no table stands as still as a datasheet's.
struct CheckoutLimits {
  static constexpr float kMargin = 2.0F;
  float rate = 0.03F;                    ///< of the expected rate; an IMU's clock has 1 %
  float accelNoise = kMargin * 0.028F;   ///< m/s^2
  float gyroNoise = kMargin * 0.0031F;   ///< rad/s
  float magNoise = kMargin * 0.3F;       ///< uT
  float pressureNoise = kMargin * 2.0F;  ///< Pa
  float gravity = 0.03F;                 ///< of g: an ICM20649's zero may be 0.65 m/s^2 off
  float gyroBias = 0.2F;                 ///< rad/s, length
  float lowestField = 20.0F;             ///< uT: the earth has 22 to 67
  float highestField = 70.0F;            ///< uT
  float lowestPressure = 30'000.0F;      ///< Pa: a BMP390's range
  float highestPressure = 125'000.0F;    ///< Pa
  float lowestHeight = -500.0F;          ///< m: the Dead Sea, and low pressure
  float highestHeight = 5000.0F;         ///< m: where people live
  float heightDifference = 500.0F;       ///< m, standard atmosphere to GPS: weather is 350 m
  std::uint8_t repeats = 10;             ///< equal readings in a row: noise never does that
  std::uint8_t satellites = 6;           ///< both from SensorConfig: what navigation asks for
  float hdop = 2.5F;
  std::uint32_t gpsRejected = 2;  ///< lines in 5 s: one may be cut at either end
};

}  // namespace strix
