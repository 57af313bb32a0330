#include "gateway/shell/ads_controller.hpp"

#include <optional>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/server.hpp"
#include "cnc/ads/stream.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"
#include "gateway/shell/back_off.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/cnc/variables/fake_cnc.hpp"

namespace millrace::gateway {
namespace {

using cnc::ads::Bytes;
using cnc::ads::BytesView;
using cnc::ads::ErrorCode;
using cnc::ads::Index;

template <typename T>
using Result = cnc::ads::Result<T>;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;
using tests::run_until;
using namespace std::chrono_literals;

/// A controller with two channels, whose REQUEST_STATE is the channel's number.
class TwoChannels final : public cnc::ads::Device {
 public:
  [[nodiscard]] bool has_port(std::uint16_t port) const override { return port == 552; }
  Result<cnc::ads::DeviceInfo> info(std::uint16_t) override { return cnc::ads::DeviceInfo{}; }
  Result<cnc::ads::DeviceState> state(std::uint16_t) override {
    return cnc::ads::DeviceState{5, 0};
  }
  Result<void> write_control(std::uint16_t, cnc::ads::DeviceState, BytesView) override {
    return tl::unexpected(ErrorCode::service_not_supported);
  }
  Result<Bytes> read(std::uint16_t, Index, std::uint32_t) override {
    return tl::unexpected(ErrorCode::invalid_group);
  }
  Result<void> write(std::uint16_t, Index index, BytesView) override {
    written = index;
    return write_result;
  }
  Result<Bytes> read_write(std::uint16_t, Index index, std::uint32_t, BytesView data) override {
    const auto channel = index.group - cnc::variables::decoder_group;
    if (channel < 1 || channel > channels) {
      return tl::unexpected(ErrorCode::invalid_group);
    }
    const auto stream = cnc::variables::decode_name(data);
    if (!stream || !stream->name.ends_with("STATE")) {
      return Bytes{'x', 0};
    }
    return Bytes{static_cast<std::uint8_t>(channel), 0, 0, 0};
  }

  std::uint32_t channels = 2;
  Index written{};
  Result<void> write_result{};
};

class AdsControllerTest : public testing::Test, public machines::ControllerEvents {
 protected:
  void on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels) override {
    EXPECT_EQ(machine, "cnc");
    up.push_back(channels);
  }
  void on_link_down(const std::string& machine, const machines::LinkLoss& loss) override {
    EXPECT_EQ(machine, "cnc");
    down.push_back(loss.reason);
  }
  void on_read(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot) override {
    EXPECT_EQ(key.channel, snapshot.request_state);
    snapshots.push_back(snapshot);
  }
  void on_read_failed(const fabric::ChannelKey&, const fabric::Message& reason) override {
    failures.push_back(reason);
  }
  void on_write(const fabric::ChannelKey&, WriteOutcome outcome,
                const fabric::Message& reason) override {
    outcomes.push_back(outcome);
    failures.push_back(reason);
  }
  void on_subscribed(const std::string& machine,
                     const std::vector<machines::SubscribeOutcome>& channels) override {
    EXPECT_EQ(machine, "cnc");
    watched.insert(watched.end(), channels.begin(), channels.end());
  }
  void on_notification(const fabric::ChannelKey& key, Variable variable,
                       std::optional<std::uint32_t> value) override {
    notifications.emplace_back(key.channel, variable, value);
  }
  void on_answer(const std::string&, const machines::Answer& answer) override {
    answers.push_back(answer);
  }
  void on_queue_answer(const fabric::ChannelKey&, queues::StepAnswer answer) override {
    queue_answers.push_back(std::move(answer));
  }
  void on_queue_event(const fabric::ChannelKey&) override {}

  void serve() {
    server.reset();
    cnc::ads::ServerOptions options;
    options.tcp_port = port;
    options.security = server_security;
    options.secure_faults = secure_faults;
    server = std::make_unique<cnc::ads::Server>(
        io.get_executor(), with_sums ? static_cast<cnc::ads::Device&>(sums) : device, options,
        base::program::no_log());
    port = server->tcp_port();
  }

  void connect() {
    settings::MachineSettings settings;
    settings.controller.tcp_port = port;
    settings.channels = named_channels;
    settings.controller.security = security;
    sut = std::make_unique<shell::AdsController>(io.get_executor(), settings, *this,
                                                 base::program::no_log());
    sut->start();
  }

  bool run(const std::function<bool()>& done) { return run_until(io, done); }

