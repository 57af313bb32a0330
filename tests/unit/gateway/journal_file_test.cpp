#include <array>
#include <csignal>
#include <fstream>
#include <set>

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "gateway/journal/format.hpp"
#include "gateway/journal/journal.hpp"
#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::gateway::journal {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::IsEmpty;
using tests::run_until;

/// A limit on the size of files acts as a full disk.
class FullDisk {
 public:
  FullDisk() {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    old_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    rlimit none = before_;
    none.rlim_cur = 0;
    ::setrlimit(RLIMIT_FSIZE, &none);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    static_cast<void>(std::signal(SIGXFSZ, old_handler_));
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*old_handler_)(int) = SIG_DFL;
};

DispatchedEntry dispatched(std::uint64_t number) {
  DispatchedEntry entry;
  entry.call = {1, number};
  entry.key = {"cnc", static_cast<std::uint16_t>(number)};
  return entry;
}

class JournalFile : public testing::TestWithParam<Sync> {
 protected:
  void open(std::size_t compact_at = FileOptions().compact_at) {
    sut.reset();
    sut = open_file(io.get_executor(),
                    {.folder = folder.path() / "journal",
                     .sync = GetParam(),
                     .period = 5ms,
                     .compact_at = compact_at},
                    base::program::no_log());
    sut->on_recorded([this](const Ticket&) { ++recorded; });
    sut->on_write_error([this](const std::string& text) { errors.push_back(text); });
  }

  void append(const JournalEntry& entry) { sut->append(entry, {.owner = Ticket::Owner::channel}); }

  [[nodiscard]] std::filesystem::path file() const {
    return folder.path() / "journal" / "calls.journal";
  }

  tests::TemporaryFolder folder;
  boost::asio::io_context io;
  std::unique_ptr<Journal> sut;
  int recorded = 0;
  std::vector<std::string> errors;
};

TEST_P(JournalFile, RemembersItsCallsWhenItIsOpenedAgain) {
  open();
  const std::uint64_t epoch = sut->state().numbers().epoch;
  append(NumbersEntry{epoch, 1000});
  append(dispatched(1));
  append(dispatched(2));
  append(EndedEntry{{1, 1}});
  EXPECT_EQ(recorded, 0) << "nothing is confirmed from within append()";
  ASSERT_TRUE(run_until(io, [&] { return recorded == 4; }));
  open();
  ASSERT_EQ(sut->state().open_calls().size(), 1U);
  EXPECT_EQ(sut->state().open_calls().front().id.number, 2U);
  EXPECT_EQ(sut->state().numbers(), (NumbersEntry{epoch, 1000}));
}

TEST_P(JournalFile, FollowsNoLinkAtTheNamesOfItsFiles) {
  const auto other = folder.path() / "other";
  std::ofstream(other) << "another's";
  std::filesystem::create_directory(file().parent_path());
  std::filesystem::create_symlink(other, file().string() + ".new");
  open();
  append(dispatched(1));
  ASSERT_TRUE(run_until(io, [&] { return recorded == 1; }));
  EXPECT_FALSE(std::filesystem::is_symlink(file()));
  std::string first;
  EXPECT_TRUE(std::ifstream(other) >> first);
  EXPECT_EQ(first, "another's");

  sut.reset();
  std::filesystem::remove(file().parent_path() / "lock");
  std::filesystem::create_symlink(folder.path() / "elsewhere", file().parent_path() / "lock");
  EXPECT_THROW(open(), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "elsewhere"));
}

TEST_P(JournalFile, DrawsAnEpochOfItsOwn) {
  open();
  const std::uint64_t epoch = sut->state().numbers().epoch;
  EXPECT_NE(epoch, 0U);
  sut.reset();
  std::filesystem::remove(file());
  open();
  EXPECT_NE(sut->state().numbers().epoch, epoch);
}

