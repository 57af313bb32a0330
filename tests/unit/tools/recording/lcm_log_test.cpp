#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/lcm/mirror.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::recording {
namespace {

using namespace std::string_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::string big(std::uint64_t number, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) {
    text.push_back(static_cast<char>(number >> (8 * i)));
  }
  return text;
}

std::string event(const std::string& channel, const std::string& message) {
  return "\xED\xA1\xDA\x01"s + big(1, 8) + big(2, 8) + big(channel.size(), 4) +
         big(message.size(), 4) + channel + message;
}

std::string mirrored(std::uint64_t number) {
  const auto message = fabric::lcm::mirrored(
      {.at = fabric::Time(std::chrono::nanoseconds(number)),
       .uuid = "u",
       .sample = fabric::Request{
           .key = {"cnc", 1}, .call = {5, number}, .uuid = "u", .text = "text", .state = 1}});
  return event(message->channel, message->bytes);
}

struct Read {
  ReadReport report;
  std::vector<std::uint64_t> numbers;
};

Read read(const std::string& bytes, const Filter& filter = {}) {
  mcap::Memory file(bytes);
  Read read;
  read.report = read_entries(
      file, filter, [&](const Entry& entry) { read.numbers.push_back(call_of(entry).number); });
  return read;
}

TEST(LcmLog, IsReadAsARecording) {
  const Read sut = read(mirrored(1) + event("CAMERA", std::string(100'000, 'p')) + mirrored(2) +
                        event("MILLRACE_PRESENCE", "x") + mirrored(3));
  EXPECT_THAT(sut.numbers, ElementsAre(1, 2, 3));
  EXPECT_THAT(sut.report.problems, IsEmpty());
  EXPECT_EQ(sut.report.foreign, 2U);
  EXPECT_THAT(read(mirrored(1) + mirrored(2), {.call = fabric::CallId{5, 2}}).numbers,
              ElementsAre(2));
}

TEST(LcmLog, ThatIsCutOffIsReadUpToThere) {
  const std::string whole = mirrored(1) + mirrored(2);
  for (std::size_t size = mirrored(1).size() + 1; size < whole.size(); ++size) {
    const Read sut = read(whole.substr(0, size));
    ASSERT_THAT(sut.numbers, ElementsAre(1)) << size;
    ASSERT_THAT(sut.report.problems, SizeIs(1)) << size;
    EXPECT_EQ(sut.report.problems[0].offset, mirrored(1).size());
  }
}

TEST(LcmLog, IsReadAfterADamagedPlace) {
  const Read torn = read(mirrored(1) + "torn"s + mirrored(2));
  EXPECT_THAT(torn.numbers, ElementsAre(1, 2));
  EXPECT_THAT(torn.report.problems.at(0).text, HasSubstr("4 bytes are skipped"));
  std::string huge = mirrored(1);
  huge[24] = '\x7F';
  const Read sut = read(huge + mirrored(2));
  EXPECT_THAT(sut.numbers, ElementsAre(2));
  EXPECT_THAT(sut.report.problems.at(0).text, HasSubstr("after the end of the file"));
}

TEST(LcmLog, ReportsInvalidMirrorMessages) {
  const Read sut = read(mirrored(1) + event("MILLRACE_MIRROR.request", "nonsense!"));
  EXPECT_THAT(sut.numbers, ElementsAre(1));
  EXPECT_THAT(sut.report.problems.at(0).text, HasSubstr("on MILLRACE_MIRROR.request: "));
}

}  // namespace
}  // namespace millrace::tools::recording
