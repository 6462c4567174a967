/// Stands in for Bosch's BMP3 driver (as it comes in Adafruit's BMP3XX library 2.1.x), which CI
/// does not have: the types and the five calls that BaroBmp390 uses, with the same register
/// accesses in the same order. Written from the BMP390 datasheet (BST-BMP390-DS002): registers
/// section 4.3, measurement time 3.9.2, compensation 8.4 to 8.6; none of Bosch's code.
#pragma once

#include <array>
#include <cstdint>

constexpr std::int8_t BMP3_OK = 0;
constexpr std::int8_t BMP3_E_DEV_NOT_FOUND = -2;
constexpr std::int8_t BMP3_E_INVALID_ODR_OSR_SETTINGS = -3;
constexpr std::int8_t BMP3_E_CMD_EXEC_FAILED = -4;
constexpr std::int8_t BMP3_E_CONFIGURATION_ERR = -5;
constexpr std::int8_t BMP3_E_COMM_FAIL = -7;

constexpr std::uint8_t BMP390_CHIP_ID = 0x60;
constexpr std::uint8_t BMP3_REG_CHIP_ID = 0x00;
constexpr std::uint8_t BMP3_REG_ERR = 0x02;
constexpr std::uint8_t BMP3_REG_SENS_STATUS = 0x03;
constexpr std::uint8_t BMP3_REG_DATA = 0x04;
constexpr std::uint8_t BMP3_REG_INT_CTRL = 0x19;
constexpr std::uint8_t BMP3_REG_PWR_CTRL = 0x1B;
constexpr std::uint8_t BMP3_REG_OSR = 0x1C;
constexpr std::uint8_t BMP3_REG_ODR = 0x1D;
constexpr std::uint8_t BMP3_REG_CONFIG = 0x1F;
constexpr std::uint8_t BMP3_REG_CALIB_DATA = 0x31;
constexpr std::uint8_t BMP3_REG_CMD = 0x7E;
constexpr std::uint8_t BMP3_CMD_RDY = 0x10;
constexpr std::uint8_t BMP3_DRDY_PRESS = 0x20;
constexpr std::uint8_t BMP3_DRDY_TEMP = 0x40;
constexpr std::uint8_t BMP3_MODE_SLEEP = 0;
constexpr std::uint8_t BMP3_MODE_NORMAL = 3;
constexpr std::uint8_t BMP3_ENABLE = 1;
constexpr std::uint8_t BMP3_NO_OVERSAMPLING = 0;
constexpr std::uint8_t BMP3_OVERSAMPLING_8X = 3;
constexpr std::uint8_t BMP3_IIR_FILTER_DISABLE = 0;
constexpr std::uint8_t BMP3_ODR_50_HZ = 2;
constexpr std::uint16_t BMP3_SEL_PRESS_EN = 1U << 1U;
constexpr std::uint16_t BMP3_SEL_TEMP_EN = 1U << 2U;
constexpr std::uint16_t BMP3_SEL_PRESS_OS = 1U << 4U;
constexpr std::uint16_t BMP3_SEL_TEMP_OS = 1U << 5U;
constexpr std::uint16_t BMP3_SEL_IIR_FILTER = 1U << 6U;
constexpr std::uint16_t BMP3_SEL_ODR = 1U << 7U;
constexpr std::uint8_t BMP3_ALL = 3;

enum bmp3_intf { BMP3_SPI_INTF, BMP3_I2C_INTF };

struct bmp3_odr_filter_settings {
  std::uint8_t press_os, temp_os, iir_filter, odr;
};
struct bmp3_settings {
  std::uint8_t op_mode, press_en, temp_en;
  bmp3_odr_filter_settings odr_filter;
};
struct bmp3_quantized_calib_data {
  double par_t1, par_t2, par_t3;
  double par_p1, par_p2, par_p3, par_p4, par_p5, par_p6, par_p7, par_p8, par_p9, par_p10, par_p11;
};
struct bmp3_calib_data {
  bmp3_quantized_calib_data quantized_calib_data;
};
struct bmp3_data {
  double temperature, pressure;  // degC, Pa
};
struct bmp3_dev {
  void* intf_ptr;
  bmp3_intf intf;
  std::int8_t (*read)(std::uint8_t, std::uint8_t*, std::uint32_t, void*);
  std::int8_t (*write)(std::uint8_t, const std::uint8_t*, std::uint32_t, void*);
  void (*delay_us)(std::uint32_t, void*);
  bmp3_settings settings;
  bmp3_calib_data calib_data;
};

