// The runner without a fabric: the owners of calls while they begin and end.
#include "services/sdk/runner.hpp"

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <stop_token>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/log.hpp"
#include "tests/support/await.hpp"
#include "tests/support/domain.hpp"

namespace millrace::services::sdk {
namespace {

using testing::IsNull;
using testing::NotNull;

class RunnerTest : public testing::Test {
 protected:
  [[nodiscard]] fabric::Request request(std::uint64_t number, std::uint32_t attempt = 1) const {
    return {.key = {.machine = "cnc", .channel = 1},
            .call = {.epoch = 1, .number = number},
            .attempt = attempt,
            .assigned = self};
  }
  void withdraw() { sut->on_withdrawn({{.machine = "cnc", .channel = 1}, 1, self}); }
  /// The call that waits for a thread, if there is one.
  std::shared_ptr<const Call> next() { return sut->next(std::chrono::steady_clock::now()); }

  const fabric::InstanceId self = fabric::InstanceId::random();
  const std::shared_ptr<Runner> sut = std::make_shared<Runner>(
      CallSchedulerOptions{.instance = self}, base::program::no_log(), InlineHandler{});
};

TEST_F(RunnerTest, HandsOutACallAgainThatIsRequestedAgainOnceItsCancelledRunHasEnded) {
  sut->on_request(request(1));
  const auto first = next();
  ASSERT_THAT(first, NotNull());
  withdraw();
  EXPECT_TRUE(first->cancelled());
  sut->on_request(request(1, 2));
  EXPECT_THAT(next(), IsNull());
  first->answer({.text = "stopped"});
  const auto second = next();
  ASSERT_THAT(second, NotNull());
  EXPECT_EQ(second->attempt(), 2U);
  EXPECT_FALSE(second->cancelled());
  EXPECT_TRUE(first->cancelled());
}

// A regression: the runner held a reference to the call, and its lock, while it cancelled it. If
// the handler released the call in that moment, the runner's reference was the last one: the
// destructor requested the lock that its own thread held. The moment is short, so the test repeats
// it.
TEST_F(RunnerTest, AllowsAHandlerToDropItsCallWhileItIsCancelled) {
  constexpr std::uint64_t most = 20'000;
  constexpr auto enough = std::chrono::seconds(2);
  auto all = std::async(std::launch::async, [&] {
    std::shared_ptr<const Call> call;
    std::atomic<std::uint64_t> ready = 0;
    std::atomic<std::uint64_t> go = 0;
    std::atomic<std::uint64_t> dropped = 0;
    std::atomic<bool> over = false;
    const std::jthread handler([&] {
      for (std::uint64_t number = 1; !over; ++number) {
        ready = number;
        ready.notify_one();
        while (go.load() < number) {
        }
        for (std::atomic<std::uint64_t> later = number % 256; later > 0; --later) {
        }
        call.reset();
        dropped = number;
        dropped.notify_one();
      }
    });
    const auto end = std::chrono::steady_clock::now() + enough;
    for (std::uint64_t number = 1; !over; ++number) {
      ready.wait(number - 1);
      sut->on_request(request(number));
      call = next();
      over = number == most || std::chrono::steady_clock::now() > end;
      go = number;
      withdraw();
      dropped.wait(number - 1);
    }
  });
  if (all.wait_for(tests::await_limit) != std::future_status::ready) {
    std::fputs("the runner waits for a lock that it holds itself\n", stderr);
    std::abort();
  }
}

TEST_F(RunnerTest, KeepsNothingOfCallsThatAreOver) {
  for (std::uint64_t number = 1; number <= 100; ++number) {
    sut->on_request(request(number));
    const auto call = next();
    ASSERT_THAT(call, NotNull());
    EXPECT_EQ(sut->remembered(), 1U);
    if (number % 2 == 0) {
      withdraw();
    }
    call->answer({.text = "done"});
  }
  EXPECT_EQ(sut->remembered(), 0U);
}

TEST_F(RunnerTest, ReleasesWaitersAndAcceptsNoCallsOnceItIsClosed) {
  sut->close();
  EXPECT_TRUE(sut->closed());
  sut->on_request(request(1));
  EXPECT_THAT(next(), IsNull());
}

TEST_F(RunnerTest, IsClosedByTheAnswerOfItsLastCallWhereItIsToCloseWhenIdle) {
  sut->on_request(request(1));
  sut->close_when_idle();
  EXPECT_FALSE(sut->closed());
  const auto call = next();
  ASSERT_THAT(call, NotNull());
  EXPECT_FALSE(sut->closed());
  call->answer({.text = "done"});
  EXPECT_TRUE(sut->closed());
  sut->on_request(request(2));
  EXPECT_THAT(next(), IsNull());
}

/// A runner that passes its calls on.
class PassingRunner : public RunnerTest {
 protected:
  /// The calls passed on. There is no fabric, so nothing is sent.
  std::vector<std::shared_ptr<const Call>> passed;
  std::vector<fabric::CallId> cancelled;
  const std::shared_ptr<Runner> sut = std::make_shared<Runner>(
      CallSchedulerOptions{.instance = self}, base::program::no_log(),
      InlineHandler{.handler = [this](const auto& call) { passed.push_back(call); },
                    .forwards = true,
                    .cancelled = [this](fabric::CallId call) { cancelled.push_back(call); }});
  tests::Domain domain;
  fabric::dds::Participant participant{{.domain = domain.number()}};
  boost::asio::io_context context;
  fabric::endpoints::ReplyEndpoint end{
      participant,
      context.get_executor(),
      {.id = self, .uuid = "weather", .name = "weather", .lease = std::chrono::milliseconds(500)},
      *sut,
      fabric::endpoints::Receiving::directly};
};

TEST_F(PassingRunner, PassesOnWhatCameBeforeItsEndWasKnown) {
  sut->on_request(request(1));
  EXPECT_THAT(passed, testing::IsEmpty());
  sut->set_endpoint(&end);
  ASSERT_EQ(passed.size(), 1U);
  EXPECT_EQ(passed.front()->id().number, 1U);
  sut->set_endpoint(nullptr);
}

TEST_F(PassingRunner, PassesOnACallThatWaitedWhereTheOneBeforeItIsAnswered) {
  sut->set_endpoint(&end);
  sut->on_request(request(1));
  fabric::Request other = request(2);
  other.key.channel = 2;
  other.may_wait = true;
  sut->on_request(other);
  ASSERT_EQ(passed.size(), 1U);
  // A copy: the list grows during its answer.
  const auto first = passed.front();
  first->answer({.text = "done"});
  ASSERT_EQ(passed.size(), 2U);
  EXPECT_EQ(passed.back()->id().number, 2U);
  sut->set_endpoint(nullptr);
}

TEST_F(PassingRunner, NotifiesOfACancelledCall) {
  sut->set_endpoint(&end);
  sut->on_request(request(1));
  sut->on_withdrawn({{.machine = "cnc", .channel = 1}, 1, self});
  EXPECT_THAT(cancelled, testing::ElementsAre(fabric::CallId{1, 1}));
  EXPECT_TRUE(passed.front()->cancelled());
  sut->set_endpoint(nullptr);
}

TEST_F(RunnerTest, AllowsAStopCallbackToAnswerTheCancelledCall) {
  sut->on_request(request(1));
  const auto call = next();
  ASSERT_THAT(call, NotNull());
  bool stopped = false;
  const std::stop_callback callback(call->stop_token(), [&] {
    stopped = true;
    call->answer({.text = "stopped"});
  });
  EXPECT_FALSE(stopped);
  withdraw();
  EXPECT_TRUE(stopped);
  EXPECT_EQ(sut->remembered(), 0U) << "its run has ended";
}

TEST_F(RunnerTest, IgnoresASecondEndOfADeclinedCall) {
  sut->on_request(request(1));
  const auto call = next();
  ASSERT_THAT(call, NotNull());
  call->decline("not now");
  call->answer({.text = "late"});
  EXPECT_EQ(sut->load().status.declined, 1U);
  EXPECT_EQ(sut->load().status.answered, 0U);
  EXPECT_EQ(sut->load().status.running, 0U);
}

}  // namespace
}  // namespace millrace::services::sdk
