// Variable requests on the wire, and their two endpoints.
#include <map>
#include <memory>
#include <optional>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/variable_endpoints.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using tests::run_until;
using wire::Codec;

Time at(int seconds) {
  return Time(std::chrono::seconds(1'700'000'000 + seconds));
}

VariableRequest some_request() {
  return {.requester = InstanceId::random(),
          .token = InstanceId::random(),
          .key = {"press", 2},
          .action = VariableAction::write,
          .names = {"V.E.TABLE", "V.E.NOTE"},
          .values = {{"1", "-2"}, {std::string("Ma\xDF\0x", 5)}},
          .first = 7,
          .patience = std::chrono::milliseconds(250),
          .age = std::chrono::milliseconds(20),
          .issuer = "she@panel",
          .at = at(1)};
}

VariableReply some_reply() {
  return {.token = InstanceId::random(),
          .done = true,
          .reason = "why",
          .results = {{.value = {.name = "V.E.TABLE",
                                 .type = ValueType::sgn16,
                                 .at = at(2),
                                 .is_array = true,
                                 .elements = std::vector<std::int64_t>{1, -2}},
                       .writable = true,
                       .size = 4,
                       .dimensions = {2}},
                      {.value = {.name = "V.E.NONE",
                                 .quality = Quality::refused,
                                 .reason = "0x710 symbol not found"},
                       .error = 0x710},
                      {.value = {.name = "V.E.NOTE",
                                 .type = ValueType::string,
                                 .at = at(2),
                                 .elements = std::vector<std::string>{"Ma\xDF"}}}},
          .before = {{.name = "V.E.TABLE",
                      .type = ValueType::sgn16,
                      .is_array = true,
                      .elements = std::vector<std::int64_t>{0, 0}}},
          .total = 500,
          .at = at(3)};
}

TEST(VariablesOnTheWire, NameWhatDoesNotFit) {
  VariableReply reply = some_reply();
  reply.results[1].value.name = std::string(256, 'X');
  EXPECT_THAT(Codec<VariableReply>::encode(reply).error(), HasSubstr("at most 255 fit"));
  reply = some_reply();
  reply.before[0].name = std::string(256, 'X');
  EXPECT_THAT(Codec<VariableReply>::encode(reply).error(), HasSubstr("at most 255 fit"));
  VariableRequest request = some_request();
  request.key.machine = std::string(64, 'm');
  EXPECT_THAT(Codec<VariableRequest>::encode(request).error(), HasSubstr("at most 63 fit"));
}

TEST(VariablesOnTheWire, NameTheExcessOfATooLongRequest) {
  const auto received = [](const VariableRequest& sent) {
    return Codec<VariableRequest>::decode(*Codec<VariableRequest>::encode(sent));
  };
  VariableRequest request = some_request();
  request.names.assign(1000, "V.E.A");
  EXPECT_THAT(received(request).excess, HasSubstr("1000 names; at most 256"));
  EXPECT_THAT(received(request).names, IsEmpty());
  request = some_request();
  request.names = {std::string(1U << 20U, 'A')};
  EXPECT_THAT(received(request).excess, HasSubstr("bytes of names and values; at most 65536"));
  request = some_request();
  request.values.assign(257, {});
  EXPECT_THAT(received(request).excess, HasSubstr("values for 257 names"));
  request = some_request();
  request.values[0].assign(5000, "");
  EXPECT_THAT(received(request).excess, HasSubstr("5001 elements; at most 4096"));
}

/// A gateway `here`, a requester `there`.
class VariableEndpoints : public testing::Test {
 protected:
  struct Requester {
    Requester(const dds::Participant& participant, boost::asio::io_context& context)
        : end(participant, context.get_executor(),
              [this](const VariableReply& reply) { replies.push_back(reply); }) {}
    std::vector<VariableReply> replies;
    endpoints::VariableRequestEndpoint end;
  };

  bool until(const std::function<bool()>& done) { return run_until(context, done); }

  VariableRequest question_of(const Requester& requester) {
    VariableRequest request = some_request();
    request.requester = requester.end.id();
    request.token = InstanceId::random();
    return request;
  }

  TwoProcesses processes;
  boost::asio::io_context context;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
  std::vector<VariableRequest> requests;
  std::vector<std::string> ignored;
  endpoints::VariableReplyEndpoint sut{
      here, context.get_executor(),
      [this](const VariableRequest& entry) { requests.push_back(entry); },
      [this](const std::string& line) { ignored.push_back(line); }};
};

TEST_F(VariableEndpoints, DeliverTheReplyToItsRequesterOnly) {
  Requester requester(there, context);
  Requester other(there, context);
  ASSERT_TRUE(until([&] { return requester.end.gateways() == 1 && other.end.gateways() == 1; }));
  const VariableRequest question = question_of(requester);
  ASSERT_TRUE(requester.end.publish(question));
  ASSERT_TRUE(until([&] { return !requests.empty(); }));
  EXPECT_EQ(requests[0], question);

  VariableReply reply = some_reply();
  reply.token = question.token;
  ASSERT_TRUE(sut.publish(question.requester, reply));
  ASSERT_TRUE(until([&] { return !requester.replies.empty(); }));
  EXPECT_EQ(requester.replies[0], reply);

  ASSERT_TRUE(other.end.publish(question_of(other)));
  ASSERT_TRUE(until([&] { return requests.size() == 2; }));
  ASSERT_TRUE(sut.publish(other.end.id(), some_reply()));
  ASSERT_TRUE(until([&] { return !other.replies.empty(); }));
  EXPECT_EQ(requester.replies.size(), 1U);
  EXPECT_EQ(other.replies.size(), 1U);
  EXPECT_EQ(sut.requesters(), 2U);
}

TEST_F(VariableEndpoints, CarryAMegabyteThatIsRefusedThere) {
  Requester requester(there, context);
  ASSERT_TRUE(until([&] { return requester.end.gateways() == 1; }));
  VariableRequest question = question_of(requester);
  question.names = {std::string(1U << 20U, 'A')};
  ASSERT_TRUE(requester.end.publish(question));
  ASSERT_TRUE(until([&] { return !requests.empty(); }));
  EXPECT_THAT(requests[0].excess, HasSubstr("1048"));
  EXPECT_EQ(requests[0].token, question.token);
}

// A regression: each new id cost a DDS writer in the gateway's loop, and at 2,000 a second no call
// was answered.
TEST_F(VariableEndpoints, AdmitFewNewRequestersOfAParticipantAndNameIt) {
  Requester flooding(there, context);
  ASSERT_TRUE(until([&] { return flooding.end.gateways() == 1; }));
  VariableRequest question = question_of(flooding);
  for (std::size_t i = 0; i < 200; ++i) {
    question.requester = InstanceId::random();
    ASSERT_TRUE(flooding.end.publish(question));
  }
  // Requests come in the order of their writer.
  question.names = {"the last one"};
  const auto last_is_there = [&] {
    static_cast<void>(flooding.end.publish(question));
    return std::ranges::any_of(requests, [](const VariableRequest& request) {
      return request.names.front() == "the last one";
    });
  };
  ASSERT_TRUE(until([&] { return !ignored.empty(); }));
  EXPECT_LE(requests.size(), endpoints::VariableReplyEndpoint::most_new_of_one);
  EXPECT_EQ(sut.requesters(), requests.size());
  EXPECT_THAT(ignored.front(),
              testing::MatchesRegex("participant [0-9a-f:]+ makes variable requests "
                                    "under ever new ids: more than 8 .*"));
  EXPECT_TRUE(until(last_is_there)) << "once the window is over";
}

TEST_F(VariableEndpoints, AnswerNoRequesterThatHasNotAsked) {
  const auto published = sut.publish(InstanceId::random(), some_reply());
  ASSERT_FALSE(published);
  EXPECT_THAT(published.error(), HasSubstr("is forgotten"));
  EXPECT_EQ(sut.requesters(), 0U);
}

}  // namespace
}  // namespace millrace::fabric
