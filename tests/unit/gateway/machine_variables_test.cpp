#include "gateway/live/machine_variables.hpp"

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
using fabric::VariableAction;
using fabric::VariableReply;
using fabric::VariableRequest;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

/// A controller that the link reaches, with the variables V.E.A and V.E.B.
class MachineVariablesTest : public testing::Test {
 protected:
  MachineVariablesTest() { cnc.values = {{"V.E.A", {1, 0, 0, 0}}, {"V.E.B", {2, 0, 0, 0}}}; }

  void begin(variables::VariableSettings settings = {.writable = {{"V.E.*"}}}) {
    cnc::ads::ServerOptions options;
    options.tcp_port = 0;
    server.emplace(io.get_executor(), sums, options, base::program::no_log());
    cnc::ads::ClientOptions client_options;
    client_options.tcp_port = server->tcp_port();
    client_options.target = {{127, 0, 0, 1, 1, 1}};
    client = std::make_shared<cnc::ads::Client>(io.get_executor(), client_options);
    ASSERT_TRUE(tests::wait_for(io, client->connect()));
    sut.emplace(
        io.get_executor(), "press", settings,
        [] {
          return Moment{std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
        },
        live::VariableOutlet{
            .answer = [this](const auto&, const VariableReply& one) { replies.push_back(one); },
            .written = [this](const auto& one) { written.push_back(one.detail); }},
        base::program::no_log());
    sut->connect(client, location);
    sut->on_up({1});
  }

  VariableReply ask(VariableRequest request) {
    const std::size_t before = replies.size();
    request.key = {"press", 1};
    request.token = fabric::InstanceId::random();
    sut->on_request(request);
    EXPECT_TRUE(tests::run_until(io, [&] { return replies.size() > before; }));
    return replies.size() > before ? replies.back() : VariableReply{};
  }

  static std::int64_t number_in(const VariableReply& reply, std::size_t place) {
    return std::get<std::vector<std::int64_t>>(reply.results.at(place).value.elements).at(0);
  }

  boost::asio::io_context io;
  FakeCnc cnc;
  cnc::ads::SumCommands sums{cnc};
  std::optional<cnc::ads::Server> server;
  std::shared_ptr<cnc::ads::Client> client;
  std::shared_ptr<cnc::variables::Location> location = std::make_shared<cnc::variables::Location>();
  std::vector<VariableReply> replies;
  std::vector<std::string> written;
  std::optional<live::MachineVariables> sut;
};

TEST_F(MachineVariablesTest, AreReadOverTheLinkOfTheMachine) {
  begin();
  const VariableReply reply = ask({.names = {"V.E.A", "V.E.NONE", "V.E.B"}});
  ASSERT_THAT(reply.results, SizeIs(3));
  EXPECT_EQ(number_in(reply, 0), 1);
  EXPECT_EQ(reply.results[1].error, 0x710U);
  EXPECT_EQ(number_in(reply, 2), 2);
}

TEST_F(MachineVariablesTest, AreReadByOneRequestOnceTheyAreKnown) {
  begin({.writable = {}, .cycle = 0ms});
  ask({.names = {"V.E.A"}});
  const std::size_t asked = cnc.calls.size();
  ask({.names = {"V.E.A"}});
  EXPECT_EQ(cnc.calls.size(), asked + 1);
}

TEST_F(MachineVariablesTest, AreWrittenAndReadBack) {
  begin();
  const VariableReply reply =
      ask({.action = VariableAction::write, .names = {"V.E.A"}, .values = {{"300"}}});
  ASSERT_TRUE(reply.done) << reply.reason;
  EXPECT_EQ(number_in(reply, 0), 300);
  EXPECT_THAT(cnc.values["V.E.A"], ElementsAre(44, 1, 0, 0));
  EXPECT_THAT(written, ElementsAre(HasSubstr("V.E.A was 1, is written as 300")));
}

TEST_F(MachineVariablesTest, AreListedPageByPage) {
  cnc.values.clear();
  for (int i = 0; i < 100; ++i) {
    cnc.values[fmt::format("V.E.N{:03}", i)] = {0, 0, 0, 0};
  }
  begin();
  VariableReply reply = ask({.action = VariableAction::list, .names = {"V.E"}});
  EXPECT_EQ(reply.total, 100U);
  ASSERT_THAT(reply.results, SizeIs(fabric::variables_of_a_page));
  EXPECT_EQ(reply.results[0].value.name, "V.E.N000");
  reply = ask({.action = VariableAction::list, .names = {"V.E"}, .first = 64});
  ASSERT_THAT(reply.results, SizeIs(36));
  EXPECT_EQ(reply.results[35].value.name, "V.E.N099");
  reply = ask({.action = VariableAction::list, .names = {"V.E"}, .first = 100});
  EXPECT_TRUE(reply.done);
  EXPECT_THAT(reply.results, SizeIs(0));
}

TEST_F(MachineVariablesTest, OfAnOlderControllerAreInItsOwnIndexGroups) {
  cnc.group -= cnc::variables::new_group_bit;
  location->group = cnc.group;
  begin();
  EXPECT_EQ(number_in(ask({.names = {"V.E.B"}}), 0), 2);
  EXPECT_TRUE(ask({.action = VariableAction::write, .names = {"V.E.A"}, .values = {{"9"}}}).done);
}

TEST_F(MachineVariablesTest, GiveWayWhileACallWaitsForItsAnswer) {
  using cnc::variables::offset::read_by_name;
  begin();
  server->set_faults({.delay = 20ms});
  const cnc::ads::Index place{cnc::variables::decoder_group + 1, read_by_name};
  std::size_t asked_at_answer = 0;
  boost::asio::co_spawn(
      io,
      client->read_write(cnc::variables::sda_port, place, 4, cnc::variables::encode_name("V.E.A")),
      [&](const std::exception_ptr&, const auto& answer) {
        EXPECT_TRUE(answer);
        asked_at_answer = cnc.calls.size();
      });
  io.poll();
  EXPECT_TRUE(ask({.names = {"V.E.A"}}).done);
  EXPECT_EQ(asked_at_answer, 1U);
}

TEST_F(MachineVariablesTest, SayThatTheLinkIsDownAndGoOnWithTheNext) {
  begin();
  ask({.names = {"V.E.A"}});
  sut->on_down("the cable is out");
  EXPECT_EQ(ask({.names = {"V.E.A"}}).reason, "the link to press is down: the cable is out");
  sut->connect(client, location);
  sut->on_up({1});
  EXPECT_TRUE(ask({.names = {"V.E.A"}}).done);
}

TEST_F(MachineVariablesTest, AreGivenUpAfterTheirPatience) {
  begin({.writable = {}, .requests_per_second = 1});
  ask({.names = {"V.E.A"}});
  const VariableReply reply = ask({.names = {"V.E.B"}, .patience = 30ms});
  EXPECT_FALSE(reply.done);
  EXPECT_THAT(reply.reason, HasSubstr("could not be asked within 30 ms"));
}

}  // namespace
}  // namespace millrace::gateway