  boost::asio::io_context io;
  TwoChannels device;
  cnc::ads::SumCommands sums{device};
  bool with_sums = true;
  std::optional<cnc::ads::ServerSecurity> server_security;
  cnc::ads::SecureFaults secure_faults;
  std::optional<cnc::ads::Security> security;
  std::uint16_t port = 0;
  std::vector<std::uint16_t> named_channels;
  std::unique_ptr<cnc::ads::Server> server;
  std::unique_ptr<shell::AdsController> sut;
  std::vector<std::vector<std::uint16_t>> up;
  std::vector<std::string> down;
  std::vector<ServiceSnapshot> snapshots;
  std::vector<std::string> failures;
  std::vector<WriteOutcome> outcomes;
  std::vector<machines::SubscribeOutcome> watched;
  std::vector<machines::Answer> answers;
  std::vector<queues::StepAnswer> queue_answers;
  std::vector<std::tuple<std::uint16_t, Variable, std::optional<std::uint32_t>>> notifications;
};

TEST_F(AdsControllerTest, FindsTheChannelsOfItsController) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  EXPECT_THAT(up, ElementsAre(ElementsAre(1, 2)));
}

TEST_F(AdsControllerTest, UsesTheConfiguredChannels) {
  serve();
  named_channels = {2};
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  EXPECT_THAT(up, ElementsAre(ElementsAre(2)));
}

TEST_F(AdsControllerTest, ReadsTheRequestedVariables) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  sut->read(2, ReadSet::all);
  ASSERT_TRUE(run([&] { return !snapshots.empty(); }));
  EXPECT_EQ(snapshots.front(), (ServiceSnapshot{ReadSet::all, "x", "x", 2, 2, "x"}));
}

TEST_F(AdsControllerTest, ReadsAllDueChannelsInOneRequest) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  const auto before = sut->load().requests;
  sut->read(1, ReadSet::state);
  sut->read(2, ReadSet::state);
  ASSERT_TRUE(run([&] { return snapshots.size() == 2; }));
  EXPECT_EQ(sut->load().requests, before + 1);
}

TEST_F(AdsControllerTest, ReadsAgainAndAgain) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  for (std::size_t reads = 1; reads <= 20; ++reads) {
    sut->read(1, ReadSet::state);
    ASSERT_TRUE(run([&] { return snapshots.size() == reads; }));
  }
}

TEST_F(AdsControllerTest, ReadsEachChannelByItselfWithoutSumCommands) {
  with_sums = false;
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  for (int times = 0; times < 2; ++times) {
    sut->read(1, ReadSet::state);
    sut->read(2, ReadSet::state);
    ASSERT_TRUE(run([&] { return snapshots.size() == 2; }));
    snapshots.clear();
  }
  EXPECT_TRUE(failures.empty());
}

TEST_F(AdsControllerTest, NamesTheChannelOfAFailedReadAndContinuesWithTheOthers) {
  serve();
  named_channels = {1, 2, 3};
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  for (const std::uint16_t channel : named_channels) {
    sut->read(channel, ReadSet::state);
  }
  ASSERT_TRUE(run([&] { return snapshots.size() == 2 && failures.size() == 1; }));
  EXPECT_THAT(failures.front(), HasSubstr("Interface of channel 3: "));
}

TEST_F(AdsControllerTest, DistinguishesAWriteFromARefusedOne) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  sut->write(1, Variable::response_state, Value(1U));
  ASSERT_TRUE(run([&] { return outcomes.size() == 1; }));
  device.write_result = tl::unexpected(ErrorCode::invalid_data);
  sut->write(1, Variable::response, Value(std::string("x")));
  ASSERT_TRUE(run([&] { return outcomes.size() == 2; }));
  EXPECT_THAT(outcomes, ElementsAre(WriteOutcome::written, WriteOutcome::refused));
  EXPECT_THAT(failures.back(), StartsWith("V.G.SERVICE.RESPONSE of channel 1 cannot be written: "));
}

TEST_F(AdsControllerTest, KeepsTryingUntilTheControllerIsThere) {
  serve();
  server.reset();
  connect();
  ASSERT_TRUE(run([&] { return !down.empty(); }));
  EXPECT_THAT(down.front(), HasSubstr("refused"));
  serve();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
}

TEST_F(AdsControllerTest, WaitsLongerEachTimeForAControllerThatRefusesRapidConnections) {
  const cnc::ads::Psk psk{"millrace", "secret"};
  server_security = cnc::ads::ServerSecurity{.psk = psk};
  security = psk;
  secure_faults.least_pause = 500ms;
  serve();
  const auto another = tests::wait_for(io, cnc::ads::dial("127.0.0.1", port, 10s));
  ASSERT_TRUE(another);
  connect();
  ASSERT_TRUE(run([&] { return !down.empty(); }));
  EXPECT_THAT(down.front(), HasSubstr("were there many connections in a short time?"));
  ASSERT_TRUE(run([&] { return !up.empty(); }))
      << "a client that asks every 100 ms is never accepted";
}

