// Which instances are alive: heartbeats, silence, and the load that instances publish.
#include <utility>

#include <boost/asio/steady_timer.hpp>
#include <dds/dds.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/call_endpoint.hpp"
#include "fabric/endpoints/liveness_monitor.hpp"
#include "fabric/endpoints/reply_endpoint.hpp"
#include "fabric/registry/heartbeats.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/recording_listeners.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

using registry::Heartbeats;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;
using tests::run_until;
using namespace std::chrono_literals;

InstanceLoad load(std::uint8_t number, std::uint64_t answered = 0) {
  InstanceLoad load;
  load.status.instance.bytes.fill(number);
  load.status.answered = answered;
  return load;
}

InstanceLoad busy(std::uint8_t number) {
  InstanceLoad entry = load(number);
  entry.status.running = 1;
  entry.calls = {{7, number}};
  return entry;
}

class HeartbeatsTest : public testing::Test {
 protected:
  /// The first byte of each instance's id in the next heartbeat.
  std::vector<int> next() {
    std::vector<int> named;
    for (const InstanceLoad& load : sut.next({}).loads) {
      named.push_back(load.status.instance.bytes.front());
    }
    return named;
  }
  void quiet(std::uint8_t instances) {
    for (std::uint8_t number = 1; number <= instances; ++number) {
      sut.note(load(number));
    }
    for (std::uint64_t heartbeat = 0; heartbeat < Heartbeats::repeats; ++heartbeat) {
      static_cast<void>(sut.next({}));
    }
  }

  Heartbeats sut{InstanceId::random()};
};

TEST_F(HeartbeatsTest, ContainAChangeSeveralTimes) {
  quiet(100);
  sut.note(load(50, 1));
  for (std::uint64_t heartbeat = 0; heartbeat < Heartbeats::repeats; ++heartbeat) {
    EXPECT_THAT(next(), Contains(50));
  }
}

TEST_F(HeartbeatsTest, ContainInstancesWithCallsEachTime) {
  quiet(100);
  sut.note(busy(70));
  for (int heartbeat = 0; heartbeat < 100; ++heartbeat) {
    EXPECT_THAT(next(), Contains(70));
  }
}

TEST_F(HeartbeatsTest, ContainTheOthersInTurn) {
  quiet(40);
  std::set<int> instances;
  for (int heartbeat = 0; heartbeat < 3; ++heartbeat) {
    const auto named = next();
    EXPECT_THAT(named, SizeIs(Heartbeats::in_turn));
    instances.insert(named.begin(), named.end());
  }
  EXPECT_THAT(instances, SizeIs(40));
}

TEST_F(HeartbeatsTest, NeverContainMoreThanFits) {
  for (std::uint8_t number = 1; number <= 200; ++number) {
    sut.note(busy(number));
  }
  std::set<int> instances;
  for (int heartbeat = 0; heartbeat < 4; ++heartbeat) {
    const auto named = next();
    EXPECT_THAT(named, SizeIs(Heartbeats::most_loads));
    instances.insert(named.begin(), named.end());
  }
  EXPECT_THAT(instances, SizeIs(200));
}

TEST_F(HeartbeatsTest, ContainNothingOfAForgottenInstance) {
  sut.note(busy(1));
  sut.forget(load(1).status.instance);
  EXPECT_THAT(next(), IsEmpty());
}

struct LoadGateway : RecordingGateway {
  void on_load(const InstanceLoad& load) override { loads.push_back(load); }
  std::vector<InstanceLoad> loads;
};

/// A gateway `here`; a process with an instance `there`, which sends heartbeats as long as the test
/// runs its loop.
class Liveness : public testing::Test {
 protected:
  Liveness() { heartbeat(); }

