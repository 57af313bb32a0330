#include "cnc/variables/state_subscriptions.hpp"

#include <gmock/gmock.h>

#include "cnc/ads/symbols.hpp"
#include "tests/unit/cnc/variables/controller_fixture.hpp"

namespace millrace::cnc::variables {
namespace {

using ads::ErrorCode;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A device with only the states of two channels, as symbols.
class StatesOfTwoChannels final : public ads::Device, public ads::SymbolDirectory {
 public:
  [[nodiscard]] bool has_port(std::uint16_t port) const override { return port == sda_port; }
  ads::Result<ads::DeviceInfo> info(std::uint16_t) override { return ads::DeviceInfo{}; }
  ads::Result<ads::DeviceState> state(std::uint16_t) override { return ads::DeviceState{5, 0}; }
  ads::Result<void> write_control(std::uint16_t, ads::DeviceState, BytesView) override {
    return {};
  }
  ads::Result<Bytes> read(std::uint16_t, ads::Index index, std::uint32_t) override {
    if (index.group != 1) {
      return tl::make_unexpected(ErrorCode::invalid_group);
    }
    return ads::ByteWriter().u32(values[index.offset]).take();
  }
  ads::Result<void> write(std::uint16_t, ads::Index, BytesView) override {
    return tl::make_unexpected(ErrorCode::invalid_group);
  }
  ads::Result<Bytes> read_write(std::uint16_t, ads::Index, std::uint32_t, BytesView) override {
    return tl::make_unexpected(ErrorCode::invalid_group);
  }
  [[nodiscard]] std::optional<ads::Symbol> find(std::uint16_t,
                                                std::string_view name) const override {
    for (std::uint32_t place = 0; place < names.size(); ++place) {
      if (name == names[place]) {
        return ads::Symbol{names[place], {1, place}, 4, 19, 0, "UNS32", ""};
      }
    }
    return std::nullopt;
  }
  [[nodiscard]] std::uint8_t version(std::uint16_t) const override { return 1; }

  std::vector<std::string> names{
      "CH[1].V.G.SERVICE.REQUEST_STATE", "CH[1].V.G.SERVICE.RESPONSE_STATE",
      "CH[2].V.G.SERVICE.REQUEST_STATE", "CH[2].V.G.SERVICE.RESPONSE_STATE"};
  std::map<std::uint32_t, std::uint32_t> values;
};

class StateSubscriptionsTest : public testing::Test {
 protected:
  void start(bool sums = true, std::size_t most = 550) {
    ads::ServerOptions options;
    options.tcp_port = 0;
    options.session.subscriptions.handles = most;
    options.notifications_survive = true;
    ads::Device& device = sums ? static_cast<ads::Device&>(with_sums) : symbols;
    server.emplace(io.get_executor(), device, options, base::program::no_log());
    ads::ClientOptions client_options;
    client_options.tcp_port = server->tcp_port();
    client_options.target = options.session.net_id;
    client.emplace(io.get_executor(), client_options);
    ASSERT_TRUE(tests::wait_for(io, client->connect()));
    sut.emplace(*client, "CH[{channel}].{variable}",
                [this](auto&&... what) { notified.emplace_back(what...); });
  }
  std::vector<SubscriptionOutcome> subscribe(std::vector<std::uint16_t> channels) {
    return tests::wait_for(io, sut->subscribe(std::move(channels)));
  }
  void unsubscribe(std::vector<std::uint16_t> channels) {
    bool done = false;
    boost::asio::co_spawn(io, sut->unsubscribe(std::move(channels)),
                          [&](std::exception_ptr) { done = true; });
    ASSERT_TRUE(tests::run_until(io, [&] { return done; }));
  }
  using Word = std::tuple<std::uint16_t, ServiceVariable, std::optional<std::uint32_t>>;
  bool is_notified(const Word& word) {
    return tests::run_until(io, [&] { return std::ranges::count(notified, word) > 0; });
  }