namespace bmp3_standin {

inline std::int8_t readOne(bmp3_dev* dev, std::uint8_t reg, std::uint8_t& value) {
  return dev->read(reg, &value, 1, dev->intf_ptr);
}
inline std::int8_t writeOne(bmp3_dev* dev, std::uint8_t reg, std::uint8_t value) {
  return dev->write(reg, &value, 1, dev->intf_ptr);
}

/// Section 3.11.1 and 8.4: the bytes of the factory's memory, each scaled by a power of two.
inline bmp3_quantized_calib_data coefficients(const std::array<std::uint8_t, 21>& nvm) {
  const auto u16 = [&nvm](std::size_t i) { return nvm[i] | nvm[i + 1] << 8; };
  const auto s16 = [&u16](std::size_t i) { return static_cast<std::int16_t>(u16(i)); };
  const auto s8 = [&nvm](std::size_t i) { return static_cast<std::int8_t>(nvm[i]); };
  return {u16(0) * 0x1p8,
          u16(2) * 0x1p-30,
          s8(4) * 0x1p-48,
          (s16(5) - 16384) * 0x1p-20,
          (s16(7) - 16384) * 0x1p-29,
          s8(9) * 0x1p-32,
          s8(10) * 0x1p-37,
          u16(11) * 0x1p3,
          u16(13) * 0x1p-6,
          s8(15) * 0x1p-8,
          s8(16) * 0x1p-15,
          s16(17) * 0x1p-48,
          s8(19) * 0x1p-48,
          s8(20) * 0x1p-65};
}

/// Section 3.9.2, in us: whether the conversions fit into the period of the data rate.
inline bool fits(const bmp3_settings& settings) {
  const std::uint32_t pressure = 392U + (2000U << settings.odr_filter.press_os);
  const std::uint32_t temperature = 313U + (2000U << settings.odr_filter.temp_os);
  return 234U + pressure + temperature < (5000U << settings.odr_filter.odr);
}

inline void unpack(const std::uint8_t* osr, bmp3_odr_filter_settings& out) {
  out.press_os = osr[0] & 7U;
  out.temp_os = osr[0] >> 3U & 7U;
  out.odr = osr[1] & 0x1FU;
  out.iir_filter = osr[3] >> 1U & 7U;
}

}  // namespace bmp3_standin

inline std::int8_t bmp3_init(bmp3_dev* dev) {
  std::uint8_t value = 0;
  if (bmp3_standin::readOne(dev, BMP3_REG_CHIP_ID, value) != BMP3_OK) return BMP3_E_COMM_FAIL;
  if (value != BMP390_CHIP_ID) return BMP3_E_DEV_NOT_FOUND;
  if (bmp3_standin::readOne(dev, BMP3_REG_SENS_STATUS, value) != BMP3_OK) return BMP3_E_COMM_FAIL;
  if ((value & BMP3_CMD_RDY) == 0) return BMP3_E_CMD_EXEC_FAILED;
  if (bmp3_standin::writeOne(dev, BMP3_REG_CMD, 0xB6) != BMP3_OK) return BMP3_E_COMM_FAIL;
  dev->delay_us(2000, dev->intf_ptr);
  if (bmp3_standin::readOne(dev, BMP3_REG_ERR, value) != BMP3_OK) return BMP3_E_COMM_FAIL;
  if ((value & 2U) != 0) return BMP3_E_CMD_EXEC_FAILED;
  std::array<std::uint8_t, 21> nvm{};
  const std::int8_t result = dev->read(BMP3_REG_CALIB_DATA, nvm.data(), nvm.size(), dev->intf_ptr);
  dev->calib_data.quantized_calib_data = bmp3_standin::coefficients(nvm);
  return result;
}

