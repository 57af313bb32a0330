#include "cnc/variables/channel.hpp"

#include <gmock/gmock.h>

#include "tests/unit/variables/controller_fixture.hpp"

namespace millrace::cnc::variables {
namespace {

using testing::ElementsAre;

class ChannelTest : public ControllerFixture {
 protected:
  ChannelTest() { cnc.values["V.G.A"] = {1, 2, 3, 4}; }
  void SetUp() override {
    start();
    sut.emplace(*client, 1);
  }
  std::optional<Channel> sut;
};

TEST_F(ChannelTest, ReadsAndWritesByName) {
  EXPECT_THAT(*wait_for(sut->read("V.G.A", 4)), ElementsAre(1, 2, 3, 4));
  EXPECT_TRUE(wait_for(sut->write("V.G.A", Bytes{5, 6, 7, 8})));
  EXPECT_THAT(cnc.values["V.G.A"], ElementsAre(5, 6, 7, 8));
}

TEST_F(ChannelTest, ReadsAndWritesByHandle) {
  const auto handle = wait_for(sut->handle("V.G.A"));
  ASSERT_TRUE(handle);
  const ElementOf element{*handle, {}};
  EXPECT_THAT(*wait_for(sut->read(element, 4)), ElementsAre(1, 2, 3, 4));
  EXPECT_TRUE(wait_for(sut->write(element, Bytes{5, 6, 7, 8})));
  EXPECT_THAT(cnc.values["V.G.A"], ElementsAre(5, 6, 7, 8));
}

TEST_F(ChannelTest, ReturnsTheErrorsOfTheController) {
  EXPECT_EQ(wait_for(sut->read("V.G.NONE", 4)).error(), ads::ErrorCode::symbol_not_found);
  Channel second(*client, 2);
  EXPECT_EQ(wait_for(second.read("V.G.A", 4)).error(), ads::ErrorCode::invalid_group);
}

TEST_F(ChannelTest, OfAnOlderControllerHasAnotherGroup) {
  cnc.group = decoder_group - new_group_bit;
  Channel older(*client, 1, {.group = cnc.group});
  EXPECT_TRUE(wait_for(older.read("V.G.A", 4)));
  EXPECT_FALSE(wait_for(sut->read("V.G.A", 4)));
}

}  // namespace
}  // namespace millrace::cnc::variables
