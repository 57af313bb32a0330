#include "tools/commands/calls/call_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::commands::calls {
namespace {

using recording::tests::at;
using recording::tests::one_call;
using namespace std::chrono_literals;

TEST(TheLastCalls, ArePutTogetherFromAllThatIsHeardOfThem) {
  CallList sut(10);
  for (const recording::Entry& entry : one_call(1, 0)) {
    sut.add(entry);
  }
  ASSERT_EQ(sut.rows().size(), 1U);
  const CallRow row = sut.rows().front();
  EXPECT_EQ(row.state, "written");
  EXPECT_EQ(row.call.request, "2");
  EXPECT_EQ(row.call.response, "1.414214");
  EXPECT_EQ(row.took, 7'100us);
}

TEST(TheLastCalls, AreKnownFromTheReplyAloneWhereTheEventsWereMissed) {
  CallList sut(10);
  for (const recording::Entry& entry : one_call(1, 0)) {
    if (std::holds_alternative<fabric::Reply>(entry.sample)) {
      sut.add(entry);
    }
  }
  ASSERT_EQ(sut.rows().size(), 1U);
  const CallRow row = sut.rows().front();
  EXPECT_EQ(row.state, "answered");
  EXPECT_EQ(row.call.request, std::nullopt);
  EXPECT_EQ(row.call.response, "1.414214");
  EXPECT_EQ(row.took, 3'100us);
}

TEST(TheLastCalls, AreNoMoreThanAskedForAndTheNewestLast) {
  CallList sut(2);
  for (int number = 1; number <= 3; ++number) {
    for (const recording::Entry& entry :
         one_call(static_cast<std::uint64_t>(number), number * 10)) {
      sut.add(entry);
    }
  }
  ASSERT_EQ(sut.rows().size(), 2U);
  EXPECT_EQ(sut.rows().front().call.id.number, 2U);
  EXPECT_EQ(sut.rows().back().call.id.number, 3U);
}

}  // namespace
}  // namespace millrace::tools::commands::calls