TEST_F(AdsControllerTest, ReconnectsAfterEachEndOfTheConnection) {
  serve();
  connect();
  for (std::size_t times = 1; times <= 3; ++times) {
    ASSERT_TRUE(run([&] { return up.size() == times; }));
    serve();
    ASSERT_TRUE(run([&] { return down.size() >= times; }));
  }
}

TEST_F(AdsControllerTest, ReportsAnUnknownOutcomeOfAWriteWhoseConnectionEnded) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  sut->write(1, Variable::response_state, Value(1U));
  server.reset();
  ASSERT_TRUE(run([&] { return !outcomes.empty(); }));
  EXPECT_THAT(outcomes, ElementsAre(WriteOutcome::unknown));
}

// A regression: a read that the gateway requested after a failed write was answered while it still
// handled that write.
TEST_F(AdsControllerTest, NeverAnswersWithinTheCallAlsoWithoutAConnection) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  server.reset();
  ASSERT_TRUE(run([&] { return !down.empty(); }));
  bool within = false;
  boost::asio::post(io, [&] {
    sut->read(1, ReadSet::all);
    sut->write(1, Variable::response_state, Value(1U));
    within = !failures.empty();
  });
  ASSERT_TRUE(run([&] { return failures.size() == 2; }));
  EXPECT_FALSE(within);
}

TEST_F(AdsControllerTest, ReturnsTheResultOfAValueRequest) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  sut->ask({machines::Requester::variables, 7, data::Resolve{1, {"V.E.A"}}});
  EXPECT_TRUE(answers.empty()) << "not from within";
  ASSERT_TRUE(run([&] { return !answers.empty(); }));
  EXPECT_EQ(answers[0].requester, machines::Requester::variables);
  EXPECT_EQ(answers[0].number, 7U);
}

TEST_F(AdsControllerTest, ReportsNothingOfAMessageQueueThatWasReopenedSinceTheRequest) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  const queues::QueueSettings settings{.name = "Q", .array = "SD.Q", .control = "SD.C"};
  const fabric::ChannelKey queue = settings.key("cnc");
  sut->open(queue, settings);
  sut->ask(queue, queues::ReadControl{});
  sut->open(queue, settings);
  sut->ask(queue, queues::ReadControl{});
  ASSERT_TRUE(run([&] { return !queue_answers.empty(); }));
  // Every later request is answered later.
  sut->read(1, ReadSet::state);
  ASSERT_TRUE(run([&] { return !snapshots.empty(); }));
  EXPECT_EQ(queue_answers.size(), 1U);
}

TEST_F(AdsControllerTest, ReportsThatAControllerHasNoServiceInterface) {
  device.channels = 0;
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !down.empty(); }));
  EXPECT_THAT(down.front(), HasSubstr("no channel found"));
  device.channels = 1;
  ASSERT_TRUE(run([&] { return !up.empty(); }));
}

TEST_F(AdsControllerTest, IsSilentOnceItIsGone) {
  serve();
  connect();
  ASSERT_TRUE(run([&] { return !up.empty(); }));
  sut->read(1, ReadSet::state);
  sut.reset();
  run_until(
      io, [] { return false; }, std::chrono::milliseconds(50));
  EXPECT_TRUE(snapshots.empty());
  EXPECT_TRUE(failures.empty());
}

TEST(BackOff, DoublesUpToALimitAndStartsOverAfterALastingLink) {
  using shell::BackOff;
  BackOff sut(1);
  const auto first = sut.next(0s);
  EXPECT_GE(first, BackOff::shortest * 3 / 4);
  EXPECT_LE(first, BackOff::shortest * 5 / 4);
  for (int i = 0; i < 20; ++i) {
    EXPECT_LE(sut.next(0s), BackOff::longest * 5 / 4);
  }
  EXPECT_GE(sut.next(0s), BackOff::longest * 3 / 4);
  EXPECT_LE(sut.next(BackOff::longest), BackOff::shortest * 5 / 4);
}

TEST(BackOff, GrowsWhereEachLinkEndsSoon) {
  using shell::BackOff;
  BackOff sut(1);
  for (int i = 0; i < 5; ++i) {
    static_cast<void>(sut.next(10ms));
  }
  EXPECT_GE(sut.next(10ms), BackOff::longest * 3 / 4);
}

}  // namespace
}  // namespace millrace::gateway

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
    for (const auto& resolved : std::get<std::vector<data::Sampler::Resolved>>(known.found)) {
      EXPECT_TRUE(resolved);
      read.readings.push_back(resolved.value());
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
