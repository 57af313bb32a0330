#include "gateway/live/machine_data.hpp"

#include <functional>
#include <optional>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/server.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "tests/support/run_until.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/variables/fake_cnc.hpp"

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using cnc::variables::FakeCnc;
using fabric::Quality;
using testing::ElementsAre;
using testing::SizeIs;

class MachineDataTest : public testing::Test {
 protected:
  MachineDataTest() { cnc.values = {{"V.E.A", {1, 0, 0, 0}}, {"V.E.B", {2, 0, 0, 0}}}; }

  void serve() {
    cnc::ads::ServerOptions options;
    options.tcp_port = port;
    server.emplace(io.get_executor(), sums, options, base::program::no_log());
    port = server->tcp_port();
  }

  void connect() {
    cnc::ads::ClientOptions options;
    options.tcp_port = port;
    options.target = {{127, 0, 0, 1, 1, 1}};
    client = std::make_shared<cnc::ads::Client>(io.get_executor(), options);
    ASSERT_TRUE(tests::wait_for(io, client->connect()));
  }

  void sample(const data::DataSettings& settings) {
    sut.emplace(
        io.get_executor(), "press", settings,
        [] {
          return Moment{std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
        },
        live::DataOutlet{[this](const auto& one) { samples.push_back(one); },
                         [this](const auto& one) { left.push_back(one.group); }},
        base::program::no_log());
    sut->connect(client, location);
    sut->on_up({1});
  }

  static data::DataSettings both() {
    return {.groups = {{.name = "all", .names = {"V.E.A", "V.E.B"}, .period = 20ms}}};
  }

  boost::asio::io_context io;
  FakeCnc cnc;
  cnc::ads::SumCommands sums{cnc};
  std::uint16_t port = 0;
  std::optional<cnc::ads::Server> server;
  std::shared_ptr<cnc::ads::Client> client;
  std::shared_ptr<cnc::variables::Location> location = std::make_shared<cnc::variables::Location>();
  std::vector<fabric::DataSample> samples;
  std::vector<std::string> left;
  std::optional<live::MachineData> sut;
};

TEST_F(MachineDataTest, IsReadOverTheLinkOfTheMachine) {
  serve();
  connect();
  sample(both());
  ASSERT_TRUE(tests::run_until(io, [&] { return !samples.empty(); }));
  ASSERT_THAT(samples[0].values, SizeIs(2));
  EXPECT_EQ(samples[0].values[1].elements, fabric::Elements(std::vector<std::int64_t>{2}));

  cnc.values["V.E.B"] = {7, 0, 0, 0};
  ASSERT_TRUE(tests::run_until(io, [&] { return samples.size() > 1; }));
  EXPECT_EQ(samples[1].values[1].elements, fabric::Elements(std::vector<std::int64_t>{7}));
}

TEST_F(MachineDataTest, OfAnOlderControllerIsInItsOwnIndexGroups) {
  cnc.group -= cnc::variables::new_group_bit;
  location->group = cnc.group;
  serve();
  connect();
  sample(both());
  ASSERT_TRUE(tests::run_until(io, [&] { return !samples.empty(); }));
  EXPECT_EQ(samples[0].values[1].quality, Quality::good);
}

TEST_F(MachineDataTest, GivesWayWhileACallWaitsForItsAnswer) {
  using cnc::variables::offset::read_by_name;
  serve();
  connect();
  server->set_faults({.delay = 30ms});
  sample(both());
  const cnc::ads::Index place{cnc::variables::decoder_group + 1, read_by_name};
  std::size_t asked_at_answer = 0;
  boost::asio::co_spawn(
      io,
      client->read_write(cnc::variables::sda_port, place, 4, cnc::variables::encode_name("V.E.A")),
      [&](const std::exception_ptr&, const auto& answer) {
        EXPECT_TRUE(answer);
        asked_at_answer = cnc.calls.size();
      });

  ASSERT_TRUE(tests::run_until(io, [&] { return asked_at_answer != 0; }));
  EXPECT_EQ(asked_at_answer, 1U);
  ASSERT_TRUE(tests::run_until(io, [&] { return !samples.empty(); }));
  EXPECT_EQ(samples[0].values[0].quality, Quality::good);
}

TEST_F(MachineDataTest, DoesNotWaitForEverForALinkThatNeverRests) {
  serve();
  connect();
  sample(both());
  ASSERT_TRUE(tests::run_until(io, [&] { return !samples.empty(); }));
  // A request is always under way.
  bool over = false;
  const std::function<void()> ask = [&] {
    boost::asio::co_spawn(io, client->state(cnc::variables::sda_port),
                          [&](const std::exception_ptr&, const auto&) {
                            if (!over) {
                              ask();
                            }
                          });
  };
  server->set_faults({.delay = 5ms});
  ask();
  ask();
  cnc.values["V.E.B"] = {9, 0, 0, 0};
  EXPECT_TRUE(tests::run_until(io, [&] { return samples.size() > 1; }));
  over = true;
}

TEST_F(MachineDataTest, IsStaleWithoutItsLinkAndOursNoMoreWhenAnotherHasTheChannel) {
  serve();
  connect();
  sample(both());
  ASSERT_TRUE(tests::run_until(io, [&] { return !samples.empty(); }));

  sut->on_down();
  EXPECT_EQ(samples.back().values[0].quality, Quality::stale);
  EXPECT_EQ(samples.back().values[0].reason, "the link is down");

  sut->on_over(1);
  EXPECT_THAT(left, ElementsAre("all"));
}

TEST_F(MachineDataTest, ComesBackWithANewLink) {
  serve();
  connect();
  sample(both());
  ASSERT_TRUE(tests::run_until(io, [&] { return !samples.empty(); }));
  sut->on_down();
  client->close();

  connect();
  sut->connect(client);
  sut->on_up({1});
  const std::size_t before = samples.size();
  ASSERT_TRUE(tests::run_until(io, [&] { return samples.size() > before; }));
  EXPECT_EQ(samples.back().values[0].quality, Quality::good);
}

}  // namespace
}  // namespace millrace::gateway
