#include "gateway/dispatch/near_miss.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

const std::string served = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

TEST(ExplainUnserved, NamesTheCharacterThatIsMissingInTheVendorsOwnSample) {
  EXPECT_EQ(dispatch::explain_unserved("560AACBF-6335-44a9-895A-B27F3ED5E47", {served}),
            "no service has the UUID 560AACBF-6335-44a9-895A-B27F3ED5E47; did you mean "
            "560aacbf-6335-44a9-895a-8b27f3ed5e47, one character is missing; it is malformed: 35 "
            "characters, a UUID has 36");
}

TEST(ExplainUnserved, CountsWhatElseIsDifferent) {
  EXPECT_THAT(dispatch::explain_unserved("660AACBF-6335-44a9-895A-8B27F3ED5E47", {served}),
              testing::EndsWith("5e47, one character differs"));
  EXPECT_THAT(dispatch::explain_unserved("660AACBF-6335-44a9-895A-8B27F3ED5E48", {served}),
              testing::EndsWith("5e47, 2 characters differ"));
  EXPECT_THAT(dispatch::explain_unserved("560AACBF-6335-44a9-895A-8B27F3ED5E477", {served}),
              testing::HasSubstr("5e47, one character is too many"));
}

TEST(ExplainUnserved, MakesNoGuessThatIsFarOff) {
  EXPECT_EQ(dispatch::explain_unserved("11111111-1111-1111-1111-111111111111", {served}),
            "no service has the UUID 11111111-1111-1111-1111-111111111111");
}

TEST(ExplainUnserved, PrefersTheNearest) {
  const std::string nearest = "560aacbf-6335-44a9-895a-8b27f3ed5e4f";
  EXPECT_THAT(
      dispatch::explain_unserved("560aacbf-6335-44a9-895a-8b27f3ed5e4", {nearest, served, nearest}),
      testing::HasSubstr("did you mean 560aacbf-6335-44a9-895a-8b27f3ed5e4f"));
}

TEST(ExplainUnserved, ReportsAnEmptyUuid) {
  EXPECT_THAT(dispatch::explain_unserved("", {served}),
              testing::StartsWith("V.G.SERVICE.UUID is empty"));
}

TEST(ExplainUnserved, KeepsAnIdentifierThatIsNoUuid) {
  EXPECT_EQ(dispatch::explain_unserved("square_root", {served}),
            "no service has the UUID square_root");
}

TEST(Malformed, NamesWhatIsWrong) {
  EXPECT_EQ(dispatch::malformed(served), "");
  EXPECT_EQ(dispatch::malformed("{560AACBF-6335-44a9-895A-8B27F3ED5E47}"), "");
  EXPECT_EQ(dispatch::malformed("560aacbf-6335-44a9-895a-8b27f3ed5e4g"),
            "'g' is not a hexadecimal digit");
  EXPECT_EQ(dispatch::malformed("560aacbf-633-544a9-895a-8b27f3ed5e47"),
            "its dashes are in the wrong places");
}

}  // namespace
}  // namespace millrace::gateway
