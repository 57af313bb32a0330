// When a file of the archive is closed, which ones are removed, and the tables of a file.
#include <fstream>
#include <sstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/archiver/archive.hpp"
#include "services/archiver/segment.hpp"
#include "tests/support/data.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

const fabric::Time start{};
const Policy policy{.rotate_bytes = 100, .rotate_age = 24h, .keep_age = 240h, .keep_bytes = 1000};

TEST(Rotation, IsDueWhenAFileIsLargeOrOld) {
  EXPECT_FALSE(must_rotate(policy, start, 99, start + 23h));
  EXPECT_TRUE(must_rotate(policy, start, 100, start));
  EXPECT_TRUE(must_rotate(policy, start, 0, start + 24h));
}

TEST(Rotation, IsNeverDueWithoutLimits) {
  EXPECT_FALSE(must_rotate({.rotate_bytes = 0, .rotate_age = 0h}, start, 1'000'000, start + 9999h));
}

TEST(Retention, RemovesWhatIsTooOld) {
  const std::vector<Closed> closed{{10, start}, {10, start + 100h}, {10, start + 200h}};
  EXPECT_EQ(expired(policy, closed, 10, start + 239h), 0U);
  EXPECT_EQ(expired(policy, closed, 10, start + 240h), 1U);
  EXPECT_EQ(expired(policy, closed, 10, start + 340h), 2U);
}

TEST(Retention, RemovesTheOldestOfTooMuch) {
  const std::vector<Closed> closed{{400, start}, {400, start}, {400, start}};
  EXPECT_EQ(expired(policy, closed, 100, start), 1U);
  EXPECT_EQ(expired(policy, closed, 700, start), 2U);
}

TEST(Retention, KeepsWhatHasNoKnownAge) {
  const std::vector<Closed> closed{{10, std::nullopt}, {10, start}, {10, start}};
  EXPECT_EQ(expired(policy, closed, 10, start + 9999h), 0U);
}

TEST(Rotation, IsDueForAFileOfAClockThatWasAhead) {
  EXPECT_FALSE(must_rotate(policy, start + 23h, 0, start));
  EXPECT_TRUE(must_rotate(policy, start + 8760h, 0, start));
}

TEST(Retention, KeepsTheNewestClosedFileInAnyCase) {
  EXPECT_EQ(expired(policy, {{5000, start}}, 10, start + 9999h), 0U);
  EXPECT_EQ(expired(policy, {}, 5000, start), 0U);
}

TEST(Retention, RemovesNothingWithoutLimits) {
  const Policy unlimited{.keep_age = 0h, .keep_bytes = 0};
  EXPECT_EQ(expired(unlimited, {{5000, start}, {5000, start}}, 10, start + 99999h), 0U);
}

class SchemaTest : public testing::Test {
 protected:
  /// Creates the file of an earlier version (tests/data/archiver).
  void make_old(const std::string& dump) const {
    std::ifstream in(tests::test_data("archiver") / dump);
    std::stringstream sql;
    sql << in.rdbuf();
    SQLite::Database(file.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE).exec(sql.str());
  }
  [[nodiscard]] int version() const {
    return SQLite::Database(file.string()).execAndGet("PRAGMA user_version").getInt();
  }

  tests::TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "archive-000001.db";
};

TEST_F(SchemaTest, IsTheNewestInANewFile) {
  const Segment sut(file, {});
  EXPECT_EQ(version(), schema_version);
}

TEST_F(SchemaTest, OfAnOlderFileIsBroughtUpToDateAndItsRowsStay) {
  make_old("version_1.sql");
  Segment sut(file, {});
  EXPECT_EQ(version(), schema_version);
  EXPECT_THAT(sut.append({put(17), put(18), event(1)}), ElementsAre(1, 2, 0));
}

TEST_F(SchemaTest, OfANewerMillraceIsLeftAlone) {
  { const Segment made(file, {}); }
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE)
      .exec("PRAGMA journal_mode = DELETE; PRAGMA user_version = 99");
  const auto bytes = [this] {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
  };
  const std::string before = bytes();
  try {
    const Segment sut(file, {});
    FAIL() << "opened";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("written by a newer millrace (schema 99"));
  }
  EXPECT_TRUE(bytes() == before);
}

TEST_F(SchemaTest, IsNotForcedOnAFileThatIsNoDatabase) {
  std::ofstream(file) << std::string(4096, 'x');
  EXPECT_THROW(Segment(file, {}), Foreign);
  EXPECT_EQ(std::filesystem::file_size(file), 4096U);
}

}  // namespace
}  // namespace millrace::services::archiver
