#include "services/archiver/query.hpp"

#include <fstream>
#include <sstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/archiver/archive.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// Three puts in two files, an event and a channel's state.
class QueryTest : public testing::Test {
 protected:
  QueryTest() {
    archive.append({put(1), put(2, morning + 30min), event(1)}, morning);
    Put other = put(3, morning + 2h);
    other.key = {.machine = "press", .channel = 4};
    other.fields = {{"part", "RAD9"}, {"b", "Ma\xC3\x9F \"8\""}};
    EventRow hidden = event(2, morning + 2h);
    hidden.with_text = false;
    archive.append({other, hidden, channel(fabric::ChannelState::unserved)}, morning + 2h);
  }

  std::string rows(const Filter& filter, Format format = Format::jsonl) {
    std::ostringstream out;
    write_rows(folder.path(), filter, format, out);
    return out.str();
  }
  std::uint64_t count(const Filter& filter) {
    std::ostringstream out;
    const Found found = write_rows(folder.path(), filter, Format::csv, out);
    EXPECT_THAT(found.unread, testing::IsEmpty());
    return found.rows;
  }

  tests::TemporaryFolder folder;
  Archive archive{folder.path(), {.rotate_age = 1h}, morning};
};

TEST_F(QueryTest, ShowsPutsOfAllFilesWhileTheArchiveIsOpen) {
  EXPECT_EQ(count({}), 3U);
  EXPECT_EQ(rows({.call = "5f-1"}),
            "{\"id\":1,\"at\":\"2026-03-01T07:00:00.000000Z\",\"machine\":\"cnc\",\"channel\":1,"
            "\"call\":\"5f-1\",\"state\":7,\"text\":\"PUT part=WELLE7 d=\\\"12.345 mm\\\"\","
            "\"fields\":{\"d\":\"12.345 mm\",\"part\":\"WELLE7\"},\"replayed\":0}\n");
}

TEST_F(QueryTest, NamesAFileThatCannotBeReadAndContinues) {
  std::ofstream(folder.path() / "archive-000000.db") << "no database";
  SQLite::Database((folder.path() / "archive-000007.db").string(),
                   SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE)
      .exec("CREATE TABLE put (x)");
  std::ostringstream out;
  const Found sut = write_rows(folder.path(), {}, Format::csv, out);
  EXPECT_EQ(sut.rows, 3U);
  EXPECT_THAT(sut.unread,
              testing::ElementsAre(HasSubstr("archive-000000.db: file is not a database"),
                                   HasSubstr("archive-000007.db: not a file of an archive")));
}

TEST_F(QueryTest, ShowsEventsInUtf8) {
  const std::string line = rows({.kind = Kind::event, .call = "5f-1"});
  EXPECT_THAT(line, HasSubstr("\"kind\":\"replied\""));
  EXPECT_THAT(line, HasSubstr("\"text\":\"Ma\xC3\x9F\""));
  EXPECT_THAT(line, HasSubstr("\"detail\":\"from test\""));
}

TEST_F(QueryTest, ShowsThatATextWasNotKept) {
  EXPECT_THAT(rows({.kind = Kind::event, .call = "5f-2"}), HasSubstr("\"text\":null"));
}

TEST_F(QueryTest, ShowsChannelStates) {
  EXPECT_THAT(rows({.kind = Kind::channel}), HasSubstr("\"state\":\"unserved\",\"instance\""));
}

TEST_F(QueryTest, FiltersByTime) {
  EXPECT_EQ(count({.since = morning + 30min}), 2U);
  EXPECT_EQ(count({.until = morning + 30min}), 1U);
  EXPECT_EQ(count({.since = morning + 3h}), 0U);
}

TEST_F(QueryTest, FiltersByMachineAndChannel) {
  EXPECT_EQ(count({.machine = "press"}), 1U);
  EXPECT_EQ(count({.channel = std::uint16_t{1}}), 2U);
  EXPECT_EQ(count({.machine = "press", .channel = std::uint16_t{1}}), 0U);
}

TEST_F(QueryTest, FiltersByFieldAndItsValue) {
  EXPECT_EQ(count({.key = "b"}), 1U);
  EXPECT_EQ(count({.key = "part"}), 3U);
  EXPECT_EQ(count({.key = "part", .value = "WELLE7"}), 2U);
  EXPECT_EQ(count({.key = "b", .value = "RAD9"}), 0U);
}

TEST_F(QueryTest, TreatsSqlAsText) {
  EXPECT_EQ(count({.machine = "' OR 1=1 --"}), 0U);
}

TEST_F(QueryTest, EndsAtItsLimit) {
  EXPECT_EQ(count({.limit = 2}), 2U);
  EXPECT_EQ(count({.limit = 0}), 0U);
}

TEST_F(QueryTest, FailsForAFolderThatIsNotThere) {
  std::ostringstream out;
  EXPECT_THROW(write_rows(folder.path() / "no", {}, Format::csv, out), std::runtime_error);
}

}  // namespace
}  // namespace millrace::services::archiver
