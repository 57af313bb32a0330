// Message queues with the real programs: SSDQ → system data → ADS → gateway → DDS → service, and
// LastGet back.
#include <algorithm>
#include <csignal>
#include <fstream>
#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

/// Whether it becomes true within the longest wait of a test.
template <typename Done>
bool eventually(const Done& done) {
  try {
    await("it", done);
    return true;
  } catch (const std::runtime_error&) {
    return false;
  }
}

class AMessageQueue : public testing::Test {
 protected:
  /// A controller whose queue has this many elements and that runs this program.
  Process cnc(int elements, const std::string& program, Flags flags = {}) {
    const auto file = chain_.folder() / "cnc.textproto";
    std::ofstream(file) << fmt::format(
        "system_data {{ name: \"ALARMS\" type: STRING elements: {} }}\n"
        "system_data {{ name: \"CONTROL\" member {{ name: \"LastFilled\" }} member {{ name: "
        "\"LastGet\" }} }}\n",
        elements);
    flags.insert(flags.end(), {"--config", file.string(), "--run", Chain::program(1, program)});
    return chain_.cnc(flags);
  }

  Process gateway(const std::string& queue = "", Flags flags = {}) {
    return chain_.configured_gateway(configuration(queue, "journal"), std::move(flags));
  }

  /// A gateway with this journal; `queue` has further settings of the queue.
  [[nodiscard]] std::string configuration(const std::string& queue,
                                          const std::string& journal) const {
    return machine(fmt::format("queue {{ name: \"ALARMS\" control: \"SD.CONTROL\" uuid: "
                               "\"c0ffee00-0000-4000-8000-000000000001\" {} }}",
                               queue)) +
           fmt::format("journal {{ folder: \"{}\" }}\n", (chain_.folder() / journal).string());
  }

  static std::string machine(const std::string& queue) {
    return fmt::format(
        "machine {{ name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" {} "
        "}}\n",
        queue);
  }

  Process service(Flags flags = {}) {
    flags.insert(flags.end(), {"--texts", texts_file().string()});
    return chain_.slow_service(flags);
  }

  [[nodiscard]] std::filesystem::path texts_file() const { return chain_.folder() / "texts"; }

  /// Call and text of each execution.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> executions() const {
    std::vector<std::pair<std::string, std::string>> all;
    std::ifstream in(texts_file());
    for (std::string line; std::getline(in, line);) {
      const auto blank = line.find(' ');
      all.emplace_back(line.substr(0, blank), line.substr(blank + 1));
    }
    return all;
  }
  [[nodiscard]] std::vector<std::string> texts() const {
    std::vector<std::string> all;
    for (const auto& [call, text] : executions()) {
      all.push_back(text);
    }
    return all;
  }
  [[nodiscard]] bool await_texts(std::size_t count) const {
    return eventually([&] { return executions().size() >= count; });
  }

  static std::vector<std::string> messages(int last) {
    std::vector<std::string> all;
    for (int i = 1; i <= last; ++i) {
      all.push_back("message " + std::to_string(i));
    }
    return all;
  }

  Chain chain_;
};

TEST_F(AMessageQueue, CausesAWarningOnlyWithoutAJournal) {
  const std::string queue = "queue { name: \"ALARMS\" control: \"SD.CONTROL\" uuid: \"c0ffee00\" }";
  Process controller = cnc(3, "messages.nc");
  const std::string warning = "cnc\\.ALARMS/1: without a journal";
  {
    Process sut = chain_.configured_gateway(machine(queue), {"--no-journal"});
    sut.await_error(warning);
  }
  Process sut = gateway();
  sut.await_error("link up");
  EXPECT_THAT(sut.error_output(), Not(HasSubstr("without a journal")));
}

TEST_F(AMessageQueue, IsReadIntoTheJournalWhileItIsUnserved) {
  Process controller = cnc(3, "messages.nc", {"--exit-when-idle"});
  {
    Process reader = gateway();
    EXPECT_EQ(controller.wait(), 0) << controller.error_output() << reader.error_output();
    reader.await_error("cnc\\.ALARMS/1: no service has the UUID");
    reader.kill();
  }
  Process again = gateway();
  Process sut = service();
  ASSERT_TRUE(await_texts(200)) << again.error_output();
  EXPECT_EQ(texts(), messages(200));
}

TEST_F(AMessageQueue, LosesNothingWhenItsGatewayIsKilledAgainAndAgain) {
  Process sut = service();
  Process controller = cnc(5, "messages.nc", {"--exit-when-idle"});
  for (int round = 0; round < 6; ++round) {
    Process reader = gateway();
    ASSERT_TRUE(await_texts(static_cast<std::size_t>(round + 1) * 10)) << reader.error_output();
    reader.kill();
  }
  Process reader = gateway();
  EXPECT_EQ(controller.wait(), 0) << controller.error_output() << reader.error_output();
  ASSERT_TRUE(await_texts(200)) << reader.error_output();
  // An instance that has run a call answers its repeat from memory.
  EXPECT_EQ(texts(), messages(200));
}

