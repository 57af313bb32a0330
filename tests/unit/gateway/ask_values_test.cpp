#include <optional>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/server.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "gateway/shell/ads_controller.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/variables/fake_cnc.hpp"

namespace millrace::gateway::shell {
namespace {

using cnc::variables::FakeCnc;
using testing::ElementsAre;
using testing::SizeIs;

/// A connected controller with the variables V.E.A and V.E.B.
class ValueRequests : public testing::Test {
 protected:
  ValueRequests() { cnc.values = {{"V.E.A", {1, 0, 0, 0}}, {"V.E.B", {2, 0, 0, 0}}}; }

  machines::Answer ask(variables::Step step) {
    if (!source) {
      cnc::ads::ServerOptions options;
      options.tcp_port = 0;
      server.emplace(io.get_executor(), sums, options, base::program::no_log());
      cnc::ads::ClientOptions client_options;
      client_options.tcp_port = server->tcp_port();
      client_options.target = {{127, 0, 0, 1, 1, 1}};
      client.emplace(io.get_executor(), client_options);
      EXPECT_TRUE(tests::wait_for(io, client->connect()));
      source = std::make_shared<ValueSource>(*client, cnc::variables::Location{.group = cnc.group});
    }
    return tests::wait_for(
        io, ask_values(source, {machines::Requester::variables, ++number, std::move(step)}));
  }
  data::Read reading_of(const std::vector<std::string>& names) {
    data::Read read;
    const machines::Answer known = ask(data::Resolve{1, names});
    for (const auto& one : std::get<std::vector<data::Sampler::Resolved>>(known.found)) {
      EXPECT_TRUE(one);
      read.readings.push_back(one.value());
    }
    return read;
  }

  boost::asio::io_context io;
  FakeCnc cnc;
  cnc::ads::SumCommands sums{cnc};
  std::optional<cnc::ads::Server> server;
  std::optional<cnc::ads::Client> client;
  std::shared_ptr<ValueSource> source;
  std::uint64_t number = 0;
};

TEST_F(ValueRequests, ResolveVariablesAndReadValues) {
  const auto known = ask(data::Resolve{1, {"V.E.A", "V.E.NONE"}});
  EXPECT_EQ(known.requester, machines::Requester::variables);
  EXPECT_EQ(known.number, 1U);
  EXPECT_GT(known.requests, 0U);
  const auto& found = std::get<std::vector<data::Sampler::Resolved>>(known.found);
  ASSERT_THAT(found, SizeIs(2));
  EXPECT_TRUE(found[0]);
  EXPECT_FALSE(found[1]);

  const auto values = ask(reading_of({"V.E.A", "V.E.B"}));
  EXPECT_EQ(values.requests, 1U);
  EXPECT_TRUE(values.sums);
  const auto& bytes = std::get<std::vector<data::Sampler::Answer>>(values.found);
  ASSERT_THAT(bytes, SizeIs(2));
  EXPECT_THAT(*bytes[1], ElementsAre(2, 0, 0, 0));
}

TEST_F(ValueRequests, ReachAnOlderControllerInItsOwnIndexGroups) {
  cnc.group -= cnc::variables::new_group_bit;
  const auto values = ask(reading_of({"V.E.B"}));
  EXPECT_TRUE(std::get<std::vector<data::Sampler::Answer>>(values.found).at(0));
  const auto written = ask(variables::WriteOne{1, "V.E.A", {9, 0, 0, 0}});
  EXPECT_TRUE(std::get<cnc::ads::Result<void>>(written.found));
  EXPECT_THAT(cnc.values["V.E.A"], ElementsAre(9, 0, 0, 0));
}

TEST_F(ValueRequests, WriteAVariable) {
  const auto written = ask(variables::WriteOne{1, "V.E.A", {44, 1, 0, 0}});
  EXPECT_EQ(written.requests, 1U);
  EXPECT_TRUE(std::get<cnc::ads::Result<void>>(written.found));
  EXPECT_THAT(cnc.values["V.E.A"], ElementsAre(44, 1, 0, 0));
}

TEST_F(ValueRequests, ListAFamilyPageByPage) {
  cnc.values.clear();
  for (int i = 0; i < 100; ++i) {
    cnc.values[fmt::format("V.E.N{:03}", i)] = {0, 0, 0, 0};
  }
  const auto page = [this](std::uint32_t first) {
    return std::get<cnc::ads::Result<variables::Page>>(
               ask(variables::ListPage{1, "V.E", first}).found)
        .value();
  };
  EXPECT_EQ(page(0).total, 100U);
  EXPECT_EQ(page(0).variables.at(0).name, "V.E.N000");
  EXPECT_THAT(page(0).variables, SizeIs(fabric::variables_of_a_page));
  EXPECT_EQ(page(64).variables.at(35).name, "V.E.N099");
  EXPECT_THAT(page(100).variables, SizeIs(0));
}

}  // namespace
}  // namespace millrace::gateway::shell
