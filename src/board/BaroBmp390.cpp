#include "BaroBmp390.h"

#include <array>
#include <cstddef>
#include <cstring>

namespace strix {

namespace {

constexpr std::uint8_t kNewData = BMP3_DRDY_PRESS | BMP3_DRDY_TEMP;
constexpr float kLowestPressure = 30'000.0F;    // Pa, the sensor's range
constexpr float kHighestPressure = 125'000.0F;  // Pa

void wait(std::uint32_t duration_us, void* /*device*/) { delayMicroseconds(duration_us); }

using Coefficients = std::array<std::byte, sizeof(bmp3_quantized_calib_data)>;

Coefficients bytesOf(const bmp3_quantized_calib_data& coefficients) {
  Coefficients bytes{};
  std::memcpy(bytes.data(), &coefficients, bytes.size());
  return bytes;
}

}  // namespace

std::int8_t BaroBmp390::readRegisters(std::uint8_t reg, std::uint8_t* data, std::uint32_t count,
                                      void* device) {
  return static_cast<I2cDevice*>(device)->read(reg, data, count) ? BMP3_OK : BMP3_E_COMM_FAIL;
}

std::int8_t BaroBmp390::writeRegisters(std::uint8_t reg, const std::uint8_t* data,
                                       std::uint32_t count, void* device) {
  return static_cast<I2cDevice*>(device)->write(reg, data, count) ? BMP3_OK : BMP3_E_COMM_FAIL;
}

bool BaroBmp390::begin() {
  bosch_ = bmp3_dev{};
  bosch_.intf = BMP3_I2C_INTF;
  bosch_.intf_ptr = &device_;
  bosch_.read = readRegisters;
  bosch_.write = writeRegisters;
  bosch_.delay_us = wait;
  return device_.holds(BMP3_REG_CHIP_ID, BMP390_CHIP_ID) && readCoefficients() && configure();
}

bool BaroBmp390::readCoefficients() {
  if (bmp3_init(&bosch_) != BMP3_OK) return false;
  const Coefficients first = bytesOf(bosch_.calib_data.quantized_calib_data);
  if (bmp3_init(&bosch_) != BMP3_OK) return false;
  return first == bytesOf(bosch_.calib_data.quantized_calib_data);
}

bool BaroBmp390::configure() {
  bmp3_settings wanted{};
  wanted.op_mode = BMP3_MODE_NORMAL;
  wanted.press_en = BMP3_ENABLE;
  wanted.temp_en = BMP3_ENABLE;
  wanted.odr_filter.press_os = BMP3_OVERSAMPLING_8X;  // with it a conversion takes 18.9 of 20 ms
  wanted.odr_filter.temp_os = BMP3_NO_OVERSAMPLING;
  wanted.odr_filter.iir_filter = BMP3_IIR_FILTER_DISABLE;  // the estimator is the filter
  wanted.odr_filter.odr = BMP3_ODR_50_HZ;
  bosch_.settings = wanted;
  constexpr std::uint16_t kSelected = BMP3_SEL_PRESS_EN | BMP3_SEL_TEMP_EN | BMP3_SEL_PRESS_OS |
                                      BMP3_SEL_TEMP_OS | BMP3_SEL_IIR_FILTER | BMP3_SEL_ODR;
  if (bmp3_set_sensor_settings(kSelected, &bosch_) != BMP3_OK) return false;
  if (bmp3_set_op_mode(&bosch_) != BMP3_OK) return false;
  if (bmp3_get_sensor_settings(&bosch_) != BMP3_OK) return false;
  const bmp3_settings& found = bosch_.settings;
  return found.op_mode == wanted.op_mode && found.press_en == wanted.press_en &&
         found.temp_en == wanted.temp_en &&
         found.odr_filter.press_os == wanted.odr_filter.press_os &&
         found.odr_filter.temp_os == wanted.odr_filter.temp_os &&
         found.odr_filter.iir_filter == wanted.odr_filter.iir_filter &&
         found.odr_filter.odr == wanted.odr_filter.odr;
}

bool BaroBmp390::read(AltRaw& out) {
  const Micros now = ::micros();
  if (elapsed(now, lastPoll_) < kPollPeriod) return false;
  lastPoll_ = now;
  if (!device_.holds(BMP3_REG_SENS_STATUS, kNewData, kNewData)) return false;
  bmp3_data data{};
  if (bmp3_get_sensor_data(BMP3_ALL, &data, &bosch_) != BMP3_OK) return false;
  const auto pressure = static_cast<float>(data.pressure);
  if (!(pressure >= kLowestPressure && pressure <= kHighestPressure)) {
    ++implausible_;
    return false;
  }
  out.sampled = now;
  out.pressure = pressure;
  out.temperature = static_cast<float>(data.temperature);
  return true;
}

}  // namespace strix
