#include "services/archiver/samples.hpp"

#include <limits>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/archiver/query.hpp"
#include "services/archiver/segment.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/services/archiver/rows.hpp"

namespace millrace::services::archiver {
namespace {

using namespace std::chrono_literals;
using fabric::DataSample;
using fabric::Quality;
using fabric::Value;
using fabric::ValueType;
using testing::ElementsAre;
using testing::HasSubstr;

Value real(const std::string& name, double value, fabric::Time at) {
  return {
      .name = name, .type = ValueType::real64, .at = at, .elements = std::vector<double>{value}};
}

DataSample sample(std::vector<Value> values, fabric::Time at = morning) {
  return {.key = {"press", 1}, .group = "axes", .at = at, .values = std::move(values)};
}

class ArchivedSamples : public testing::Test {
 protected:
  /// The result of a query of samples, one line each, as JSON.
  [[nodiscard]] std::vector<std::string> found(Filter filter = {}) const {
    filter.kind = filter.kind == Kind::put ? Kind::sample : filter.kind;
    std::stringstream out;
    const Found found = write_rows(folder.path(), filter, Format::jsonl, out);
    EXPECT_THAT(found.unread, testing::IsEmpty());
    std::vector<std::string> lines;
    for (std::string line; std::getline(out, line);) {
      lines.push_back(line);
    }
    return lines;
  }

