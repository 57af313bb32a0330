// The contents of the archive after a power cut at any point of its work.
#include <SQLiteCpp/SQLiteCpp.h>
#include <gtest/gtest.h>

#include "services/archiver/archive.hpp"
#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

std::uint64_t rows_in(const std::filesystem::path& folder) {
  std::uint64_t rows = 0;
  for (const auto& file : archive_files(folder)) {
    rows += static_cast<std::uint64_t>(SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
                                           .execAndGet("SELECT count(*) FROM put")
                                           .getInt64());
  }
  return rows;
}

TEST(ArchiveAfterAPowerCut, HasEachRowThatWasAcknowledgedOnce) {
  constexpr std::uint64_t most = 5;
  const tests::TemporaryFolder folder;
  const auto archive = folder.path() / "archive";
  std::filesystem::create_directory(archive);
  // A new file after every few rows.
  const Policy policy{.rotate_bytes = 0, .rotate_age = std::chrono::hours(3), .keep_bytes = 0};
  std::vector<tests::PowerCut> cuts;
  {
    tests::PowerCutDisk disk(archive);
    Archive writer(archive, policy, morning);
    for (std::uint64_t number = 1; number <= most; ++number) {
      const fabric::Time now = morning + std::chrono::hours(number);
      ASSERT_EQ(writer.append({put(number)}, now).front(), static_cast<std::int64_t>(number));
      disk.promise(static_cast<unsigned>(number));
      writer.tidy_up(now, Ages::believed);
    }
    ASSERT_EQ(archive_files(archive).size(), 2U);
    cuts = disk.power_cuts();
  }
  ASSERT_GT(cuts.size(), most);
  for (const tests::PowerCut& cut : cuts) {
    const auto left = folder.path() / "left";
    cut.restore(left);
    std::string reported;
    const fabric::Time then = morning + std::chrono::hours(cut.promised + 1);
    Archive sut(left, policy, then, [&](const std::string& news) { reported += news; });
    EXPECT_EQ(reported, "") << cut.where;
    const std::uint64_t rows = rows_in(left);
    EXPECT_TRUE(rows == cut.promised || rows == cut.promised + 1)
        << rows << " rows of " << cut.promised << ' ' << cut.where;
    // A repeated call gets its id again.
    const auto last = std::max<std::uint64_t>(rows, 1);
    EXPECT_EQ(sut.append({put(last)}, then).front(), static_cast<std::int64_t>(last)) << cut.where;
  }
}

}  // namespace
}  // namespace millrace::services::archiver
