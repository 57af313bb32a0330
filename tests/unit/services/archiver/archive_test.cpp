#include "services/archiver/archive.hpp"

#include <fstream>
#include <sstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "services/archiver/segment.hpp"
#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::ThrowsMessage;

class ArchiveTest : public testing::Test {
 protected:
  Archive open(const Policy& policy = {}, fabric::Time now = morning) {
    return Archive(folder.path(), policy, now,
                   [this](const std::string& news) { reported += news + '\n'; });
  }
  /// Appends, and then tidies up as between batches.
  static std::vector<std::int64_t> append(Archive& archive, std::vector<Row> rows,
                                          fabric::Time now) {
    auto ids = archive.append(std::move(rows), now);
    archive.tidy_up(now, Ages::believed);
    return ids;
  }
  [[nodiscard]] std::filesystem::path numbered(int number) const {
    return folder.path() / fmt::format("archive-{:06}.db", number);
  }
  /// Makes a file with enough puts that pages of puts are in its middle.
  void fill(Archive& archive, std::uint64_t puts) {
    std::vector<Row> rows;
    for (std::uint64_t number = 1; number <= puts; ++number) {
      rows.emplace_back(put(number));
    }
    archive.append(rows, morning);
  }
  /// Damages pages like a failing disk. The write-ahead log has no copy left.
  void damage(const std::filesystem::path& file) {
    SQLite::Database(file.string(), SQLite::OPEN_READWRITE).exec("PRAGMA wal_checkpoint(TRUNCATE)");
    const auto size = std::filesystem::file_size(file);
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(static_cast<std::streamoff>(size / 4));
    bytes << std::string(size / 2, 'x');
  }
  [[nodiscard]] std::int64_t count(const Archive& archive, const std::string& table) const {
    SQLite::Database database(archive.file().string());
    return database.execAndGet("SELECT count(*) FROM " + table).getInt64();
  }

  tests::TemporaryFolder folder;
  std::string reported;
};

TEST_F(ArchiveTest, GivesEachPutTheNextId) {
  Archive sut = open();
  EXPECT_THAT(sut.append({put(1), put(2)}, morning), ElementsAre(1, 2));
  EXPECT_THAT(sut.append({event(3), put(3)}, morning), ElementsAre(0, 3));
  EXPECT_EQ(count(sut, "put"), 3);
  EXPECT_EQ(count(sut, "field"), 6);
  EXPECT_EQ(count(sut, "event"), 1);
}

TEST_F(ArchiveTest, AddsNoSecondRowForARepeatedCall) {
  Archive sut = open();
  EXPECT_THAT(sut.append({put(1)}, morning), ElementsAre(1));
  EXPECT_THAT(sut.append({put(1)}, morning), ElementsAre(1));
  EXPECT_THAT(sut.append({put(2), put(2), put(1)}, morning), ElementsAre(2, 2, 1));
  EXPECT_EQ(count(sut, "put"), 2);
  EXPECT_EQ(count(sut, "field"), 4);
}

TEST_F(ArchiveTest, AddsNoSecondRowAfterARestart) {
  { open().append({put(1)}, morning); }
  Archive sut = open();
  EXPECT_THAT(sut.append({put(1), put(2)}, morning), ElementsAre(1, 2));
}

TEST_F(ArchiveTest, AddsNoSecondRowAfterARotation) {
  Archive sut = open({.rotate_age = 1h});
  sut.append({put(1)}, morning);
  const auto first = sut.file();
  EXPECT_THAT(sut.append({put(2), put(1), put(2)}, morning + 2h), ElementsAre(2, 1, 2));
  EXPECT_NE(sut.file(), first);
  EXPECT_EQ(count(sut, "put"), 1);
}

TEST_F(ArchiveTest, StoresARepeatedChannelStateOnce) {
  Archive sut = open();
  sut.append({channel(fabric::ChannelState::idle)}, morning);
  sut.append({channel(fabric::ChannelState::idle), channel(fabric::ChannelState::running)},
             morning);
  EXPECT_EQ(count(sut, "channel"), 2);
}

TEST_F(ArchiveTest, WritesAheadAndWaitsForTheDisk) {
  Archive sut = open();
  sut.append({put(1)}, morning);
  SQLite::Database database(sut.file().string());
  EXPECT_EQ(database.execAndGet("PRAGMA journal_mode").getString(), "wal");
}

