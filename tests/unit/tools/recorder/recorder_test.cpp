#include "tools/recorder/recorder.hpp"

#include <algorithm>
#include <csignal>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/mcap/repair.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/recorder/recording_file.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::recorder {
namespace {

using namespace std::chrono_literals;
using recording::Entry;
using recording::tests::at;
using recording::tests::one_call;
using recording::tests::square_root;

bool is_written(const Entry& entry) {
  const auto* event = std::get_if<fabric::Event>(&entry.sample);
  return event != nullptr && event->kind == fabric::EventKind::written;
}

class RecorderTest : public testing::Test {
 protected:
  Options options() const {
    return {.file = folder.path() / "run.mcap", .sync = Sync::none, .library = "test"};
  }

  void record(Recorder& sut, std::uint64_t number, double start) {
    for (const Entry& entry : one_call(number, start)) {
      ASSERT_TRUE(sut.on_entry(entry, now));
    }
  }

  static std::vector<Entry> read(const std::filesystem::path& file) {
    auto source = mcap::FileSource::open(file);
    EXPECT_TRUE(source) << source.error();
    std::vector<Entry> entries;
    const auto report =
        recording::read_entries(*source, {}, [&](const Entry& entry) { entries.push_back(entry); });
    EXPECT_EQ(report.problems, mcap::Problems{});
    return entries;
  }

