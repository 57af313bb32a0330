#include "services/mail/spool.hpp"

#include <fstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::services::mail {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;
using testing::ThrowsMessage;

fabric::Time at(std::int64_t nanoseconds) {
  return fabric::Time(std::chrono::nanoseconds(nanoseconds));
}

Entry entry(std::uint64_t number, Stage stage = Stage::waiting) {
  return {.call = {.epoch = 0x5f, .number = number},
          .stage = stage,
          .mail = {.from = "a@b", .to = {"c@d", "e@f"}, .message = "Subject: x\r\n\r\n\xC3\x9F"},
          .made = at(17),
          .attempts = 2,
          .next = at(18),
          .reply = "451 \"busy\" \xFF"};
}

class MailSpool : public testing::Test {
 protected:
  std::optional<Entry> found(const Spool& sut, std::uint64_t number) {
    const auto result = sut.find({.epoch = 0x5f, .number = number});
    EXPECT_TRUE(result) << result.error();
    return result ? *result : std::nullopt;
  }

  tests::TemporaryFolder folder;
  std::filesystem::path database = folder.path() / "spool.db";
};

TEST_F(MailSpool, ReturnsWhatWasStored) {
  {
    Spool sut(folder.path() / "spool");
    EXPECT_TRUE(sut.put(entry(1)));
    EXPECT_TRUE(sut.put(entry(2)));
    EXPECT_TRUE(sut.put(entry(2, Stage::given_up)));
    EXPECT_TRUE(sut.put(entry(3)));
    EXPECT_TRUE(sut.remove({.epoch = 0x5f, .number = 3}));
  }
  const Spool sut(folder.path() / "spool");
  EXPECT_EQ(found(sut, 1), entry(1));
  EXPECT_EQ(found(sut, 2), entry(2, Stage::given_up));
  EXPECT_EQ(found(sut, 3), std::nullopt);
}

TEST_F(MailSpool, StoresEachStage) {
  Spool sut(folder.path());
  for (const Stage stage :
       {Stage::waiting, Stage::handed_over, Stage::accepted, Stage::refused, Stage::given_up}) {
    ASSERT_TRUE(sut.put(entry(1, stage)));
    EXPECT_EQ(found(sut, 1), entry(1, stage));
  }
}

TEST_F(MailSpool, ListsWhatWaitsAndWhatIsInDoubt) {
  Spool sut(folder.path());
  Entry last = entry(3, Stage::accepted);
  last.made = at(99);
  for (const Entry& each :
       {entry(1), entry(2, Stage::handed_over), last, entry(4, Stage::given_up)}) {
    ASSERT_TRUE(sut.put(each));
  }
  const auto content = sut.content();
  ASSERT_TRUE(content);
  EXPECT_EQ(content->calls, 4U);
  EXPECT_THAT(content->waiting, ElementsAre(Pair(entry(1).call, at(18))));
  EXPECT_THAT(content->in_doubt, ElementsAre(entry(2).call));
  EXPECT_EQ(content->last, at(99));
  EXPECT_EQ(Spool(folder.path() / "empty").content()->last, std::nullopt);
}

TEST_F(MailSpool, ForgetsOldCallsWhoseMessageIsNotNeeded) {
  Spool sut(folder.path());
  const auto without_message = [](Entry entry) {
    entry.mail = {};
    return entry;
  };
  Entry young = without_message(entry(3, Stage::accepted));
  young.made = at(1000);
  for (const Entry& each :
       {without_message(entry(1, Stage::accepted)), without_message(entry(2, Stage::refused)),
        young, entry(4, Stage::refused), entry(5, Stage::given_up), entry(6, Stage::waiting),
        entry(7, Stage::handed_over)}) {
    ASSERT_TRUE(sut.put(each));
  }
  ASSERT_TRUE(sut.forget(at(500)));
  EXPECT_EQ(sut.content()->calls, 5U);
  EXPECT_EQ(found(sut, 1), std::nullopt);
  EXPECT_EQ(found(sut, 2), std::nullopt);
}

TEST_F(MailSpool, BelongsToOneService) {
  const Spool sut(folder.path());
  EXPECT_THROW(Spool(folder.path()), std::runtime_error);
}

TEST_F(MailSpool, NamesADatabaseThatIsDamaged) {
  {
    Spool sut(folder.path());
    for (std::uint64_t number = 0; number < 200; ++number) {
      ASSERT_TRUE(sut.put(entry(number)));
    }
  }
  const auto size = std::filesystem::file_size(database);
  std::fstream file(database, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(size / 2));
  file << std::string(size / 4, 'x');
  file.close();
  EXPECT_THAT([&] { Spool(folder.path()); },
              ThrowsMessage<std::runtime_error>(AllOf(
                  HasSubstr(database.string()), HasSubstr("damaged"), HasSubstr(".recover"))));
}