inline std::int8_t bmp3_set_sensor_settings(std::uint32_t /*selected*/, bmp3_dev* dev) {
  const bmp3_settings& wanted = dev->settings;
  std::uint8_t power = 0;
  if (bmp3_standin::readOne(dev, BMP3_REG_PWR_CTRL, power) != BMP3_OK) return BMP3_E_COMM_FAIL;
  power = static_cast<std::uint8_t>((power & ~3U) | wanted.press_en | wanted.temp_en << 1U);
  if (bmp3_standin::writeOne(dev, BMP3_REG_PWR_CTRL, power) != BMP3_OK) return BMP3_E_COMM_FAIL;
  std::array<std::uint8_t, 4> old{};
  if (dev->read(BMP3_REG_OSR, old.data(), old.size(), dev->intf_ptr) != BMP3_OK) {
    return BMP3_E_COMM_FAIL;
  }
  if (!bmp3_standin::fits(wanted)) return BMP3_E_INVALID_ODR_OSR_SETTINGS;
  const bmp3_odr_filter_settings& filter = wanted.odr_filter;
  const std::array<std::uint8_t, 5> pairs{
      static_cast<std::uint8_t>(filter.press_os | filter.temp_os << 3U), BMP3_REG_ODR, filter.odr,
      BMP3_REG_CONFIG, static_cast<std::uint8_t>(filter.iir_filter << 1U)};
  return dev->write(BMP3_REG_OSR, pairs.data(), pairs.size(), dev->intf_ptr);
}

inline std::int8_t bmp3_set_op_mode(bmp3_dev* dev) {
  std::uint8_t power = 0;
  if (bmp3_standin::readOne(dev, BMP3_REG_PWR_CTRL, power) != BMP3_OK) return BMP3_E_COMM_FAIL;
  std::array<std::uint8_t, 4> set{};
  if (dev->read(BMP3_REG_OSR, set.data(), set.size(), dev->intf_ptr) != BMP3_OK) {
    return BMP3_E_COMM_FAIL;
  }
  bmp3_standin::unpack(set.data(), dev->settings.odr_filter);
  if (!bmp3_standin::fits(dev->settings)) return BMP3_E_INVALID_ODR_OSR_SETTINGS;
  if (bmp3_standin::readOne(dev, BMP3_REG_PWR_CTRL, power) != BMP3_OK) return BMP3_E_COMM_FAIL;
  power = static_cast<std::uint8_t>((power & ~0x30U) | dev->settings.op_mode << 4U);
  if (bmp3_standin::writeOne(dev, BMP3_REG_PWR_CTRL, power) != BMP3_OK) return BMP3_E_COMM_FAIL;
  std::uint8_t error = 0;
  if (bmp3_standin::readOne(dev, BMP3_REG_ERR, error) != BMP3_OK) return BMP3_E_COMM_FAIL;
  return (error & 4U) != 0 ? BMP3_E_CONFIGURATION_ERR : BMP3_OK;
}

inline std::int8_t bmp3_get_sensor_settings(bmp3_dev* dev) {
  std::array<std::uint8_t, 7> set{};
  if (dev->read(BMP3_REG_INT_CTRL, set.data(), set.size(), dev->intf_ptr) != BMP3_OK) {
    return BMP3_E_COMM_FAIL;
  }
  const std::uint8_t power = set[BMP3_REG_PWR_CTRL - BMP3_REG_INT_CTRL];
  dev->settings.op_mode = power >> 4U & 3U;
  dev->settings.press_en = power & 1U;
  dev->settings.temp_en = power >> 1U & 1U;
  bmp3_standin::unpack(&set[BMP3_REG_OSR - BMP3_REG_INT_CTRL], dev->settings.odr_filter);
  return BMP3_OK;
}

/// Section 8.5 and 8.6.
inline std::int8_t bmp3_get_sensor_data(std::uint8_t /*component*/, bmp3_data* data,
                                        bmp3_dev* dev) {
  std::array<std::uint8_t, 6> raw{};
  if (dev->read(BMP3_REG_DATA, raw.data(), raw.size(), dev->intf_ptr) != BMP3_OK) {
    return BMP3_E_COMM_FAIL;
  }
  const double p = raw[0] | raw[1] << 8 | raw[2] << 16;
  const bmp3_quantized_calib_data& c = dev->calib_data.quantized_calib_data;
  const double difference = (raw[3] | raw[4] << 8 | raw[5] << 16) - c.par_t1;
  const double t = difference * c.par_t2 + difference * difference * c.par_t3;
  const double out1 = c.par_p5 + c.par_p6 * t + c.par_p7 * t * t + c.par_p8 * t * t * t;
  const double out2 = p * (c.par_p1 + c.par_p2 * t + c.par_p3 * t * t + c.par_p4 * t * t * t);
  const double out3 = p * p * (c.par_p9 + c.par_p10 * t) + p * p * p * c.par_p11;
  data->temperature = t;
  data->pressure = out1 + out2 + out3;
  return BMP3_OK;
}