  tests::TemporaryFolder folder;
  Recorder::Moment now{};
};

TEST_F(RecorderTest, WritesWhatItReceivesAndCountsIt) {
  Recorder sut(options());
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  record(sut, 2, 10);
  ASSERT_TRUE(sut.finish(14, 0, at(10'000)));
  EXPECT_EQ(sut.tally().received, 14U);
  EXPECT_EQ(sut.tally().written, 14U);
  EXPECT_EQ(read(folder.path() / "run.mcap").size(), 14U);

  auto source = mcap::FileSource::open(folder.path() / "run.mcap");
  const mcap::Survey survey = mcap::survey(*source);
  ASSERT_EQ(survey.metadata.size(), 2U);
  EXPECT_EQ(survey.metadata[0].values.at("delivered_by_the_bus"), "14");
  EXPECT_EQ(survey.metadata[0].values.at("written"), "14");
  EXPECT_EQ(survey.metadata[0].values.at("calls_ended"), "2");
  EXPECT_EQ(survey.metadata[0].values.at("calls_failed"), "0");
  EXPECT_EQ(survey.metadata[1].values.at(square_root + " total"),
            "calls 2, p50 7.10 ms, p99 7.10 ms, max 7.10 ms");
}

TEST_F(RecorderTest, ReportsWhatIsMissingWhateverItFiltersItself) {
  Options partly = options();
  partly.filter.uuids = {square_root};
  partly.without_text = {square_root};
  Recorder sut(partly);
  ASSERT_TRUE(sut.start(now));
  ASSERT_TRUE(sut.on_entry(
      {.at = at(-10), .sample = fabric::MachineStatus{.machine = "cnc", .epoch = 0x5f}}, now));
  record(sut, 1, 0);
  for (const Entry& entry : one_call(2, 10)) {
    if (!std::holds_alternative<fabric::Reply>(entry.sample)) {
      ASSERT_TRUE(sut.on_entry(entry, now));
    }
  }
  ASSERT_TRUE(sut.finish(14, 0, at(10'000)));
  EXPECT_EQ(sut.missing(), (recording::Missing{.complete = 1, .incomplete = 1, .replies = 1}));

  auto source = mcap::FileSource::open(folder.path() / "run.mcap");
  const auto values = mcap::survey(*source).metadata.at(0).values;
  EXPECT_EQ(values.at("calls_complete"), "1");
  EXPECT_EQ(values.at("calls_incomplete"), "1");
  EXPECT_EQ(values.at("calls_unseen"), "0");
  EXPECT_EQ(values.at("missing_requests"), "0");
  EXPECT_EQ(values.at("missing_replies"), "1");
  EXPECT_EQ(values.at("missing_events"), "0");
}

TEST_F(RecorderTest, AttachesTheConfigurationToEachFile) {
  Options with_rotation = options();
  with_rotation.rotate_size = 1;
  with_rotation.attachments.push_back(
      {.name = "fabric.textproto", .media_type = "text/plain", .data = "domain: 7\n"});
  Recorder sut(with_rotation);
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  ASSERT_TRUE(sut.finish(7, 0, at(10'000)));
  ASSERT_GE(sut.files().size(), 2U);
  for (const auto& file : sut.files()) {
    auto source = mcap::FileSource::open(file);
    const mcap::Survey survey = mcap::survey(*source);
    EXPECT_TRUE(survey.problems.empty());
    ASSERT_EQ(survey.summary.attachments.size(), 1U);
    EXPECT_EQ(survey.summary.attachments[0].name, "fabric.textproto");
    EXPECT_EQ(survey.summary.attachments[0].data_size, 10U);
  }
}

TEST_F(RecorderTest, ContinuesWithTheNextNumberAfterARestart) {
  Options with_rotation = options();
  with_rotation.rotate_size = 1;
  for (int run = 0; run < 2; ++run) {
    Recorder sut(with_rotation);
    ASSERT_TRUE(sut.start(now));
    ASSERT_TRUE(sut.on_entry(one_call(1, 0)[0], now));
    ASSERT_TRUE(sut.finish(1, 0, at(10'000)));
  }
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "run-0004.mcap"));
}

TEST_F(RecorderTest, KeepsTheNewestWithinItsSize) {
  Options with_budget = options();
  with_budget.rotate_size = 1;
  with_budget.keep_size = 20'000;
  Recorder sut(with_budget);
  ASSERT_TRUE(sut.start(now));
  for (std::uint64_t number = 1; number <= 10; ++number) {
    record(sut, number, static_cast<double>(10 * number));
  }
  ASSERT_TRUE(sut.finish(70, 0, at(10'000)));
  EXPECT_FALSE(sut.take_removed().empty());
  std::uint64_t size = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    size += entry.file_size();
  }
  EXPECT_LE(size, 20'000U);
  EXPECT_TRUE(std::filesystem::exists(sut.files().back()));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "run-0001.mcap"));
}

TEST_F(RecorderTest, RemovesTheOldestWhereTheDiskIsFull) {
  Options with_budget = options();
  with_budget.rotate_size = 1;
  with_budget.keep_size = 1'000'000'000;
  const auto closed = [this] {
    return std::count_if(std::filesystem::directory_iterator(folder.path()), {},
                         [](const auto& entry) { return entry.path().extension() == ".mcap"; });
  };
  // Each removed file makes room for one.
  Recorder sut(with_budget, [&](const std::filesystem::path&) -> std::uint64_t {
    return closed() > 3 ? 0 : 1'000'000'000;
  });
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  ASSERT_TRUE(sut.tick(now));
  EXPECT_FALSE(sut.disk_is_full());
  EXPECT_EQ(closed(), 3);
  ASSERT_TRUE(sut.finish(7, 0, at(10'000)));
}

TEST_F(RecorderTest, IsCountedAgainWhenItIsRepaired) {
  {
    Recorder sut(options());
    ASSERT_TRUE(sut.start(now));
    record(sut, 1, 0);
    now += 1s;
    ASSERT_TRUE(sut.tick(now));
    record(sut, 2, 10);
    ASSERT_TRUE(sut.finish(14, 3, at(10'000)));
  }
  const auto whole = folder.path() / "run.mcap";
  // A byte of the second call.
  const auto entries = std::filesystem::file_size(whole);
  std::string bytes(entries, ' ');
  std::ifstream(whole, std::ios::binary).read(bytes.data(), static_cast<long>(entries));
  const std::size_t first = bytes.find("1.414214");
  const std::size_t second = bytes.rfind("1.414214");
  ASSERT_LT(first + 1000, second);
  bytes[second] = 'x';
  std::ofstream(whole, std::ios::binary) << bytes;

  const auto repaired = folder.path() / "repaired.mcap";
  ASSERT_TRUE(repair_recording(whole, repaired, "test"));
  EXPECT_EQ(read(repaired).size(), 7U);
  auto source = mcap::FileSource::open(repaired);
  const mcap::Survey survey = mcap::survey(*source);
  ASSERT_EQ(survey.metadata.size(), 2U);
  const auto& values = survey.metadata[0].values;
  EXPECT_EQ(values.at("written"), "7");
  EXPECT_EQ(values.at("repaired"), "true");
  EXPECT_EQ(values.at("calls_ended"), "1");
  EXPECT_FALSE(values.contains("delivered_by_the_bus"));
  EXPECT_EQ(survey.metadata[1].values.at(square_root + " total"),
            "calls 1, p50 7.10 ms, p99 7.10 ms, max 7.10 ms");
}

TEST_F(RecorderTest, GrowsUnderAnotherNameUntilItIsWhole) {
  Recorder sut(options());
  ASSERT_TRUE(sut.start(now));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "run.mcap"));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "run.mcap.part"));
  ASSERT_TRUE(sut.finish(0, 0, at(10'000)));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "run.mcap"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "run.mcap.part"));
}

TEST_F(RecorderTest, LosesNothingOlderThanAQuarterOfASecondWhenItDies) {
  const auto repaired = folder.path() / "repaired.mcap";
  {
    Recorder sut(options());
    ASSERT_TRUE(sut.start(now));
    record(sut, 1, 0);
    now += 250ms;
    ASSERT_TRUE(sut.tick(now));
    record(sut, 2, 300);
  }  // without finish(), as in a crash
  ASSERT_TRUE(mcap::repair_file(folder.path() / "run.mcap.part", repaired, "test"));
  EXPECT_EQ(read(repaired).size(), 7U);
}

TEST_F(RecorderTest, ClosesAChunkOnlyWhenItsOwnFirstEntryIsAQuarterOfASecondOld) {
  Recorder sut(options());
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  ASSERT_TRUE(sut.tick(now += 250ms));
  record(sut, 2, 250);
  ASSERT_TRUE(sut.tick(now += 100ms));
  record(sut, 3, 350);
  ASSERT_TRUE(sut.finish(21, 0, at(10'000)));
  auto source = mcap::FileSource::open(folder.path() / "run.mcap");
  EXPECT_EQ(mcap::read_summary(*source)->chunks.size(), 2U);
}

TEST_F(RecorderTest, HasEachCallThatEndedBeforeAPowerCutIfConfigured) {
  Options forced = options();
  forced.sync = Sync::call;
  const tests::TemporaryFolder left;
  tests::PowerCutDisk disk(folder.path());
  {
    Recorder sut(forced);
    ASSERT_TRUE(sut.start(now));
    for (unsigned call = 1; call <= 3; ++call) {
      record(sut, call, 10.0 * call);
      disk.promise(call);
    }
  }
  for (const tests::PowerCut& cut : disk.power_cuts()) {
    cut.restore(left.path());
    const auto repaired = left.path() / "repaired.mcap";
    if (cut.promised > 0) {
      ASSERT_TRUE(mcap::repair_file(left.path() / "run.mcap.part", repaired, "test")) << cut.where;
      const auto entries = read(repaired);
      EXPECT_GE(static_cast<unsigned>(std::ranges::count_if(entries, is_written)), cut.promised)
          << cut.where;
    }
  }
}

TEST_F(RecorderTest, PutsAFailedCallOnTheDiskAtOnce) {
  const auto repaired = folder.path() / "repaired.mcap";
  {
    Recorder sut(options());
    ASSERT_TRUE(sut.start(now));
    Entry failed = one_call(1, 0)[3];
    std::get<fabric::Reply>(failed.sample).code = fabric::ServiceCode::failed;
    ASSERT_TRUE(sut.on_entry(failed, now));
  }
  ASSERT_TRUE(mcap::repair_file(folder.path() / "run.mcap.part", repaired, "test"));
  EXPECT_EQ(read(repaired).size(), 1U);
}

TEST_F(RecorderTest, LeavesOutWhatTheFilterRefuses) {
  Options filtered = options();
  filtered.filter.kinds = {"request"};
  Recorder sut(filtered);
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  ASSERT_TRUE(sut.finish(7, 0, at(10'000)));
  EXPECT_EQ(sut.tally().filtered, 6U);
  EXPECT_EQ(read(folder.path() / "run.mcap").size(), 1U);
}

TEST_F(RecorderTest, KeepsOnlyTheSizesOfTextsItMustNotKeep) {
  Options discreet = options();
  discreet.without_text = {square_root};
  Recorder sut(discreet);
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  ASSERT_TRUE(sut.finish(7, 0, at(10'000)));
  for (const Entry& entry : read(folder.path() / "run.mcap")) {
    if (const std::string* text = recording::text_of(entry)) {
      EXPECT_EQ(*text, "");
      EXPECT_TRUE(entry.withheld);
    }
  }
}

TEST_F(RecorderTest, BeginsANewFileAtItsSizeAndLosesNothing) {
  Options small = options();
  small.rotate_size = 20000;
  Recorder sut(small);
  ASSERT_TRUE(sut.start(now));
  for (std::uint64_t number = 1; number <= 100; ++number) {
    record(sut, number, static_cast<double>(number) * 10);
  }
  ASSERT_TRUE(sut.finish(700, 0, at(10'000)));
  ASSERT_GT(sut.files().size(), 2U);
  EXPECT_EQ(sut.files()[1].filename(), "run-0002.mcap");
  std::size_t entries = 0;
  for (const auto& file : sut.files()) {
    entries += read(file).size();
  }
  EXPECT_EQ(entries, 700U);
}

TEST_F(RecorderTest, BeginsANewFileAfterItsTimeButNoEmptyOne) {
  Options hourly = options();
  hourly.rotate_time = 1h;
  Recorder sut(hourly);
  ASSERT_TRUE(sut.start(now));
  now += 2h;
  ASSERT_TRUE(sut.tick(now));
  EXPECT_TRUE(sut.files().empty());
  record(sut, 1, 0);
  EXPECT_EQ(sut.files().size(), 1U);
}

TEST_F(RecorderTest, WritesItsWindowWhenACallFails) {
  Options window = options();
  window.window = Window{.length = 1s, .after = 100ms};
  Recorder sut(window);
  ASSERT_TRUE(sut.start(now));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  record(sut, 1, 0);  // too old when call 3 fails
  record(sut, 2, 2000);
  Entry failed = one_call(3, 2500)[3];
  std::get<fabric::Reply>(failed.sample).code = fabric::ServiceCode::failed;
  ASSERT_TRUE(sut.on_entry(failed, now));
  now += 50ms;
  record(sut, 4, 2550);  // still of interest
  now += 100ms;
  record(sut, 5, 2700);  // not any more
  ASSERT_TRUE(sut.finish(0, 0, at(10'000)));
  EXPECT_EQ(read(folder.path() / "run.mcap").size(), 7U + 1U + 7U);
  EXPECT_EQ(sut.tally().failures, 1U);
  EXPECT_EQ(sut.tally().let_go, 14U);
}

TEST_F(RecorderTest, WritesNoFileIfNothingFails) {
  Options window = options();
  window.window = Window{};
  Recorder sut(window);
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  ASSERT_TRUE(sut.finish(7, 0, at(10'000)));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST_F(RecorderTest, NoticesADiskThatIsNearlyFull) {
  std::uint64_t left = 1 << 30;
  Options careful = options();
  careful.minimum_free = 1 << 20;
  Recorder sut(careful, [&](const std::filesystem::path&) { return left; });
  ASSERT_TRUE(sut.start(now));
  ASSERT_TRUE(sut.tick(now));
  EXPECT_FALSE(sut.disk_is_full());
  left = 1000;
  ASSERT_TRUE(sut.tick(now));
  EXPECT_TRUE(sut.disk_is_full());
}

TEST_F(RecorderTest, WaitsForRoomWhereItHasManyFilesAndContinuesWithTheNext) {
  std::uint64_t left = 1 << 30;
  Options careful = options();
  careful.minimum_free = 1 << 20;
  careful.rotate_time = std::chrono::hours(24);
  Recorder sut(careful, [&](const std::filesystem::path&) { return left; });
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  left = 1000;
  ASSERT_TRUE(sut.tick(now));
  EXPECT_TRUE(sut.waits_for_room());
  EXPECT_EQ(sut.writes(), std::nullopt);
  EXPECT_EQ(read(folder.path() / "run-0001.mcap").size(), 7U);
  record(sut, 2, 10);
  EXPECT_EQ(sut.tally().let_go, 7U);
  left = 1 << 30;
  ASSERT_TRUE(sut.tick(now));
  EXPECT_FALSE(sut.waits_for_room());
  record(sut, 3, 20);
  ASSERT_TRUE(sut.finish(21, 0, at(10'000)));
  EXPECT_EQ(read(folder.path() / "run-0002.mcap").size(), 7U);
}

TEST_F(RecorderTest, KeepsItsWindowInMemoryWhereRoomReturnsDuringAFailure) {
  std::uint64_t left = 1 << 30;
  Options window = options();
  window.minimum_free = 1 << 20;
  window.rotate_time = std::chrono::hours(24);
  window.window = Window{.length = 10s, .after = 1s};
  Recorder sut(window, [&](const std::filesystem::path&) { return left; });
  ASSERT_TRUE(sut.start(now));
  Entry failed = one_call(1, 0)[3];
  std::get<fabric::Reply>(failed.sample).code = fabric::ServiceCode::failed;
  ASSERT_TRUE(sut.on_entry(failed, now));
  left = 1000;
  ASSERT_TRUE(sut.tick(now));
  EXPECT_TRUE(sut.waits_for_room());
  left = 1 << 30;
  ASSERT_TRUE(sut.tick(now));
  record(sut, 2, 10);
  ASSERT_TRUE(sut.on_entry(failed, now));
  ASSERT_TRUE(sut.finish(9, 0, at(10'000)));
  EXPECT_EQ(read(folder.path() / "run-0001.mcap").size(), 1U);
  EXPECT_EQ(read(folder.path() / "run-0002.mcap").size(), 8U);
}

TEST_F(RecorderTest, BeginsNoFileOfManyOnADiskThatIsFull) {
  Options careful = options();
  careful.rotate_time = std::chrono::hours(24);
  Recorder sut(careful, [](const std::filesystem::path&) { return std::uint64_t{0}; });
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  ASSERT_TRUE(sut.tick(now));
  ASSERT_TRUE(sut.finish(7, 0, at(10'000)));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

/// A disk that, while it is full, takes no byte beyond those that each file has.
class FullDisk {
 public:
  FullDisk() {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
  }
  ~FullDisk() {
    make_room();
    static_cast<void>(std::signal(SIGXFSZ, handler_));
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

  /// Leaves `left` bytes for a file as large as this one.
  void fill(const std::filesystem::path& file, std::uint64_t left = 0) {
    rlimit limit = before_;
    limit.rlim_cur = std::filesystem::file_size(file) + left;
    ::setrlimit(RLIMIT_FSIZE, &limit);
    full_ = true;
  }
  void make_room() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    full_ = false;
  }
  Recorder::FreeSpace space() {
    return [this](const std::filesystem::path&) -> std::uint64_t {
      return full_ ? 0 : std::uint64_t{1} << 30;
    };
  }

 private:
  rlimit before_{};
  bool full_ = false;
  void (*handler_)(int) = nullptr;
};

TEST_F(RecorderTest, SurvivesASuddenlyFullDiskWhereItHasManyFiles) {
  FullDisk disk;
  Options daily = options();
  daily.rotate_time = std::chrono::hours(24);
  Recorder sut(daily, disk.space());
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  ASSERT_TRUE(sut.tick(now += 1s));
  // Half a chunk.
  disk.fill(folder.path() / "run-0001.mcap.part", 300);
  record(sut, 2, 10);
  ASSERT_TRUE(sut.tick(now += 1s));
  EXPECT_TRUE(sut.waits_for_room());
  EXPECT_EQ(sut.writes(), std::nullopt);
  record(sut, 3, 20);
  ASSERT_TRUE(sut.tick(now += 1s));
  disk.make_room();
  ASSERT_TRUE(sut.tick(now += 1s));
  EXPECT_FALSE(sut.waits_for_room());
  record(sut, 4, 30);
  ASSERT_TRUE(sut.finish(28, 0, at(10'000)));
  EXPECT_EQ(read(folder.path() / "run-0001.mcap").size(), 21U) << "all but call 3";
  EXPECT_EQ(sut.tally().let_go, 7U);
}

TEST_F(RecorderTest, EndsAFileLaterThatItCouldNotEndOnAFullDisk) {
  FullDisk disk;
  Options daily = options();
  daily.rotate_time = std::chrono::hours(24);
  Recorder sut(daily, disk.space());
  ASSERT_TRUE(sut.start(now));
  record(sut, 1, 0);
  ASSERT_TRUE(sut.tick(now += 1s));
  disk.fill(folder.path() / "run-0001.mcap.part");
  ASSERT_TRUE(sut.tick(now += 1s)) << "nothing is to be written but the end of the file";
  EXPECT_TRUE(sut.waits_for_room());
  disk.make_room();
  ASSERT_TRUE(sut.tick(now += 1s));
  record(sut, 2, 10);
  ASSERT_TRUE(sut.finish(14, 0, at(10'000)));
  EXPECT_EQ(read(folder.path() / "run-0001.mcap").size(), 7U);
  EXPECT_EQ(read(folder.path() / "run-0002.mcap").size(), 7U);
}

TEST_F(RecorderTest, NoticesAFullDiskAsSoonAsAChunkDoesNotFit) {
  FullDisk disk;
  Recorder sut(options(), disk.space());
  ASSERT_TRUE(sut.start(now));
  disk.fill(folder.path() / "run.mcap.part");
  constexpr std::uint64_t calls_of_a_chunk = 1'000;
  for (std::uint64_t number = 1; number <= calls_of_a_chunk; ++number) {
    record(sut, number, static_cast<double>(10 * number));
  }
  EXPECT_TRUE(sut.disk_is_full());
}

TEST_F(RecorderTest, CountsWhatIsInItsFileAndNotWhatTheDiskRefused) {
  const auto part = folder.path() / "run.mcap.part";
  const auto repaired = folder.path() / "repaired.mcap";
  {
    FullDisk disk;
    Recorder sut(options(), disk.space());
    ASSERT_TRUE(sut.start(now));
    record(sut, 1, 0);
    ASSERT_TRUE(sut.tick(now += 1s));
    disk.fill(part, 300);
    record(sut, 2, 10);
    ASSERT_TRUE(sut.tick(now += 1s));
    EXPECT_TRUE(sut.disk_is_full());
    EXPECT_FALSE(sut.finish(14, 0, at(10'000)));
    EXPECT_EQ(sut.tally().written, 7U);
  }
  ASSERT_TRUE(repair_recording(part, repaired, "test"));
  EXPECT_EQ(read(repaired).size(), 7U);
}

TEST_F(RecorderTest, DoesNotOverwriteARecording) {
  Recorder first(options());
  ASSERT_TRUE(first.start(now));
  ASSERT_TRUE(first.finish(0, 0, at(10'000)));
  Recorder sut(options());
  EXPECT_FALSE(sut.start(now));
}

}  // namespace
}  // namespace millrace::tools::recorder
