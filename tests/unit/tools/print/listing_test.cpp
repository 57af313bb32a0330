#include "tools/print/listing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::print {
namespace {

using recording::tests::at;
using testing::HasSubstr;
using testing::Not;
using namespace std::chrono_literals;
using Kind = Format::Kind;

struct Channel {
  std::string name;
  fabric::Time since;
  std::optional<std::chrono::nanoseconds> mean;
  std::string why;
};

Cell mean_of(const Channel& row) {
  return row.mean ? Cell(*row.mean) : Cell();
}

const Listing<Channel>& sut() {
  static const Listing<Channel> listing{
      {"CHANNEL", "channel", [](const Channel& row) -> Cell { return row.name; }},
      {"SINCE", "since", [](const Channel& row) -> Cell { return row.since; }, Align::right, 2},
      {"MEAN", "mean_ms", &mean_of, Align::right, 3},
      {"SIZE", "", [](const Channel&) -> Cell { return std::int64_t{7}; }, Align::right, only_wide},
      {"WHY", "reason", [](const Channel& row) -> Cell { return row.why; }}};
  return listing;
}

const std::vector<Channel> rows{{"mill/1", at(0), 10ms, "the service, which is busy, has ended"},
                                {"lathe/2", {}, {}, ""}};
const fabric::Time now = at(0) + 117s;

TEST(AListing, ShowsATimeAsTheTimeSinceThenAndWhatIsUnknownAsADash) {
  EXPECT_EQ(sut().text(rows, {}, now),
            "CHANNEL  SINCE     MEAN  WHY\n"
            "mill/1   1m57s  10.0 ms  the service, which is busy, has ended\n"
            "lathe/2      -        -  -\n");
}

TEST(AListing, LeavesOutTheLeastImportantColumnsWhereTheTerminalIsNarrow) {
  EXPECT_EQ(sut().text(rows, {.width = 56}, now),
            "CHANNEL  SINCE  WHY\n"
            "mill/1   1m57s  the service, which is busy, has ended\n"
            "lathe/2      -  -\n");
}

TEST(AListing, CutsTheWidestTextWhereNoMoreColumnsMayGo) {
  EXPECT_EQ(sut().text(rows, {.width = 30}, now),
            "CHANNEL  WHY\n"
            "mill/1   the service, which i…\n"
            "lathe/2  -\n");
}

TEST(AListing, CutsAllTextsThatAreTooWide) {
  const Channel row{"the_press_of_hall_3/1", {}, {}, "the only instance is busy"};
  EXPECT_EQ(sut().text({row}, {.width = 30}, now),
            "CHANNEL         WHY\n"
            "the_press_of_…  the only inst…\n");
}

TEST(AListing, LeavesOutAColumnThatIsUnknownInEachRow) {
  EXPECT_THAT(sut().text({rows[1]}, {}, now), Not(HasSubstr("MEAN")));
  EXPECT_THAT(sut().text({rows[1]}, {.wide = true}, now), HasSubstr("MEAN"));
}

TEST(AListing, ShowsEveryColumnIfWide) {
  EXPECT_THAT(sut().text(rows, {.width = 30, .wide = true}, now),
              testing::StartsWith("CHANNEL  SINCE     MEAN  SIZE  WHY\n"));
}

TEST(AListing, ShowsTheChosenColumnsInTheirOrder) {
  EXPECT_EQ(sut().text(rows, {.width = 10, .columns = {"size", "Channel"}}, now),
            "SIZE  CHANNEL\n"
            "   7  mill/1\n"
            "   7  lathe/2\n");
  EXPECT_EQ(find_column(sut().headings(), "nothing", Kind::terminal), sut().headings().size());
  EXPECT_EQ(find_column(sut().headings(), "size", Kind::csv), sut().headings().size());
  EXPECT_EQ(column_names(sut().headings(), Kind::terminal), "channel, since, mean, size, why");
  EXPECT_EQ(column_names(sut().headings(), Kind::json), "channel, since, mean_ms, reason");
}

}  // namespace
}  // namespace millrace::tools::print
