#include "services/archiver/writer.hpp"

#include <atomic>
#include <fstream>
#include <future>
#include <sstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/ostream_sink.h>

#include "base/messages/catalogue.hpp"
#include "base/program/log.hpp"
#include "services/archiver/row_writer.hpp"
#include "tests/support/await.hpp"
#include "tests/support/kept_alarms.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

class WriterTest : public testing::Test {
 protected:
  /// One file, independent of the age of `morning`.
  Archive archive() {
    return Archive(folder.path(), {.rotate_age = std::chrono::hours(0)}, morning);
  }
  [[nodiscard]] std::int64_t count(const std::string& table) const {
    SQLite::Database database((folder.path() / "archive-000001.db").string());
    return database.execAndGet("SELECT count(*) FROM " + table).getInt64();
  }

  tests::TemporaryFolder folder;
  tests::KeptAlarms alarms;
};

TEST_F(WriterTest, ReturnsTheIdOfAPutOnceItIsWritten) {
  Writer sut(archive(), base::program::no_log(), alarms);
  std::promise<Written> written;
  std::int64_t rows = -1;
  sut.put(put(1), [&](const Written& id) {
    rows = count("put");
    written.set_value(id);
  });
  EXPECT_EQ(written.get_future().get(), 1);
  EXPECT_EQ(rows, 1);
}

TEST_F(WriterTest, WritesFromManyThreads) {
  constexpr std::uint64_t threads = 8;
  constexpr std::uint64_t puts = 50;
  std::atomic<std::uint64_t> written = 0;
  {
    Writer sut(archive(), base::program::no_log(), alarms);
    std::vector<std::thread> callers;
    for (std::uint64_t thread = 0; thread < threads; ++thread) {
      callers.emplace_back([&, thread] {
        for (std::uint64_t i = 0; i < puts; ++i) {
          sut.put(put(thread * puts + i), [&](const Written& id) { written += id ? 1U : 0U; });
          sut.record(event(i));
        }
      });
    }
    for (std::thread& caller : callers) {
      caller.join();
    }
  }
  EXPECT_EQ(written, threads * puts);
  EXPECT_EQ(count("put"), static_cast<std::int64_t>(threads * puts));
  EXPECT_EQ(count("event"), static_cast<std::int64_t>(threads * puts));
}

TEST_F(WriterTest, ReportsWhyAPutIsNotWrittenAndRetriesRecordedRows) {
  Writer sut(archive(), base::program::no_log(), alarms);
  // An example of any failed write.
  SQLite::Database database((folder.path() / "archive-000001.db").string(), SQLite::OPEN_READWRITE);
  database.exec(
      "CREATE TRIGGER full BEFORE INSERT ON put BEGIN SELECT RAISE(ABORT, 'disk full'); END");
  std::promise<Written> failed;
  sut.record(event(1));
  sut.put(put(1), [&](const Written& id) { failed.set_value(id); });
  EXPECT_EQ(failed.get_future().get().error(), "disk full");
  const auto alarm = alarms.of("archive");
  ASSERT_TRUE(alarm);
  EXPECT_EQ(alarm->level, fabric::AlarmLevel::problem);
  EXPECT_THAT(alarm->text, testing::EndsWith("archive-000001.db cannot be written: disk full"));

  database.exec("DROP TRIGGER full");
  std::promise<Written> written;
  sut.put(put(1), [&](const Written& id) { written.set_value(id); });
  EXPECT_EQ(written.get_future().get(), 1);
  tests::await("the recorded row", [&] { return count("event") > 0; });
  EXPECT_TRUE(alarms.empty());
}

/// The lines of a log.
class Lines {
 public:
  Lines() : sink_(std::make_shared<spdlog::sinks::ostream_sink_mt>(text_)) {}
  [[nodiscard]] base::program::Log log() const {
    return std::make_shared<spdlog::logger>("test", sink_);
  }
  /// Call it after all logging has ended.
  [[nodiscard]] std::size_t with(const std::string& part) const {
    const std::string all = text_.str();
    std::size_t count = 0;
    for (auto at = all.find(part); at != std::string::npos; at = all.find(part, at + 1)) {
      ++count;
    }
    return count;
  }

 private:
  std::ostringstream text_;
  std::shared_ptr<spdlog::sinks::sink> sink_;
};

TEST_F(WriterTest, AdvisesToEndTheProcessThatLocksTheArchive) {
  Writer sut(archive(), base::program::no_log(), alarms);
  SQLite::Database other((folder.path() / "archive-000001.db").string(), SQLite::OPEN_READWRITE);
  other.exec("BEGIN IMMEDIATE");
  std::promise<Written> failed;
  sut.put(put(1), [&](const Written& id) { failed.set_value(id); });
  EXPECT_FALSE(failed.get_future().get());
  ASSERT_TRUE(alarms.of("archive"));
  EXPECT_EQ(alarms.of("archive")->advice, base::messages::archive_unlock());
  other.exec("COMMIT");
}

