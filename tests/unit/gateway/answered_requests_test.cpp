#include "gateway/channel/answered_requests.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

using channel::AnsweredRequests;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using namespace std::chrono_literals;

fabric::RequestKey request(std::uint16_t channel, std::uint8_t instance = 1) {
  fabric::RequestKey key{{"cnc", channel}, 7, {}};
  key.instance.bytes.fill(instance);
  return key;
}

class AnsweredRequestsTest : public testing::Test {
 protected:
  AnsweredRequests sut;
  SteadyTime now{1h};
};

TEST_F(AnsweredRequestsTest, WithdrawsARequestOnceItHasBeenQuiet) {
  sut.add(request(1), now);
  ASSERT_EQ(sut.next_time(), now + AnsweredRequests::quiet);
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet - 1ms), IsEmpty());
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), ElementsAre(request(1)));
  EXPECT_EQ(sut.next_time(), std::nullopt);
}

TEST_F(AnsweredRequestsTest, WithdrawsNoRequestThatTheNextOneReplaces) {
  sut.add(request(1), now);
  sut.replace(request(1));
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), IsEmpty());
}

TEST_F(AnsweredRequestsTest, KeepsTheRequestOfAnotherInstanceOfTheSameChannel) {
  sut.add(request(1, 1), now);
  sut.add(request(1, 2), now);
  sut.replace(request(1, 2));
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), ElementsAre(request(1, 1)));
}

TEST_F(AnsweredRequestsTest, WithdrawsEachRequestAfterItsOwnQuietTime) {
  sut.add(request(1), now);
  sut.add(request(2), now + 500ms);
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), ElementsAre(request(1)));
  ASSERT_EQ(sut.next_time(), now + 500ms + AnsweredRequests::quiet);
  EXPECT_THAT(sut.due(*sut.next_time()), ElementsAre(request(2)));
}

TEST_F(AnsweredRequestsTest, CountsTheQuietFromTheLastAnswer) {
  sut.add(request(1), now);
  sut.add(request(1), now + 900ms);
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), IsEmpty());
  EXPECT_THAT(sut.due(now + 900ms + AnsweredRequests::quiet), SizeIs(1));
}

TEST_F(AnsweredRequestsTest, LimitsTheWithdrawalsAtOnce) {
  for (std::uint16_t channel = 1; channel <= AnsweredRequests::at_once + 1; ++channel) {
    sut.add(request(channel), now);
  }
  const SteadyTime first = now + AnsweredRequests::quiet;
  EXPECT_THAT(sut.due(first), SizeIs(AnsweredRequests::at_once));
  ASSERT_EQ(sut.next_time(), first + AnsweredRequests::pause);
  EXPECT_THAT(sut.due(*sut.next_time()), SizeIs(1));
}

TEST_F(AnsweredRequestsTest, GivesUpAllOfAChannel) {
  sut.add(request(1, 1), now);
  sut.add(request(1, 2), now);
  sut.add(request(2, 1), now);
  EXPECT_THAT(sut.take({"cnc", 1}), ElementsAre(request(1, 1), request(1, 2)));
  EXPECT_THAT(sut.take_all(), ElementsAre(request(2, 1)));
}

}  // namespace
}  // namespace millrace::gateway
