#include "tools/commands/names.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tools::commands {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> chosen_rows(const std::string& what) {
  return chosen(std::vector<std::string>{"mill", "mill_2", "560aacbf-6335-44a9-895a-8b27f3ed5e47"},
                what, [](const std::string& name) { return Names{name}; });
}

TEST(AName, ChoosesTheRowThatHasItOrElseThoseThatBeginWithIt) {
  EXPECT_THAT(chosen_rows("mill"), ElementsAre("mill"));
  EXPECT_THAT(chosen_rows("mi"), ElementsAre("mill", "mill_2"));
  EXPECT_THAT(chosen_rows("ill"), IsEmpty());
  EXPECT_THAT(chosen_rows(""), testing::SizeIs(3));
}

TEST(AName, IsComparedWithoutRegardToCaseUnlessARowHasItInThisCase) {
  EXPECT_THAT(chosen_rows("560AACBF-6335-44A9-895A-8B27F3ED5E47"), testing::SizeIs(1));
  EXPECT_THAT(chosen_rows("560AACBF-63"), testing::SizeIs(1));
  EXPECT_THAT(chosen_rows("MILL"), ElementsAre("mill"));
  EXPECT_THAT(chosen_rows("MI"), ElementsAre("mill", "mill_2"));
  EXPECT_EQ(match({"mill"}, "MILL"), Match::any_case);
  EXPECT_EQ(match({"mill"}, "mill"), Match::exact);
  EXPECT_EQ(match({"mill", "Mill"}, "Mill"), Match::exact);
}

}  // namespace
}  // namespace millrace::tools::commands
