#include "services/archiver/query.hpp"

#include <fstream>
#include <sstream>

#include <SQLiteCpp/SQLiteCpp.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/archiver/answering.hpp"
#include "services/archiver/archive.hpp"
#include "services/archiver/config.hpp"
#include "services/text/answer.hpp"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

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

TEST(ArchiverRequest, HasFieldsBehindPut) {
  EXPECT_THAT(*parse("PUT part=WELLE7 d=12.345"),
              ElementsAre(Field{"part", "WELLE7"}, Field{"d", "12.345"}));
  EXPECT_THAT(*parse("  put \t a=1  b= "), ElementsAre(Field{"a", "1"}, Field{"b", ""}));
}

TEST(ArchiverRequest, MayQuoteValues) {
  EXPECT_THAT(*parse(R"(PUT d="12.345 mm" say="we said ""no""" none="" e=a=b)"),
              ElementsAre(Field{"d", "12.345 mm"}, Field{"say", "we said \"no\""},
                          Field{"none", ""}, Field{"e", "a=b"}));
}

TEST(ArchiverRequest, IsTextOtherwise) {
  EXPECT_THAT(*parse("tool 5 changed; a=1 $(reboot)"), IsEmpty());
  EXPECT_THAT(*parse("PUTTING a=1"), IsEmpty());
}

struct Mistake {
  std::string request;
  std::string error;
};

class WrongArchiverRequest : public testing::TestWithParam<Mistake> {};

TEST_P(WrongArchiverRequest, ReportsWhatIsWrong) {
  const auto sut = parse(GetParam().request);
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(), HasSubstr(GetParam().error));
}

INSTANTIATE_TEST_SUITE_P(
    Requests, WrongArchiverRequest,
    testing::Values(Mistake{"", "the request is empty"}, Mistake{"  \t ", "the request is empty"},
                    Mistake{"PUT", "PUT without key=value"},
                    Mistake{"PUT a", "expected key=value at 'a'"},
                    Mistake{"PUT =1", "expected key=value at '=1'"},
                    Mistake{"PUT a=1 b c=2", "expected key=value at 'b c=2'"},
                    Mistake{"PUT a.b=1", "expected key=value at 'a.b=1'"},
                    Mistake{"PUT a=1 a=2", "key 'a' occurs twice"},
                    Mistake{"PUT a=\"1", "no closing quote for '\"1'"},
                    Mistake{"PUT a=\"1\"b=2", "expected a blank at 'b=2'"},
                    Mistake{"PUT " + std::string(33, 'k') + "=1", "expected key=value"},
                    Mistake{"PUT " + std::string(123, '\xFF'), "expected key=value"}));

fabric::Request call(const std::string& request) {
  return {.key = {.machine = "cnc", .channel = 2},
          .call = {.epoch = 0x5f, .number = 3},
          .text = request,
          .state = 9,
          .replayed = true};
}

TEST(ArchiverAnswering, KeepsTheRequestAndItsFieldsInUtf8) {
  const auto sut = put_of(call("PUT ma\xDF=1 x=Ma\xDF"), morning);
  ASSERT_FALSE(sut) << "keys are ASCII";
  const auto good = put_of(call("PUT x=Ma\xDF"), morning);
  ASSERT_TRUE(good);
  EXPECT_EQ(good->text, "PUT x=Maß");
  EXPECT_THAT(good->fields, ElementsAre(Field{"x", "Maß"}));
  EXPECT_EQ(good->key.channel, 2);
  EXPECT_EQ(good->state, 9U);
  EXPECT_EQ(good->at, morning);
  EXPECT_TRUE(good->replayed);
}

TEST(ArchiverAnswering, KeepsFreeText) {
  const auto sut = put_of(call("tool 5 changed"), morning);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->text, "tool 5 changed");
  EXPECT_THAT(sut->fields, IsEmpty());
}

TEST(ArchiverAnswering, RefusesABadRequest) {
  EXPECT_EQ(put_of(call("PUT a"), morning).error(), text::error(10, "expected key=value at 'a'"));
}

TEST(ArchiverAnswering, AnswersWithTheIdOrTheReason) {
  EXPECT_EQ(answer_to(17), (sdk::Response{.text = "OK 17", .state = 1}));
  EXPECT_EQ(answer_to(tl::unexpected(std::string("disk full"))),
            text::error(11, "the archive cannot be written: disk full"));
}

std::filesystem::path data(const std::string& name) {
  return tests::test_data("config") / name;
}

TEST(ArchiverConfig, ReadsEveryField) {
  const auto sut = load(data("good/plant.archiver.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->folder, "/var/lib/millrace/archive");
  EXPECT_FALSE(sut->record_events);
  EXPECT_FALSE(sut->record_channels);
  EXPECT_THAT(sut->without_text, testing::ElementsAre("fdeccc37-09ba-4ef6-bf20-2955ea738286"));
  EXPECT_EQ(sut->policy.rotate_bytes, 64U << 20U);
  EXPECT_EQ(sut->policy.rotate_age, 12h);
  EXPECT_EQ(sut->policy.keep_age, 720h);
  EXPECT_EQ(sut->policy.keep_bytes, 2048ULL << 20U);
}

TEST(ArchiverConfig, HasDefaults) {
  const Config sut = default_config("/srv");
  EXPECT_EQ(sut.folder, "/srv/archive");
  EXPECT_TRUE(sut.record_events);
  EXPECT_EQ(sut.policy.keep_age, 365 * 24h);
}

TEST(ArchiverConfig, AcceptsARelativePath) {
  const auto here = std::filesystem::current_path();
  const auto sut = load(std::filesystem::relative(data("good/plant.archiver.textproto"), here));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->folder, "/var/lib/millrace/archive");
  EXPECT_EQ(default_config("archives").folder, here / "archives/archive");
}

TEST(ArchiverConfig, NamesEveryMistakeWithItsPlace) {
  tests::expect_mistakes("archiver", [](const auto& file) {
    const auto sut = load(file);
    return sut ? "no error" : sut.error();
  });
}

}  // namespace
}  // namespace millrace::services::archiver
