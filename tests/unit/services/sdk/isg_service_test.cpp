#include "services/sdk/isg_service.h"

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <stdexcept>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/call_endpoint.hpp"
#include "services/sdk/isg_settings.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/recording_listeners.hpp"
#include "tests/unit/services/sdk/thread_shortage.hpp"

namespace millrace::services::sdk {
namespace {

using fabric::Reply;
using fabric::ServiceCode;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StrEq;

constexpr const char* c_uuid = "560AACBF-6335-44a9-895A-8B27F3ED5E47";

/// Follows the instruction in its request.
void follow_request(ISG_SERVICE* service, char* request, ADS_UINT32 request_state, char* response,
                    size_t max_response_size, ADS_UINT32* response_state) {
  EXPECT_EQ(max_response_size, 128U);
  *response_state = request_state + 1;
  if (std::strcmp(request, "fill") == 0) {
    std::memset(response, 'x', max_response_size);
  } else if (std::strcmp(request, "forget the state") == 0) {
    *response_state = 0;
  } else if (std::strcmp(request, "interim") == 0) {
    EXPECT_EQ(isgServiceInterim(service, "half", 50), ISG_SERVICE_CODE_OK);
    EXPECT_EQ(isgServiceInterim(service, std::string(128, 'x').c_str(), 50),
              ISG_SERVICE_CODE_INVALID_ARGUMENT);
  } else {
    EXPECT_EQ(isgServiceCancelled(service), 0);
    sprintf_s(response, max_response_size, "%s!", request);
  }
}

ISG_SERVICE_CODE refuse(ISG_SERVICE*, char*, ADS_UINT32, char*, size_t, ADS_UINT32*) {
  return 7;
}

class IsgService : public testing::Test {
 protected:
  IsgService() {
    ::setenv("MILLRACE_DOMAIN", std::to_string(domain.number()).c_str(), 1);
    ::setenv("MILLRACE_LOG_LEVEL", "error", 1);
    EXPECT_EQ(isgServiceConnectionCreateADSLocal(552, 553, &connection), ISG_SERVICE_CODE_OK);
  }
  ~IsgService() override { isgServiceDelete(&sut); }

