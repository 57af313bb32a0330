// I7: a recording can be opened, or repaired, even if its recorder was killed. I9: status queries
// reach every instance.
#include <fstream>
#include <regex>
#include <set>

#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"
#include "tools/mcap/file.hpp"
#include "tools/mcap/repair.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tests::cluster {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using tools::recording::Entry;

class TheRecorder : public Scenario {
 protected:
  std::size_t written_calls(const std::filesystem::path& file) {
    auto source = tools::mcap::FileSource::open(file);
    EXPECT_TRUE(source) << source.error();
    std::size_t count = 0;
    const auto report = tools::recording::read_entries(*source, {}, [&](const Entry& entry) {
      const auto* event = std::get_if<fabric::Event>(&entry.sample);
      count += event != nullptr && event->kind == fabric::EventKind::written ? 1 : 0;
    });
    EXPECT_THAT(report.problems, IsEmpty());
    return count;
  }
};

TEST_P(TheRecorder, ThatIsKilledLosesItsLastQuarterOfASecondAndDisturbsNoCall) {
  sut().service("service-1", "slow-1", {"--work", "10"});
  sut().gateway();
  sut().cnc({.channels = 1, .calls = 200});
  sut().await_finished(100);
  sut().task("recorder").kill();
  const auto part = tools::mcap::part_of(sut().recording());
  const auto repaired = tools::mcap::repaired_name(part);
  const auto report = tools::mcap::repair_file(part, repaired, "test");
  ASSERT_TRUE(report) << report.error();
  // A call takes at least 10 ms; a chunk is closed after 250 ms.
  EXPECT_GE(written_calls(repaired), 100U - 50U);
  std::filesystem::remove(part);
  sut().record_again();
  sut().expect_all_answered();
}

TEST_P(TheRecorder, HostPingsEveryInstance) {
  for (const char* number : {"1", "2", "3"}) {
    sut().service(std::string("service-") + number, std::string("slow-") + number);
  }
  const std::string answers = sut().millrace("recorder", {"services", "--ping", slow_uuid});
  for (const char* name : {"slow-1", "slow-2", "slow-3"}) {
    EXPECT_THAT(answers, HasSubstr(name)) << "I9";
  }
  EXPECT_THAT(answers, Not(HasSubstr("no answer"))) << "I9";
}

INSTANTIATE_TEST_SUITE_P(Cluster, TheRecorder, testing::ValuesIn(backends), name_of);

// I6: what the archiver has acknowledged is in the archive, even if its process was killed.

constexpr const char* archiver_uuid = "326de49a-633b-4cea-a9b8-1924d7f926a7";

class TheArchive : public Scenario {
 protected:
  static constexpr std::uint32_t channels = 2;
  static constexpr std::uint32_t calls = 200;

  std::filesystem::path folder() { return sut().hosts().folder() / "archive"; }

  void start_archiver(const std::string& name) {
    const auto config = sut().hosts().folder() / "archiver.textproto";
    std::ofstream(config) << "folder: \"" << folder().string() << "\"\n";
    sut().start("service-1", name, "millrace-archiver", {"--config", config});
  }

  /// The calls with rows in the archive, once for each row.
  std::multiset<std::string> kept() {
    const auto query =
        sut().hosts().up("service-1", "millrace-archiver",
                         {"export", "--folder", folder(), "--kind", "put", "--format", "jsonl"});
    EXPECT_EQ(query->wait(), 0) << query->log();
    const std::string rows = query->output();
    const std::regex call("\"call\":\"([^\"]+)\"");
    std::multiset<std::string> found;
    for (std::sregex_iterator row(rows.begin(), rows.end(), call), end; row != end; ++row) {
      found.insert((*row)[1]);
    }
    return found;
  }
};

TEST_P(TheArchive, HasEachAcknowledgedCallOnceAlthoughItsWriterWasKilled) {
  start_archiver("archiver-1");
  sut().gateway();
  sut().cnc(
      {.channels = channels, .calls = calls, .uuid = archiver_uuid, .program = "archiving.nc"});
  sut().task("cnc").await("^\\[ch1\\] number 20$");
  sut().task("archiver-1").kill();
  start_archiver("archiver-2");
  sut().expect_all_answered();
  const std::multiset<std::string> rows = kept();
  std::size_t answered = 0;
  for (const gateway::JournalEntry& entry : sut().history().journal) {
    if (const auto* answer = std::get_if<gateway::AnsweredEntry>(&entry)) {
      ++answered;
      EXPECT_EQ(rows.count(answer->call.to_string()), 1U) << "I6: " << answer->call.to_string();
    }
  }
  EXPECT_EQ(answered, channels * calls);
  sut().task("archiver-2").terminate();
  EXPECT_EQ(sut().task("archiver-2").wait(), 0);
}

INSTANTIATE_TEST_SUITE_P(Cluster, TheArchive, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
