// Who is there: beats, silence, and what instances say of their load.
#include <utility>

#include <boost/asio/steady_timer.hpp>
#include <dds/dds.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/ends/beat_end.hpp"
#include "fabric/ends/call_end.hpp"
#include "fabric/ends/reply_end.hpp"
#include "fabric/registry/beats.hpp"
#include "tests/support/run_until.hpp"
#include "tests/unit/fabric/recording_listeners.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

using registry::Beats;
using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;
using testing::SizeIs;
using tests::run_until;
using namespace std::chrono_literals;

InstanceLoad load(std::uint8_t number, std::uint64_t answered = 0) {
  InstanceLoad one;
  one.status.instance.bytes.fill(number);
  one.status.answered = answered;
  return one;
}

InstanceLoad busy(std::uint8_t number) {
  InstanceLoad one = load(number);
  one.status.running = 1;
  one.calls = {{7, number}};
  return one;
}

class BeatsTest : public testing::Test {
 protected:
  /// The first bytes of the instances in the next beat.
  std::vector<int> next() {
    std::vector<int> named;
    for (const InstanceLoad& one : sut.next({}).loads) {
      named.push_back(one.status.instance.bytes.front());
    }
    return named;
  }
  void quiet(std::uint8_t instances) {
    for (std::uint8_t number = 1; number <= instances; ++number) {
      sut.note(load(number));
    }
    for (std::uint64_t beat = 0; beat < Beats::told; ++beat) {
      static_cast<void>(sut.next({}));
    }
  }

  Beats sut{InstanceId::random()};
};

TEST_F(BeatsTest, TellOfAChangeInSeveralBeats) {
  quiet(100);
  sut.note(load(50, 1));
  for (std::uint64_t beat = 0; beat < Beats::told; ++beat) {
    EXPECT_THAT(next(), Contains(50));
  }
}

TEST_F(BeatsTest, TellOfWhoHasCallsEachTime) {
  quiet(100);
  sut.note(busy(70));
  for (int beat = 0; beat < 100; ++beat) {
    EXPECT_THAT(next(), Contains(70));
  }
}

TEST_F(BeatsTest, TellOfTheOthersInTurn) {
  quiet(10);
  std::set<int> told;
  for (int beat = 0; beat < 3; ++beat) {
    const auto named = next();
    EXPECT_THAT(named, SizeIs(Beats::in_turn));
    told.insert(named.begin(), named.end());
  }
  EXPECT_THAT(told, SizeIs(10));
}

TEST_F(BeatsTest, NeverTellOfMoreThanFits) {
  for (std::uint8_t number = 1; number <= 200; ++number) {
    sut.note(busy(number));
  }
  std::set<int> told;
  for (int beat = 0; beat < 4; ++beat) {
    const auto named = next();
    EXPECT_THAT(named, SizeIs(Beats::most_loads));
    told.insert(named.begin(), named.end());
  }
  EXPECT_THAT(told, SizeIs(200));
}

TEST_F(BeatsTest, TellNothingOfWhoIsForgotten) {
  sut.note(busy(1));
  sut.forget(load(1).status.instance);
  EXPECT_THAT(next(), IsEmpty());
}

struct LoadGateway : RecordingGateway {
  void on_load(const InstanceLoad& one) override { loads.push_back(one); }
  std::vector<InstanceLoad> loads;
};

/// A gateway here; there a process with an instance, which beats as long as the test runs its loop.
class Presence : public testing::Test {
 protected:
  Presence() { beat(); }

  void beat() {
    InstanceLoad one{.status = {.instance = who.id, .running = 1}, .calls = {{7, 1}}};
    EXPECT_TRUE(beats.publish({.member = member, .loads = {one}}));
    timer.expires_after(who.lease / ends::BeatEnd::beats_per_lease);
    timer.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        beat();
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
  RecordingInstance heard;
  ends::ReplyEnd end{there, context.get_executor(), who, heard};
  ends::BeatEnd beats{there};
  boost::asio::steady_timer timer{context};
  LoadGateway gateway;
  ends::CallEnd sut{here, context.get_executor(), gateway};
};

TEST_F(Presence, IsLostWithinItsLeaseByAProcessThatFallsSilentAndFoundAtItsNextBeat) {
  ASSERT_TRUE(until([&] { return gateway.ready.contains(who.id); }));
  const auto silent = std::chrono::steady_clock::now();
  ASSERT_EQ(dds_domain_set_deafmute(there.handle(), true, true, DDS_INFINITY), DDS_RETCODE_OK);
  ASSERT_TRUE(until([&] { return gateway.ready.empty(); }));
  EXPECT_LT(std::chrono::steady_clock::now() - silent, 2 * who.lease);
  ASSERT_EQ(dds_domain_set_deafmute(there.handle(), false, false, DDS_INFINITY), DDS_RETCODE_OK);
  EXPECT_TRUE(until([&] { return gateway.ready.contains(who.id); }));
}

TEST_F(Presence, IsNotLostByBeatsThatKeepComing) {
  ASSERT_TRUE(until([&] { return gateway.ready.contains(who.id); }));
  using Clock = std::chrono::steady_clock;
  std::size_t beats_heard = gateway.loads.size();
  auto last = Clock::now();
  auto since = last;
  int lost_before = 0;
  // On a host that is too busy a beat may be heard too late: then it counts from there.
  const auto heard_in_time_for_four_leases = [&] {
    if (gateway.loads.size() == beats_heard) {
      return false;
    }
    beats_heard = gateway.loads.size();
    const auto before = std::exchange(last, Clock::now());
    if (last - before > who.lease * 3 / 4) {
      since = last;
      lost_before = gateway.gone;
    }
    return last - since > 4 * who.lease;
  };
  ASSERT_TRUE(run_until(context, heard_in_time_for_four_leases, 60s));
  EXPECT_EQ(gateway.gone, lost_before);
}

TEST_F(Presence, TellsWhatAnInstanceDoes) {
  ASSERT_TRUE(until([&] { return !gateway.loads.empty(); }));
  EXPECT_EQ(gateway.loads.front().status.instance, who.id);
  EXPECT_THAT(gateway.loads.front().calls, ElementsAre(CallId{7, 1}));
}

TEST_F(Presence, IsNotForAnotherProcessToTell) {
  ASSERT_TRUE(until([&] { return !gateway.loads.empty(); }));
  // It has an instance of its own, and speaks for ours too.
  dds::Participant elsewhere(processes.there());
  InstanceIdentity strange{.id = InstanceId::random(), .uuid = "weather", .name = "strange"};
  RecordingInstance nobody;
  ends::ReplyEnd other(elsewhere, context.get_executor(), strange, nobody);
  ends::BeatEnd false_beats(elsewhere);
  ASSERT_TRUE(until([&] { return gateway.ready.contains(strange.id); }));
  const InstanceLoad lie{.status = {.instance = who.id, .answered = 666}};
  ASSERT_TRUE(until([&] {
    EXPECT_TRUE(false_beats.publish({.member = strange.id, .loads = {lie}}));
    return !gateway.ignored.empty();
  }));
  EXPECT_THAT(gateway.ignored,
              ElementsAre(testing::HasSubstr("speaks for instance " + who.id.to_string())));
  for (const InstanceLoad& one : gateway.loads) {
    EXPECT_EQ(one.status.answered, 0U);
  }
}

}  // namespace
}  // namespace millrace::fabric