TEST_F(MailSpool, NamesAFileThatIsNoDatabaseAndLeavesItAsItIs) {
  const std::string text(5000, 'x');
  std::ofstream(database) << text;
  EXPECT_THAT([&] { Spool(folder.path()); },
              ThrowsMessage<std::runtime_error>(AllOf(
                  HasSubstr(database.string()), HasSubstr("not the spool of a mail service"))));
  std::ostringstream after;
  after << std::ifstream(database).rdbuf();
  EXPECT_EQ(after.str(), text);
}

TEST_F(MailSpool, NamesTheDatabaseOfAnotherProgramAndThatOfANewerVersion) {
  SQLite::Database(database.string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE)
      .exec("CREATE TABLE other (x)");
  EXPECT_THAT([&] { Spool(folder.path()); },
              ThrowsMessage<std::runtime_error>(HasSubstr("the database of another program")));
  SQLite::Database(database.string(), SQLite::OPEN_READWRITE).exec("PRAGMA user_version = 99");
  EXPECT_THAT([&] { Spool(folder.path()); },
              ThrowsMessage<std::runtime_error>(HasSubstr("written by a newer millrace")));
}

TEST_F(MailSpool, WritesNothingToAFileThatIsNoLongerTheSpool) {
  Spool sut(folder.path() / "spool");
  std::filesystem::remove_all(folder.path() / "spool");
  EXPECT_THAT(sut.put(entry(1)).error(), HasSubstr("moved or removed"));
}

TEST_F(MailSpool, NamesWhatItCannotWrite) {
  Spool sut(folder.path());
  SQLite::Database other(database.string(), SQLite::OPEN_READWRITE);
  other.exec("DROP TABLE mail");
  EXPECT_THAT(sut.put(entry(1)).error(),
              AllOf(HasSubstr(database.string()), HasSubstr("no such table")));
}

// The contents of the spool after a power cut at any point of its work.

Entry at_stage(std::uint64_t number, Stage stage) {
  return {.call = {.epoch = 0x5f, .number = number},
          .stage = stage,
          .mail = {.from = "a@b", .to = {"c@d"}, .message = "Subject: x\r\n"}};
}

// A handed-over mail that is missing in the spool would be sent twice.
TEST(MailSpoolAfterAPowerCut, HasWhatWasPutAndNothingThatWasRemoved) {
  const tests::TemporaryFolder folder;
  const auto spool = folder.path() / "spool";
  std::filesystem::create_directory(spool);
  std::vector<Entry> puts;
  for (std::uint64_t number = 1; number <= 4; ++number) {
    for (const Stage stage : {Stage::waiting, Stage::handed_over, Stage::accepted}) {
      puts.push_back(at_stage(number, stage));
    }
  }
  std::vector<tests::PowerCut> cuts;
  {
    tests::PowerCutDisk disk(spool);
    Spool writer(spool);
    for (unsigned done = 0; done < puts.size(); ++done) {
      ASSERT_TRUE(writer.put(puts[done]));
      disk.promise(done + 1);
    }
    ASSERT_TRUE(writer.remove(puts.front().call));
    disk.promise(static_cast<unsigned>(puts.size()) + 1);
    cuts = disk.power_cuts();
  }
  ASSERT_GT(cuts.size(), puts.size());
  for (const tests::PowerCut& cut : cuts) {
    cut.restore(folder.path() / "left");
    const Spool sut(folder.path() / "left");
    // One more than promised may be present.
    bool as_promised = false;
    for (unsigned done = cut.promised; done <= cut.promised + 1; ++done) {
      std::map<fabric::CallId, Entry> expected;
      for (unsigned i = 0; i < std::min<std::size_t>(done, puts.size()); ++i) {
        expected.insert_or_assign(puts[i].call, puts[i]);
      }
      if (done > puts.size()) {
        expected.erase(puts.front().call);
      }
      bool all = true;
      for (std::uint64_t number = 1; number <= 4; ++number) {
        const fabric::CallId call{.epoch = 0x5f, .number = number};
        const auto found = sut.find(call);
        ASSERT_TRUE(found) << cut.where << ": " << found.error();
        const auto known = expected.find(call);
        all = all && (known == expected.end() ? !*found : *found == known->second);
      }
      as_promised = as_promised || all;
    }
    EXPECT_TRUE(as_promised) << cut.where << ", after " << cut.promised << " of " << puts.size();
  }
}

}  // namespace
}  // namespace millrace::services::mail