  boost::asio::io_context io;
  StatesOfTwoChannels cnc;
  ads::Symbols symbols{cnc, cnc};
  ads::SumCommands with_sums{symbols};
  std::optional<ads::Server> server;
  std::optional<ads::Client> client;
  std::vector<Word> notified;
  std::optional<StateSubscriptions> sut;
};

using enum ServiceVariable;

TEST_F(StateSubscriptionsTest, PassesTheFirstValuesAndTheChanges) {
  start();
  const auto outcomes = subscribe({1, 2});
  EXPECT_EQ(outcomes.at(0).error, ErrorCode::none);
  EXPECT_EQ(outcomes.at(1).error, ErrorCode::none);
  EXPECT_TRUE(is_notified({2, response_state, 0}));
  cnc.values[2] = 7;
  EXPECT_TRUE(is_notified({2, request_state, 7}));
}

TEST_F(StateSubscriptionsTest, WorksWithoutSumCommands) {
  start(false);
  EXPECT_EQ(subscribe({1, 2}).at(1).error, ErrorCode::none);
  EXPECT_TRUE(is_notified({2, request_state, 0}));
}

TEST_F(StateSubscriptionsTest, NamesAVariableWithoutAHandleAndSubscribesTheOthers) {
  start();
  const auto outcomes = subscribe({1, 3});
  EXPECT_EQ(outcomes.at(0).error, ErrorCode::none);
  EXPECT_EQ(outcomes.at(1).error, ErrorCode::symbol_not_found);
  EXPECT_THAT(outcomes.at(1).refusal, HasSubstr("CH[3].V.G.SERVICE.REQUEST_STATE: 0x710"));
  EXPECT_TRUE(is_notified({1, request_state, 0}));
}

TEST_F(StateSubscriptionsTest, NeitherStateIsNotifiedWhereOneIsRefused) {
  start(true, 3);
  const auto outcomes = subscribe({1, 2});
  EXPECT_EQ(outcomes.at(0).error, ErrorCode::none);
  EXPECT_EQ(outcomes.at(1).error, ErrorCode::no_more_handles);
  ASSERT_TRUE(is_notified({1, request_state, 0}));
  notified.clear();
  cnc.values[2] = 7;
  cnc.values[0] = 1;
  ASSERT_TRUE(is_notified({1, request_state, 1}));
  EXPECT_THAT(notified, ElementsAre(Word{1, request_state, 1}));
  EXPECT_EQ(symbols.handles(), 2U) << "the handles of channel 2 are released";
}

TEST_F(StateSubscriptionsTest, SendsNothingMoreAndLeavesNothingOfAnUnsubscribedChannel) {
  start(true, 2);
  ASSERT_EQ(subscribe({1}).at(0).error, ErrorCode::none);
  unsubscribe({1});
  EXPECT_EQ(symbols.handles(), 0U);
  EXPECT_EQ(subscribe({2}).at(0).error, ErrorCode::none) << "there is room again";
}

TEST_F(StateSubscriptionsTest, ReleasesEverythingAsItLeaves) {
  for (const bool sums : {true, false}) {
    start(sums, 4);
    ASSERT_EQ(subscribe({1, 2}).at(1).error, ErrorCode::none);
    sut->leave();
    EXPECT_TRUE(tests::run_until(io, [&] { return symbols.handles() == 0; }));
    ASSERT_TRUE(tests::wait_for(io, client->connect()));
    EXPECT_EQ(subscribe({1, 2}).at(1).error, ErrorCode::none) << "no notification was left";
    sut->leave();
    ASSERT_TRUE(tests::run_until(io, [&] { return symbols.handles() == 0; }));
  }
}

TEST_F(StateSubscriptionsTest, ReportsThatTheControllerDoesNotAnswer) {
  start();
  client->close();
  const auto outcomes = subscribe({1});
  EXPECT_EQ(outcomes.at(0).error, ErrorCode::link_down);
  EXPECT_THAT(notified, IsEmpty());
}

}  // namespace
}  // namespace millrace::cnc::variables
