#include "services/archiver/archive.hpp"

#include <fstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/archiver/schema.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

class ArchiveTest : public testing::Test {
 protected:
  Archive open(const Policy& policy = {}, fabric::Time now = morning) {
    return Archive(folder.path(), policy, now);
  }
  [[nodiscard]] std::int64_t count(const Archive& archive, const std::string& table) const {
    SQLite::Database database(archive.file().string());
    return database.execAndGet("SELECT count(*) FROM " + table).getInt64();
  }

  tests::TemporaryFolder folder;
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

TEST_F(ArchiveTest, KeepsAChannelStateThatIsToldTwiceOnce) {
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
  sut.append({put(2)}, morning + 2h);
  EXPECT_FALSE(std::filesystem::exists(closed.string() + "-wal"));
  SQLite::Database database(closed.string(), SQLite::OPEN_READONLY);
  EXPECT_EQ(database.execAndGet("PRAGMA journal_mode").getString(), "delete");
  EXPECT_EQ(database.execAndGet("SELECT count(*) FROM put").getInt(), 1);
}

TEST_F(ArchiveTest, RemovesClosedFilesThatAreTooOld) {
  Archive sut = open({.rotate_age = 24h, .keep_age = 48h});
  for (int day = 0; day < 6; ++day) {
    sut.append({put(static_cast<std::uint64_t>(day))}, morning + day * 24h);
  }
  EXPECT_THAT(archive_files(folder.path()), SizeIs(3));
}

TEST_F(ArchiveTest, RemovesTheOldestFilesOfTooMuch) {
  Archive sut = open({.rotate_age = 1h, .keep_bytes = 150'000});
  for (int hour = 0; hour < 8; ++hour) {
    sut.append({put(static_cast<std::uint64_t>(hour))}, morning + hour * 1h);
  }
  std::uintmax_t size = 0;
  for (const auto& file : archive_files(folder.path())) {
    size += std::filesystem::file_size(file);
  }
  EXPECT_LE(size, 250'000U);
  EXPECT_LT(archive_files(folder.path()).size(), 8U);
}

TEST_F(ArchiveTest, GoesOnAfterACrashBetweenTheEndOfAFileAndTheNext) {
  { open().append({put(1)}, morning); }
  Segment(archive_files(folder.path()).back(), {}).end(morning);
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
    EXPECT_THAT(error.what(), HasSubstr("another archiver writes here"));
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

TEST_F(ArchiveTest, IgnoresFilesOfOthers) {
  for (const char* const name : {"archive-1.txt", "archive-x.db", "other.db"}) {
    std::ofstream(folder.path() / name) << "x";
  }
  Archive sut = open();
  EXPECT_THAT(archive_files(folder.path()), ElementsAre(folder.path() / "archive-000001.db"));
}

}  // namespace
}  // namespace millrace::services::archiver
