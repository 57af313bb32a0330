// The test bench for services: a handler with one call, and a loopback.
#include <atomic>
#include <future>
#include <stdexcept>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/sdk/testing/fake_call.hpp"
#include "services/sdk/testing/loopback.hpp"
#include "tests/support/await.hpp"

// In services::sdk the name `testing` would be ambiguous.
namespace millrace {
namespace {

namespace sdk = services::sdk;
using sdk::Call;
using sdk::Response;
using sdk::testing::FakeCall;
using sdk::testing::Loopback;
using testing::ElementsAre;
using testing::HasSubstr;

const std::string uuid = "b0ad2ab8-5e5c-4c8c-9b0b-0f6f0a1c2d3e";

Response length(const Call& call) {
  return {.text = std::to_string(call.text().size()), .state = call.attempt()};
}

TEST(AFakeCall, RunsAHandlerAsAServiceDoes) {
  const auto reply = FakeCall({.attempt = 3, .text = "hello"}).run(length);
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->text, "5");
  EXPECT_EQ(reply->state, 3U);
  EXPECT_EQ(reply->code, fabric::ServiceCode::ok);
}

TEST(AFakeCall, IsTheArgumentOfAHandler) {
  const FakeCall call({.text = "hello"});
  EXPECT_EQ(length(call), (Response{"5", 1}));
  EXPECT_EQ(static_cast<const Call&>(call).channel().to_string(), "cnc/1");
  EXPECT_EQ(static_cast<const Call&>(call).state(), 1U);
}

TEST(AFakeCall, GetsAnErrorResponseForAnExceptionAndForAResponseThatCannotBeSent) {
  const auto thrown = FakeCall().run(
      [](const Call&) -> Response { throw std::runtime_error("the gauge is missing"); });
  EXPECT_EQ(thrown->text, "ERROR: the gauge is missing");
  EXPECT_EQ(thrown->state, 500U);
  EXPECT_EQ(thrown->code, fabric::ServiceCode::failed);
  const auto refused = FakeCall({}, {.error_state = 99}).run([](const Call&) -> Response {
    return {"", 0};
  });
  EXPECT_THAT(refused->text, HasSubstr("answered with state 0"));
  EXPECT_EQ(refused->state, 99U);
  EXPECT_EQ(refused->code, fabric::ServiceCode::refused);
}

TEST(AFakeCall, ShowsInterimResponsesUntilItIsCancelled) {
  FakeCall sut;
  const Call& call = sut;
  call.interim({"half way", 50});
  EXPECT_THROW(call.interim({std::string(128, 'x'), 50}), std::invalid_argument);
  EXPECT_FALSE(call.cancelled());
  sut.cancel();
  EXPECT_TRUE(call.cancelled());
  call.interim({"too late", 60});
  EXPECT_THAT(sut.interims(), ElementsAre(Response{"half way", 50}));
  EXPECT_FALSE(sut.run(length)) << "nothing is sent";
}

TEST(AFakeCall, OfProgramsThatWaitForTheTextHasNoInterimResponses) {
  FakeCall sut({.text = "1"}, {.completion_signal = fabric::CompletionSignal::response});
  const auto reply = sut.run([](const Call& call) -> Response {
    call.interim({"half way", 50});
    return {call.text(), 0};
  });
  EXPECT_EQ(reply->state, 0U);
  EXPECT_THAT(sut.interims(), ElementsAre());
}

TEST(AFakeCall, MayBeAnsweredLaterOrDropped) {
  std::jthread later;
  const auto reply = FakeCall().run([&](const std::shared_ptr<const Call>& call) {
    later = std::jthread([call] { call->answer({"done", 4}); });
  });
  EXPECT_EQ(reply->text, "done");
  const auto dropped = FakeCall().run([](const std::shared_ptr<const Call>&) {});
  EXPECT_THAT(dropped->text, HasSubstr("dropped the call"));
}

TEST(AFakeCall, ShowsThatItWasDeclined) {
  const auto reply = FakeCall().run(
      [](const std::shared_ptr<const Call>& call) { call->decline("the gauge is in use"); });
  EXPECT_EQ(reply->kind, fabric::ReplyKind::declined);
  EXPECT_EQ(reply->text, "the gauge is in use");
}

TEST(AFakeCall, ReportsAHandlerThatDoesNotAnswer) {
  std::shared_ptr<const Call> kept;
  FakeCall sut;
  EXPECT_THROW(sut.run([&](std::shared_ptr<const Call> call) { kept = std::move(call); },
                       std::chrono::milliseconds(5)),
               std::runtime_error);
}

TEST(AFakeCall, RefusesATextThatNoNcProgramCanSend) {
  EXPECT_THROW(FakeCall({.text = std::string(128, 'x')}), std::invalid_argument);
}

class ALoopback : public testing::Test {
 protected:
  ~ALoopback() override { open(); }

