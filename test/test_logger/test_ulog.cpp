// What is in the file, read by a reader that knows ULog but not our code.
#include <unity.h>

#include "LogFlight.h"
#include "ULogReader.h"
#include "suites.h"

using namespace strix;

namespace {

LogFlight flight;

ULogFile read() {
  ULogFile file(flight.card.durableFile());
  TEST_ASSERT_EQUAL_STRING("", file.error.c_str());
  return file;
}

/// CRC-32 bit by bit, to check the table-driven one.
std::uint32_t crcBitwise(const std::uint8_t* data, std::size_t size) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t i = 0; i < size; ++i) {
    crc ^= data[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) * 0xEDB88320U);
  }
  return ~crc;
}

void test_the_crc_is_the_one_of_zip() {
  const char* check = "123456789";
  Crc32 crc;
  crc.update(reinterpret_cast<const std::uint8_t*>(check), 9);
  TEST_ASSERT_EQUAL_HEX32(0xCBF43926, crc.value());
  TEST_ASSERT_EQUAL_HEX32(0xCBF43926, crcBitwise(reinterpret_cast<const std::uint8_t*>(check), 9));
}

void test_a_log_that_was_only_begun_is_already_a_readable_file() {
  flight.begin(123456789);
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const ULogFile file = read();
  TEST_ASSERT_EQUAL_UINT64(123456789, file.start);
  TEST_ASSERT_EQUAL_STRING("Strix", file.infos.at("sys_name").c_str());
  TEST_ASSERT_EQUAL_STRING("Quad5in", file.infos.at("vehicle").c_str());
  TEST_ASSERT_EQUAL_STRING("test", file.infos.at("ver_hw").c_str());
  TEST_ASSERT_EQUAL_STRING("1.2.3", file.infos.at("ver_sw").c_str());
  TEST_ASSERT_EQUAL_STRING("cafe123", file.infos.at("ver_sw_git").c_str());
  TEST_ASSERT_EQUAL(kLogStreamCount + 1, file.subscriptions.size());
}

void test_an_unknown_version_is_left_out_and_a_long_one_is_cut() {
  const std::string longText(200, 'v');
  flight.begin(0);
  flight.logger.begin(0, {"Quad5in", "0123456789", longText.c_str(), "", 1});
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const ULogFile file = read();
  TEST_ASSERT_EQUAL(0, file.infos.count("ver_sw_git"));
  TEST_ASSERT_EQUAL_STRING("0123456789", file.infos.at("ver_hw").c_str());
  TEST_ASSERT_EQUAL_STRING(longText.substr(0, 40).c_str(), file.infos.at("ver_sw").c_str());
}

void test_the_parameters_stand_in_the_header_by_name_also_as_many_as_there_may_be() {
  std::array<LogParameter, LogParameters::kMost> table;
  for (std::size_t i = 0; i < table.size(); i += 2) {
    table[i] = {"SIXTEEN_LETTERS_", -1.5e-7F};
    table[i + 1] = {"SHORT", 30.0F};
  }
  for (const std::size_t count : {std::size_t{2}, LogParameters::kMost}) {
    flight.begin(0);
    flight.logger.begin(0, {"Quad5in", "test", "1", "2", 77, {count, table.data()}});
    flight.logger.log(topic::SensorMag{1, 2, {}});
    TEST_ASSERT_TRUE(flight.finish(1'000'000));
    const ULogFile file = read();
    TEST_ASSERT_EQUAL(2, file.parameters.size());
    TEST_ASSERT_EQUAL_FLOAT(-1.5e-7F, file.parameters.at("SIXTEEN_LETTERS_"));
    TEST_ASSERT_EQUAL_FLOAT(30.0F, file.parameters.at("SHORT"));
    TEST_ASSERT_EQUAL(1, file.of("sensor_mag").size());
  }
}

void test_saving_makes_durable_what_was_logged_without_waiting() {
  flight.begin(0);
  for (int i = 0; i < 500; ++i) flight.pass();
  flight.logger.logText(ulog::LogLevel::Error, flight.now, "the last words");
  flight.logger.save();
  TEST_ASSERT_FALSE(flight.logger.saved());
  int passes = 0;
  while (!flight.logger.saved() && passes < 1000) {
    flight.pass();
    ++passes;
  }
  TEST_ASSERT_LESS_THAN(100, passes);  // a sector a pass: 20 KB wait at most
  const std::vector<std::uint8_t> bytes = flight.card.durableFile();
  const std::string text(bytes.begin(), bytes.end());
  TEST_ASSERT_TRUE(text.find("the last words") != std::string::npos);
}

