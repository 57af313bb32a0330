#include "services/sdk/call_scheduler.hpp"

#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/unit/services/sdk/call_scheduler_fixture.hpp"

namespace millrace::services::sdk {
namespace {

using fabric::CallId;
using fabric::Moment;
using fabric::Reply;
using fabric::Request;
using fabric::RequestKey;
using fabric::ServiceCode;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST_F(CallSchedulerTest, StartsACallAndSendsItsAnswer) {
  ASSERT_EQ(started(request(1)), 1U);
  const auto sent = only<Send>(sut.on_result(call(1), answer, later(3)));
  ASSERT_THAT(sent, SizeIs(1));
  const Reply& reply = sent.front().reply;
  EXPECT_EQ(reply.call, call(1));
  EXPECT_EQ(reply.instance, self);
  EXPECT_EQ(reply.code, ServiceCode::ok);
  EXPECT_EQ(reply.text, "2.000000");
  EXPECT_EQ(reply.answered - reply.received, std::chrono::milliseconds(3));
  EXPECT_TRUE(sut.idle());
}

TEST_F(CallSchedulerTest, DeclinesACallForWhichItHasNoRoom) {
  ASSERT_EQ(started(at_once(request(1, 1))), 1U);
  const Actions actions = sut.on_request(at_once(again(request(2, 2), 3)), now);
  ASSERT_THAT(actions, SizeIs(1));
  const Reply& reply = std::get<Send>(actions.front()).reply;
  EXPECT_EQ(reply.kind, fabric::ReplyKind::declined);
  EXPECT_EQ(reply.call, call(2));
  EXPECT_EQ(reply.attempt, 3U);
  EXPECT_EQ(reply.text, "it runs at most 1 calls at once");
  EXPECT_EQ(sut.status().declined, 1U);
  EXPECT_THAT(sut.load().calls, testing::ElementsAre(call(1)));
  sut.on_result(call(1), answer, now);
  EXPECT_EQ(started(at_once(again(request(2, 2), 4))), 1U) << "it may be asked again";
}

// A regression: the gateway had dispatched the attempt once more when it learned that it was
// declined, and dispatched the call to another instance: it ran twice. Found by the simulation.
TEST_F(CallSchedulerTest, DeclinesAnAttemptForGood) {
  ASSERT_EQ(started(at_once(request(1, 1))), 1U);
  sut.on_request(at_once(request(2, 2)), now);
  sut.on_result(call(1), answer, now);
  const auto sent = only<Send>(sut.on_request(at_once(request(2, 2)), now));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.kind, fabric::ReplyKind::declined);
  EXPECT_EQ(started(at_once(again(request(2, 2), 2))), 1U) << "the next attempt is another one";
}

TEST_F(CallSchedulerTest, DeclinesNothingThatItHas) {
  ASSERT_EQ(started(at_once(request(1))), 1U);
  EXPECT_THAT(sut.on_request(at_once(again(request(1), 2)), now), IsEmpty());
  answered(1, answer);
  EXPECT_EQ(only<Send>(sut.on_request(at_once(request(1)), now)).front().reply.code,
            ServiceCode::repeated);
}

// A restarted gateway requests it once more, while the instance leaves. Found by the simulation:
// the call, which may run at most once, was dispatched to another instance.
TEST_F(CallSchedulerTest, RepeatsItsAnswersAlsoWhileItIsLeaving) {
  started(request(1));
  answered(1, answer);
  const auto sent = only<Send>(sut.decline(request(1), "it is leaving"));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.code, ServiceCode::repeated);
  EXPECT_EQ(sut.status().declined, 0U);
}

TEST_F(CallSchedulerTest, DoesNotDeclineARunningCallWhileItIsLeaving) {
  started(request(1));
  EXPECT_THAT(sut.decline(request(1), "it is leaving"), IsEmpty());
  const auto sent = only<Send>(sut.decline(request(2), "it is leaving"));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.kind, fabric::ReplyKind::declined);
}

TEST_F(CallSchedulerTest, LimitsTheNumberOfWaitingCalls) {
  CallScheduler small({.instance = self, .most_waiting = 1});
  small.on_request(request(1, 1), now);
  EXPECT_THAT(small.on_request(request(2, 2), now), IsEmpty());
  const auto sent = only<Send>(small.on_request(request(3, 3), now));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.kind, fabric::ReplyKind::declined);
}

