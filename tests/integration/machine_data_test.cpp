// Machine data from the virtual CNC to the page, the recorder and the archive.
#include <csignal>
#include <fstream>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/data.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string machine(const std::string& more) {
  return "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" " +
         more + " }\n";
}

constexpr const char* axes =
    "data { name: \"axes\" variable: [\"V.A.ACT_POS.X\", \"block_number\", "
    "\"mc_active_feed_override_r\", \"V.E.NONE\"] period_ms: 50 }";

/// Moves X to and fro for a minute.
constexpr const char* moving = "moving.nc";

TEST(MachineData, IsSeenWhileAProgramMoves) {
  Chain sut;
  Process cnc = sut.cnc({"--run", Chain::program(1, moving)});
  Process gateway = sut.configured_gateway(machine(axes));
  gateway.await_error("data axes: V\\.E\\.NONE cannot be read: 0x710 symbol not found");

  Process watch = sut.millrace({"data", "cnc", "--follow", "--count", "3"});
  ASSERT_EQ(watch.wait(), 0) << watch.error_output();
  EXPECT_THAT(watch.output(), HasSubstr("cnc/1  axes  V.A.ACT_POS.X="));
  EXPECT_THAT(watch.output(), HasSubstr("mc_active_feed_override_r=1000  V.E.NONE=- (refused: "));

  Process data = sut.millrace({"data", "--json"});
  ASSERT_EQ(data.wait(), 0) << data.error_output();
  EXPECT_THAT(data.output(), HasSubstr(R"("group":"axes")"));
  EXPECT_THAT(data.output(), HasSubstr(R"("name":"block_number","type":"SGN32","quality":"good")"));
}

TEST(MachineData, IsStaleWithoutItsControllerAndGoodAgainWithIt) {
  Chain sut;
  std::optional<Process> cnc(sut.cnc());
  const std::string address = "127.0.0.1:" + std::to_string(sut.port());
  Process gateway = sut.configured_gateway(machine(
      "data { name: \"state\" variable: [\"mode\", \"cnc_number_of_channel_r\"] period_ms: 50 }"));
  Process watch = sut.millrace({"data", "--follow"});
  watch.await("state  mode=1  cnc_number_of_channel_r=2$");

  cnc.reset();
  watch.await("mode=1 \\(stale: the link is down\\)");

  cnc.emplace(Process({binary("millrace-cnc"), "--listen", address, "--channels", "3", "--dir",
                       sut.folder().string()}));
  watch.await("state  mode=1  cnc_number_of_channel_r=3$");
}

TEST(MachineData, IsReplayedWithAMarkAndRetractedAtTheEnd) {
  Chain sut;
  Process cnc = sut.cnc({"--run", Chain::program(1, moving)});
  const std::string file = (sut.folder() / "run.mcap").string();
  Process record = sut.millrace({"record", "-o", file});
  record.await("^ready: ");
  Process gateway = sut.configured_gateway(machine(axes));
  {
    Process watch = sut.millrace({"data", "--follow", "--count", "10"});
    ASSERT_EQ(watch.wait(), 0) << watch.error_output();
  }
  record.terminate();
  ASSERT_EQ(record.wait(), 0) << record.error_output();

  // The machine itself is still served, and its data are not replaced.
  Process taken = sut.millrace({"replay", "--data", "--channel", "cnc=cnc", file});
  EXPECT_EQ(taken.wait(), 2);
  EXPECT_THAT(taken.error_output(), HasSubstr("a gateway serves machine 'cnc'"));

  Process watch = sut.millrace({"data", "--follow"});
  watch.await("cnc/1  axes  V.A.ACT_POS.X=");
  Process replay = sut.millrace({"replay", "--data", "--rate", "4", file});
  watch.await("replay\\.[0-9a-f]{8}\\.cnc/1  axes  V\\.A\\.ACT_POS\\.X=.*\\(replayed\\)");
  watch.await("replay\\.[0-9a-f]{8}\\.cnc/1  axes  not published any more");
  ASSERT_EQ(replay.wait(), 0) << replay.error_output();
  EXPECT_THAT(replay.error_output(), HasSubstr("cnc/1 is replayed as replay."));
  EXPECT_THAT(replay.output(), HasSubstr("samples and events in "));
}

