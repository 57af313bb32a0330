#include "fabric/messages.hpp"

#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

const std::string canonical = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

TEST(CanonicalUuid, IsLowerCaseWithoutBracesAndBlanks) {
  EXPECT_EQ(canonical_uuid("560AACBF-6335-44a9-895A-8B27F3ED5E47"), canonical);
  EXPECT_EQ(canonical_uuid(" {560AACBF-6335-44A9-895A-8B27F3ED5E47}\r\n"), canonical);
}

TEST(CanonicalUuid, LeavesAnIdentifierThatIsNoUuidAsItIs) {
  // In the NC sample of the vendor's manual, one character of the service's UUID is missing.
  EXPECT_EQ(canonical_uuid("560AACBF-6335-44a9-895A-8B27F3ED5E4"),
            "560AACBF-6335-44a9-895A-8B27F3ED5E4");
  EXPECT_EQ(canonical_uuid("  Weather "), "Weather");
  EXPECT_EQ(canonical_uuid("{Weather}"), "{Weather}");
  EXPECT_EQ(canonical_uuid("  "), "");
}

TEST(InstanceId, ReadsWhatItWrites) {
  const InstanceId sut = InstanceId::random();
  EXPECT_TRUE(is_uuid(sut.to_string()));
  EXPECT_EQ(InstanceId::parse(sut.to_string()), sut);
  EXPECT_EQ(InstanceId::parse(canonical)->to_string(), canonical);
  EXPECT_EQ(InstanceId::parse("560AACBF-6335-44A9-895A-8B27F3ED5E47")->to_string(), canonical);
  EXPECT_FALSE(InstanceId::parse("560aacbf"));
}

TEST(InstanceId, IsAnotherOneEachTimeAndOfVersion4) {
  const InstanceId sut = InstanceId::random();
  EXPECT_NE(sut, InstanceId::random());
  EXPECT_EQ(sut.to_string()[14], '4');
  EXPECT_NE(std::string("89ab").find(sut.to_string()[19]), std::string::npos);
}

TEST(Messages, PrintTheirKeys) {
  EXPECT_EQ((ChannelKey{"cnc", 3}.to_string()), "cnc/3");
  EXPECT_EQ((CallId{0x5f3a9c0112d4, 17}.to_string()), "5f3a9c0112d4-17");
}

}  // namespace
}  // namespace millrace::fabric