TEST_F(CallSchedulerTest, NamesTheCallsThatItHas) {
  started(request(1, 1));
  started(request(2, 2));
  const fabric::InstanceLoad load = sut.load();
  EXPECT_THAT(load.calls, testing::ElementsAre(call(1), call(2)));
  EXPECT_EQ(load.status.waiting, 1U);
}

TEST_F(CallSchedulerTest, GivesUpTheCallOfAGatewayThatHasLostTheChannel) {
  started(request(1));
  Request successor = of_another_gateway(1);
  successor.succeeds = 1;
  const Actions actions = sut.on_request(successor, now);
  EXPECT_THAT(only<Cancel>(actions), SizeIs(1));
  // The gateway may be present after all.
  ASSERT_THAT(only<Send>(actions), SizeIs(1));
  EXPECT_EQ(only<Send>(actions).front().reply.kind, fabric::ReplyKind::declined);
  EXPECT_EQ(only<Send>(actions).front().reply.call, call(1));
}

// A regression: an operator had the running call dispatched again, to the same instance. It
// declined the attempt that was cancelled, and the gateway waited for the new one for ever. Found
// by the simulation (seed 1174747788395).
TEST_F(CallSchedulerTest, DeclinesTheWaitingAttemptOfAGatewayThatHasLostTheChannel) {
  started(request(1));
  sut.on_withdrawn(key_of(request(1)));
  ASSERT_EQ(started(again(request(1), 3)), 0U) << "its cancelled run has not ended";
  Request successor = of_another_gateway(1);
  successor.succeeds = 1;
  const auto sent = only<Send>(sut.on_request(successor, now));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.kind, fabric::ReplyKind::declined);
  EXPECT_EQ(sent.front().reply.attempt, 3U);
}

TEST_F(CallSchedulerTest, AnswersAGatewayThatHasLostTheChannelThatACallMustNotRunTwice) {
  CallScheduler once({.instance = self, .delivery = fabric::Delivery::at_most_once});
  once.on_request(request(1), now);
  Request successor = of_another_gateway(1);
  successor.succeeds = 1;
  const auto sent = only<Send>(once.on_request(successor, now));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.code, ServiceCode::failed);
  EXPECT_EQ(sent.front().reply.text,
            "ERROR: the call was cancelled while it ran, and it must not run twice");
}

TEST_F(CallSchedulerTest, RunsNoMoreCallsAtOnceThanAllowed) {
  EXPECT_EQ(started(request(1, 1)), 1U);
  EXPECT_EQ(started(request(2, 2)), 0U);
  const auto next = only<Start>(sut.on_result(call(1), answer, now));
  ASSERT_THAT(next, SizeIs(1));
  EXPECT_EQ(next.front().request.call, call(2));
}

TEST_F(CallSchedulerTest, RunsARepeatedCallOnceAndNamesTheLatestAttempt) {
  ASSERT_EQ(started(request(1)), 1U);
  EXPECT_EQ(started(request(1)), 0U);
  EXPECT_EQ(started(again(request(1), 3)), 0U);
  EXPECT_EQ(answered(1, answer).attempt, 3U);
}

TEST_F(CallSchedulerTest, RunsARepeatedCallOnceThatStillWaits) {
  ASSERT_EQ(started(request(1, 1)), 1U);
  started(request(2, 2));
  started(again(request(2, 2), 2));
  const auto next = only<Start>(sut.on_result(call(1), answer, now));
  ASSERT_THAT(next, SizeIs(1));
  EXPECT_EQ(next.front().request.attempt, 2U);
}

TEST_F(CallSchedulerTest, AnswersARepeatFromMemory) {
  started(request(1));
  answered(1, answer);
  const Actions actions = sut.on_request(again(request(1), 2), now);
  EXPECT_THAT(only<Start>(actions), IsEmpty());
  const auto sent = only<Send>(actions);
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.code, ServiceCode::repeated);
  EXPECT_EQ(sent.front().reply.attempt, 2U);
  EXPECT_EQ(sent.front().reply.text, "2.000000");
  EXPECT_EQ(sut.status().repeated, 1U);
}

