// The table of rates and rings, and that the manual has it.
#include <unity.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "Logger.h"
#include "suites.h"

using namespace strix;

namespace {

struct Sum {
  std::size_t bytesPerSecond = 0;
  std::size_t ring = 0;  // bytes
};

/// One row a ring, as in docs/logging.md.
template <class Stream>
std::string row(Sum& sum) {
  sum.bytesPerSecond += Stream::kBytesPerSecond;
  sum.ring += Stream::kMessageSize * Stream::kRecords;
  std::ostringstream text;
  text << "| " << kTopicName<typename Stream::Topic>;
  if (Stream::kInstance != 0) text << ' ' << int{Stream::kInstance};
  text << " | " << Stream::kMessageSize << " | " << Stream::kBytesPerSecond / Stream::kMessageSize
       << " | " << Stream::kRecords << " | " << Stream::kMessageSize * Stream::kRecords << " |";
  return text.str();
}

template <class... Streams>
std::vector<std::string> rows(const std::tuple<Streams...>* /*types*/) {
  Sum sum;
  std::vector<std::string> all{row<Streams>(sum)...};
  std::ostringstream text;
  text << "| all | | " << sum.bytesPerSecond << " B/s | | " << sum.ring << " |";
  all.push_back(text.str());
  return all;
}

void test_the_manual_has_the_table_of_the_rings() {
  const char* root = std::getenv("STRIX_ROOT");
  std::ifstream in(std::string(root == nullptr ? "." : root) + "/docs/logging.md");
  if (!in) TEST_IGNORE_MESSAGE("no docs/logging.md here");
  std::stringstream manual;
  manual << in.rdbuf();
  const auto table = rows(static_cast<const LogStreams*>(nullptr));
  std::string missing;
  for (const std::string& line : table) {
    if (manual.str().find("\n" + line + "\n") == std::string::npos) missing = line;
  }
  if (missing.empty()) return;
  for (const std::string& line : table) std::printf("%s\n", line.c_str());
  TEST_FAIL_MESSAGE(("docs/logging.md: put the table above there; it lacks " + missing).c_str());
}

template <class Stream>
void assertHoldsTwoSeconds() {
  constexpr std::size_t kPerTwoSeconds = 2 * Stream::kBytesPerSecond / Stream::kMessageSize;
  TEST_ASSERT_GREATER_OR_EQUAL_MESSAGE(kPerTwoSeconds, Stream::kRecords,
                                       kTopicName<typename Stream::Topic>.data());
}

template <class... Streams>
void assertAllHoldTwoSeconds(const std::tuple<Streams...>* /*types*/) {
  (assertHoldsTwoSeconds<Streams>(), ...);
}

void test_every_ring_holds_two_seconds_at_its_full_rate() {
  assertAllHoldTwoSeconds(static_cast<const LogStreams*>(nullptr));
}

}  // namespace

void runRingTableTests() {
  Unity.TestFile = __FILE__;
  RUN_TEST(test_the_manual_has_the_table_of_the_rings);
  RUN_TEST(test_every_ring_holds_two_seconds_at_its_full_rate);
}