TEST_P(JournalFile, CutsATornEndOff) {
  open();
  append(dispatched(1));
  ASSERT_TRUE(run_until(io, [&] { return recorded == 1; }));
  sut.reset();
  std::ofstream(file(), std::ios::app | std::ios::binary) << encode(dispatched(2)).substr(0, 20);
  open();
  EXPECT_EQ(sut->state().open_calls().size(), 1U);
  append(dispatched(3));
  ASSERT_TRUE(run_until(io, [&] { return recorded == 2; }));
  open();
  EXPECT_EQ(sut->state().open_calls().size(), 2U);
}

TEST_P(JournalFile, RefusesAFolderThatAnotherGatewayUses) {
  open();
  try {
    open_file(io.get_executor(), {.folder = folder.path() / "journal"}, base::program::no_log());
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("another gateway uses this journal folder"));
  }
}

TEST_P(JournalFile, StaysUsableWhenAnotherGatewayIsRefused) {
  open();
  append(dispatched(1));
  ASSERT_TRUE(run_until(io, [&] { return recorded == 1; }));
  EXPECT_THROW(
      open_file(io.get_executor(), {.folder = folder.path() / "journal"}, base::program::no_log()),
      std::runtime_error);
  append(dispatched(2));
  ASSERT_TRUE(run_until(io, [&] { return recorded == 2; }));
  open();
  EXPECT_EQ(sut->state().open_calls().size(), 2U);
}

TEST_P(JournalFile, ConfirmsNothingOnceItIsClosed) {
  open();
  append(dispatched(1));
  sut.reset();
  io.poll();
  EXPECT_EQ(recorded, 0);
}

TEST_P(JournalFile, RefusesAFileThatIsNoJournal) {
  std::filesystem::create_directories(file().parent_path());
  std::ofstream(file()) << "dear diary";
  try {
    open();
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("calls.journal: it does not begin like a journal"));
  }
}

TEST_P(JournalFile, ReportsAFullDiskAndConfirmsOnceThereIsRoom) {
  open();
  {
    const FullDisk full;
    append(dispatched(1));
    ASSERT_TRUE(run_until(io, [&] { return !errors.empty(); }));
    EXPECT_THAT(errors.back(), HasSubstr("calls.journal cannot be written: File too large"));
    append(dispatched(2));
    // Time for several tries.
    const auto later = std::chrono::steady_clock::now() + 30ms;
    run_until(io, [&] { return std::chrono::steady_clock::now() > later; });
    EXPECT_EQ(recorded, 0);
  }
  ASSERT_TRUE(run_until(io, [&] { return recorded == 2 && errors.back().empty(); }));
  open();
  EXPECT_EQ(sut->state().open_calls().size(), 2U);
}

