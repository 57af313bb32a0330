#include <fstream>
#include <sstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/archiver/segment.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class SchemaTest : public testing::Test {
 protected:
  /// Creates the file of an earlier version (tests/data/archiver).
  void make_old(const std::string& dump) const {
    std::ifstream in(std::string(MILLRACE_TEST_DATA) + "/archiver/" + dump);
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
  SQLite::Database(file.string(), SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
  try {
    const Segment sut(file, {});
    FAIL() << "opened";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("written by a newer millrace (schema 99"));
  }
  EXPECT_EQ(version(), 99);
}

TEST_F(SchemaTest, IsNotForcedOnAFileThatIsNoDatabase) {
  std::ofstream(file) << std::string(4096, 'x');
  EXPECT_THROW(Segment(file, {}), Foreign);
  EXPECT_EQ(std::filesystem::file_size(file), 4096U);
}

}  // namespace
}  // namespace millrace::services::archiver