TEST_F(ArchiveTest, BeginsANewFileWhenTheOldOneIsLarge) {
  Archive sut = open({.rotate_bytes = 200'000});
  std::uint64_t number = 0;
  while (archive_files(folder.path()).size() < 3) {
    sut.append({put(++number)}, morning);
    ASSERT_LT(number, 10'000U);
  }
  const auto last = static_cast<std::int64_t>(number);
  EXPECT_THAT(sut.append({put(number), put(number + 1)}, morning), ElementsAre(last, last + 1));
}

TEST_F(ArchiveTest, LeavesAClosedFileThatStandsAlone) {
  Archive sut = open({.rotate_age = 1h});
  sut.append({put(1)}, morning);
  const std::filesystem::path closed = sut.file();
  append(sut, {put(2)}, morning + 2h);
  EXPECT_FALSE(sut.untidy());
  EXPECT_FALSE(std::filesystem::exists(closed.string() + "-wal"));
  SQLite::Database database(closed.string(), SQLite::OPEN_READONLY);
  EXPECT_EQ(database.execAndGet("PRAGMA journal_mode").getString(), "delete");
  EXPECT_EQ(database.execAndGet("SELECT count(*) FROM put").getInt(), 1);
}

TEST_F(ArchiveTest, LeavesAFileThatStandsAloneAtItsEnd) {
  {
    Archive sut = open();
    sut.append({put(1)}, morning);
  }
  SQLite::Database database(numbered(1).string(), SQLite::OPEN_READONLY);
  EXPECT_EQ(database.execAndGet("PRAGMA journal_mode").getString(), "delete");
  EXPECT_EQ(database.execAndGet("SELECT count(*) FROM put").getInt(), 1);
  Archive again = open();
  EXPECT_EQ(again.file(), numbered(1));
  EXPECT_THAT(again.append({put(2)}, morning), ElementsAre(2));
}

/// The rights of another user: root may write everywhere.
class AnotherUser {
 public:
  AnotherUser() : is_root_(::geteuid() == 0) {
    if (is_root_) {
      EXPECT_EQ(::seteuid(65534), 0);
    }
  }
  ~AnotherUser() {
    if (is_root_) {
      EXPECT_EQ(::seteuid(0), 0);
    }
  }
  AnotherUser(const AnotherUser&) = delete;
  AnotherUser& operator=(const AnotherUser&) = delete;

 private:
  bool is_root_;
};

TEST_F(ArchiveTest, OfAKilledArchiverIsReadWithoutTheRightToWrite) {
  const std::filesystem::path copied = folder.path() / "copied";
  std::filesystem::create_directory(copied);
  {
    Archive sut = open();
    sut.append({put(1)}, morning);
    SQLite::Database(sut.file().string(), SQLite::OPEN_READWRITE)
        .exec("PRAGMA wal_checkpoint(TRUNCATE)");
    std::filesystem::copy(sut.file(), copied / "archive-000001.db");
  }
  using std::filesystem::perms;
  std::filesystem::permissions(copied / "archive-000001.db",
                               perms::owner_read | perms::group_read | perms::others_read);
  const perms listed = perms::owner_read | perms::owner_exec | perms::group_read |
                       perms::group_exec | perms::others_read | perms::others_exec;
  std::filesystem::permissions(folder.path(), listed | perms::owner_write);
  std::filesystem::permissions(copied, listed);
  {
    const AnotherUser user;
    SQLite::Database sut = open_to_read(copied / "archive-000001.db");
    EXPECT_EQ(sut.execAndGet("SELECT count(*) FROM put").getInt(), 1);
  }
  std::filesystem::permissions(copied, perms::owner_all);
}

TEST_F(ArchiveTest, BeginsTheNextFileWhileTheOldOneIsRead) {
  Archive sut = open({.rotate_age = 1h});
  sut.append({put(1)}, morning);
  {
    SQLite::Database reader(numbered(1).string(), SQLite::OPEN_READONLY);
    SQLite::Statement reading(reader, "SELECT id FROM put");
    ASSERT_TRUE(reading.executeStep());
    EXPECT_THAT(append(sut, {put(2), put(1)}, morning + 2h), ElementsAre(2, 1));
    EXPECT_EQ(sut.file(), numbered(2));
    EXPECT_TRUE(sut.untidy());
    EXPECT_THAT(append(sut, {put(3), put(1)}, morning + 2h), ElementsAre(3, 1));
  }
  sut.tidy_up(morning + 3h, Ages::believed);
  EXPECT_FALSE(sut.untidy());
  EXPECT_FALSE(std::filesystem::exists(numbered(1).string() + "-wal"));
  EXPECT_EQ(reported, "");
}

TEST_F(ArchiveTest, TriesAgainToCloseWhatCannotBeWrittenNow) {
  Archive sut = open({.rotate_age = 1h});
  sut.append({put(1)}, morning);
  SQLite::Database(numbered(1).string(), SQLite::OPEN_READWRITE)
      .exec(
          "CREATE TRIGGER full BEFORE UPDATE ON archive BEGIN SELECT RAISE(ABORT, 'disk full'); "
          "END");
  append(sut, {put(2)}, morning + 2h);
  sut.tidy_up(morning + 2h, Ages::believed);
  EXPECT_TRUE(sut.untidy());
  EXPECT_THAT(reported, testing::EndsWith("archive-000001.db cannot be closed yet: disk full\n"));
  EXPECT_EQ(std::count(reported.begin(), reported.end(), '\n'), 1);
  SQLite::Database(numbered(1).string(), SQLite::OPEN_READWRITE).exec("DROP TRIGGER full");
  sut.tidy_up(morning + 2h, Ages::believed);
  EXPECT_FALSE(sut.untidy());
}

TEST_F(ArchiveTest, ClosesAtItsStartWhatAnEarlierOneHadToLeaveOpen) {
  {
    Archive earlier = open({.rotate_age = 1h});
    earlier.append({put(1)}, morning);
    earlier.append({put(2)}, morning + 2h);
  }
  Archive sut = open({.rotate_age = 1h}, morning + 2h);
  EXPECT_TRUE(sut.untidy());
  sut.tidy_up(morning + 2h, Ages::believed);
  EXPECT_FALSE(sut.untidy());
  EXPECT_TRUE(ClosedSegment(numbered(1)).closed());
}

TEST_F(ArchiveTest, ContinuesItsFileWhereTheNextCannotBeBegun) {
  Archive sut = open({.rotate_age = 1h});
  sut.append({put(1)}, morning);
  std::filesystem::create_directory(numbered(2));
  EXPECT_THAT(append(sut, {put(2)}, morning + 2h), ElementsAre(2));
  EXPECT_THAT(append(sut, {put(3)}, morning + 2h), ElementsAre(3));
  EXPECT_EQ(sut.file(), numbered(1));
  EXPECT_THAT(reported, HasSubstr("archive-000002.db cannot be created"));
  EXPECT_EQ(std::count(reported.begin(), reported.end(), '\n'), 1);
  std::filesystem::remove(numbered(2));
  EXPECT_THAT(append(sut, {put(4)}, morning + 2h), ElementsAre(4));
  EXPECT_EQ(sut.file(), numbered(2));
}

TEST_F(ArchiveTest, FillsFilesUpToTheirSize) {
  Archive sut = open({.rotate_bytes = 1U << 20U});
  std::uint64_t number = 0;
  while (sut.file() == numbered(1)) {
    std::vector<Row> rows;
    for (int i = 0; i < 100; ++i) {
      rows.emplace_back(put(++number));
    }
    append(sut, rows, morning);
    ASSERT_LT(number, 100'000U);
  }
  EXPECT_GT(std::filesystem::file_size(numbered(1)), (1U << 20U) * 9 / 10);
}

TEST_F(ArchiveTest, LeavesADamagedFileAsItIsAndContinues) {
  {
    Archive earlier = open({.rotate_age = 1h});
    append(earlier, {put(1)}, morning);
    append(earlier, {put(2)}, morning + 2h);
    append(earlier, {put(3)}, morning + 4h);
  }
  std::ofstream(numbered(1)) << "no database";
  std::ofstream(numbered(2), std::ios::in | std::ios::out).seekp(4096) << std::string(9000, 'x');
  Archive sut = open({.rotate_age = 1h, .keep_age = 1h}, morning + 4h);
  EXPECT_THAT(append(sut, {put(4), put(3)}, morning + 400h), ElementsAre(4, 3));
  EXPECT_THAT(reported, HasSubstr("archive-000001.db is damaged or not a file of an archive"));
  EXPECT_TRUE(std::filesystem::exists(numbered(1)));
}

TEST_F(ArchiveTest, WritesNothingIntoAForeignDatabase) {
  { open().append({put(1)}, morning); }
  SQLite::Database(numbered(2).string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE)
      .exec("CREATE TABLE theirs (x)");
  Archive sut = open();
  EXPECT_EQ(sut.file(), numbered(3));
  EXPECT_THAT(reported, HasSubstr("archive-000002.db is damaged or not a file of an archive"));
  EXPECT_THAT(sut.append({put(1), put(2)}, morning), ElementsAre(1, 2));
  SQLite::Database foreign(numbered(2).string());
  EXPECT_FALSE(foreign.tableExists("put"));
}

TEST_F(ArchiveTest, ContinuesTheIdsWhereTheNewestFileIsEmpty) {
  { open().append({put(1), put(2)}, morning); }
  const std::ofstream begun(numbered(2));
  Archive sut = open();
  EXPECT_EQ(sut.file(), numbered(2));
  EXPECT_THAT(sut.append({put(2), put(3)}, morning), ElementsAre(2, 3));
}

TEST_F(ArchiveTest, RemovesNothingForItsAgeWhileTheClockIsDoubted) {
  Archive sut = open({.rotate_age = 24h, .keep_age = 48h});
  for (int day = 0; day < 6; ++day) {
    sut.append({put(static_cast<std::uint64_t>(day))}, morning + day * 24h);
    sut.tidy_up(morning + day * 24h, Ages::doubted);
  }
  EXPECT_THAT(archive_files(folder.path()), SizeIs(6));
}

TEST_F(ArchiveTest, RemovesClosedFilesThatAreTooOld) {
  Archive sut = open({.rotate_age = 24h, .keep_age = 48h});
  for (int day = 0; day < 6; ++day) {
    append(sut, {put(static_cast<std::uint64_t>(day))}, morning + day * 24h);
  }
  EXPECT_THAT(archive_files(folder.path()), SizeIs(3));
}

TEST_F(ArchiveTest, RemovesTheOldestFilesOfTooMuch) {
  Archive sut = open({.rotate_age = 1h, .keep_bytes = 150'000});
  for (int hour = 0; hour < 8; ++hour) {
    append(sut, {put(static_cast<std::uint64_t>(hour))}, morning + hour * 1h);
  }
  std::uintmax_t size = 0;
  for (const auto& file : archive_files(folder.path())) {
    size += std::filesystem::file_size(file);
  }
  EXPECT_LE(size, 250'000U);
  EXPECT_LT(archive_files(folder.path()).size(), 8U);
}

TEST_F(ArchiveTest, ContinuesAfterACrashBetweenTheEndOfAFileAndTheNext) {
  { open().append({put(1)}, morning); }
  ASSERT_TRUE(close(archive_files(folder.path()).back(), morning));
  Archive sut = open();
  EXPECT_THAT(sut.append({put(1), put(2)}, morning), ElementsAre(1, 2));
  EXPECT_THAT(archive_files(folder.path()), SizeIs(2));
}

TEST_F(ArchiveTest, IsWrittenByOneArchiverAtATime) {
  const Archive first = open();
  try {
    open();
    FAIL() << "opened twice";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("another archiver writes into this folder"));
  }
}

TEST_F(ArchiveTest, AddsAllRowsOrNone) {
  Archive sut = open();
  sut.append({put(1)}, morning);
  Put broken = put(3);
  broken.fields = {{"same", "1"}, {"same", "2"}};
  EXPECT_THROW(sut.append({put(2), broken}, morning), SQLite::Exception);
  EXPECT_EQ(count(sut, "put"), 1);
  EXPECT_THAT(sut.append({put(4)}, morning), ElementsAre(2));
}

TEST_F(ArchiveTest, ContinuesAsSoonAsAnotherProcessReleasesItsLock) {
  Archive sut = open();
  sut.append({put(1), event(1)}, morning);
  SQLite::Database other(sut.file().string(), SQLite::OPEN_READWRITE);
  other.exec("BEGIN IMMEDIATE");
  other.exec("DELETE FROM event");
  EXPECT_THROW(sut.append({event(2)}, morning), SQLite::Exception);
  other.exec("COMMIT");
  EXPECT_THAT(sut.append({put(2)}, morning), ElementsAre(2));
  EXPECT_THAT(sut.append({event(2)}, morning), ElementsAre(0));
}

TEST_F(ArchiveTest, AcknowledgesNothingWhileItsFolderHasAnotherName) {
  const auto here = folder.path() / "archive";
  const auto there = folder.path() / "yesterday";
  Archive sut(here, {}, morning);
  sut.append({put(1)}, morning);
  std::filesystem::rename(here, there);
  EXPECT_THAT([&] { sut.append({put(2)}, morning); },
              ThrowsMessage<std::runtime_error>(HasSubstr("it was moved or removed")));
  std::filesystem::create_directory(here);
  EXPECT_ANY_THROW(sut.append({put(2)}, morning));
  std::filesystem::remove(here);
  std::filesystem::rename(there, here);
  EXPECT_THAT(sut.append({put(2)}, morning), ElementsAre(2));
}

TEST_F(ArchiveTest, AcknowledgesNothingIntoAFileThatWasRemoved) {
  Archive sut = open();
  sut.append({put(1)}, morning);
  std::filesystem::remove(sut.file().string() + "-wal");
  EXPECT_ANY_THROW(sut.append({put(2)}, morning)) << "rows go there first";
  std::filesystem::remove(sut.file());
  EXPECT_ANY_THROW(sut.append({put(2)}, morning));
}

TEST_F(ArchiveTest, ContinuesWhereTheFileBeforeWasMovedAway) {
  Archive sut = open({.rotate_age = 1h});
  sut.append({put(1)}, morning);
  append(sut, {put(2)}, morning + 2h);
  std::filesystem::remove(numbered(1));
  EXPECT_THAT(sut.append({put(3)}, morning + 2h), ElementsAre(3));
}

TEST_F(ArchiveTest, BeginsANewFileAtItsStartWhereThePagesOfTheNewestAreDamaged) {
  {
    Archive earlier = open();
    fill(earlier, 2000);
  }
  damage(numbered(1));
  Archive sut = open();
  EXPECT_EQ(sut.file(), numbered(2));
  EXPECT_THAT(reported, HasSubstr("archive-000001.db is damaged"));
  EXPECT_THAT(sut.append({put(2001)}, morning), ElementsAre(testing::Ge(2001)));
  EXPECT_TRUE(std::filesystem::exists(numbered(1)));
}

TEST_F(ArchiveTest, BeginsANewFileWhenItFindsPagesOfTheNewestDamaged) {
  Archive sut = open();
  fill(sut, 2000);
  damage(numbered(1));
  std::vector<std::int64_t> ids;
  for (std::uint64_t number = 2001; sut.file() == numbered(1); ++number) {
    const std::vector<std::int64_t> id = sut.append({put(number)}, morning);
    ids.insert(ids.end(), id.begin(), id.end());
    ASSERT_LT(number, 10'000U);
  }
  EXPECT_EQ(ids.back(), 2000 + static_cast<std::int64_t>(ids.size()));
  EXPECT_THAT(reported, HasSubstr("archive-000001.db is damaged"));
  EXPECT_THAT(sut.foreign(), ElementsAre(numbered(1)));
}

TEST_F(ArchiveTest, GivesNoIdTwiceWhereNothingCanBeReadOfTheFilesBefore) {
  {
    Archive earlier = open({.rotate_age = 1h});
    earlier.append({put(1), put(2)}, morning);
    append(earlier, {put(3)}, morning + 2h);
  }
  std::ofstream(numbered(1)) << "no database";
  std::ofstream(numbered(2)) << "none either";
  std::vector<std::int64_t> ids;
  {
    Archive sut = open();
    ids = sut.append({put(4)}, morning);
    EXPECT_THAT(ids, ElementsAre(testing::Gt(3)));
    EXPECT_LT(ids.front(), std::int64_t{1} << 53) << "NC programs count in REAL64";
  }
  Archive sut = open();
  EXPECT_THAT(sut.append({put(5)}, morning), ElementsAre(ids.front() + 1));
}

TEST_F(ArchiveTest, CountsNoFileWithANumberThatHasNoNext) {
  std::ofstream(folder.path() / "archive-18446744073709551615.db") << "x";
  { open().append({put(1)}, morning); }
  Archive sut = open({.rotate_age = 1h});
  EXPECT_EQ(sut.file(), numbered(1));
  append(sut, {put(2)}, morning + 2h);
  EXPECT_EQ(sut.file(), numbered(2));
}

TEST_F(ArchiveTest, ContinuesTheFileOfTheLastNumber) {
  { open().append({put(1)}, morning); }
  std::filesystem::rename(numbered(1), folder.path() / "archive-999999999999.db");
  Archive sut = open({.rotate_age = 1h});
  EXPECT_THAT(append(sut, {put(2)}, morning + 2h), ElementsAre(2));
  EXPECT_THAT(reported, HasSubstr("has the highest possible number"));
}

TEST_F(ArchiveTest, IgnoresFilesOfOthers) {
  for (const char* const name : {"archive-1.txt", "archive-x.db", "other.db"}) {
    std::ofstream(folder.path() / name) << "x";
  }
  Archive sut = open();
  EXPECT_THAT(archive_files(folder.path()), ElementsAre(folder.path() / "archive-000001.db"));
}

// The contents of the archive after a power cut at any point of its work.

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
