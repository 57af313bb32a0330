// Entries as line, JSON and CSV.
#include "tools/print/entry_text.hpp"

#include <boost/json/serialize.hpp>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::print {
namespace {

using recording::Entry;
using recording::tests::one_call;

TEST(EntryLine, ShowsARequest) {
  EXPECT_EQ(line_of(one_call(17, 0)[1]),
            "2026-03-01T07:00:00.001100Z  request     cnc/1  5f-17  #1 to "
            "11111111-1111-1111-1111-111111111111  560aacbf-6335-44a9-895a-8b27f3ed5e47 \"2\"  "
            "state 1");
}

TEST(EntryLine, ShowsTheSizeOfAWithheldText) {
  Entry entry = one_call(17, 0)[3];
  recording::withhold_text(entry);
  EXPECT_NE(line_of(entry).find("(8 bytes, not recorded)"), std::string::npos);
}

TEST(EntryLine, ShowsAnAlarmAndItsEnd) {
  Entry entry{.at = recording::tests::at(0),
              .sample = recording::AlarmNews{.alarm = {.key = {{}, "archive", "main"},
                                                       .text = "disk full",
                                                       .program = "archiver",
                                                       .host = "vm",
                                                       .pid = 17}}};
  EXPECT_EQ(line_of(entry),
            "2026-03-01T07:00:00.000000Z  alarm       problem  archive main  archiver on vm, pid "
            "17: disk full");
  std::get<recording::AlarmNews>(entry.sample).over = true;
  EXPECT_EQ(line_of(entry),
            "2026-03-01T07:00:00.000000Z  alarm       over  archive main  archiver on vm, pid 17: "
            "disk full");
  EXPECT_EQ(json_of(entry).at("kind"), "alarm");
  EXPECT_EQ(json_of(entry).at("alarm"), "archive");
  EXPECT_EQ(json_of(entry).at("text"), "disk full");
  EXPECT_EQ(json_of(entry).at("over"), true);
}

TEST(EntryLine, ShowsTheIdsOfCommandsAndInstances) {
  const std::string one = "01000000-0000-0000-0000-000000000000";
  const std::string two = "02000000-0000-0000-0000-000000000000";
  const auto tail = [](recording::Sample sample) {
    return line_of({.at = recording::tests::at(0), .sample = std::move(sample)})
        .substr(std::string("2026-03-01T07:00:00.000000Z  ").size());
  };
  EXPECT_EQ(tail(fabric::Command{.id = {{1}},
                                 .kind = fabric::CommandKind::answer,
                                 .key = {"cnc", 1},
                                 .text = "3",
                                 .state = 7,
                                 .issuer = "she@panel"}),
            "command     cnc/1  answer by she@panel  \"3\"  state 7  command " + one);
  EXPECT_EQ(tail(fabric::Command{
                .id = {{1}}, .kind = fabric::CommandKind::drain, .instance = {{2}}, .issuer = "x"}),
            "command     drain by x  to " + two + "  command " + one);
  EXPECT_EQ(tail(fabric::Outcome{.responder = {{2}}, .command = {{1}}, .done = true}),
            "outcome     done  by " + two + "  command " + one);
  EXPECT_EQ(tail(recording::Withdrawal{.key = {"cnc", 1}, .instance = {{2}}}),
            "withdrawal  cnc/1  from " + two);
  EXPECT_EQ(tail(fabric::Event{.key = {"cnc", 1},
                               .attempt = 2,
                               .kind = fabric::EventKind::dispatched,
                               .instance = {{2}}}),
            "event       cnc/1  #2 dispatched  instance " + two);
}

TEST(EntryJson, NamesEveryField) {
  EXPECT_EQ(boost::json::serialize(json_of(one_call(17, 0)[4])),
            R"({"time":"2026-03-01T07:00:00.005100Z","kind":"event","machine":"cnc","channel":1,)"
            R"("call":"5f-17","uuid":"560aacbf-6335-44a9-895a-8b27f3ed5e47","event":"replied",)"
            R"("attempt":1,"at":"2026-03-01T07:00:00.005100Z",)"
            R"("instance":"11111111-1111-1111-1111-111111111111","text":"","state":0,)"
            R"("detail":"","replayed":false})");
}

TEST(EntryJson, IsUtf8WhateverTheBytesWere) {
  Entry entry = one_call(17, 0)[1];
  std::get<fabric::Request>(entry.sample).text = "Ma\xDF \"\n";
  EXPECT_EQ(boost::json::serialize(json_of(entry).at("text")), R"("Maß \"\n")");
}

TEST(EntryCsv, HasTheSameColumnsInEveryRow) {
  const Csv sut;
  const auto columns = [](const std::string& row) {
    return std::count(row.begin(), row.end(), ',');
  };
  for (const Entry& entry : one_call(17, 0)) {
    EXPECT_EQ(columns(sut.row(entry)), columns(sut.header()));
    EXPECT_TRUE(sut.row(entry).ends_with("\r\n"));
  }
}

TEST(EntryCsv, QuotesWhatHoldsASeparator) {
  Entry entry = one_call(17, 0)[1];
  std::get<fabric::Request>(entry.sample).text = "1,2 \"x\"";
  EXPECT_NE(Csv().row(entry).find(",\"1,2 \"\"x\"\"\","), std::string::npos);
}

TEST(EntryCsv, HasTheColumnsOfTheSelectedKinds) {
  EXPECT_EQ(Csv({"outcome", "command"}).header(),
            "time,kind,uuid,command,what,machine,channel,call,text,text_size,state,instance,issuer,"
            "at,responder,done,detail\r\n");
}

}  // namespace
}  // namespace millrace::tools::print
