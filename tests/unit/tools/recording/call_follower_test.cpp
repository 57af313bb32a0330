#include "tools/recording/call_follower.hpp"

#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::recording {
namespace {

using std::chrono_literals::operator""us;
using tests::at;
using tests::one_call;

/// The result of `follower` for the last of `entries`; the others must end no call.
std::optional<FollowedCall> feed(CallFollower& follower, const std::vector<Entry>& entries) {
  std::optional<FollowedCall> last;
  for (const Entry& entry : entries) {
    EXPECT_FALSE(last);
    last = follower.add(entry);
  }
  return last;
}

Entry ready(const std::string& name) {
  InstanceNews news{.change = Change::ready, .identity = {}};
  news.identity.id.bytes.fill(0x11);
  news.identity.name = name;
  news.identity.host = "hall";
  return {.at = at(0), .sample = news};
}

std::vector<Entry> until_written(std::vector<Entry> entries) {
  entries.resize(6);
  return entries;
}

TEST(ACallFollower, TellsACallWhenItsAnswerIsWritten) {
  CallFollower sut;
  sut.add(ready("sq1"));
  const auto call = feed(sut, until_written(one_call(17, 0)));
  ASSERT_TRUE(call);
  EXPECT_EQ(call->id.to_string(), "5f-17");
  EXPECT_EQ(call->request, "2");
  EXPECT_EQ(call->response, "1.414214");
  EXPECT_EQ(call->response_state, 1U);
  EXPECT_EQ(call->instance_name, "sq1");
  EXPECT_EQ(call->host, "hall");
  EXPECT_EQ(call->duration(), 7100us);
  EXPECT_TRUE(sut.under_way().empty());
}

TEST(ACallFollower, ShowsTheCallThatIsUnderWay) {
  CallFollower sut;
  const auto entries = one_call(17, 0);
  EXPECT_FALSE(sut.add(entries[0]));
  EXPECT_FALSE(sut.add(entries[2]));
  ASSERT_EQ(sut.under_way().size(), 1U);
  EXPECT_EQ(sut.under_way().begin()->second.last, fabric::EventKind::dispatched);
}

TEST(ACallFollower, KnowsNoRequestAndNoTimeOfACallItSawHalfOf) {
  CallFollower sut;
  const auto call = sut.add(one_call(17, 0)[5]);
  ASSERT_TRUE(call);
  EXPECT_EQ(call->request, std::nullopt);
  EXPECT_EQ(call->duration(), std::nullopt);
}

TEST(ACallFollower, TellsAWithdrawnCall) {
  CallFollower sut;
  auto entries = until_written(one_call(17, 0));
  auto& event = std::get<fabric::Event>(entries.back().sample);
  event.kind = fabric::EventKind::withdrawn;
  event.text.clear();
  const auto call = feed(sut, entries);
  ASSERT_TRUE(call);
  EXPECT_EQ(call->last, fabric::EventKind::withdrawn);
  EXPECT_TRUE(call->response.empty());
}

TEST(ACallFollower, ForgetsACallWhoseEndItMissed) {
  CallFollower sut;
  sut.add(one_call(17, 0)[0]);
  const auto call = feed(sut, until_written(one_call(18, 100)));
  ASSERT_TRUE(call);
  EXPECT_EQ(call->id.number, 18U);
  EXPECT_EQ(call->seen, at(100));
  EXPECT_TRUE(sut.under_way().empty());
}

TEST(ACallFollower, TakesARequestThatNobodyServesForNoCall) {
  CallFollower sut;
  EXPECT_FALSE(sut.add({.sample = fabric::Event{.kind = fabric::EventKind::unserved}}));
  EXPECT_TRUE(sut.under_way().empty());
}

}  // namespace
}  // namespace millrace::tools::recording