TEST_F(WriterTest, ReportsALastingFaultOnceAndThenItsEnd) {
  const Lines lines;
  {
    Writer sut(archive(), lines.log(), alarms);
    SQLite::Database database((folder.path() / "archive-000001.db").string(),
                              SQLite::OPEN_READWRITE);
    database.exec(
        "CREATE TRIGGER full BEFORE INSERT ON put BEGIN SELECT RAISE(ABORT, 'disk full'); END");
    const auto put_one = [&](std::uint64_t number) {
      std::promise<Written> done;
      sut.put(put(number), [&](const Written& id) { done.set_value(id); });
      return done.get_future().get();
    };
    for (std::uint64_t number = 1; number <= 20; ++number) {
      ASSERT_FALSE(put_one(number));
    }
    database.exec("DROP TRIGGER full");
    ASSERT_TRUE(put_one(21));
  }
  EXPECT_EQ(lines.with("cannot be written"), 1U);
  EXPECT_EQ(lines.with("is writable again; 20 attempts failed"), 1U);
}

TEST_F(WriterTest, NamesFilesThatAreNotOfTheArchive) {
  std::ofstream(folder.path() / "archive-000001.db") << "not a database, whatever its name says";
  Writer sut(Archive(folder.path(), {}, morning), base::program::no_log(), alarms);
  tests::await("the alarm about the file", [&] { return alarms.of("foreign_files").has_value(); });
  EXPECT_THAT(alarms.of("foreign_files")->text, testing::HasSubstr("archive-000001.db"));
  EXPECT_EQ(alarms.of("foreign_files")->level, fabric::AlarmLevel::warning);
}

// The weight of rows that were taken from the queue, and returned to it when the disk was full, was
// not counted again. The counter became negative, and the archiver dropped new rows.
TEST_F(WriterTest, KeepsAllThatComesAfterAFailureThatIsOver) {
  constexpr std::uint64_t rows = 50;
  constexpr std::int64_t together = 5;
  {
    Writer sut(archive(), base::program::no_log(), alarms);
    SQLite::Database database((folder.path() / "archive-000001.db").string(),
                              SQLite::OPEN_READWRITE);
    database.exec(
        "CREATE TRIGGER full BEFORE INSERT ON event BEGIN SELECT RAISE(ABORT, 'disk full'); END");
    // Several in one batch: they arrive while the writer's thread reports the result of a put.
    std::promise<void> telling;
    std::promise<void> go_on;
    sut.put(put(1), [&](const Written&) {
      telling.set_value();
      go_on.get_future().wait();
    });
    telling.get_future().wait();
    for (std::uint64_t number = 1; number <= together; ++number) {
      sut.record(event(number));
    }
    go_on.set_value();
    tests::await("a failure", [&] { return alarms.of("archive").has_value(); });
    database.exec("DROP TRIGGER full");
    tests::await("the recorded rows", [&] { return count("event") == together; });
    for (std::uint64_t number = together + 1; number <= rows; ++number) {
      sut.record(event(number));
    }
  }
  EXPECT_EQ(count("event"), static_cast<std::int64_t>(rows));
  EXPECT_FALSE(alarms.of("lost_rows"));
}

const std::vector<Cell> cells{{Cell::Type::number, "7"},
                              {Cell::Type::text, "a,\"b\"\r\nc\td"},
                              {Cell::Type::null, ""},
                              {Cell::Type::json, "{\"k\":1}"}};

std::string written(Format format) {
  std::ostringstream out;
  RowWriter sut(format, {"id", "text", "none", "fields"}, out);
  sut.write(cells);
  return out.str();
}

TEST(RowWriter, AsTextIsOneLinePerRow) {
  EXPECT_EQ(written(Format::text), "id\ttext\tnone\tfields\n7\ta,\"b\"  c d\t\t{\"k\":1}\n");
}

TEST(RowWriter, AsTextEscapesTerminalControls) {
  std::ostringstream out;
  RowWriter(Format::text, {"a"}, out)
      .write({{Cell::Type::text,
               "\x1b[2J\xc2\x9b"
               "2J"}});
  EXPECT_EQ(out.str(), "a\n\\x1b[2J\\x9b2J\n");
}

TEST(RowWriter, AsCsvQuotesWhatNeedsIt) {
  EXPECT_EQ(written(Format::csv),
            "id,text,none,fields\r\n7,\"a,\"\"b\"\"\\x0d\\x0ac\\x09d\",,\"{\"\"k\"\":1}\"\r\n");
}

TEST(RowWriter, AsCsvHasNoFormula) {
  std::ostringstream out;
  RowWriter(Format::csv, {"id", "text"}, out)
      .write({{Cell::Type::number, "-7"}, {Cell::Type::text, "=1+1"}});
  EXPECT_EQ(out.str(), "id,text\r\n-7,'=1+1\r\n");
}

TEST(RowWriter, AsJsonLinesKeepsTypes) {
  EXPECT_EQ(written(Format::jsonl),
            "{\"id\":7,\"text\":\"a,\\\"b\\\"\\r\\nc\\td\",\"none\":null,"
            "\"fields\":{\"k\":1}}\n");
}

}  // namespace
}  // namespace millrace::services::archiver
