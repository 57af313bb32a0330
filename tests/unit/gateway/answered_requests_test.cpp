#include "gateway/control/answered_requests.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;
using namespace std::chrono_literals;

const fabric::ChannelKey channel{"cnc", 1};
const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
const std::string other_uuid = "00000000-0000-4000-8000-000000000001";

class LeftoversTest : public testing::Test {
 protected:
  control::AnsweredRequests sut;
  SteadyTime now{1h};
};

TEST_F(LeftoversTest, TakesARequestBackOnceItsChannelHasBeenQuiet) {
  sut.keep(channel, uuid, now);
  ASSERT_EQ(sut.next_time(), now + control::AnsweredRequests::quiet);
  EXPECT_THAT(sut.due(now + control::AnsweredRequests::quiet - 1ms), IsEmpty());
  EXPECT_THAT(sut.due(now + control::AnsweredRequests::quiet), ElementsAre(Pair(channel, uuid)));
  EXPECT_EQ(sut.next_time(), std::nullopt);
}

TEST_F(LeftoversTest, SaysNothingOfARequestThatTheNextOneReplaces) {
  sut.keep(channel, uuid, now);
  EXPECT_EQ(sut.replace(channel, uuid), std::nullopt);
  EXPECT_THAT(sut.due(now + control::AnsweredRequests::quiet), IsEmpty());
}

TEST_F(LeftoversTest, TakesARequestBackWhenTheNextOneIsOfAnotherUuid) {
  sut.keep(channel, uuid, now);
  EXPECT_EQ(sut.replace(channel, other_uuid), uuid);
  EXPECT_EQ(sut.replace(channel, other_uuid), std::nullopt);
}

TEST_F(LeftoversTest, LooksAgainForWhatWasNotQuietForLongEnough) {
  sut.keep(channel, uuid, now);
  sut.keep({"cnc", 2}, uuid, now + 500ms);
  EXPECT_THAT(sut.due(now + control::AnsweredRequests::quiet), SizeIs(1));
  ASSERT_EQ(sut.next_time(), now + 2 * control::AnsweredRequests::quiet);
  EXPECT_THAT(sut.due(*sut.next_time()), ElementsAre(Pair(fabric::ChannelKey{"cnc", 2}, uuid)));
}

TEST_F(LeftoversTest, CountsTheQuietFromTheLastAnswer) {
  sut.keep(channel, uuid, now);
  sut.replace(channel, uuid);
  sut.keep(channel, uuid, now + 900ms);
  EXPECT_THAT(sut.due(now + control::AnsweredRequests::quiet), IsEmpty());
  EXPECT_THAT(sut.due(now + 2 * control::AnsweredRequests::quiet), SizeIs(1));
}

}  // namespace
}  // namespace millrace::gateway
