// Services with an inline handler: ServiceOptions::run_inline.
#include <array>
#include <chrono>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/ostream_sink.h>
#include <unistd.h>

#include "base/program/log.hpp"
#include "base/program/retrying_sink.hpp"
#include "fabric/endpoints/reply_endpoint.hpp"
#include "services/sdk/runner.hpp"
#include "tests/unit/services/sdk/service_fixture.hpp"

namespace millrace::services::sdk {
namespace {

using fabric::ServiceCode;
using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;

/// Within one process a request arrives in the thread that sends it: that of the test.
std::string this_thread() {
  std::ostringstream id;
  id << std::this_thread::get_id();
  return id.str();
}

Response name_the_thread(const Call&) {
  return {.text = this_thread()};
}

class InlineServiceTest : public ServiceTest {
 protected:
  [[nodiscard]] ServiceOptions inline_options() const {
    ServiceOptions options = this->options();
    options.run_inline = true;
    return options;
  }

  std::string answer(const Service& sut, std::uint64_t number) {
    call(request(sut, number));
    return next_reply().text;
  }
};

TEST_F(InlineServiceTest, RunsItsHandlerWhereCallsArrive) {
  const Service sut(inline_options(), name_the_thread, base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  EXPECT_EQ(answer(sut, 1), this_thread());
}

TEST_F(InlineServiceTest, OthersRunTheirHandlerOnAnotherThread) {
  const Service sut(options(), name_the_thread, base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  EXPECT_NE(answer(sut, 1), this_thread());
}

TEST_F(InlineServiceTest, LogsEachCallThatBegins) {
  for (const ServiceOptions& chosen : {inline_options(), options()}) {
    std::ostringstream text;
    const auto log = std::make_shared<spdlog::logger>(
        "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(text));
    log->set_level(spdlog::level::debug);
    {
      const Service sut(chosen, echo, log);
      ASSERT_TRUE(until_ready(sut));
      EXPECT_EQ(answer(sut, 1), "4");
    }
    EXPECT_THAT(text.str(), HasSubstr(R"(call 1-1 from cnc/1: "4", state 1, attempt 1)"));
  }
}

TEST_F(InlineServiceTest, MovesAHandlerThatIsTooSlowToAThreadOfItsOwnAndLogsIt) {
  std::ostringstream text;
  const auto log = std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(text));
  {
    const Service sut(
        inline_options(),
        [](const Call& call) {
          if (call.id().number == 1) {
            // It waits, which an inline handler must not.
            std::this_thread::sleep_for(2 * inline_limit);
          }
          return name_the_thread(call);
        },
        log);
    ASSERT_TRUE(until_ready(sut));
    EXPECT_EQ(answer(sut, 1), this_thread());
    EXPECT_NE(answer(sut, 2), this_thread());
  }
  EXPECT_THAT(text.str(), AllOf(HasSubstr("ms for call 1-1 in the receiving thread"),
                                HasSubstr("10.000 ms are allowed")));
}

TEST_F(InlineServiceTest, TurnsAnExceptionIntoAnErrorAnswerAndContinues) {
  const Service sut(
      inline_options(),
      [](const Call& call) -> Response {
        if (call.id().number == 1) {
          throw std::runtime_error("the gauge is off");
        }
        return echo(call);
      },
      base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  call(request(sut, 1));
  EXPECT_EQ(next_reply().code, ServiceCode::failed);
  EXPECT_EQ(answer(sut, 2), "4");
}

// A regression: its log is written in the receiving thread, so a stopped terminal stopped
// reception.
TEST_F(InlineServiceTest, AnswersAlthoughItsLogIsNotRead) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  ASSERT_GT(::fcntl(ends[1], F_SETPIPE_SZ, 4096), 0);
  {
    const Service sut(inline_options(), echo,
                      std::make_shared<spdlog::logger>(
                          "test", std::make_shared<base::program::RetryingSink>(ends[1])));
    ASSERT_TRUE(until_ready(sut));
    for (std::uint64_t number = 1; number <= 200; ++number) {
      ASSERT_EQ(answer(sut, number), "4");
    }
  }
  ::close(ends[0]);
  ::close(ends[1]);
}

/// Throws at the first request.
class FailingOnce : public fabric::endpoints::ReplyEndpointListener {
 public:
  void on_request(const fabric::Request& request) override {
    if (std::exchange(fails_, false)) {
      throw std::runtime_error("on purpose, by a test");
    }
    numbers.push_back(request.call.number);
  }
  void on_withdrawn(const fabric::RequestKey&) override {}

  std::vector<std::uint64_t> numbers;

 private:
  bool fails_ = true;
};

// A regression: the exception went into Cyclone's C code, which held its locks.
TEST_F(InlineServiceTest, ReceivesTheNextCallAfterAListenerThatThrows) {
  FailingOnce listener;
  fabric::InstanceIdentity identity{
      .id = fabric::InstanceId::random(), .uuid = fabric::canonical_uuid(uuid), .name = "test"};
  const fabric::endpoints::ReplyEndpoint sut(participant, context.get_executor(), identity,
                                             listener, fabric::endpoints::Receiving::directly);
  ASSERT_TRUE(until([&] { return gateway.ready.contains(identity.id); }));
  for (const std::uint64_t number : {1U, 2U}) {
    call({.key = {.machine = "cnc", .channel = 1},
          .call = {.epoch = 1, .number = number},
          .assigned = identity.id,
          .uuid = uuid,
          .state = 1});
  }
  EXPECT_TRUE(until([&] { return !listener.numbers.empty(); }));
  EXPECT_EQ(listener.numbers.back(), 2U);
}

class InlineRunnerTest : public testing::Test {
 protected:
  void use_end() { sut->set_endpoint(&end); }

  [[nodiscard]] fabric::Request request(std::uint16_t channel) const {
    return {.key = {.machine = "cnc", .channel = channel},
            .call = {.epoch = 1, .number = channel},
            .assigned = identity.id,
            .uuid = uuid,
            .state = 1,
            .may_wait = true};
  }

  /// The number of the call that waits for its own thread; 0 if there is none.
  [[nodiscard]] std::uint64_t waiting() const {
    const auto call = sut->next(std::chrono::steady_clock::now());
    return call ? call->id().number : 0;
  }

  std::vector<std::shared_ptr<const Call>> handled;
  const fabric::InstanceIdentity identity{
      .id = fabric::InstanceId::random(), .uuid = fabric::canonical_uuid(uuid), .name = "test"};
  const std::shared_ptr<Runner> sut = std::make_shared<Runner>(
      CallSchedulerOptions{.instance = identity.id}, base::program::no_log(),
      // A busy host may delay it for longer than inline_limit.
      InlineHandler{
          [this](std::shared_ptr<const Call> call) { handled.push_back(std::move(call)); },
          std::chrono::hours(1)});

 private:
  const tests::Domain domain;
  fabric::dds::Participant participant{{.domain = domain.number()}};
  boost::asio::io_context context;
  fabric::endpoints::ReplyEndpoint end{participant, context.get_executor(), identity, *sut,
                                       fabric::endpoints::Receiving::directly};
};

TEST_F(InlineRunnerTest, RunsEachCallAsItComes) {
  use_end();
  sut->on_request(request(1));
  ASSERT_THAT(handled, SizeIs(1));
  handled.front()->answer({.text = "done"});
  sut->on_request(request(2));
  EXPECT_THAT(handled, SizeIs(2));
  EXPECT_EQ(waiting(), 0U);
}

TEST_F(InlineRunnerTest, LeavesACallThatCannotBeAnsweredYetToAThreadOfItsOwn) {
  sut->on_request(request(1));
  EXPECT_THAT(handled, SizeIs(0));
  EXPECT_EQ(waiting(), 1U);
}

TEST_F(InlineRunnerTest, LeavesACallThatHadToWaitForAnotherOneToAThreadOfItsOwn) {
  use_end();
  sut->on_request(request(1));
  sut->on_request(request(2));
  ASSERT_THAT(handled, SizeIs(1));
  EXPECT_EQ(waiting(), 0U);
  handled.front()->answer({.text = "done"});
  EXPECT_THAT(handled, SizeIs(1));
  EXPECT_EQ(waiting(), 2U);
}

}  // namespace
}  // namespace millrace::services::sdk