// A regression: the repetition was written to the program as an answer. Found by the simulation.
TEST_F(CallSchedulerTest, RefusesAnAnswerThatCannotBeWrittenAlsoWhenItIsRepeated) {
  started(request(1));
  answered(1, Response{.text = "2.000000", .state = 0});
  const auto sent = only<Send>(sut.on_request(again(request(1), 2), now));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.code, ServiceCode::refused);
  EXPECT_EQ(sut.status().repeated, 1U);
}

TEST_F(CallSchedulerTest, ForgetsTheOldestAnswersOnly) {
  CallScheduler small({.instance = self, .memory = 2});
  for (std::uint64_t number = 1; number <= 3; ++number) {
    small.on_request(request(number), now);
    small.on_result(call(number), answer, now);
  }
  EXPECT_THAT(only<Send>(small.on_request(again(request(3), 2), now)), SizeIs(1));
  EXPECT_THAT(only<Send>(small.on_request(again(request(2), 2), now)), SizeIs(1));
  EXPECT_THAT(only<Start>(small.on_request(again(request(1), 2), now)), SizeIs(1));
}

TEST_F(CallSchedulerTest, AnswersAFailureWithTheErrorState) {
  started(request(1));
  const Reply reply = answered(1, tl::unexpected(std::string("no gauge")));
  EXPECT_EQ(reply.code, ServiceCode::failed);
  EXPECT_EQ(reply.text, "ERROR: no gauge");
  EXPECT_EQ(reply.state, 500U);
  EXPECT_EQ(sut.status().failed, 1U);
}

TEST_F(CallSchedulerTest, ShowsThatALongReasonIsShortened) {
  started(request(1));
  const Reply reply = answered(1, tl::unexpected(std::string(300, 'x')));
  EXPECT_THAT(reply.text, SizeIs(fabric::max_text));
  EXPECT_THAT(reply.text, EndsWith("x..."));
}

TEST_F(CallSchedulerTest, RefusesAnAnswerThatCannotBeSent) {
  const std::vector<std::pair<Response, std::string>> cases{
      {{.text = std::string(128, 'x')},
       "ERROR: the service's answer has 128 bytes, at most 127 fit"},
      {{.text = "ok", .state = 0},
       "ERROR: the service answered with state 0, which would not release the program"},
      {{.text = std::string("a\0b", 3)}, "ERROR: the service's answer contains a NUL byte"},
  };
  std::uint64_t number = 0;
  for (const auto& [response, text] : cases) {
    started(request(++number));
    const Reply reply = answered(number, response);
    EXPECT_EQ(reply.code, ServiceCode::refused);
    EXPECT_EQ(reply.state, 500U);
    EXPECT_EQ(reply.text, text);
  }
}

class ACallSchedulerForProgramsThatWaitForTheText : public CallSchedulerTest {};

TEST_F(ACallSchedulerForProgramsThatWaitForTheText,
       SendsState0ButNeitherEmptyTextsNorInterimReplies) {
  sut = CallScheduler({.instance = self, .completion_signal = fabric::CompletionSignal::response});
  sut.on_request(request(1), now);
  EXPECT_THAT(sut.on_interim(call(1), {.text = "half", .state = 50}, now), IsEmpty());
  Reply sent =
      std::get<Send>(sut.on_result(call(1), Response{.text = "x", .state = 0}, now).front()).reply;
  EXPECT_EQ(sent.code, ServiceCode::ok);
  EXPECT_EQ(sent.state, 0U);
  sut.on_request(request(2), now);
  sent =
      std::get<Send>(sut.on_result(call(2), Response{.text = "", .state = 1}, now).front()).reply;
  EXPECT_EQ(sent.code, ServiceCode::refused);
  EXPECT_THAT(sent.text, HasSubstr("without a text"));
}

TEST_F(CallSchedulerTest, SendsInterimRepliesOfACallThatRuns) {
  started(request(1));
  const auto sent = only<Send>(sut.on_interim(call(1), {.text = "half", .state = 50}, now));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.kind, fabric::ReplyKind::interim);
  EXPECT_EQ(sent.front().reply.state, 50U);
  answered(1, answer);
  EXPECT_THAT(sut.on_interim(call(1), answer, now), IsEmpty());
}

