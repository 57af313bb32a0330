#include "fabric/endpoints/command_endpoint.hpp"

#include <gtest/gtest.h>

#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

using tests::run_until;

struct RecordedCommands : endpoints::CommandListener {
  void on_command(const Command& command) override { commands.push_back(command); }
  std::vector<Command> commands;
};

/// A gateway or instance `here`, an operator `there`.
class CommandEndpoints : public testing::Test {
 protected:
  bool until(const std::function<bool()>& done) { return run_until(context, done); }
  /// Samples that are sent later reach the other side.
  bool until_matched() {
    return until([&] { return !commands.matched().empty(); });
  }

  TwoProcesses processes;
  boost::asio::io_context context;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
  RecordedCommands received;
  endpoints::CommandEndpoint sut{here, context.get_executor(), received};
  wire::Writer<Command> commands{there, "millrace"};
};

TEST_F(CommandEndpoints, ReceiveACommandWithAllItsFields) {
  ASSERT_TRUE(until_matched());
  const Command sent{.id = InstanceId::random(),
                     .kind = CommandKind::answer,
                     .key = {.machine = "cnc", .channel = 2},
                     .call = {.epoch = 7, .number = 9},
                     .text = "1.5",
                     .state = 99,
                     .issuer = "operator@host",
                     .at = Time(std::chrono::nanoseconds(5))};
  ASSERT_TRUE(commands.write(sent));
  ASSERT_TRUE(until([&] { return !received.commands.empty(); }));
  const Command& got = received.commands.front();
  EXPECT_EQ(got.id, sent.id);
  EXPECT_EQ(got.kind, sent.kind);
  EXPECT_EQ(got.key, sent.key);
  EXPECT_EQ(got.call, sent.call);
  EXPECT_EQ(got.text, sent.text);
  EXPECT_EQ(got.state, sent.state);
  EXPECT_EQ(got.issuer, sent.issuer);
  EXPECT_EQ(got.at, sent.at);
}

TEST_F(CommandEndpoints, ReceiveARepeatedCommandOnce) {
  ASSERT_TRUE(until_matched());
  const Command drain{.id = InstanceId::random(), .kind = CommandKind::drain};
  const Command next{.id = InstanceId::random(), .kind = CommandKind::drain};
  for (const Command& command : {drain, drain, next}) {
    ASSERT_TRUE(commands.write(command));
  }
  ASSERT_TRUE(
      until([&] { return !received.commands.empty() && received.commands.back().id == next.id; }));
  EXPECT_EQ(received.commands.size(), 2U);
}

TEST_F(CommandEndpoints, PublishTheOutcomeAlsoToAToolThatIsDiscoveredLate) {
  const Outcome outcome{.responder = InstanceId::random(),
                        .command = InstanceId::random(),
                        .done = true,
                        .detail = "drained"};
  ASSERT_TRUE(sut.publish(outcome));
  wire::Reader<Outcome> outcomes(there, "millrace", wire::Keep::all);
  std::vector<wire::Taken<Outcome>> got;
  ASSERT_TRUE(until([&] {
    if (got.empty()) {
      got = outcomes.take();
    }
    return !got.empty();
  }));
  EXPECT_EQ(got.front().value.command, outcome.command);
  EXPECT_EQ(got.front().value.responder, outcome.responder);
  EXPECT_TRUE(got.front().value.done);
  EXPECT_EQ(got.front().value.detail, "drained");
}

}  // namespace
}  // namespace millrace::fabric