TEST(MachineData, IsReplayedOnlyWhereThereIsSome) {
  Chain sut;
  Process none = sut.millrace({"replay", "--data", test_data("recordings/demo.mcap")});
  EXPECT_EQ(none.wait(), 2);
  EXPECT_THAT(none.error_output(), HasSubstr("has no machine data"));
  for (const Flags& more : {Flags{"--step"}, Flags{"--verify"}, Flags{"--to-services"}}) {
    Flags command{"replay", "--data", test_data("recordings/demo.mcap")};
    command.insert(command.end(), more.begin(), more.end());
    Process wrong = sut.millrace(command);
    EXPECT_EQ(wrong.wait(), 2) << more.front();
  }
}

TEST(MachineData, IsArchived) {
  Chain sut;
  Process cnc = sut.cnc({"--run", Chain::program(1, moving)});
  const std::string folder = (sut.folder() / "archive").string();
  const std::string config = (sut.folder() / "archiver.textproto").string();
  std::ofstream(config) << "folder: \"archive\"\n";
  Process archiver(
      {binary("millrace-archiver"), "--domain", std::to_string(sut.domain()), "--config", config});
  archiver.await("^ready: ");
  Process gateway = sut.configured_gateway(machine(axes));
  Process watch = sut.millrace({"data", "--follow", "--count", "10"});
  ASSERT_EQ(watch.wait(), 0) << watch.error_output();
  archiver.terminate();
  ASSERT_EQ(archiver.wait(), 0) << archiver.error_output();

  Process query({binary("millrace-archiver"), "query", "--folder", folder, "--kind", "sample",
                 "--variable", "V.A.ACT_POS.X"});
  ASSERT_EQ(query.wait(), 0) << query.error_output();
  EXPECT_THAT(query.output(), HasSubstr("\tcnc\t1\taxes\tV.A.ACT_POS.X\tREAL64\t"));
  EXPECT_THAT(query.output(), Not(HasSubstr("V.E.NONE")));
}

TEST(MachineData, IsCheckedBeforeAGatewayRuns) {
  Chain sut;
  Process cnc = sut.cnc();
  sut.configure(
      machine(axes) +
      "machine { name: \"off\" host: \"127.0.0.1\" port: 1 net_id: \"1.1.1.1.1.1\" data { "
      "name: \"a\" variable: \"mode\" } }\n");
  Process ask(
      {binary("millrace-gateway"), "--config", sut.configuration().string(), "--check", "--ask"});
  EXPECT_EQ(ask.wait(), 2);
  EXPECT_THAT(ask.error_output(), HasSubstr("cnc/1: data axes: V.E.NONE: 0x710 symbol not found"));
  EXPECT_THAT(ask.error_output(), HasSubstr("not checked: off (127.0.0.1:1, 1.1.1.1.1.1)"));
  EXPECT_THAT(ask.error_output(), Not(HasSubstr("V.A.ACT_POS.X")));
}

TEST(MachineData, NeedsNoSumCommands) {
  Chain sut;
  const std::string config = (sut.folder() / "cnc.textproto").string();
  std::ofstream(config) << "connections { sum_commands: false }\n";
  Process cnc = sut.cnc({"--config", config});
  Process gateway = sut.configured_gateway(
      machine("data { name: \"few\" variable: [\"mode\", \"state\", \"V.G.BLOCK_NR\"] "
              "period_ms: 10 } data_requests_per_second: 20"));
  Process watch = sut.millrace({"data", "--follow", "--count", "1"});
  watch.await("few  mode=1  state=2  V\\.G\\.BLOCK_NR=0");
  gateway.await_error(
      "data few: sampled every \\d+ ms, not every 10 ms: the budget of 20 requests a second");
}

}  // namespace
}  // namespace millrace::tests::integration