  tests::TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "archive-000001.db";
  Segment sut{file, {.begun = morning}};
};

TEST_F(ArchivedSamples, HaveARowForAnotherTypeOfTheSameValue) {
  const auto whole = [](ValueType type) {
    return Value{
        .name = "N", .type = type, .at = morning, .elements = std::vector<std::int64_t>{7}};
  };
  sut.append({sample({whole(ValueType::sgn16)}, morning)});
  sut.append({sample({whole(ValueType::sgn32)}, morning + 1s)});
  EXPECT_THAT(found(), ElementsAre(HasSubstr(R"("type":"SGN16")"), HasSubstr(R"("type":"SGN32")")));
}

TEST_F(ArchivedSamples, AreRowsOfWhatChanged) {
  sut.append({sample({real("X", 1.5, morning), real("Y", 2, morning)})});
  sut.append({sample({real("X", 1.5, morning + 1s), real("Y", 2.25, morning + 1s)}, morning + 1s)});

  EXPECT_THAT(
      found(),
      ElementsAre(HasSubstr(R"("at":"2026-03-01T07:00:00.000000Z","machine":"press","channel":1,)"
                            R"("group":"axes","variable":"X","type":"REAL64","value":1.5,)"
                            R"("quality":"good","reason":null,"replayed":0})"),
                  HasSubstr(R"("variable":"Y","type":"REAL64","value":2,)"),
                  HasSubstr(R"("at":"2026-03-01T07:00:01.000000Z","machine":"press","channel":1,)"
                            R"("group":"axes","variable":"Y","type":"REAL64","value":2.25)")));
}

TEST_F(ArchivedSamples, ThatComeAgainAddNothing) {
  sut.append({sample({real("X", 1, morning)})});
  Segment later(file, {});
  later.append({sample({real("X", 1, morning)})});
  EXPECT_THAT(found(), testing::SizeIs(1));
}

TEST_F(ArchivedSamples, HoldArraysAsJsonAlsoWhereAnElementIsNoNumber) {
  sut.append({sample(
      {{.name = "A",
        .type = ValueType::real64,
        .at = morning,
        .is_array = true,
        .elements = std::vector<double>{10, 1.5, std::numeric_limits<double>::quiet_NaN()}}})});
  EXPECT_THAT(found(), ElementsAre(HasSubstr(R"("value":"[10,1.5,\"nan\"]")")));
}

TEST_F(ArchivedSamples, HoldTextsIntegersArraysAndWhatIsRefused) {
  sut.append({sample({{.name = "T",
                       .type = ValueType::string,
                       .at = morning,
                       .elements = std::vector<std::string>{"Ma\xDF"}},
                      {.name = "A",
                       .type = ValueType::sgn16,
                       .at = morning,
                       .is_array = true,
                       .elements = std::vector<std::int64_t>{1, -2}},
                      {.name = "B",
                       .type = ValueType::boolean,
                       .at = morning,
                       .elements = std::vector<std::int64_t>{1}},
                      {.name = "N", .quality = Quality::refused, .reason = "0x710"}})});
  EXPECT_THAT(found({.variable = "T"}), ElementsAre(HasSubstr(R"("value":"Maß")")));
  EXPECT_THAT(found({.variable = "A"}),
              ElementsAre(HasSubstr(R"("type":"SGN16[]","value":"[1,-2]")")));
  EXPECT_THAT(found({.variable = "B"}), ElementsAre(HasSubstr(R"("value":1,)")));
  EXPECT_THAT(found({.variable = "N"}),
              ElementsAre(HasSubstr(R"("value":null,"quality":"refused","reason":"0x710")")));
}

TEST_F(ArchivedSamples, AreStaleWithoutTheirGateway) {
  sut.append({sample({real("X", 1, morning)})});
  sut.append({sample({}, morning + 5s)});
  EXPECT_THAT(found(), ElementsAre(HasSubstr(R"("quality":"good")"),
                                   HasSubstr(R"("at":"2026-03-01T07:00:05.000000Z")")));
  EXPECT_THAT(found()[1],
              HasSubstr(R"("value":1,"quality":"stale","reason":"its gateway is gone")"));
}

TEST_F(ArchivedSamples, StandWholeInEachFile) {
  sut.append({sample({real("X", 1, morning)})});
  Segment next(folder.path() / "archive-000002.db", {.begun = morning});
  next.append({sample({real("X", 1, morning + 1s)}, morning + 1s)});
  EXPECT_THAT(found(), testing::SizeIs(2));
}

TEST_F(ArchivedSamples, AreFoundByTimeMachineChannelGroupAndVariable) {
  sut.append({sample({real("X", 1, morning), real("Y", 1, morning)})});
  EXPECT_THAT(found({.since = morning + 1s}), testing::SizeIs(0));
  EXPECT_THAT(
      found({.machine = "press", .channel = std::uint16_t{1}, .group = "axes", .variable = "Y"}),
      testing::SizeIs(1));
  EXPECT_THAT(found({.machine = "lathe"}), testing::SizeIs(0));
  EXPECT_THAT(found({.group = "other"}), testing::SizeIs(0));
}

TEST_F(ArchivedSamples, OfAFileThatCannotBeWrittenAreWrittenWholeLater) {
  sut.append({sample({real("X", 1, morning)})});
  EXPECT_ANY_THROW(sut.append({sample({real("X", 2, morning + 1s)}, morning + 1s),
                               fabric::ChannelStatus{.key = {.machine = std::string("\0", 1)}},
                               fabric::ProgramEvent{.key = {"press", 1}},
                               Put{.fields = {{"a", "1"}, {"a", "1"}}}}));
  sut.append({sample({real("X", 2, morning + 1s)}, morning + 1s)});
  EXPECT_THAT(found(), testing::SizeIs(2));
}

TEST_F(ArchivedSamples, StandBesideProgramEvents) {
  sut.append({fabric::ProgramEvent{.key = {"press", 1},
                                   .kind = fabric::ProgramEventKind::aborted,
                                   .at = morning + 90s,
                                   .started = morning,
                                   .program = "wei\xDF.nc",
                                   .error = 21462,
                                   .parts = 17,
                                   .mode = 2}});
  EXPECT_THAT(
      found({.kind = Kind::program}),
      ElementsAre(HasSubstr(
          R"("kind":"aborted","program":"weiß.nc","seconds":90,"error":21462,"parts":17,)")));
}

}  // namespace
}  // namespace millrace::services::archiver
