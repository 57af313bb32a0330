// I7: a recording can be opened, or repaired, even if its recorder was killed. I9: status queries
// reach every instance.
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

}  // namespace
}  // namespace millrace::tests::cluster
