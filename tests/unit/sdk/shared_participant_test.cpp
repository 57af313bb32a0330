// Several services in one process.
#include "services/sdk/shared_participant.hpp"

#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <dds/dds.h>
#include <gmock/gmock.h>

#include "base/program/log.hpp"
#include "fabric/wire/subscription.hpp"
#include "tests/unit/sdk/service_fixture.hpp"

namespace millrace::services::sdk {
namespace {

using namespace std::chrono_literals;

class SharedParticipantTest : public ServiceTest {
 protected:
  ServiceOptions hosted(const std::string& name, const std::string& of = uuid) {
    ServiceOptions one = options();
    one.uuid = of;
    one.name = name;
    one.participant = sut;
    return one;
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
  const Service one(hosted("one"), echo, base::program::no_log());
  ASSERT_TRUE(until_ready(one));
  Latch latch;
  boost::asio::post(sut->loop(), [&latch] { latch.pass(); });
  boost::asio::steady_timer busy(context, 3 * participant.options().lease);
  bool over = false;
  busy.async_wait([&over](boost::system::error_code) { over = true; });
  ASSERT_TRUE(until([&over] { return over; }));
  EXPECT_EQ(gateway.gone, 0U);
  latch.open();
  call(request(one, 1));
  EXPECT_EQ(next_reply().call, request(one, 1).call);
}

TEST_F(SharedParticipantTest, IsMissedOnceItsLoopIsStuck) {
  const Service one(hosted("one"), echo, base::program::no_log());
  ASSERT_TRUE(until_ready(one));
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
  std::vector<fabric::Heartbeat> heard;
  fabric::wire::Subscription<fabric::Heartbeat> heartbeats{
      participant, context.get_executor(), participant.options().fabric,
      [this](const auto& taken) { heard.push_back(taken.value); }};
};

TEST_F(AnIdleProcess, SendsAHeartbeatSoonAfterARequest) {
  ServiceOptions hosted = options();
  hosted.participant = sut;
  Latch latch;
  const Service one(
      hosted,
      [&latch](const Call& call) {
        latch.pass();
        return echo(call);
      },
      base::program::no_log());
  ASSERT_TRUE(until_ready(one));
  // The first second counts as busy; a heartbeat in it is followed by another one after a second.
  ASSERT_TRUE(until([&] { return !heard.empty() && heard.back().at - started > 1500ms; }));
  const fabric::Time asked = std::chrono::system_clock::now();
  call(request(one, 1));
  const auto lists_a_call = [](const fabric::Heartbeat& heartbeat) {
    return !heartbeat.loads.empty() && !heartbeat.loads.front().calls.empty();
  };
  ASSERT_TRUE(until([&] { return lists_a_call(heard.back()); }));
  EXPECT_LT(heard.back().at - asked, 2s) << "one a second with calls, one in three seconds without";
  latch.open();
  EXPECT_EQ(next_reply().call, request(one, 1).call);
}

TEST_F(SharedParticipantTest, MayBeReleasedBeforeItsServices) {
  const Service one(hosted("one"), echo, base::program::no_log());
  sut.reset();
  ASSERT_TRUE(until_ready(one));
  call(request(one, 1));
  EXPECT_EQ(next_reply().call, request(one, 1).call);
}

}  // namespace
}  // namespace millrace::services::sdk
