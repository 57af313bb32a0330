// The contents of the gateway's journal after a power cut at any point of its work.
#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/journal/journal.hpp"
#include "tests/support/power_cut_disk.hpp"
#include "tests/support/run_until.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::gateway::journal {
namespace {

using tests::run_until;
using namespace std::chrono_literals;

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
