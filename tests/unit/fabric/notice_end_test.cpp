#include "fabric/ends/notice_end.hpp"

#include <map>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

#include "fabric/wire/reader.hpp"
#include "tests/support/run_until.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

/// A program here, a tool there.
class ANoticeEnd : public testing::Test {
 protected:
  ANoticeEnd() { begin(); }

  void begin() {
    sut.emplace(here, context.get_executor(),
                Notice{.key = {.responder = id}, .program = "archiver", .host = "vm", .pid = 17});
  }
  /// What a tool knows after it has taken what came.
  const std::map<NoticeKey, Notice>& known() {
    for (const wire::Taken<Notice>& taken : reader.take()) {
      if (taken.presence != wire::Presence::alive) {
        heard.erase(taken.value.key);
      } else if (taken.valid) {
        ++samples;
        heard.insert_or_assign(taken.value.key, taken.value);
      }
    }
    return heard;
  }
  bool until(const std::function<bool()>& done) { return tests::run_until(context, done); }

  static Notice disk_full() {
    return {.key = {.kind = "archive", .subject = "main"},
            .level = NoticeLevel::warning,
            .text = "disk full",
            .advice = "make room"};
  }

  const InstanceId id = InstanceId::random();
  TwoProcesses processes;
  boost::asio::io_context context;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
  wire::Reader<Notice> reader{there, "millrace", wire::Keep::last};
  std::map<NoticeKey, Notice> heard;
  int samples = 0;
  std::optional<ends::NoticeEnd> sut;
};

TEST_F(ANoticeEnd, TellsAllThatANoticeSays) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  const Notice& got = heard.begin()->second;
  EXPECT_EQ(got.key, (NoticeKey{id, "archive", "main"}));
  EXPECT_EQ(got.level, NoticeLevel::warning);
  EXPECT_EQ(got.text, "disk full");
  EXPECT_EQ(got.advice, "make room");
  EXPECT_EQ(got.program, "archiver");
  EXPECT_EQ(got.host, "vm");
  EXPECT_EQ(got.pid, 17U);
  EXPECT_NE(got.since, Time{});
}

TEST_F(ANoticeEnd, TellsAToolThatComesLate) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  wire::Reader<Notice> late(there, "millrace", wire::Keep::last);
  EXPECT_TRUE(until([&] { return !late.take().empty(); }));
}

TEST_F(ANoticeEnd, TakesBackWhatIsOver) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  ASSERT_TRUE(sut->clear("archive", "main"));
  EXPECT_TRUE(until([&] { return known().empty(); }));
}

TEST_F(ANoticeEnd, TakesBackAllWhenItsProgramEnds) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  sut.reset();
  EXPECT_TRUE(until([&] { return known().empty(); }));
}

TEST_F(ANoticeEnd, SaysAgainWhatStillHolds) {
  ASSERT_TRUE(sut->raise(disk_full()));
  EXPECT_TRUE(until([&] {
    known();
    return samples >= 3;
  }));
}

TEST_F(ANoticeEnd, IsGoneWhenItsLoopHangsAndBackWhenItTurnsAgain) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  // Its own loop stands still meanwhile.
  boost::asio::io_context other;
  EXPECT_TRUE(tests::run_until(
      other, [&] { return known().empty(); }, 2 * ends::NoticeEnd::lease));
  EXPECT_TRUE(until([&] { return !known().empty(); }));
}

TEST_F(ANoticeEnd, OpensNoWriterBeforeThereIsSomethingToSay) {
  ASSERT_TRUE(sut->clear("archive", "main"));
  EXPECT_TRUE(reader.matched().empty());
  ASSERT_TRUE(sut->raise(disk_full()));
  EXPECT_TRUE(until([&] { return !reader.matched().empty(); }));
}

}  // namespace
}  // namespace millrace::fabric
