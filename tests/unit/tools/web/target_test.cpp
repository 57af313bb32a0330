#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/web/http/message.hpp"

namespace millrace::tools::web::http {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ATarget, IsParsed) {
  const auto sut = parse_target("/api/calls/5f-17?limit=20&machine=lathe+2&x=%C3%A4");
  ASSERT_TRUE(sut);
  EXPECT_THAT(sut->path, ElementsAre("api", "calls", "5f-17"));
  EXPECT_EQ(sut->value("limit"), "20");
  EXPECT_EQ(sut->value("machine"), "lathe 2");
  EXPECT_EQ(sut->value("x"), "ä");
  EXPECT_EQ(sut->value("y"), "");
  EXPECT_THAT(parse_target("/")->path, IsEmpty());
  EXPECT_THAT(parse_target("/?wall")->path, IsEmpty());
  EXPECT_THAT(parse_target("/a%20b")->path, ElementsAre("a b"));
}

TEST(ATarget, MayHaveOneParameterSeveralTimes) {
  const auto sut = parse_target("/api/data/history?variable=1/a/X&since=&variable=1/a/Y");
  ASSERT_TRUE(sut);
  EXPECT_THAT(sut->values("variable"), ElementsAre("1/a/X", "1/a/Y"));
  EXPECT_EQ(sut->value("variable"), "1/a/Y");
  EXPECT_THAT(sut->values("since"), ElementsAre(""));
  EXPECT_THAT(sut->values("x"), IsEmpty());
}

TEST(ATarget, IsRefusedUnlessItIsPlain) {
  for (const char* text :
       {"", "*", "api", "http://elsewhere/", "//", "//etc/passwd", "/..", "/a/../b", "/a/%2e%2e/b",
        "/a/./b", "/a//b", "/a%2Fb", "/a%00b", "/%", "/%4", "/%zz", "/a?x=%", "/a?%q=1"}) {
    EXPECT_FALSE(parse_target(text)) << text;
  }
}

}  // namespace
}  // namespace millrace::tools::web::http