void test_a_dead_card_never_says_that_it_saved() {
  flight.begin(0);
  flight.card.refuses = true;
  flight.logger.save();
  for (int i = 0; i < 3000; ++i) flight.pass();
  TEST_ASSERT_FALSE(flight.logger.saved());
}

void test_every_field_is_read_back_under_its_name() {
  flight.begin(5);
  topic::VehicleGpsPosition gps;
  gps.timestamp = 0x0102030405060708;
  gps.timestamp_sample = 9;
  gps.lat = -593000000;
  gps.lon = 180684000;
  gps.alt = -12345;
  gps.speed_knots = 1.5F;
  gps.course_deg = 359.75F;
  gps.hdop = 0.9F;
  gps.fix_type = 3;
  gps.satellites_used = 250;
  flight.logger.logGPS(gps);
  topic::SensorCombined imu;
  imu.timestamp = 10;
  imu.timestamp_sample = 8;
  imu.accelerometer_m_s2 = {1.0F, 2.0F, -9.8F};
  imu.gyro_rad = {-0.1F, 0.2F, 0.3F};
  imu.temperature = 36.6F;
  flight.logger.logIMU(imu);
  GncRecords gnc;
  gnc.outputs = {11, 4, {1150.0F, 1200.0F, 1300.0F, 1700.0F}};
  gnc.attitude = {11, toArray(Quaternion{0.5F, -0.5F, 0.5F, -0.5F})};
  gnc.tick = {11, 0xDEADBEEF, 430, 2};
  flight.logger.logGNC(gnc);
  TEST_ASSERT_TRUE(flight.finish(1'000'000));

  const ULogFile file = read();
  const ULogFile::Record g = file.of("vehicle_gps_position").at(0);
  TEST_ASSERT_EQUAL_UINT64(0x0102030405060708, file.value<std::uint64_t>(g, "timestamp"));
  TEST_ASSERT_EQUAL_UINT64(9, file.value<std::uint64_t>(g, "timestamp_sample"));
  TEST_ASSERT_EQUAL_INT32(-593000000, file.value<std::int32_t>(g, "lat"));
  TEST_ASSERT_EQUAL_INT32(180684000, file.value<std::int32_t>(g, "lon"));
  TEST_ASSERT_EQUAL_INT32(-12345, file.value<std::int32_t>(g, "alt"));
  TEST_ASSERT_EQUAL_FLOAT(1.5F, file.value<float>(g, "speed_knots"));
  TEST_ASSERT_EQUAL_FLOAT(359.75F, file.value<float>(g, "course_deg"));
  TEST_ASSERT_EQUAL_FLOAT(0.9F, file.value<float>(g, "hdop"));
  TEST_ASSERT_EQUAL_UINT8(3, file.value<std::uint8_t>(g, "fix_type"));
  TEST_ASSERT_EQUAL_UINT8(250, file.value<std::uint8_t>(g, "satellites_used"));
  const ULogFile::Record i = file.of("sensor_combined").at(0);
  for (std::size_t k = 0; k < 3; ++k) {
    TEST_ASSERT_EQUAL_FLOAT(imu.accelerometer_m_s2[k],
                            file.value<float>(i, "accelerometer_m_s2", k));
    TEST_ASSERT_EQUAL_FLOAT(imu.gyro_rad[k], file.value<float>(i, "gyro_rad", k));
  }
  TEST_ASSERT_EQUAL_FLOAT(36.6F, file.value<float>(i, "temperature"));
  TEST_ASSERT_EQUAL_FLOAT(1700.0F,
                          file.value<float>(file.of("actuator_outputs").at(0), "output", 3));
  TEST_ASSERT_EQUAL_FLOAT(-0.5F, file.value<float>(file.of("vehicle_attitude").at(0), "q", 1));
  TEST_ASSERT_EQUAL_HEX32(0xDEADBEEF,
                          file.value<std::uint32_t>(file.of("control_tick").at(0), "state_hash"));
}

void test_each_sensor_has_its_own_instance_of_the_innovations() {
  flight.begin(0);
  topic::EstimatorAidSource aid;
  const auto mark = [&](std::uint8_t count) {
    aid.count = count;
    return aid;
  };
  flight.logger.logAid<AidSource::Tilt>(mark(30));
  flight.logger.logAid<AidSource::Magnetometer>(mark(31));
  flight.logger.logAid<AidSource::Altimeter>(mark(32));
  flight.logger.logAid<AidSource::Gps>(mark(33));
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const ULogFile file = read();
  for (int instance = 0; instance < 4; ++instance) {
    const auto records = file.of("estimator_aid_source", instance);
    TEST_ASSERT_EQUAL(1, records.size());
    TEST_ASSERT_EQUAL(30 + instance, file.value<std::uint8_t>(records[0], "count"));
  }
}

