#include "cnc/variables/service_interface.hpp"

#include <array>

#include <gmock/gmock.h>

#include "cnc/variables/channel.hpp"
#include "tests/unit/cnc/variables/controller_fixture.hpp"

namespace millrace::cnc::variables {
namespace {

using ads::ErrorCode;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using enum ServiceVariable;

Bytes padded(std::string_view text) {
  Bytes bytes(text.begin(), text.end());
  bytes.resize(128);
  return bytes;
}

class ServiceInterfaceTest : public ControllerFixture {
 protected:
  ServiceInterfaceTest() {
    cnc.values["V.G.SERVICE.UUID"] = padded("560aacbf");
    cnc.values["V.G.SERVICE.REQUEST"] = {'4', '2', 0};
    cnc.values["V.G.SERVICE.REQUEST_STATE"] = {7, 0, 0, 0};
    cnc.values["V.G.SERVICE.RESPONSE_STATE"] = {0, 0, 0, 0};
    cnc.values["V.G.SERVICE.RESPONSE"] = padded("");
  }
  ServiceInterface make() { return ServiceInterface(*client, 1); }
  Bytes& value(ServiceVariable variable) { return cnc.values[std::string(name_of(variable))]; }
};

TEST_F(ServiceInterfaceTest, ReadsTextsPaddedOrNotAndStates) {
  start();
  auto sut = make();
  EXPECT_EQ(*wait_for(sut.read(uuid)), ServiceValue("560aacbf"));
  EXPECT_EQ(*wait_for(sut.read(request)), ServiceValue("42"));
  EXPECT_EQ(*wait_for(sut.read(request_state)), ServiceValue(7U));
}

TEST_F(ServiceInterfaceTest, WritesTextsWithTheirNulAndStatesIn4Bytes) {
  start();
  auto sut = make();
  EXPECT_TRUE(wait_for(sut.write(response, "ok")));
  EXPECT_TRUE(wait_for(sut.write(response_state, 0x01020304U)));
  EXPECT_THAT(value(response), ElementsAre('o', 'k', 0));
  EXPECT_THAT(value(response_state), ElementsAre(4, 3, 2, 1));
}

TEST_F(ServiceInterfaceTest, RefusesALongTextWithoutARequest) {
  start();
  auto sut = make();
  EXPECT_EQ(wait_for(sut.write(response, std::string(128, 'x'))).error(), ErrorCode::invalid_size);
  EXPECT_THAT(cnc.calls, IsEmpty());
}

TEST_F(ServiceInterfaceTest, RefusesAStateOfAnotherSize) {
  start();
  auto sut = make();
  value(request_state) = {7, 0};
  EXPECT_EQ(wait_for(sut.read(request_state)).error(), ErrorCode::protocol_error);
}

TEST_F(ServiceInterfaceTest, DoesNotRepeatAWriteWhoseOutcomeIsUnknown) {
  start();
  auto sut = make();
  EXPECT_TRUE(wait_for(sut.write(request_state, 0U)));
  cnc.calls.clear();
  cnc.failure = ErrorCode::device_timeout;
  EXPECT_EQ(wait_for(sut.write(request_state, 1U)).error(), ErrorCode::device_timeout);
  EXPECT_THAT(cnc.calls, SizeIs(1));
}

class ServiceReadsTest : public ServiceInterfaceTest {
 protected:
  explicit ServiceReadsTest(bool sums = true) {
    cnc.channels = 2;
    start(sums);
    sut.emplace(*client);
  }

  static constexpr std::array whole_request{uuid, request, request_state};
  static constexpr std::array state{request_state};
  /// All of a request in channel 1, and REQUEST_STATE in channel 2.
  std::vector<ads::Result<ServiceReads::Values>> read() {
    return wait_for(sut->read({{1, whole_request}, {2, state}}));
  }
  static void expect_both(const std::vector<ads::Result<ServiceReads::Values>>& results) {
    ASSERT_THAT(results, SizeIs(2));
    ASSERT_TRUE(results[0]) << describe(results[0].error());
    EXPECT_THAT(*results[0],
                ElementsAre(ServiceValue("560aacbf"), ServiceValue("42"), ServiceValue(7U)));
    ASSERT_TRUE(results[1]) << describe(results[1].error());
    EXPECT_THAT(*results[1], ElementsAre(ServiceValue(7U)));
  }
  [[nodiscard]] std::uint64_t requests() const { return client->counters().requests; }

  std::optional<ServiceReads> sut;
};

TEST_F(ServiceReadsTest, OfSeveralChannelsShareARequest) {
  const auto before = requests();
  expect_both(read());
  EXPECT_EQ(requests(), before + 1);
}

TEST_F(ServiceReadsTest, OfOneChannelFailAlone) {
  cnc.values.erase("V.G.SERVICE.REQUEST");
  const auto results = read();
  EXPECT_EQ(results[0].error(), ErrorCode::symbol_not_found);
  EXPECT_THAT(*results[1], ElementsAre(ServiceValue(7U)));
}

TEST_F(ServiceReadsTest, ReportABusyControllerAndKeepSums) {
  cnc.failure = ErrorCode::busy;
  const auto results = read();
  EXPECT_EQ(results[0].error(), ErrorCode::busy);
  EXPECT_EQ(results[1].error(), ErrorCode::busy);
  cnc.failure = ErrorCode::none;
  const auto before = requests();
  expect_both(read());
  EXPECT_EQ(requests(), before + 1);
}

class ServiceReadsWithoutSums : public ServiceReadsTest {
 protected:
  ServiceReadsWithoutSums() : ServiceReadsTest(false) {}
};

TEST_F(ServiceReadsWithoutSums, AreMadeOneByOneAfterOneTry) {
  expect_both(read());
  const auto before = requests();
  expect_both(read());
  EXPECT_EQ(requests(), before + 4);
  sut->forget();
  expect_both(read());
  EXPECT_EQ(requests(), before + 9) << "another controller may be there now";
}

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
