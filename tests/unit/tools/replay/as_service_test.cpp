#include "tools/replay/as_service.hpp"

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/wire/codec.hpp"
#include "fabric/wire/reader.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/run_until.hpp"
#include "tests/unit/tools/replay/sample_plan.hpp"

namespace millrace::tools::replay {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using tests::run_until;
using Clock = std::chrono::steady_clock;

struct Listener : AsServiceListener {
  void on_match(const fabric::Request&, std::size_t call) override { matched.push_back(call); }
  void on_mismatch(const fabric::Request&, const std::string& reason) override {
    mismatches.push_back(reason);
  }
  void on_drain(const fabric::InstanceIdentity&, const std::string&) override {}
  void on_complete() override { complete = true; }

  std::vector<std::size_t> matched;
  std::vector<std::string> mismatches;
  bool complete = false;
};

class AsServiceTest : public testing::Test {
 protected:
  static std::map<fabric::ChannelKey, fabric::ChannelKey> same_channels(const Plan& plan) {
    std::map<fabric::ChannelKey, fabric::ChannelKey> channels;
    for (const PlannedCall& call : plan.calls) {
      channels.emplace(call.channel, call.channel);
    }
    return channels;
  }
  AsService& stand_in(Plan recorded) {
    plan = std::move(recorded);
    return sut.emplace(participant, io.get_executor(), plan,
                       AsServiceOptions{.channels = same_channels(plan), .name = "stand-in"},
                       listener);
  }
  /// As a gateway dispatches it to the only instance.
  fabric::Request given(std::uint64_t number, std::uint16_t channel = 1) {
    fabric::Request request = request_entry(number, channel);
    request.assigned = sut->instances().at(0).id;
    return request;
  }

  tests::Domain domain;
  boost::asio::io_context io;
  fabric::dds::Participant participant{{.domain = domain.number()}};
  Listener listener;
  Plan plan;
  std::optional<AsService> sut;
};

// Both timers have expired when the loop checks them: the first one withdraws the call of the
// second.
TEST_F(AsServiceTest, IsNotEndedByTheTimerOfACallThatWasWithdrawn) {
  stand_in({.calls = {planned(1, 0ms, 10ms), planned(1, 20ms, 0ms)}});
  io.poll();
  boost::asio::steady_timer withdraws(io, Clock::now());
  const fabric::Request request = given(1);
  withdraws.async_wait(
      [&](const boost::system::error_code&) { sut->on_withdrawn(fabric::key_of(request)); });
  sut->on_request(request);
  const auto both = Clock::now() + 50ms;
  while (Clock::now() < both) {
    // The loop does not turn until here.
  }
  io.restart();
  EXPECT_NO_THROW(io.poll());
  sut->on_request(given(2));
  EXPECT_THAT(listener.matched, ElementsAre(0, 1));
  EXPECT_THAT(listener.mismatches, IsEmpty());
}

TEST_F(AsServiceTest, SendsHeartbeatsForItsInstancesAndNamesTheCallsTheyHave) {
  fabric::dds::Participant gateway{{.domain = domain.number()}};
  fabric::wire::Reader<fabric::Heartbeat> heartbeats(gateway, "millrace", fabric::wire::Keep::last);
  stand_in({.calls = {planned(1, 0ms, 1h), planned(1, 20ms, 0ms)}});
  EXPECT_EQ(sut->instances().at(0).lease, participant.options().lease);

  fabric::InstanceLoad told;
  const auto until_told = [&](const std::function<bool()>& enough) {
    return run_until(io, [&] {
      for (const auto& taken : heartbeats.take()) {
        for (const fabric::InstanceLoad& load : taken.value.loads) {
          told = load;
        }
      }
      return enough();
    });
  };
  const fabric::InstanceId instance = sut->instances().at(0).id;
  ASSERT_TRUE(until_told([&] { return told.status.instance == instance; }));
  EXPECT_THAT(told.calls, IsEmpty());

  const fabric::Request request = given(1);
  sut->on_request(request);
  ASSERT_TRUE(until_told([&] { return told.status.running == 1; }));
  EXPECT_THAT(told.calls, ElementsAre(request.call));

  sut->on_withdrawn(fabric::key_of(request));
  sut->on_request(given(2));
  ASSERT_TRUE(until_told([&] { return told.status.answered == 1; }));
  EXPECT_EQ(told.status.cancelled, 1U);
  EXPECT_THAT(told.calls, IsEmpty());
}

}  // namespace
}  // namespace millrace::tools::replay
