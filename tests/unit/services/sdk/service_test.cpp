#include "services/sdk/service.hpp"

#include <array>
#include <future>
#include <optional>
#include <stdexcept>

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <dds/dds.h>
#include <gmock/gmock.h>

#include "base/program/log.hpp"
#include "base/program/version.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/subscription.hpp"
#include "fabric/wire/writer.hpp"
#include "services/sdk/command_line.hpp"
#include "services/sdk/shared_participant.hpp"
#include "tests/support/await.hpp"
#include "tests/unit/services/sdk/service_fixture.hpp"
#include "tests/unit/services/sdk/thread_shortage.hpp"

namespace millrace::services::sdk {
namespace {

using namespace std::chrono_literals;
using fabric::Reply;
using fabric::ReplyKind;
using fabric::Request;
using fabric::ServiceCode;
using testing::HasSubstr;
using testing::SizeIs;

TEST_F(ServiceTest, AnswersCallsWithItsFunction) {
  const Service sut(options(), echo, base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  for (std::uint64_t number = 1; number <= 20; ++number) {
    call(request(sut, number));
    const Reply reply = next_reply();
    EXPECT_EQ(reply.call.number, number);
    EXPECT_EQ(reply.text, "4");
    EXPECT_EQ(reply.instance, sut.identity().id);
    EXPECT_LE(reply.received, reply.started);
    EXPECT_LE(reply.started, reply.answered);
  }
}

TEST_F(ServiceTest, GivesTheHandlerAllDataOfTheCall) {
  Request sent{.replayed = true};
  std::promise<void> checked;
  const Service sut(
      options(),
      [&](const Call& call) -> Response {
        EXPECT_EQ(call.id(), sent.call);
        EXPECT_EQ(call.attempt(), 3U);
        EXPECT_EQ(call.channel(), sent.key);
        EXPECT_EQ(call.uuid(), uuid);
        EXPECT_EQ(call.text(), "4");
        EXPECT_EQ(call.state(), 1U);
        EXPECT_EQ(call.deadline(), sent.deadline);
        EXPECT_TRUE(call.replayed());
        EXPECT_FALSE(call.cancelled());
        checked.set_value();
        return {};
      },
      base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  sent = request(sut, 1);
  sent.attempt = 3;
  sent.replayed = true;
  sent.deadline = fabric::Time(std::chrono::hours(1));
  call(sent);
  checked.get_future().wait();
  EXPECT_TRUE(next_reply().replayed);
}

TEST_F(ServiceTest, TurnsAnExceptionIntoAnErrorAnswerAndContinues) {
  const Service sut(
      options(),
      [](const Call& call) -> Response {
        if (call.id().number == 1) {
          throw std::runtime_error("the gauge is off");
        }
        if (call.id().number == 2) {
          throw 42;
        }
        return echo(call);
      },
      base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  call(request(sut, 1));
  const Reply reply = next_reply();
  EXPECT_EQ(reply.code, ServiceCode::failed);
  EXPECT_EQ(reply.text, "ERROR: the gauge is off");
  EXPECT_EQ(reply.state, default_error_state);
  call(request(sut, 2));
  EXPECT_EQ(next_reply().code, ServiceCode::failed);
  call(request(sut, 3));
  EXPECT_EQ(next_reply().text, "4");
}

TEST_F(ServiceTest, NotifiesARunningHandlerThatItsCallIsWithdrawn) {
  std::promise<void> entered;
  const Service sut(
      options(),
      [&](const Call& call) -> Response {
        if (call.id().number == 1) {
          entered.set_value();
          tests::await("the cancellation of the call", [&] { return call.cancelled(); });
        }
        return echo(call);
      },
      base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  const Request first = request(sut, 1);
  call(first);
  entered.get_future().wait();
  end.withdraw(key_of(first));
  call(request(sut, 2));
  EXPECT_EQ(next_reply().call.number, 2U);
}

// Without certificates only DDS reports that a gateway is gone.
TEST_F(ServiceTest, CancelsARunningHandlerWhenAnotherGatewayHasTheChannelOfOneThatIsGone) {
  std::promise<void> entered;
  const Service sut(
      options(),
      [&](const Call& call) -> Response {
        if (call.id().epoch == 2) {
          entered.set_value();
          tests::await("the cancellation of the call", [&] { return call.cancelled(); });
        }
        return echo(call);
      },
      base::program::no_log());
  fabric::RecordingGateway other_gateway;
  std::optional<fabric::endpoints::CallEndpoint> other(std::in_place, participant,
                                                       context.get_executor(), other_gateway);
  ASSERT_TRUE(until_ready(sut));
  ASSERT_TRUE(until([&] { return !other_gateway.ready.empty(); }));
  Request first = request(sut, 1);
  first.call.epoch = 2;
  ASSERT_TRUE(other->publish(first));
  entered.get_future().wait();
  Request successor = request(sut, 1);
  successor.succeeds = first.call.epoch;
  successor.may_wait = true;
  call(successor);
  other.reset();
  EXPECT_EQ(next_reply().call, successor.call);
}

TEST_F(ServiceTest, ShowsInterimStatesBeforeTheAnswer) {
  Latch latch;
  const Service sut(
      options(),
      [&](const Call& call) -> Response {
        EXPECT_THROW(call.interim({.text = std::string(128, 'x')}), std::invalid_argument);
        call.interim({.text = "half", .state = 50});
        latch.pass();
        return {.text = "done"};
      },
      base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  call(request(sut, 1));
  const Reply interim = next_reply();
  EXPECT_EQ(interim.kind, ReplyKind::interim);
  EXPECT_EQ(interim.text, "half");
  latch.open();
  EXPECT_EQ(next_reply().text, "done");
}

TEST_F(ServiceTest, RunsAsManyCallsAtOnceAsItMay) {
  constexpr std::uint32_t concurrency = 3;
  Latch latch;
  std::atomic<std::uint32_t> inside = 0;
  const Service sut(
      options(concurrency),
      [&](const Call& call) -> Response {
        ++inside;
        latch.pass();
        return echo(call);
      },
      base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  for (std::uint16_t channel = 1; channel <= concurrency + 1; ++channel) {
    call(request(sut, channel, channel));
  }
  EXPECT_TRUE(until([&] { return inside == concurrency; }));
  latch.open();
  EXPECT_TRUE(until([&] { return gateway.replies.size() == concurrency + 1; }));
}

TEST_F(ServiceTest, MayAnswerLaterFromAnotherThread) {
  std::promise<std::shared_ptr<const Call>> held;
  const Service sut(
      options(), [&](const std::shared_ptr<const Call>& call) { held.set_value(call); },
      base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  call(request(sut, 1));
  const auto later = held.get_future().get();
  later->answer({.text = "late"});
  later->answer({.text = "too late"});
  EXPECT_EQ(next_reply().text, "late");
}

TEST_F(ServiceTest, AnswersForAHandlerThatForgetsACall) {
  const Service sut(
      options(), [](const std::shared_ptr<const Call>&) {}, base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  call(request(sut, 1));
  const Reply reply = next_reply();
  EXPECT_EQ(reply.code, ServiceCode::failed);
  EXPECT_THAT(reply.text, HasSubstr("without an answer"));
}

TEST_F(ServiceTest, FinishesItsCallsBeforeItLeaves) {
  Latch latch;
  Service sut(
      options(),
      [&](const Call& call) -> Response {
        latch.pass();
        return echo(call);
      },
      base::program::no_log());
  const fabric::InstanceId id = sut.identity().id;
  ASSERT_TRUE(until_ready(sut));
  call(request(sut, 1, 1));
  call(request(sut, 2, 2));
  sut.stop();
  ASSERT_TRUE(until([&] { return gateway.ready.at(id).draining; }));
  latch.open();
  sut.wait();
  EXPECT_TRUE(until([&] { return gateway.ready.empty(); }));
  EXPECT_EQ(gateway.replies.size(), 2U);
}

TEST_F(ServiceTest, LeavesOnAnOperatorsCommand) {
  Service sut(options(), echo, base::program::no_log());
  const fabric::InstanceId id = sut.identity().id;
  ASSERT_TRUE(until_ready(sut));
  fabric::wire::Writer<fabric::Command> commands(participant, "millrace");
  fabric::wire::Reader<fabric::Outcome> outcomes(participant, "millrace", fabric::wire::Keep::all);
  fabric::Command command{.id = fabric::InstanceId::random(),
                          .kind = fabric::CommandKind::drain,
                          .instance = fabric::InstanceId::random()};
  ASSERT_TRUE(commands.write(command));
  command.id = fabric::InstanceId::random();
  command.instance = id;
  ASSERT_TRUE(commands.write(command));
  sut.wait();
  EXPECT_TRUE(until([&] { return gateway.ready.empty(); }));
  const auto taken = outcomes.take();
  ASSERT_THAT(taken, SizeIs(1));
  EXPECT_EQ(taken.front().value.responder, id);
  EXPECT_EQ(taken.front().value.command, command.id);
  EXPECT_TRUE(taken.front().value.done);
}

TEST_F(ServiceTest, AnswersAPing) {
  const Service sut(options(), echo, base::program::no_log());
  const fabric::InstanceId id = sut.identity().id;
  ASSERT_TRUE(until_ready(sut));
  fabric::wire::Writer<fabric::Command> commands(participant, "millrace");
  fabric::wire::Reader<fabric::Outcome> outcomes(participant, "millrace", fabric::wire::Keep::all);
  const fabric::Command ping{
      .id = fabric::InstanceId::random(), .kind = fabric::CommandKind::ping, .instance = id};
  ASSERT_TRUE(commands.write(ping));
  std::vector<fabric::wire::Taken<fabric::Outcome>> taken;
  ASSERT_TRUE(until([&] {
    if (taken.empty()) {
      taken = outcomes.take();
    }
    return !taken.empty();
  }));
  EXPECT_EQ(taken.front().value.command, ping.id);
  EXPECT_EQ(taken.front().value.responder, id);
}

TEST_F(ServiceTest, OutlivesCallsThatAreHeldLongerThanItself) {
  std::shared_ptr<const Call> held;
  {
    std::promise<std::shared_ptr<const Call>> promise;
    Service sut(
        options(),
        [&](const std::shared_ptr<const Call>& call) {
          call->answer({.text = "done"});
          promise.set_value(call);
        },
        base::program::no_log());
    ASSERT_TRUE(until_ready(sut));
    call(request(sut, 1));
    held = promise.get_future().get();
  }
  held->answer({.text = "too late"});
  held->interim({.text = "too late"});
  EXPECT_FALSE(held->cancelled());
}

TEST_F(ServiceTest, RefusesInvalidOptions) {
  const auto with = [&](auto change) {
    ServiceOptions wrong = options();
    change(wrong);
    const Service sut(wrong, echo, base::program::no_log());
  };
  EXPECT_THROW(with([](auto& sut) { sut.uuid = ""; }), std::invalid_argument);
  EXPECT_THROW(with([](auto& sut) { sut.concurrency = 0; }), std::invalid_argument);
  EXPECT_THROW(with([](auto& sut) { sut.concurrency = 1000; }), std::invalid_argument);
  EXPECT_THROW(with([](auto& sut) { sut.error_state = 0; }), std::invalid_argument);
}

// A regression: a service that had started its loop, or some of its threads, waited for ever for
// those that ran.
TEST_F(ServiceTest, FailsIfAnyOfItsThreadsCannotBeStarted) {
  constexpr int workers = 3;
  constexpr int threads = 2 + workers;
  for (int started = 0; started < threads; ++started) {
    const tests::ThreadShortage shortage(started);
    EXPECT_THROW(Service(options(workers), echo, base::program::no_log()), std::system_error);
  }
  const tests::ThreadShortage enough(threads);
  const Service sut(options(workers), echo, base::program::no_log());
  ASSERT_TRUE(until_ready(sut));
  EXPECT_TRUE(until([&] { return gateway.ready.size() == 1; }));
}

TEST(AServiceProgram, WithoutAUuidNamesTheTwoWaysToSetOne) {
  ServiceProgram sut({.name = "weather"});
  std::string name = "my-service";
  std::array<char*, 1> arguments{name.data()};
  testing::internal::CaptureStderr();
  EXPECT_EQ(sut.run(1, arguments.data(), [&]() -> Handler { return echo; }), 2);
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::AllOf(testing::StartsWith("my-service: --uuid is required: "),
                             testing::HasSubstr("--uuid UUID"),
                             testing::HasSubstr("ServiceOptions::uuid")));
}

TEST(AServiceProgram, PrintsItsOwnVersionAndThatOfMillrace) {
  const auto version_of = [](const std::string& version) {
    ServiceProgram sut({.uuid = "weather", .name = "weather", .version = version});
    std::string name = "my-service";
    std::string flag = "--version";
    std::array<char*, 2> arguments{name.data(), flag.data()};
    testing::internal::CaptureStdout();
    const auto nothing = [](const Call&) { return Response{"", 1}; };
    EXPECT_EQ(sut.run(2, arguments.data(), [&]() -> Handler { return nothing; }), 0);
    return testing::internal::GetCapturedStdout();
  };
  const std::string of_millrace = std::string("(millrace ") + base::program::version() + ")\n";
  EXPECT_EQ(version_of("2.3"), "weather 2.3 " + of_millrace);
  EXPECT_EQ(version_of(""), "weather " + of_millrace);
}

// Several services in one process.

class SharedParticipantTest : public ServiceTest {
 protected:
  ServiceOptions hosted(const std::string& name, const std::string& of = uuid) {
    ServiceOptions entry = options();
    entry.uuid = of;
    entry.name = name;
    entry.participant = sut;
    return entry;
  }
  [[nodiscard]] std::size_t participants() const {
    return static_cast<std::size_t>(dds_lookup_participant(domain.number(), nullptr, 0));
  }

  std::shared_ptr<SharedParticipant> sut = std::make_shared<SharedParticipant>(
      fabric::dds::ParticipantOptions{.domain = domain.number()}, base::program::no_log());
};

TEST_F(SharedParticipantTest, IsOneParticipantHoweverManyServicesItHosts) {
  const std::size_t before = participants();
  const Service first(hosted("first"), echo, base::program::no_log());
  const Service second(hosted("second"), echo, base::program::no_log());
  const Service other(hosted("other", "weather"), echo, base::program::no_log());
  EXPECT_EQ(participants(), before);
  ASSERT_TRUE(until_ready(first));
  ASSERT_TRUE(until_ready(second));
  ASSERT_TRUE(until_ready(other));
  call(request(first, 1, 1));
  call(request(second, 2, 2));
  EXPECT_EQ(next_reply().code, fabric::ServiceCode::ok);
  EXPECT_EQ(next_reply().code, fabric::ServiceCode::ok);
}

TEST_F(SharedParticipantTest, KeepsTheOthersWhenOneServiceLeaves) {
  const Service stays(hosted("stays"), echo, base::program::no_log());
  {
    const Service leaves(hosted("leaves"), echo, base::program::no_log());
    ASSERT_TRUE(until_ready(leaves));
    ASSERT_TRUE(until_ready(stays));
  }
  ASSERT_TRUE(until([&] { return gateway.gone == 1; }));
  call(request(stays, 1));
  EXPECT_EQ(next_reply().call, request(stays, 1).call);
}

TEST_F(SharedParticipantTest, IsNotMissedWhileItsLoopHasOtherWork) {
  const Service service(hosted("one"), echo, base::program::no_log());
  ASSERT_TRUE(until_ready(service));
  Latch latch;
  boost::asio::post(sut->loop(), [&latch] { latch.pass(); });
  boost::asio::steady_timer busy(context, 3 * participant.options().lease);
  bool over = false;
  busy.async_wait([&over](boost::system::error_code) { over = true; });
  ASSERT_TRUE(until([&over] { return over; }));
  EXPECT_EQ(gateway.gone, 0U);
  latch.open();
  call(request(service, 1));
  EXPECT_EQ(next_reply().call, request(service, 1).call);
}

TEST_F(SharedParticipantTest, IsMissedOnceItsLoopIsStuck) {
  const Service service(hosted("one"), echo, base::program::no_log());
  ASSERT_TRUE(until_ready(service));
  Latch latch;
  boost::asio::post(sut->loop(), [&latch] { latch.pass(); });
  EXPECT_TRUE(until([&] { return gateway.gone == 1; }));
  latch.open();
}

/// A process with a lease of 4 s with calls, and one of 12 s without.
class AnIdleProcess : public ServiceTest {
 protected:
  const fabric::Time started = std::chrono::system_clock::now();
  std::shared_ptr<SharedParticipant> sut = std::make_shared<SharedParticipant>(
      fabric::dds::ParticipantOptions{.domain = domain.number(), .lease = std::chrono::seconds(4)},
      base::program::no_log());
  std::vector<fabric::Heartbeat> received;
  fabric::wire::Subscription<fabric::Heartbeat> heartbeats{
      participant, context.get_executor(), participant.options().fabric,
      [this](const auto& taken) { received.push_back(taken.value); }};
};

TEST_F(AnIdleProcess, SendsAHeartbeatSoonAfterARequest) {
  ServiceOptions hosted = options();
  hosted.participant = sut;
  Latch latch;
  const Service service(
      hosted,
      [&latch](const Call& call) {
        latch.pass();
        return echo(call);
      },
      base::program::no_log());
  ASSERT_TRUE(until_ready(service));
  // The first second counts as busy; a heartbeat in it is followed by another one after a second.
  ASSERT_TRUE(until([&] { return !received.empty() && received.back().at - started > 1500ms; }));
  const fabric::Time asked = std::chrono::system_clock::now();
  call(request(service, 1));
  const auto lists_a_call = [](const fabric::Heartbeat& heartbeat) {
    return !heartbeat.loads.empty() && !heartbeat.loads.front().calls.empty();
  };
  ASSERT_TRUE(until([&] { return lists_a_call(received.back()); }));
  EXPECT_LT(received.back().at - asked, 2s)
      << "one a second with calls, one in three seconds without";
  latch.open();
  EXPECT_EQ(next_reply().call, request(service, 1).call);
}

TEST_F(SharedParticipantTest, MayBeReleasedBeforeItsServices) {
  const Service service(hosted("one"), echo, base::program::no_log());
  sut.reset();
  ASSERT_TRUE(until_ready(service));
  call(request(service, 1));
  EXPECT_EQ(next_reply().call, request(service, 1).call);
}

}  // namespace
}  // namespace millrace::services::sdk