TEST_F(CallSchedulerTest, MeasuresTheTimeOfACallWhateverTheClock) {
  started(request(1));
  started(request(2, 2));
  Moment set_back = later(4);
  set_back.wall -= std::chrono::hours(1);
  const auto actions = sut.on_result(call(1), answer, set_back);
  const Reply reply = only<Send>(actions).at(0).reply;
  EXPECT_EQ(reply.received, now.wall);
  EXPECT_EQ(reply.answered, later(4).wall);
  EXPECT_EQ(sut.status().mean, std::chrono::milliseconds(4));
  // A regression: the second one had to wait for the first.
  set_back.steady = later(6).steady;
  const Reply second = only<Send>(sut.on_result(call(2), answer, set_back)).at(0).reply;
  EXPECT_EQ(second.started, later(4).wall);
  EXPECT_EQ(second.answered, later(6).wall);
}

TEST_F(CallSchedulerTest, CountsForTheStatus) {
  started(request(1));
  EXPECT_EQ(sut.status().running, 1U);
  sut.on_result(call(1), answer, later(4));
  const fabric::InstanceStatus status = sut.status();
  EXPECT_EQ(status.running, 0U);
  EXPECT_EQ(status.answered, 1U);
  EXPECT_EQ(status.mean, std::chrono::milliseconds(4));
  EXPECT_EQ(status.last_call, now.wall);
}

TEST_F(CallSchedulerTest, DeclinesAnAttemptThatItsHandlerDeclinesAndDoesNotRunItAgain) {
  started(request(1));
  const auto sent = only<Send>(sut.on_declined(call(1), "the gauge is in use", now));
  ASSERT_THAT(sent, SizeIs(1));
  EXPECT_EQ(sent.front().reply.kind, fabric::ReplyKind::declined);
  EXPECT_EQ(sent.front().reply.text, "the gauge is in use");
  EXPECT_TRUE(sut.idle());
  EXPECT_EQ(sut.status().declined, 1U);
  EXPECT_EQ(started(request(1)), 0U) << "the same attempt";
  EXPECT_EQ(started(again(request(1), 2)), 1U);
}

TEST_F(CallSchedulerTest, StartsTheNextCallInPlaceOfADeclinedOne) {
  started(request(1, 1));
  EXPECT_EQ(started(request(2, 2)), 0U);
  EXPECT_THAT(only<Start>(sut.on_declined(call(1), "not now", now)), SizeIs(1));
}

TEST_F(CallSchedulerTest, SendsNothingForACallThatIsDeclinedAfterItsWithdrawal) {
  started(request(1));
  sut.on_withdrawn(asked_by(1));
  const Actions actions = sut.on_declined(call(1), "not now", now);
  EXPECT_THAT(only<Send>(actions), SizeIs(0));
  EXPECT_THAT(only<Drop>(actions), SizeIs(1));
  EXPECT_TRUE(sut.idle());
  EXPECT_THAT(sut.on_declined(call(1), "not now", now), SizeIs(0)) << "it is over";
}

// The call scheduler with gateways that repeat, reassign, withdraw and replace calls, and come and
// go, at random.

constexpr std::size_t calls_at_once = 2;
constexpr std::uint16_t channels = 4;
/// The result of a cancelled handler.
const std::string garbage = "stopped";

/// Plays two gateways, each of which may regard a channel as its own, and the handlers, and checks
/// each action.
class World {
 public:
  explicit World(std::uint32_t seed) : random_(seed) {}

  void step() {
    const RequestKey key{
        {"cnc", static_cast<std::uint16_t>(1 + pick(channels))}, 1 + pick(2), self_};
    switch (pick(8)) {
      case 0:
        call(key);
        break;
      case 1:
        repeat(key);
        break;
      case 2:
        withdraw(key);
        break;
      case 3:
        lose(key);
        break;
      default:
        finish();
    }
    EXPECT_LE(running_.size(), calls_at_once);
    EXPECT_EQ(running_.size(), sut_.running());
  }

  void finish_all() {
    while (!running_.empty()) {
      finish();
    }
    EXPECT_TRUE(sut_.idle());
    for (const auto& [key, request] : pending_) {
      EXPECT_TRUE(request.assigned != self_ || lost_.contains(key) ||
                  replied_.contains(request.call))
          << key.key.to_string() << " waits for ever for gateway " << key.epoch;
    }
  }

 private:
  std::size_t pick(std::size_t count) { return random_() % count; }

