#include "cnc/variables/service_interface.hpp"

#include <gmock/gmock.h>

#include "tests/unit/variables/controller_fixture.hpp"

namespace millrace::cnc::variables {
namespace {

using ads::ErrorCode;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;
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
  ServiceInterface make(bool handles = false) {
    return ServiceInterface(*client, 1, {.handles = handles});
  }
  Bytes& value(ServiceVariable variable) { return cnc.values[std::string(name_of(variable))]; }

  const std::vector<ServiceVariable> whole_request{uuid, request, request_state};
  static void expect_request(const ads::Result<std::vector<ServiceValue>>& values) {
    ASSERT_TRUE(values) << describe(values.error());
    EXPECT_THAT(*values,
                ElementsAre(ServiceValue("560aacbf"), ServiceValue("42"), ServiceValue(7U)));
  }
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

TEST_F(ServiceInterfaceTest, ReadsVariablesTogetherInOneRequest) {
  start();
  auto sut = make();
  const auto requests = client->counters().requests;
  expect_request(wait_for(sut.read(whole_request)));
  EXPECT_EQ(client->counters().requests, requests + 1);
}

TEST_F(ServiceInterfaceTest, ReadsThemOneByOneWithoutSumCommands) {
  start(false);
  auto sut = make();
  expect_request(wait_for(sut.read(whole_request)));
  const auto requests = client->counters().requests;
  expect_request(wait_for(sut.read(whole_request)));
  EXPECT_EQ(client->counters().requests, requests + 3) << "sums are tried once";
}

TEST_F(ServiceInterfaceTest, ReturnsTheErrorOfAVariableThatCannotBeRead) {
  start();
  auto sut = make();
  cnc.values.erase("V.G.SERVICE.REQUEST");
  EXPECT_EQ(wait_for(sut.read(whole_request)).error(), ErrorCode::symbol_not_found);
}

TEST_F(ServiceInterfaceTest, ReportsABusyControllerAndKeepsSumCommands) {
  start();
  auto sut = make();
  cnc.failure = ErrorCode::busy;
  EXPECT_EQ(wait_for(sut.read(whole_request)).error(), ErrorCode::busy);
  cnc.failure = ErrorCode::none;
  const auto requests = client->counters().requests;
  expect_request(wait_for(sut.read(whole_request)));
  EXPECT_EQ(client->counters().requests, requests + 1);
}

TEST_F(ServiceInterfaceTest, RefusesAStateOfAnotherSize) {
  start();
  auto sut = make();
  value(request_state) = {7, 0};
  EXPECT_EQ(wait_for(sut.read(request_state)).error(), ErrorCode::protocol_error);
}

TEST_F(ServiceInterfaceTest, LooksUpHandlesOnceIfConfigured) {
  start();
  auto sut = make(true);
  expect_request(wait_for(sut.read(whole_request)));
  EXPECT_THAT(cnc.calls, SizeIs(6)) << "three handles, three values";
  EXPECT_TRUE(wait_for(sut.write(request_state, 0U)));
  EXPECT_EQ(wait_for(sut.read(request_state)), ServiceValue(0U));
  EXPECT_THAT(cnc.calls, SizeIs(8));
  EXPECT_THAT(cnc.calls, Not(Contains(offset::read_by_name)));
  EXPECT_THAT(cnc.calls, Not(Contains(offset::write_by_name)));
}

TEST_F(ServiceInterfaceTest, ReplacesAStaleHandle) {
  start();
  auto sut = make(true);
  expect_request(wait_for(sut.read(whole_request)));
  cnc.handle_base = 0x20010000;
  expect_request(wait_for(sut.read(whole_request)));
  EXPECT_TRUE(wait_for(sut.write(request_state, 7U)));
  cnc.handle_base = 0x30010000;
  EXPECT_EQ(wait_for(sut.read(request_state)), ServiceValue(7U));
  EXPECT_TRUE(wait_for(sut.write(request_state, 1U)));
  EXPECT_EQ(wait_for(sut.read(request_state)), ServiceValue(1U));
}

TEST_F(ServiceInterfaceTest, UsesNamesWhereHandlesAreRefused) {
  cnc.knows_handles = false;
  start();
  auto sut = make(true);
  expect_request(wait_for(sut.read(whole_request)));
  cnc.calls.clear();
  expect_request(wait_for(sut.read(whole_request)));
  EXPECT_TRUE(wait_for(sut.write(request_state, 0U)));
  EXPECT_THAT(cnc.calls, ElementsAre(offset::read_by_name, offset::read_by_name,
                                     offset::read_by_name, offset::write_by_name));
  sut.forget();
  EXPECT_TRUE(wait_for(sut.read(request_state)));
  EXPECT_THAT(cnc.calls, Contains(offset::handle_by_name)) << "another controller may be there now";
}

TEST_F(ServiceInterfaceTest, DoesNotRepeatAWriteWhoseOutcomeIsUnknown) {
  start();
  auto sut = make(true);
  EXPECT_TRUE(wait_for(sut.write(request_state, 0U)));
  cnc.calls.clear();
  cnc.failure = ErrorCode::device_timeout;
  EXPECT_EQ(wait_for(sut.write(request_state, 1U)).error(), ErrorCode::device_timeout);
  EXPECT_THAT(cnc.calls, SizeIs(1));
}

}  // namespace
}  // namespace millrace::cnc::variables