void test_texts_keep_their_order_level_and_time_and_long_ones_are_cut() {
  flight.begin(0);
  flight.logger.logText(ulog::LogLevel::Notice, 100, "armed");
  flight.logger.logText(ulog::LogLevel::Warning, 200, std::string(300, 'x'));
  flight.logger.logText(ulog::LogLevel::Error, 300, "");
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const ULogFile file = read();
  TEST_ASSERT_EQUAL(3, file.texts.size());
  TEST_ASSERT_EQUAL_STRING("armed", file.texts[0].text.c_str());
  TEST_ASSERT_EQUAL_CHAR('5', file.texts[0].level);
  TEST_ASSERT_EQUAL_UINT64(100, file.texts[0].time);
  TEST_ASSERT_EQUAL(Logger<FakeCard>::kTextLength, file.texts[1].text.size());
  TEST_ASSERT_EQUAL_STRING("", file.texts[2].text.c_str());
}

void test_a_text_that_finds_its_ring_full_is_counted() {
  flight.begin(0);
  for (int i = 0; i < 40; ++i) flight.logger.logText(ulog::LogLevel::Info, 0, "again");
  TEST_ASSERT_EQUAL_UINT32(8, flight.logger.dropped());
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const ULogFile file = read();
  TEST_ASSERT_EQUAL(32, file.texts.size());
  const auto status = file.of("log_status").at(0);
  TEST_ASSERT_EQUAL_UINT32(8, file.value<std::uint32_t>(status, "dropped_text"));
  TEST_ASSERT_EQUAL_UINT32(8, file.value<std::uint32_t>(status, "dropped"));
}

void test_every_byte_of_the_file_is_in_a_block_whose_crc_holds() {
  flight.begin(1000);
  for (int i = 0; i < 3000; ++i) {
    for (int k = 0; i % 100 == 0 && k < 32; ++k) {  // texts end blocks as well
      flight.logger.logText(ulog::LogLevel::Info, flight.now, std::string(100, 't'));
    }
    flight.pass();
  }
  TEST_ASSERT_TRUE(flight.finish(1'000'000));
  const std::vector<std::uint8_t> bytes = flight.card.durableFile();
  const ULogFile file = read();
  std::size_t blockStart = 0;
  std::uint32_t sequence = 0;
  for (const ULogFile::Record& end : file.of("log_block")) {
    const auto length = file.value<std::uint32_t>(end, "length");
    const std::size_t blockEnd = end.messageStart + 5 + end.size;
    TEST_ASSERT_EQUAL_UINT32(blockEnd - blockStart, length);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(sequence == 0 ? 8192 : 4096, length);
    TEST_ASSERT_EQUAL_UINT32(77, file.value<std::uint32_t>(end, "boot_id"));
    TEST_ASSERT_EQUAL_UINT32(sequence++, file.value<std::uint32_t>(end, "sequence"));
    TEST_ASSERT_EQUAL_HEX32(crcBitwise(&bytes[blockStart], length - 4),
                            file.value<std::uint32_t>(end, "crc32"));
    blockStart = blockEnd;
  }
  TEST_ASSERT_EQUAL(bytes.size(), blockStart);
  // 3 s of 200 KB/s: blocks are nearly full, but for the two a second that a sync cuts short.
  TEST_ASSERT_GREATER_THAN_UINT32(140, sequence);
  TEST_ASSERT_LESS_THAN_UINT32(175, sequence);
}

}  // namespace

void runULogTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_crc_is_the_one_of_zip);
  RUN_TEST(test_a_log_that_was_only_begun_is_already_a_readable_file);
  RUN_TEST(test_an_unknown_version_is_left_out_and_a_long_one_is_cut);
  RUN_TEST(test_the_parameters_stand_in_the_header_by_name_also_as_many_as_there_may_be);
  RUN_TEST(test_saving_makes_durable_what_was_logged_without_waiting);
  RUN_TEST(test_a_dead_card_never_says_that_it_saved);
  RUN_TEST(test_every_field_is_read_back_under_its_name);
  RUN_TEST(test_each_sensor_has_its_own_instance_of_the_innovations);
  RUN_TEST(test_texts_keep_their_order_level_and_time_and_long_ones_are_cut);
  RUN_TEST(test_a_text_that_finds_its_ring_full_is_counted);
  RUN_TEST(test_every_byte_of_the_file_is_in_a_block_whose_crc_holds);
}