  void heartbeat() {
    InstanceLoad load{.status = {.instance = who.id, .running = 1}, .calls = {{7, 1}}};
    EXPECT_TRUE(heartbeats.publish({.process = member, .loads = {load}}));
    timer.expires_after(who.lease / endpoints::HeartbeatEndpoint::heartbeats_per_lease);
    timer.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        heartbeat();
      }
    });
  }
  bool until(const std::function<bool()>& done) { return run_until(context, done); }

  TwoProcesses processes;
  boost::asio::io_context context;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
  InstanceIdentity who{
      .id = InstanceId::random(), .uuid = "weather", .name = "weather", .lease = 500ms};
  InstanceId member = InstanceId::random();
  RecordingInstance listener;
  endpoints::ReplyEndpoint end{there, context.get_executor(), who, listener};
  endpoints::HeartbeatEndpoint heartbeats{there, member};
  boost::asio::steady_timer timer{context};
  LoadGateway gateway;
  endpoints::CallEndpoint sut{here, context.get_executor(), gateway};
};

TEST_F(Liveness, IsLostWithinItsLeaseByAProcessThatFallsSilentAndFoundAtItsNextHeartbeat) {
  ASSERT_TRUE(until([&] { return gateway.ready.contains(who.id); }));
  const auto silent = std::chrono::steady_clock::now();
  ASSERT_EQ(dds_domain_set_deafmute(there.handle(), true, true, DDS_INFINITY), DDS_RETCODE_OK);
  ASSERT_TRUE(until([&] { return gateway.ready.empty(); }));
  EXPECT_LT(std::chrono::steady_clock::now() - silent, 2 * who.lease);
  ASSERT_EQ(dds_domain_set_deafmute(there.handle(), false, false, DDS_INFINITY), DDS_RETCODE_OK);
  EXPECT_TRUE(until([&] { return gateway.ready.contains(who.id); }));
}

TEST_F(Liveness, IsNotLostByHeartbeatsThatKeepComing) {
  ASSERT_TRUE(until([&] { return gateway.ready.contains(who.id); }));
  using Clock = std::chrono::steady_clock;
  std::size_t heartbeats_received = gateway.loads.size();
  auto last = Clock::now();
  auto since = last;
  int lost_before = 0;
  // On a busy host a heartbeat may be heard too late: then the time counts from there.
  const auto received_in_time_for_four_leases = [&] {
    if (gateway.loads.size() == heartbeats_received) {
      return false;
    }
    heartbeats_received = gateway.loads.size();
    const auto before = std::exchange(last, Clock::now());
    if (last - before > who.lease * 3 / 4) {
      since = last;
      lost_before = gateway.gone;
    }
    return last - since > 4 * who.lease;
  };
  ASSERT_TRUE(run_until(context, received_in_time_for_four_leases, 60s));
  EXPECT_EQ(gateway.gone, lost_before);
}

TEST_F(Liveness, ReportsTheLoadOfAnInstance) {
  ASSERT_TRUE(until([&] { return !gateway.loads.empty(); }));
  EXPECT_EQ(gateway.loads.front().status.instance, who.id);
  EXPECT_THAT(gateway.loads.front().calls, ElementsAre(CallId{7, 1}));
}

TEST_F(Liveness, IsNotReportedByAnotherProcess) {
  ASSERT_TRUE(until([&] { return !gateway.loads.empty(); }));
  // It has its own instance, and sends heartbeats for ours too.
  dds::Participant elsewhere(processes.there());
  InstanceIdentity strange{.id = InstanceId::random(), .uuid = "weather", .name = "strange"};
  RecordingInstance ignored;
  endpoints::ReplyEndpoint other(elsewhere, context.get_executor(), strange, ignored);
  endpoints::HeartbeatEndpoint false_heartbeats(elsewhere, strange.id);
  ASSERT_TRUE(until([&] { return gateway.ready.contains(strange.id); }));
  const InstanceLoad lie{.status = {.instance = who.id, .answered = 666}};
  ASSERT_TRUE(until([&] {
    EXPECT_TRUE(false_heartbeats.publish({.process = strange.id, .loads = {lie}}));
    return !gateway.ignored.empty();
  }));
  EXPECT_THAT(gateway.ignored,
              ElementsAre(testing::HasSubstr("a heartbeat of instance " + who.id.to_string())));
  for (const InstanceLoad& load : gateway.loads) {
    EXPECT_EQ(load.status.answered, 0U);
  }
}

}  // namespace
}  // namespace millrace::fabric
