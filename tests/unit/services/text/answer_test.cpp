#include "services/text/answer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/messages.hpp"

namespace millrace::services::text {
namespace {

using testing::EndsWith;

TEST(Answer, OfAnErrorBeginsWithTheWord) {
  EXPECT_EQ(error(11, "no gauge 'x'"), (sdk::Response{.text = "ERROR: no gauge 'x'", .state = 11}));
}

TEST(Answer, OfALongErrorFitsAndShowsItsCut) {
  const sdk::Response sut = error(11, std::string(200, 'x'));
  EXPECT_EQ(sut.text.size(), fabric::max_text);
  EXPECT_THAT(sut.text, EndsWith("x..."));
}

TEST(Answer, OfAnErrorThatJustFitsIsNotCut) {
  const std::string message(fabric::max_text - 7, 'x');
  EXPECT_EQ(error(11, message).text, "ERROR: " + message);
}

TEST(InQuotes, ReplacesWhatDoesNotPrint) {
  EXPECT_EQ(in_quotes("a\r\nb\x81\x7F\xDF"), "'a??b??\xDF'");
}

TEST(InQuotes, ShortensLongText) {
  EXPECT_EQ(in_quotes(std::string(33, 'x')).size(), 34U);
}

}  // namespace
}  // namespace millrace::services::text
