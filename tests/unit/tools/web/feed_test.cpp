#include "tools/web/live/feed.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/web/live/messages.hpp"

namespace millrace::tools::web::live {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(AFeed, DeliversWhatWasPublishedInOrder) {
  Feeds feeds(2);
  const auto sut = feeds.open("a");
  feeds.publish("one");
  feeds.publish("two");
  EXPECT_EQ(*sut->take(), "one");
  EXPECT_EQ(*sut->take(), "two");
  EXPECT_EQ(sut->take(), nullptr);
}

TEST(AFeed, IsGivenUpWhenItIsNotRead) {
  Feeds feeds(2);
  const auto sut = feeds.open("a");
  const auto reader = feeds.open("a");
  int news = 0;
  sut->on_news([&] { ++news; });
  for (int i = 0; i < 10; ++i) {
    feeds.publish(std::string(1U << 20U, 'x'));
    EXPECT_NE(reader->take(), nullptr);
  }
  EXPECT_TRUE(sut->has_ended());
  EXPECT_EQ(sut->take(), nullptr);
  EXPECT_EQ(news, 9);
  EXPECT_FALSE(reader->has_ended());
}

TEST(Feeds, AreNoMoreThanThereIsRoomFor) {
  Feeds sut(2);
  auto feed = sut.open("a");
  const auto two = sut.open("a");
  EXPECT_EQ(sut.open("a"), nullptr);
  feed.reset();
  EXPECT_NE(sut.open("a"), nullptr);
}

TEST(Feeds, AreNotAllUsedByOneAddress) {
  Feeds sut(3);
  const auto first = sut.open("greedy");
  const auto second = sut.open("greedy");
  const auto third = sut.open("greedy");
  EXPECT_EQ(sut.open("greedy"), nullptr);
  const auto other = sut.open("other");
  ASSERT_NE(other, nullptr);
  EXPECT_TRUE(third->has_ended());
  EXPECT_FALSE(first->has_ended());
  EXPECT_EQ(sut.size(), 3U);
  EXPECT_EQ(sut.open("greedy"), nullptr);
  EXPECT_EQ(sut.open("other"), nullptr) << "they would take it from each other for ever";
}

TEST(TheHeadOfAnAnswer, KeepsThePageToItself) {
  const http::Response response{.status = 404, .headers = {{"ETag", "\"1\""}}};
  const std::string sut = head_text(response, {.keep_alive = false, .length = 12});
  EXPECT_THAT(sut, StartsWith("HTTP/1.1 404 Not Found\r\n"));
  EXPECT_THAT(sut, HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self'"));
  EXPECT_THAT(sut, HasSubstr("X-Content-Type-Options: nosniff\r\n"));
  EXPECT_THAT(sut, HasSubstr("Content-Length: 12\r\n"));
  EXPECT_THAT(sut, HasSubstr("ETag: \"1\"\r\n"));
  EXPECT_THAT(sut, EndsWith("Connection: close\r\n\r\n"));
  EXPECT_THAT(sut, Not(HasSubstr("unsafe")));
}

TEST(TheNameOfADownload, EndsNoHeader) {
  EXPECT_EQ(attachment_header("a\r\nSet-Cookie: b\".mcap"),
            "attachment; filename*=UTF-8''a%0D%0ASet-Cookie%3A%20b%22.mcap");
}

}  // namespace
}  // namespace millrace::tools::web::live
