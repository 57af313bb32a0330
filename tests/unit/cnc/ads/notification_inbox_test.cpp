#include "cnc/ads/notification_inbox.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

constexpr std::uint16_t port = 552;

class NotificationInboxTest : public testing::Test {
 protected:
  void receive(std::uint32_t handle, const Bytes& value, std::uint16_t from = port) {
    sut.receive(from, {{0, {{handle, value}}}});
  }
  std::vector<std::uint32_t> strangers() {
    std::vector<std::uint32_t> all;
    for (const auto& stranger : sut.take_strangers()) {
      all.push_back(stranger.number);
    }
    return all;
  }

  NotificationInbox sut;
  std::vector<std::pair<std::size_t, Bytes>> notified;
  NotificationHandler record = [this](std::size_t item, BytesView value) {
    notified.emplace_back(item, Bytes(value.begin(), value.end()));
  };
};

TEST_F(NotificationInboxTest, NamesTheChangedItem) {
  sut.expect();
  sut.add(port, {7, 8}, record);
  receive(8, {1});
  receive(7, {2});
  EXPECT_THAT(notified, ElementsAre(Pair(1, Bytes{1}), Pair(0, Bytes{2})));
}

TEST_F(NotificationInboxTest, HoldsWhatComesBeforeTheAnswerIsRead) {
  sut.expect();
  receive(7, {1});
  EXPECT_THAT(notified, IsEmpty());
  sut.add(port, {7}, record);
  EXPECT_THAT(notified, ElementsAre(Pair(0, Bytes{1})));
  EXPECT_THAT(strangers(), IsEmpty());
}

TEST_F(NotificationInboxTest, ReportsAnUnknownHandleOnceAlsoIfItWasHeld) {
  receive(9, {1});
  receive(9, {2});
  sut.expect();
  receive(10, {1});
  sut.add(port, {7}, record);
  EXPECT_THAT(strangers(), ElementsAre(9, 10));
  receive(10, {3});
  EXPECT_THAT(strangers(), IsEmpty());
  EXPECT_THAT(notified, IsEmpty());
}

TEST_F(NotificationInboxTest, KeepsWhatAnotherRequestMayBeAbout) {
  sut.expect();
  sut.expect();
  receive(8, {1});
  sut.add(port, {7}, record);
  EXPECT_THAT(strangers(), IsEmpty());
  sut.add(port, {8}, record);
  EXPECT_THAT(notified, ElementsAre(Pair(0, Bytes{1})));
}

TEST_F(NotificationInboxTest, TheSameNumberOnAnotherPortIsAnotherHandle) {
  sut.expect();
  sut.add(port, {7}, record);
  receive(7, {1}, 551);
  EXPECT_THAT(notified, IsEmpty());
  EXPECT_THAT(strangers(), ElementsAre(7));
}

TEST_F(NotificationInboxTest, ALateSampleOfARemovedItemIsNotUnknown) {
  sut.expect();
  sut.add(port, {7}, record);
  sut.remove(port, {7});
  receive(7, {1});
  EXPECT_THAT(notified, IsEmpty());
  EXPECT_THAT(strangers(), IsEmpty());
}

TEST_F(NotificationInboxTest, AnItemThatWasRefusedHasNoHandle) {
  sut.expect();
  sut.add(port, {0, 7}, record);
  receive(0, {1});
  receive(7, {2});
  EXPECT_THAT(notified, ElementsAre(Pair(1, Bytes{2})));
}

TEST_F(NotificationInboxTest, ACallbackMayEndEverything) {
  sut.expect();
  sut.add(port, {7, 8}, [this](std::size_t item, BytesView value) {
    sut.clear();
    record(item, value);
  });
  const Bytes value{1};
  sut.receive(port, {{0, {{7, value}, {8, value}}}});
  EXPECT_THAT(notified, ElementsAre(Pair(0, value)));
}

}  // namespace
}  // namespace millrace::cnc::ads