  void call(const RequestKey& key) {
    pending_[key] = Request{.key = key.key,
                            .call = {.epoch = key.epoch, .number = ++number_},
                            .assigned = self_,
                            .may_wait = pick(4) != 0};
    ask(key);
  }

  void repeat(const RequestKey& key) {
    if (const auto pending = pending_.find(key); pending != pending_.end()) {
      pending->second.attempt += static_cast<std::uint32_t>(pick(2));
      ask(key);
    }
  }

  void ask(const RequestKey& key) {
    lost_.erase(key);
    perform(sut_.on_request(pending_.at(key), {}));
  }

  void withdraw(const RequestKey& key) {
    if (!lost_.contains(key)) {
      pending_.erase(key);
      perform(sut_.on_withdrawn(key));
    }
  }

  /// A gateway is not heard any more; its call remains until it returns.
  void lose(const RequestKey& key) {
    if (pending_.contains(key)) {
      lost_.insert(key);
    }
    perform(sut_.on_orphaned(key));
  }

  void finish() {
    if (running_.empty()) {
      return;
    }
    const auto done =
        std::next(running_.begin(), static_cast<std::ptrdiff_t>(pick(running_.size())));
    const CallId id = done->first;
    const bool cancelled = done->second;
    running_.erase(done);
    perform(
        sut_.on_result(id, Response{.text = cancelled ? garbage : std::to_string(id.number)}, {}));
  }

  void perform(const Actions& actions) {
    for (const Action& action : actions) {
      if (const auto* cancel = std::get_if<Cancel>(&action)) {
        EXPECT_FALSE(is_wanted(cancel->call)) << "withdrawn although its gateway waits";
        if (const auto running = running_.find(cancel->call); running != running_.end()) {
          running->second = true;
          ever_started_.erase(cancel->call);
        }
      } else if (const auto* start = std::get_if<Start>(&action)) {
        EXPECT_TRUE(ever_started_.insert(start->request.call).second) << "run twice";
        EXPECT_TRUE(is_pending(start->request.call)) << "started although its request is withdrawn";
        EXPECT_TRUE(running_.emplace(start->request.call, false).second)
            << "run again before its cancelled run has ended";
      } else if (const auto* send = std::get_if<Send>(&action)) {
        if (send->reply.kind == fabric::ReplyKind::declined) {
          EXPECT_FALSE(running_.contains(send->reply.call)) << "declined although it runs";
          EXPECT_FALSE(replied_.contains(send->reply.call)) << "declined although it is known";
          dispatch_to_another(send->reply.call);
          continue;
        }
        EXPECT_TRUE(is_pending(send->reply.call)) << "a stale reply overwrites that of its channel";
        EXPECT_EQ(send->reply.text, std::to_string(send->reply.call.number));
        replied_.insert(send->reply.call);
      }
    }
  }

  /// As a gateway does with a declined call.
  void dispatch_to_another(CallId id) {
    std::erase_if(pending_, [&](const auto& each) { return each.second.call == id; });
  }

  bool is_pending(CallId id) const {
    return std::any_of(pending_.begin(), pending_.end(),
                       [&](const auto& each) { return each.second.call == id; });
  }

  /// Its gateway is present and waits for the answer.
  bool is_wanted(CallId id) const {
    return std::any_of(pending_.begin(), pending_.end(), [&](const auto& each) {
      return each.second.call == id && !lost_.contains(each.first);
    });
  }

  std::mt19937 random_;
  const fabric::InstanceId self_{{1}};
  CallScheduler sut_{{.instance = self_, .concurrency = calls_at_once}};
  std::uint64_t number_ = 0;
  std::map<RequestKey, Request> pending_;
  std::set<RequestKey> lost_;
  /// The running calls, and whether they are cancelled.
  std::map<CallId, bool> running_;
  /// Except cancelled runs.
  std::set<CallId> ever_started_;
  std::set<CallId> replied_;
};

TEST(CallSchedulerAtRandom, RunsEachCallOnceExceptCancelledRunsAndAnswersEachRequestedOne) {
  for (std::uint32_t seed = 1; seed <= 2000; ++seed) {
    SCOPED_TRACE(seed);
    World world(seed);
    for (int step = 0; step < 100; ++step) {
      world.step();
    }
    world.finish_all();
    ASSERT_FALSE(testing::Test::HasFailure());
  }
}

}  // namespace
}  // namespace millrace::services::sdk