  /// Lets the slow handlers return.
  void open() {
    if (!std::exchange(opened_, true)) {
      go_.set_value();
    }
  }
  std::size_t start_slow(sdk::ServiceOptions options = {}) {
    options.uuid = uuid;
    return sut.start(options, [this](const Call& call) -> Response {
      ++runs;
      call.interim({"begun", 50});
      passed_.wait();
      return {.text = call.text(), .state = call.attempt()};
    });
  }
  auto send(const std::string& text) { return sut.send({.uuid = uuid, .text = text}); }
  static void await_begin_of(const sdk::testing::Pending& pending) {
    tests::await("the handler", [&] { return !pending.interims().empty(); });
  }

  std::atomic<int> runs = 0;

 private:
  bool opened_ = false;
  std::promise<void> go_;
  std::shared_future<void> passed_ = go_.get_future().share();

 protected:
  /// Last: its handlers end before the others do.
  Loopback sut;
};

TEST_F(ALoopback, DispatchesEachCallToOneInstance) {
  start_slow();
  start_slow();
  auto first = send("1");
  auto second = send("2");
  auto third = send("3");
  EXPECT_NE(first.instance(), second.instance());
  EXPECT_EQ(third.attempt(), 0U) << "it waits for room";
  open();
  EXPECT_EQ(first.wait()->text, "1");
  EXPECT_EQ(second.wait()->text, "2");
  EXPECT_EQ(third.wait()->text, "3");
  EXPECT_EQ(runs, 3);
}

TEST_F(ALoopback, DispatchesTheCallOfAKilledInstanceAgain) {
  start_slow();
  auto pending = send("3");
  await_begin_of(pending);
  sut.kill(*pending.instance());
  EXPECT_EQ(pending.attempt(), 1U) << "no instance is alive";
  start_slow();
  EXPECT_EQ(pending.attempt(), 2U);
  open();
  EXPECT_EQ(pending.wait()->state, 2U);
  EXPECT_EQ(pending.replies(), 1U) << "the dead instance's response is lost";
  EXPECT_EQ(runs, 2);
}

TEST_F(ALoopback, BlocksTheCallOfAKilledInstanceThatMayRunAtMostOnce) {
  start_slow({.delivery = fabric::Delivery::at_most_once});
  start_slow({.delivery = fabric::Delivery::at_most_once});
  auto pending = send("3");
  await_begin_of(pending);
  sut.kill(*pending.instance());
  EXPECT_FALSE(pending.wait());
  EXPECT_TRUE(pending.blocked());
  EXPECT_EQ(runs, 1);
}

TEST_F(ALoopback, AnswersARepeatFromMemory) {
  start_slow();
  open();
  auto pending = send("3");
  EXPECT_EQ(pending.wait()->code, fabric::ServiceCode::ok);
  pending.repeat();
  EXPECT_EQ(pending.wait()->code, fabric::ServiceCode::repeated);
  EXPECT_EQ(pending.replies(), 2U);
  EXPECT_EQ(runs, 1);
}

TEST_F(ALoopback, RunsACallOnceThatIsRepeatedWhileItRuns) {
  start_slow({.concurrency = 2});
  auto pending = send("3");
  await_begin_of(pending);
  pending.repeat();
  open();
  EXPECT_EQ(pending.wait()->text, "3");
  EXPECT_EQ(runs, 1);
}

TEST_F(ALoopback, DropsTheResponseToAWithdrawnCall) {
  start_slow();
  auto pending = send("3");
  await_begin_of(pending);
  pending.withdraw();
  EXPECT_FALSE(pending.wait());
  auto next = send("4");
  EXPECT_EQ(next.attempt(), 0U) << "the cancelled run has not ended";
  open();
  EXPECT_EQ(next.wait()->text, "4");
  EXPECT_EQ(pending.replies(), 0U);
}

TEST_F(ALoopback, NotifiesAHandlerThatItsCallIsWithdrawn) {
  sut.start({.uuid = uuid}, [](const std::shared_ptr<const Call>& call) {
    std::promise<void> stopped;
    const std::stop_callback notified(call->stop_token(), [&] { stopped.set_value(); });
    stopped.get_future().wait();
    call->answer({"not read"});
  });
  auto pending = send("3");
  pending.withdraw();
  auto next = send("4");
  tests::await("room", [&] { return next.attempt() == 1; });
}

TEST_F(ALoopback, WithdrawsACallWhoseChannelMakesAnother) {
  start_slow({.concurrency = 2});
  const fabric::ChannelKey channel{.machine = "cnc", .channel = 1};
  auto first = sut.send({.key = channel, .uuid = uuid, .text = "1"});
  auto second = sut.send({.key = channel, .uuid = uuid, .text = "2"});
  open();
  EXPECT_EQ(second.wait()->text, "2");
  EXPECT_FALSE(first.wait());
}

TEST_F(ALoopback, DispatchesADeclinedCallToAnotherInstance) {
  const auto busy = sut.start({.uuid = uuid}, [](const std::shared_ptr<const Call>& call) {
    call->decline("the gauge is in use");
  });
  const auto other = sut.start({.uuid = uuid}, length);
  for (int i = 0; i < 3; ++i) {
    auto pending = send("3");
    EXPECT_EQ(pending.wait()->text, "1");
    EXPECT_EQ(pending.instance(), other);
  }
  sut.kill(other);
  auto alone = send("3");
  tests::await("further attempts", [&] { return alone.attempt() >= 3; });
  EXPECT_EQ(alone.instance(), busy);
}

TEST_F(ALoopback, DispatchesToTheChannelsAndTheUuidOfAnInstance) {
  sut.start({.uuid = "B0AD2AB8-5E5C-4C8C-9B0B-0F6F0A1C2D3E", .channels = {{"press", 0}}}, length);
  EXPECT_EQ(sut.send({.key = {"press", 2}, .uuid = uuid}).wait()->text, "0");
  EXPECT_EQ(sut.send({.key = {"cnc", 2}, .uuid = uuid}).attempt(), 0U);
  EXPECT_EQ(sut.send({.key = {"press", 2}, .uuid = "other"}).attempt(), 0U);
}

TEST_F(ALoopback, CancelsCallsThatRunAtItsEnd) {
  std::atomic<int> stopped = 0;
  {
    Loopback own;
    for (int i = 0; i < 2; ++i) {
      own.start({.uuid = uuid}, [&](const Call& call) -> Response {
        call.interim({"begun", 50});
        while (!call.cancelled()) {
          std::this_thread::yield();
        }
        ++stopped;
        return {};
      });
    }
    auto lost = own.send({.uuid = uuid});
    auto running = own.send({.uuid = uuid});
    await_begin_of(lost);
    await_begin_of(running);
    own.kill(*lost.instance());
  }
  EXPECT_EQ(stopped, 2);
}

TEST_F(ALoopback, AnswersManyCallsOfManyThreads) {
  constexpr int threads = 4;
  constexpr int calls = 250;
  for (int i = 0; i < 3; ++i) {
    sut.start({.uuid = uuid, .concurrency = 2}, length);
  }
  std::atomic<int> answered = 0;
  {
    std::vector<std::jthread> callers;
    for (int i = 0; i < threads; ++i) {
      callers.emplace_back([&] {
        for (int n = 0; n < calls; ++n) {
          const auto reply = send("hello").wait();
          answered += reply && reply->text == "5" ? 1 : 0;
        }
      });
    }
    const std::jthread killer([&] {
      for (std::size_t i = 0; i < 3; ++i) {
        sut.start({.uuid = uuid}, length);
        sut.kill(i);
      }
    });
  }
  EXPECT_EQ(answered, threads * calls);
}

}  // namespace
}  // namespace millrace