TEST_F(AMessageQueue, RepeatsUnderTheSameIdWhenItsServiceIsKilled) {
  Process controller = cnc(5, "messages.nc", {"--exit-when-idle"});
  Process reader = gateway("drain: WHEN_ANSWERED");
  for (int round = 0; round < 5; ++round) {
    Process sut = service();
    ASSERT_TRUE(await_texts(executions().size() + 10)) << reader.error_output();
    sut.kill();
  }
  Process sut = service();
  EXPECT_EQ(controller.wait(), 0) << controller.error_output() << reader.error_output();
  // All messages arrive in their order, and repetitions have the same id.
  std::map<std::string, std::set<std::string>> calls;
  std::vector<std::string> first;
  for (const auto& [call, text] : executions()) {
    if (calls[text].empty()) {
      first.push_back(text);
    }
    calls[text].insert(call);
  }
  EXPECT_EQ(first, messages(200));
  for (const auto& [text, ids] : calls) {
    EXPECT_THAT(ids, SizeIs(1)) << text;
  }
}

TEST_F(AMessageQueue, OfASlowServiceWaitsInTheJournalAsFarAsItMay) {
  Process sut = service({"--work", "10"});
  // It writes the next message after the previous ones were read: at most 8 wait.
  Process controller = cnc(3, "messages.nc", {"--exit-when-idle"});
  Process reader = gateway("backlog: 8");
  reader.await_error("[678] of 8 messages that the journal may hold");
  EXPECT_LT(executions().size(), 200U);
  EXPECT_EQ(controller.wait(), 0) << controller.error_output() << reader.error_output();
  ASSERT_TRUE(await_texts(200)) << reader.error_output();
  EXPECT_EQ(texts(), messages(200));
  reader.await_error("SD.ALARMS has room again");
}

TEST_F(AMessageQueue, ShowsInTheOperatorsTools) {
  Process controller = cnc(4, "two_messages.nc");
  Process reader = gateway("drain: WHEN_ANSWERED");
  controller.await("written");
  reader.await_error("cnc\\.ALARMS/1: no service has the UUID");
  Process status = chain_.millrace({"channels"});
  EXPECT_EQ(status.wait(), 0) << status.error_output();
  EXPECT_THAT(status.output(),
              AllOf(HasSubstr("cnc.ALARMS/1"), HasSubstr("unserved"), HasSubstr("cnc/1")));
  std::string shown;
  EXPECT_TRUE(eventually([&] {
    Process queues = chain_.millrace({"queues", "cnc"});
    queues.wait();
    shown = queues.output();
    return shown.find("2 of 3") != std::string::npos;
  })) << shown;
  EXPECT_THAT(shown,
              AllOf(HasSubstr("cnc.ALARMS/1"), HasSubstr("SD.ALARMS"), HasSubstr("WHEN_ANSWERED")));
  // An operator answers in the service's place, once a message waits for an answer.
  Process sut = service();
  ASSERT_TRUE(await_texts(2)) << reader.error_output();
  EXPECT_THAT(texts(), ElementsAre("drill worn", "coolant low"));
  EXPECT_TRUE(eventually([&] {
    Process queues = chain_.millrace({"queues", "--json"});
    queues.wait();
    shown = queues.output();
    return shown.find("\"answered\"") != std::string::npos &&
           shown.find("coolant low") != std::string::npos;
  })) << shown;
}

TEST_F(AMessageQueue, IsReadAtOnceWithNotifications) {
  Process sut = service();
  Process controller = cnc(3, "messages.nc", {"--exit-when-idle"});
  // Polling once a minute would take a day and a half.
  Process reader = gateway("period_ms: 60000 events: true");
  EXPECT_EQ(controller.wait(), 0) << controller.error_output() << reader.error_output();
  ASSERT_TRUE(await_texts(200)) << reader.error_output();
  EXPECT_EQ(texts(), messages(200));
}

TEST_F(AMessageQueue, IsReadOnlyWhileTheConfigurationNamesIt) {
  Process sut = service();
  Process controller = cnc(4, "two_messages.nc");
  Process reader = chain_.configured_gateway(machine(""));
  reader.await_error("link up");
  const auto queue = [&](const std::string& more) {
    return machine(
        "queue { name: \"ALARMS\" control: \"SD.CONTROL\" uuid: "
        "\"c0ffee00-0000-4000-8000-000000000001\" " +
        more + "}");
  };
  chain_.configure(queue(""));
  reader.signal(SIGHUP);
  ASSERT_TRUE(await_texts(2)) << reader.error_output();
  EXPECT_THAT(texts(), ElementsAre("drill worn", "coolant low"));
  chain_.configure(machine(""));
  reader.signal(SIGHUP);
  std::string shown;
  EXPECT_TRUE(eventually([&] {
    Process channels = chain_.millrace({"channels"});
    channels.wait();
    shown = channels.output();
    return shown.find("cnc/1") != std::string::npos && shown.find("ALARMS") == std::string::npos;
  })) << shown
      << reader.error_output();
}

TEST_F(AMessageQueue, IsReadByASecondGatewayWhenTheFirstIsGone) {
  Process sut = service();
  Process controller = cnc(5, "messages.nc", {"--exit-when-idle"});
  Process first = gateway("drain: WHEN_ANSWERED");
  first.await_error("link up");
  chain_.configure(configuration("drain: WHEN_ANSWERED", "second journal"));
  Process second({binary("millrace-gateway"), "--domain", std::to_string(chain_.domain()),
                  "--config", chain_.configuration().string()});
  second.await_error("this gateway stands by");
  ASSERT_TRUE(await_texts(20)) << first.error_output();
  first.kill();
  EXPECT_EQ(controller.wait(), 0) << controller.error_output() << second.error_output();
  // The second gateway does not know the call under way and dispatches it again.
  auto all = texts();
  all.erase(std::unique(all.begin(), all.end()), all.end());
  EXPECT_EQ(all, messages(200)) << second.error_output();
}

}  // namespace
}  // namespace millrace::tests::integration