  void call(const std::string& text) {
    ASSERT_TRUE(until([&] { return !gateway.ready.empty(); }));
    ASSERT_TRUE(end.publish(fabric::Request{.key = {.machine = "cnc", .channel = 1},
                                            .call = {.epoch = 1, .number = ++number},
                                            .assigned = gateway.ready.begin()->first,
                                            .uuid = c_uuid,
                                            .text = text,
                                            .state = 1}));
  }
  /// Polls for one call and returns the replies to it, the last one being final.
  std::vector<Reply> poll() {
    EXPECT_EQ(isgServicePollOnce(&sut, 10'000), ISG_SERVICE_CODE_OK);
    EXPECT_TRUE(until([&] {
      return !gateway.replies.empty() && gateway.replies.back().kind == fabric::ReplyKind::final;
    }));
    return std::exchange(gateway.replies, {});
  }
  bool until(const std::function<bool()>& done) { return tests::run_until(context, done); }

  tests::Domain domain;
  boost::asio::io_context context;
  fabric::dds::Participant participant{{.domain = domain.number()}};
  fabric::RecordingGateway gateway;
  fabric::endpoints::CallEndpoint end{participant, context.get_executor(), gateway};
  std::uint64_t number = 0;
  ISG_SERVICE_CONNECTION connection;
  ISG_SERVICE sut{};
};

TEST_F(IsgService, RunsItsFunctionOnceForEachPoll) {
  ASSERT_EQ(isgServiceCreate(c_uuid, "test", follow_request, &connection, &sut),
            ISG_SERVICE_CODE_OK);
  EXPECT_EQ(isgServicePollOnce(&sut, 0), ISG_SERVICE_CODE_NO_CALL);
  call("hello");
  const Reply reply = poll().back();
  EXPECT_EQ(reply.text, "hello!");
  EXPECT_EQ(reply.state, 2U);
}

TEST_F(IsgService, RefusesAnswersThatCannotBeSent) {
  ASSERT_EQ(isgServiceCreate(c_uuid, "test", follow_request, &connection, &sut),
            ISG_SERVICE_CODE_OK);
  call("fill");
  Reply reply = poll().back();
  EXPECT_EQ(reply.code, ServiceCode::refused);
  EXPECT_THAT(reply.text, HasSubstr("128 bytes"));
  call("forget the state");
  reply = poll().back();
  EXPECT_EQ(reply.code, ServiceCode::refused);
  EXPECT_THAT(reply.text, HasSubstr("state 0"));
}

TEST_F(IsgService, ShowsInterimStates) {
  ASSERT_EQ(isgServiceCreate(c_uuid, "test", follow_request, &connection, &sut),
            ISG_SERVICE_CODE_OK);
  call("interim");
  const auto replies = poll();
  EXPECT_EQ(replies.back().state, 2U);
  EXPECT_EQ(isgServiceInterim(&sut, "too late", 1), ISG_SERVICE_CODE_CLOSED);
}

TEST_F(IsgService, TurnsACodeIntoAnErrorAnswer) {
  ASSERT_EQ(isgServiceCreate(c_uuid, "test", refuse, &connection, &sut), ISG_SERVICE_CODE_OK);
  call("hello");
  const Reply reply = poll().back();
  EXPECT_EQ(reply.code, ServiceCode::failed);
  EXPECT_EQ(reply.text, "ERROR: the service function returned code 7");
}

TEST_F(IsgService, TurnsAnExceptionOfItsFunctionIntoAnError) {
  const auto throw_it = [](ISG_SERVICE*, char* request, ADS_UINT32, char*, size_t, ADS_UINT32*) {
    if (std::strcmp(request, "number") == 0) {
      throw 42;
    }
    throw std::runtime_error("no gauge");
  };
  ASSERT_EQ(isgServiceCreateVoid(c_uuid, "test", throw_it, &connection, &sut), ISG_SERVICE_CODE_OK);
  call("number");
  EXPECT_EQ(poll().back().code, ServiceCode::failed);
  call("exception");
  EXPECT_EQ(poll().back().text, "ERROR: no gauge");
}

TEST_F(IsgService, FailsIfAnyOfItsThreadsCannotBeStarted) {
  constexpr int threads = 3;  // for signals, and two for the fabric
  for (int started = 0; started < threads; ++started) {
    const tests::ThreadShortage shortage(started);
    EXPECT_EQ(isgServiceCreate(c_uuid, "test", follow_request, &connection, &sut),
              ISG_SERVICE_CODE_NOT_CONNECTED);
    EXPECT_EQ(isgServicePoll(&sut), ISG_SERVICE_CODE_CLOSED);
  }
  const tests::ThreadShortage enough(threads);
  EXPECT_EQ(isgServiceCreate(c_uuid, "test", follow_request, &connection, &sut),
            ISG_SERVICE_CODE_OK);
}

// As a shell script starts a command with '&'.
TEST_F(IsgService, KeepsASignalIgnoredThatWasIgnoredAtItsStart) {
  struct sigaction ignored {};
  struct sigaction before {};
  ignored.sa_handler = SIG_IGN;
  ::sigaction(SIGINT, &ignored, &before);
  ASSERT_EQ(isgServiceCreate(c_uuid, "test", follow_request, &connection, &sut),
            ISG_SERVICE_CODE_OK);
  struct sigaction interrupt {};
  struct sigaction terminate {};
  ::sigaction(SIGINT, nullptr, &interrupt);
  ::sigaction(SIGTERM, nullptr, &terminate);
  EXPECT_EQ(interrupt.sa_handler, SIG_IGN);
  EXPECT_NE(terminate.sa_handler, SIG_DFL);
  ::sigaction(SIGINT, &before, nullptr);
}

TEST_F(IsgService, PollsUntilItIsStopped) {
  ASSERT_EQ(isgServiceCreate(c_uuid, "test", follow_request, &connection, &sut),
            ISG_SERVICE_CODE_OK);
  std::thread poller([&] { EXPECT_EQ(isgServicePoll(&sut), ISG_SERVICE_CODE_OK); });
  call("hello");
  EXPECT_TRUE(until([&] { return !gateway.replies.empty(); }));
  EXPECT_EQ(isgServiceStop(&sut), ISG_SERVICE_CODE_OK);
  poller.join();
  EXPECT_TRUE(until([&] { return gateway.ready.empty(); }));
  EXPECT_EQ(isgServicePoll(&sut), ISG_SERVICE_CODE_CLOSED);
  EXPECT_EQ(isgServicePollOnce(&sut, 0), ISG_SERVICE_CODE_CLOSED);
}

TEST_F(IsgService, EndsPollsForOneCallToo) {
  ASSERT_EQ(isgServiceCreate(c_uuid, "test", follow_request, &connection, &sut),
            ISG_SERVICE_CODE_OK);
  EXPECT_EQ(isgServiceStop(&sut), ISG_SERVICE_CODE_OK);
  EXPECT_EQ(isgServicePollOnce(&sut, 10'000), ISG_SERVICE_CODE_CLOSED);
}

TEST_F(IsgService, ReportsEachMissingArgument) {
  constexpr auto invalid = ISG_SERVICE_CODE_INVALID_ARGUMENT;
  EXPECT_EQ(isgServiceCreate(nullptr, "test", follow_request, &connection, &sut), invalid);
  EXPECT_EQ(isgServiceCreate(c_uuid, nullptr, follow_request, &connection, &sut), invalid);
  EXPECT_EQ(isgServiceCreate(c_uuid, "test", ISG_SERVICE_FUNCTION{}, &connection, &sut), invalid);
  EXPECT_EQ(isgServiceCreate(c_uuid, "test", follow_request, nullptr, &sut), invalid);
  EXPECT_EQ(isgServiceCreate(c_uuid, "test", follow_request, &connection, nullptr), invalid);
}

TEST_F(IsgService, ReportsWrongUse) {
  EXPECT_EQ(isgServiceCreate("a*", "test", follow_request, &connection, &sut),
            ISG_SERVICE_CODE_INVALID_ARGUMENT);
  EXPECT_EQ(isgServiceConnectionCreateADSLocal(1, 2, nullptr), ISG_SERVICE_CODE_INVALID_ARGUMENT);
  EXPECT_EQ(isgServicePoll(nullptr), ISG_SERVICE_CODE_CLOSED);
  EXPECT_THAT(isgServiceCodeText(ISG_SERVICE_CODE_NO_CALL), StrEq("no call came within the time"));
}

TEST(SprintfS, LeavesAnEmptyStringWhenTheTextDoesNotFit) {
  char buffer[4] = "abc";
  EXPECT_EQ(sprintf_s(buffer, sizeof buffer, "%d", 123), 3);
  EXPECT_STREQ(buffer, "123");
  EXPECT_EQ(sprintf_s(buffer, sizeof buffer, "%d", 1234), -1);
  EXPECT_STREQ(buffer, "");
}

tl::expected<IsgSettings, std::string> read(const std::map<std::string, std::string>& variables) {
  const auto environment = [&](const char* name) -> const char* {
    const auto found = variables.find(name);
    return found == variables.end() ? nullptr : found->second.c_str();
  };
  return read_isg_settings(environment, "/no/such/file");
}

TEST(IsgSettings, HaveDefaults) {
  const auto sut = read({});
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->options.domain, 0U);
  EXPECT_EQ(sut->options.fabric, "millrace");
  EXPECT_TRUE(sut->options.channels.empty());
  EXPECT_EQ(sut->log_level, spdlog::level::info);
}

TEST(IsgSettings, ReadTheEnvironment) {
  const auto sut = read({{"MILLRACE_DOMAIN", "7"},
                         {"MILLRACE_FABRIC", "shop"},
                         {"MILLRACE_CHANNELS", " cnc/1  press/* "},
                         {"MILLRACE_DELIVERY", "at-most-once"},
                         {"MILLRACE_COMPLETION_SIGNAL", "response"},
                         {"MILLRACE_LOG_LEVEL", "debug"}});
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->options.domain, 7U);
  EXPECT_EQ(sut->options.fabric, "shop");
  EXPECT_THAT(sut->options.channels,
              ElementsAre(fabric::ChannelScope{"cnc", 1}, fabric::ChannelScope{"press", 0}));
  EXPECT_EQ(sut->options.delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(sut->options.completion_signal, fabric::CompletionSignal::response);
  EXPECT_EQ(sut->log_level, spdlog::level::debug);
}

TEST(IsgSettings, ReadTheFabricFromAFileByDefault) {
  const tests::TemporaryFolder folder;
  const std::string file = (folder.path() / "fabric.textproto").string();
  std::ofstream(file) << "domain: 9 fabric: 'shop'";
  const auto sut = read({{"MILLRACE_FABRIC_CONFIG", file}, {"MILLRACE_DOMAIN", "7"}});
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->options.fabric, "shop");
  EXPECT_EQ(sut->options.domain, 7U);
  EXPECT_THAT(read({{"MILLRACE_FABRIC_CONFIG", "no/such/file"}}).error(),
              HasSubstr("no/such/file"));
}

TEST(IsgSettings, UseTheFileOfTheHostWhereTheEnvironmentNamesNone) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "fabric.textproto";
  std::ofstream(file) << "domain: 9";
  const auto nothing = [](const char*) -> const char* { return nullptr; };
  const auto none = [](const char* name) {
    return std::string_view(name) == "MILLRACE_FABRIC_CONFIG" ? "" : nullptr;
  };
  EXPECT_EQ(read_isg_settings(nothing, file)->options.domain, 9U);
  EXPECT_EQ(read_isg_settings(none, file)->options.domain, 0U);
  EXPECT_EQ(read_isg_settings(nothing, folder.path() / "none")->options.domain, 0U);
}

TEST(IsgSettings, NameTheVariableThatIsWrong) {
  EXPECT_EQ(read({{"MILLRACE_DOMAIN", "233"}}).error(),
            "MILLRACE_DOMAIN=233: expected a number from 0 to 232");
  EXPECT_THAT(read({{"MILLRACE_DOMAIN", "x"}}).error(), HasSubstr("MILLRACE_DOMAIN=x"));
  EXPECT_THAT(read({{"MILLRACE_CHANNELS", "cnc"}}).error(), HasSubstr("MACHINE/N"));
  EXPECT_THAT(read({{"MILLRACE_DELIVERY", "once"}}).error(), HasSubstr("at-least-once"));
  EXPECT_THAT(read({{"MILLRACE_COMPLETION_SIGNAL", "text"}}).error(),
              HasSubstr("response-state or response"));
  EXPECT_THAT(read({{"MILLRACE_LOG_LEVEL", "loud"}}).error(), HasSubstr("trace"));
}

}  // namespace
}  // namespace millrace::services::sdk
