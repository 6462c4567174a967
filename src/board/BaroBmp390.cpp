#include "BaroBmp390.h"

#include <array>
#include <cstddef>
#include <cstring>

namespace strix {

namespace {

constexpr std::uint8_t kNewData = BMP3_DRDY_PRESS | BMP3_DRDY_TEMP;

// The sensor's range, datasheet table 2.
constexpr double kLowestPressure = 30'000.0;    // Pa
constexpr double kHighestPressure = 125'000.0;  // Pa
constexpr double kLowestTemperature = -40.0;    // degC
constexpr double kHighestTemperature = 85.0;    // degC

// What both a start and a restart set.
constexpr std::uint8_t kPressureOversampling = BMP3_OVERSAMPLING_8X;
constexpr std::uint8_t kTemperatureOversampling = BMP3_NO_OVERSAMPLING;
constexpr std::uint8_t kFilter = BMP3_IIR_FILTER_DISABLE;  // the estimator is the filter
constexpr std::uint8_t kRate = BMP3_ODR_50_HZ;

// The data rate's code halves 200 Hz so many times (datasheet 4.3.20), and a conversion must fit
// into it (3.9.2, longest times, us).
static_assert(5000U << kRate == BaroBmp390::kPeriod);
static_assert(234U + 392U + (2020U << kPressureOversampling) + 163U +
                  (2020U << kTemperatureOversampling) <
              BaroBmp390::kPeriod);

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
  lastReading_ = ::micros();
  begun_ = device_.holds(BMP3_REG_CHIP_ID, BMP390_CHIP_ID) && readCoefficients() && configure();
  return begun_;
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
  wanted.odr_filter.press_os = kPressureOversampling;
  wanted.odr_filter.temp_os = kTemperatureOversampling;
  wanted.odr_filter.iir_filter = kFilter;
  wanted.odr_filter.odr = kRate;
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

/// The same settings in one transfer, as pairs of address and value (datasheet 5.2.1), the mode
/// last. The coefficients are the factory's and have not changed.
void BaroBmp390::restart() {
  constexpr std::uint8_t kOversampling = kPressureOversampling | kTemperatureOversampling << 3U;
  constexpr std::uint8_t kPower = BMP3_MODE_NORMAL << 4U | BMP3_ENABLE << 1U | BMP3_ENABLE;
  constexpr std::array<std::uint8_t, 7> kPairs{kOversampling,   BMP3_REG_ODR,  kRate,
                                               BMP3_REG_CONFIG, kFilter << 1U, BMP3_REG_PWR_CTRL,
                                               kPower};
  if (device_.write(BMP3_REG_OSR, kPairs.data(), kPairs.size())) ++restarts_;
}

bool BaroBmp390::due(Micros now) const {
  return elapsed(now, lastReading_) >= kPause && elapsed(now, lastPoll_) >= kPollPeriod;
}

bool BaroBmp390::read(AltRaw& out) {
  const Micros now = ::micros();
  if (!begun_ || !due(now)) return false;
  lastPoll_ = now;
  if (silent_) {
    silent_ = false;
    lastReading_ = now;
    restart();
    return false;
  }
  std::uint8_t status = 0;
  if (!device_.read(BMP3_REG_SENS_STATUS, &status, 1)) return false;
  if ((status & kNewData) != kNewData) {
    silent_ = elapsed(now, lastReading_) >= kSilence;
    return false;
  }
  bmp3_data data{};
  if (bmp3_get_sensor_data(BMP3_ALL, &data, &bosch_) != BMP3_OK) return false;
  lastReading_ = now;
  if (!isGood(data)) return false;
  out.sampled = now;
  out.pressure = static_cast<float>(data.pressure);
  out.temperature = static_cast<float>(data.temperature);
  return true;
}

bool BaroBmp390::isGood(const bmp3_data& data) {
  const bool repeats = data.pressure == last_.pressure && data.temperature == last_.temperature;
  repeated_ = repeats ? repeated_ + 1 : 0;
  last_ = data;
  if (repeated_ >= kStuckAfter) {
    ++stuck_;
    return false;
  }
  if (!(data.pressure >= kLowestPressure && data.pressure <= kHighestPressure &&
        data.temperature >= kLowestTemperature && data.temperature <= kHighestTemperature)) {
    ++implausible_;
    return false;
  }
  return true;
}

}  // namespace strix
