#include <csignal>
#include <fstream>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "gateway/journal/format.hpp"
#include "gateway/journal/journal.hpp"
#include "tests/support/run_until.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::gateway::journal {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using tests::run_until;
using namespace std::chrono_literals;

/// A limit on the size of files stands for a full disk.
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
  void open() {
    sut.reset();
    sut = open_file(io.get_executor(),
                    {.folder = folder.path() / "journal", .sync = GetParam(), .period = 5ms},
                    base::program::no_log());
    sut->on_trouble([this](const std::string& text) { troubles.push_back(text); });
  }

  void append(const JournalEntry& entry) {
    sut->append(entry, [this] { ++recorded; });
  }

  [[nodiscard]] std::filesystem::path file() const {
    return folder.path() / "journal" / "calls.journal";
  }

  tests::TemporaryFolder folder;
  boost::asio::io_context io;
  std::unique_ptr<Journal> sut;
  int recorded = 0;
  std::vector<std::string> troubles;
};

TEST_P(JournalFile, RemembersItsCallsWhenItIsOpenedAgain) {
  open();
  const std::uint64_t epoch = sut->ledger().numbers().epoch;
  append(NumbersEntry{epoch, 1000});
  append(dispatched(1));
  append(dispatched(2));
  append(EndedEntry{{1, 1}});
  EXPECT_EQ(recorded, 0) << "nothing is confirmed from within append()";
  ASSERT_TRUE(run_until(io, [&] { return recorded == 4; }));
  open();
  ASSERT_EQ(sut->ledger().open_calls().size(), 1U);
  EXPECT_EQ(sut->ledger().open_calls().front().id.number, 2U);
  EXPECT_EQ(sut->ledger().numbers(), (NumbersEntry{epoch, 1000}));
}

TEST_P(JournalFile, DrawsAnEpochOfItsOwn) {
  open();
  const std::uint64_t epoch = sut->ledger().numbers().epoch;
  EXPECT_NE(epoch, 0U);
  sut.reset();
  std::filesystem::remove(file());
  open();
  EXPECT_NE(sut->ledger().numbers().epoch, epoch);
}

TEST_P(JournalFile, CutsATornEndOff) {
  open();
  append(dispatched(1));
  ASSERT_TRUE(run_until(io, [&] { return recorded == 1; }));
  sut.reset();
  std::ofstream(file(), std::ios::app | std::ios::binary) << encode(dispatched(2)).substr(0, 20);
  open();
  EXPECT_EQ(sut->ledger().open_calls().size(), 1U);
  append(dispatched(3));
  ASSERT_TRUE(run_until(io, [&] { return recorded == 2; }));
  open();
  EXPECT_EQ(sut->ledger().open_calls().size(), 2U);
}

TEST_P(JournalFile, RefusesAFolderThatAnotherGatewayUses) {
  open();
  try {
    open_file(io.get_executor(), {.folder = folder.path() / "journal"}, base::program::no_log());
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("is in use by another gateway"));
  }
}

TEST_P(JournalFile, RefusesAFileThatIsNoJournal) {
  std::filesystem::create_directories(file().parent_path());
  std::ofstream(file()) << "dear diary";
  try {
    open();
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("calls.journal: it does not begin as a journal"));
  }
}

TEST_P(JournalFile, SaysThatTheDiskIsFullAndConfirmsWhenItIsNot) {
  open();
  {
    const FullDisk full;
    append(dispatched(1));
    ASSERT_TRUE(run_until(io, [&] { return !troubles.empty(); }));
    EXPECT_THAT(troubles.back(), HasSubstr("calls.journal cannot be written: File too large"));
    append(dispatched(2));
    // Several tries pass.
    const auto later = std::chrono::steady_clock::now() + 30ms;
    run_until(io, [&] { return std::chrono::steady_clock::now() > later; });
    EXPECT_EQ(recorded, 0);
  }
  ASSERT_TRUE(run_until(io, [&] { return recorded == 2 && troubles.back().empty(); }));
  open();
  EXPECT_EQ(sut->ledger().open_calls().size(), 2U);
}

TEST_P(JournalFile, StaysShortHoweverManyCallsThereWere) {
  sut = open_file(
      io.get_executor(),
      {.folder = folder.path() / "journal", .sync = GetParam(), .period = 5ms, .compact_at = 4096},
      base::program::no_log());
  append(dispatched(60'000));
  for (std::uint64_t number = 1; number <= 1000; ++number) {
    append(dispatched(number));
    append(EndedEntry{{1, number}});
  }
  ASSERT_TRUE(
      run_until(io, [&] { return recorded == 2001 && std::filesystem::file_size(file()) < 4096; }));
  open();
  ASSERT_EQ(sut->ledger().open_calls().size(), 1U);
  EXPECT_EQ(sut->ledger().open_calls().front().id.number, 60'000U);
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
  EXPECT_NE(sut->ledger().numbers().epoch, 0U);
  bool recorded = false;
  sut->append(dispatched(1), [&] { recorded = true; });
  EXPECT_FALSE(recorded);
  io.run();
  EXPECT_TRUE(recorded);
}

}  // namespace
}  // namespace millrace::gateway::journal