TEST_P(JournalFile, StaysShortHoweverManyCallsThereWere) {
  open(4096);
  append(dispatched(60'000));
  for (std::uint64_t number = 1; number <= 1000; ++number) {
    append(dispatched(number));
    append(EndedEntry{{1, number}});
  }
  ASSERT_TRUE(
      run_until(io, [&] { return recorded == 2001 && std::filesystem::file_size(file()) < 4096; }));
  open();
  ASSERT_EQ(sut->state().open_calls().size(), 1U);
  EXPECT_EQ(sut->state().open_calls().front().id.number, 60'000U);
}

/// Acts as a disk that stands still: opening a pipe for writing waits for a reader.
class StuckFile {
 public:
  explicit StuckFile(const std::filesystem::path& name) : name_(name), other_(name.string() + "_") {
    EXPECT_EQ(::mkfifo(name_.c_str(), 0600), 0);
    std::filesystem::create_hard_link(name_, other_);
  }
  ~StuckFile() { ::close(reader_); }
  StuckFile(const StuckFile&) = delete;
  StuckFile& operator=(const StuckFile&) = delete;

  /// Lets the waiting writer continue, which then fails because a pipe cannot be forced. There is
  /// no pipe for the next one.
  void let_go(boost::asio::io_context& io) {
    reader_ = ::open(other_.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    EXPECT_TRUE(run_until(io, [this] {
      pollfd written{.fd = reader_, .events = POLLIN, .revents = 0};
      return ::poll(&written, 1, 0) == 1 && (written.revents & POLLIN) != 0;
    }));
    std::filesystem::remove(name_);
  }

 private:
  std::filesystem::path name_;
  std::filesystem::path other_;
  int reader_ = -1;
};

TEST_P(JournalFile, KeepsTheLoopRunningWhileTheDiskStalls) {
  open(1024);
  StuckFile new_file(file().string() + ".new");
  for (std::uint64_t number = 1; number <= 100; ++number) {
    append(dispatched(number));
  }
  bool turned = false;
  boost::asio::steady_timer several_tries(io, 30ms);
  several_tries.async_wait([&](boost::system::error_code) {
    append(dispatched(101));
    turned = true;
  });
  ASSERT_TRUE(run_until(io, [&] { return turned; }));
  if (GetParam() == Sync::always) {
    EXPECT_LE(recorded, 100);
  } else {
    ASSERT_TRUE(run_until(io, [&] { return recorded == 101; }));
  }
  EXPECT_THAT(errors, IsEmpty());
  new_file.let_go(io);
  ASSERT_TRUE(run_until(io, [&] { return !errors.empty() && errors.back().empty(); }));
  EXPECT_THAT(errors.front(), HasSubstr("calls.journal.new cannot be forced to the disk"));
  ASSERT_TRUE(run_until(io, [&] { return recorded == 101; }));
  open();
  EXPECT_EQ(sut->state().open_calls().size(), 101U);
}

/// Accepts calls without end, each open until the tenth after it is recorded, and reports their
/// numbers.
[[noreturn]] void journal_until_killed(const FileOptions& options, int report) {
  boost::asio::io_context io;
  const auto journal = open_file(io.get_executor(), options, base::program::no_log());
  const auto take = [&](std::uint64_t number) {
    journal->append(dispatched(number), {.owner = Ticket::Owner::channel, .number = number});
  };
  journal->on_recorded([&](const Ticket& ticket) {
    if (::write(report, &ticket.number, sizeof ticket.number) != sizeof ticket.number) {
      ::_exit(1);
    }
    if (ticket.number > 10) {
      journal->append(EndedEntry{{1, ticket.number - 10}}, {});
    }
    take(ticket.number + 1);
  });
  take(1);
  io.run();
  ::_exit(1);
}

TEST_P(JournalFile, HasWhatItConfirmedWhenTheProcessIsKilledDuringItsRewrites) {
  // Each force takes time.
  const std::uint64_t most = GetParam() == Sync::always ? 100 : 400;
  for (std::uint64_t least = 20; least <= most; least += 20) {
    std::filesystem::remove_all(file().parent_path());
    std::array<int, 2> report{};
    ASSERT_EQ(::pipe2(report.data(), O_CLOEXEC), 0);
    const pid_t killed = ::fork();
    ASSERT_GE(killed, 0);
    if (killed == 0) {
      journal_until_killed(
          {.folder = file().parent_path(), .sync = GetParam(), .period = 1ms, .compact_at = 512},
          report[1]);
    }
    ::close(report[1]);
    std::uint64_t last = 0;
    const auto hear = [&] { return ::read(report[0], &last, sizeof last) == sizeof last; };
    while (last < least && hear()) {
    }
    ::kill(killed, SIGKILL);
    while (hear()) {
    }
    ::waitpid(killed, nullptr, 0);
    ::close(report[0]);
    ASSERT_GE(last, least);
    open();
    std::set<std::uint64_t> found;
    for (const CallRecord& call : sut->state().open_calls()) {
      found.insert(call.id.number);
    }
    for (std::uint64_t number = last - 9; number <= last; ++number) {
      EXPECT_TRUE(found.contains(number)) << number << " of " << last;
    }
    EXPECT_LE(found.size(), 12U);
    sut.reset();
  }
}

std::string name_of(const testing::TestParamInfo<Sync>& policy) {
  switch (policy.param) {
    case Sync::never:
      return "SyncNever";
    case Sync::interval:
      return "SyncInterval";
    case Sync::always:
      return "SyncAlways";
  }
  return {};
}

INSTANTIATE_TEST_SUITE_P(, JournalFile, testing::Values(Sync::never, Sync::interval, Sync::always),
                         name_of);

TEST(MemoryJournal, ConfirmsAtOnceAndHasAnEpoch) {
  boost::asio::io_context io;
  const auto sut = in_memory(io.get_executor());
  EXPECT_NE(sut->state().numbers().epoch, 0U);
  bool recorded = false;
  sut->on_recorded([&](const Ticket&) { recorded = true; });
  sut->append(dispatched(1), {.owner = Ticket::Owner::channel});
  EXPECT_FALSE(recorded);
  io.run();
  EXPECT_TRUE(recorded);
}

// The contents of the gateway's journal after a power cut at any point of its work.

/// The channel makes one call after the other: where one is lost, an earlier one is found.
DispatchedEntry call_of_the_channel(std::uint64_t number) {
  DispatchedEntry entry;
  entry.call = {1, number};
  entry.key = {"cnc", 1};
  entry.request.text = std::string(100, 'x');
  return entry;
}

class JournalAfterAPowerCut : public testing::TestWithParam<Sync> {
 protected:
  static constexpr std::uint64_t calls = 12;

  std::unique_ptr<Journal> open(const std::filesystem::path& where) {
    return open_file(io.get_executor(),
                     // Small enough that the file is rewritten while calls are appended.
                     {.folder = where, .sync = GetParam(), .period = 1ms, .compact_at = 300},
                     base::program::no_log());
  }

  /// Calls one after the other, each begun when the journal has confirmed the previous one.
  std::vector<tests::PowerCut> work() {
    std::filesystem::create_directories(journal);
    tests::PowerCutDisk disk(journal);
    auto writer = open(journal);
    disk.promise(1);
    bool recorded = false;
    writer->on_recorded([&](const Ticket&) { recorded = true; });
    for (std::uint64_t number = 1; number <= calls; ++number) {
      recorded = false;
      writer->append(EndedEntry{{1, number - 1}}, {});
      writer->append(call_of_the_channel(number), {.owner = Ticket::Owner::channel});
      EXPECT_TRUE(run_until(io, [&] { return recorded; }));
      disk.promise(static_cast<unsigned>(number + 1));
    }
    epoch = writer->state().numbers().epoch;
    return disk.power_cuts();
  }

  /// The number of the call that the next gateway finds; 0 if none.
  std::uint64_t found(const Journal& sut) {
    const auto open = sut.state().open_calls();
    EXPECT_LE(open.size(), 1U);
    return open.empty() ? 0 : open.front().id.number;
  }

  tests::TemporaryFolder folder;
  std::filesystem::path journal = folder.path() / "journal";
  boost::asio::io_context io;
  std::uint64_t epoch = 0;
};

TEST_P(JournalAfterAPowerCut, CanBeReadAndHasItsEpoch) {
  const auto cuts = work();
  ASSERT_GT(cuts.size(), calls);
  for (const tests::PowerCut& cut : cuts) {
    cut.restore(folder.path() / "left");
    const auto sut = open(folder.path() / "left");
    EXPECT_LE(found(*sut), calls) << cut.where;
    if (cut.promised > 0) {
      EXPECT_EQ(sut->state().numbers().epoch, epoch) << cut.where;
    }
  }
}

TEST_P(JournalAfterAPowerCut, HasWhatWasConfirmedIfEachEntryIsForced) {
  if (GetParam() != Sync::always) {
    return;
  }
  for (const tests::PowerCut& cut : work()) {
    cut.restore(folder.path() / "left");
    const auto sut = open(folder.path() / "left");
    const std::uint64_t number = found(*sut);
    // The next call may be present too, or only the end of the confirmed one.
    const std::uint64_t confirmed = cut.promised == 0 ? 0 : cut.promised - 1;
    EXPECT_TRUE(number == confirmed || number == confirmed + 1 || number == 0) << cut.where;
    EXPECT_FALSE(number == 0 && confirmed == calls) << cut.where;
  }
}

INSTANTIATE_TEST_SUITE_P(Policies, JournalAfterAPowerCut,
                         testing::Values(Sync::always, Sync::interval));

}  // namespace
}  // namespace millrace::gateway::journal
