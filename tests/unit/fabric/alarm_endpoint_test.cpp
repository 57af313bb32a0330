#include "fabric/endpoints/alarm_endpoint.hpp"

#include <map>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

#include "fabric/wire/reader.hpp"
#include "tests/support/run_until.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

/// A publishing program `here`, a reading tool `there`.
class AnAlarmEndpoint : public testing::Test {
 protected:
  AnAlarmEndpoint() { begin(); }

  void begin() {
    sut.emplace(here, context.get_executor(),
                Alarm{.key = {.responder = id}, .program = "archiver", .host = "vm", .pid = 17});
  }
  /// The alarms that the tool knows after it has taken the samples.
  const std::map<AlarmKey, Alarm>& known() {
    for (const wire::Taken<Alarm>& taken : reader.take()) {
      if (taken.instance_state != wire::InstanceState::alive) {
        heard.erase(taken.value.key);
      } else if (taken.valid) {
        ++samples;
        heard.insert_or_assign(taken.value.key, taken.value);
      }
    }
    return heard;
  }
  bool until(const std::function<bool()>& done) { return tests::run_until(context, done); }

  static Alarm disk_full() {
    return {.key = {.kind = "archive", .subject = "main"},
            .level = AlarmLevel::warning,
            .text = "disk full",
            .advice = "make room"};
  }

  const InstanceId id = InstanceId::random();
  TwoProcesses processes;
  boost::asio::io_context context;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
  wire::Reader<Alarm> reader{there, "millrace", wire::Keep::last};
  std::map<AlarmKey, Alarm> heard;
  int samples = 0;
  std::optional<endpoints::AlarmEndpoint> sut;
};

TEST_F(AnAlarmEndpoint, PublishesAllFieldsOfAnAlarm) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  const Alarm& got = heard.begin()->second;
  EXPECT_EQ(got.key, (AlarmKey{id, "archive", "main"}));
  EXPECT_EQ(got.level, AlarmLevel::warning);
  EXPECT_EQ(got.text, "disk full");
  EXPECT_EQ(got.advice, "make room");
  EXPECT_EQ(got.program, "archiver");
  EXPECT_EQ(got.host, "vm");
  EXPECT_EQ(got.pid, 17U);
  EXPECT_NE(got.since, Time{});
}

TEST_F(AnAlarmEndpoint, PublishesToALateReader) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  wire::Reader<Alarm> late(there, "millrace", wire::Keep::last);
  EXPECT_TRUE(until([&] { return !late.take().empty(); }));
}

TEST_F(AnAlarmEndpoint, RetractsWhatIsOver) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  ASSERT_TRUE(sut->clear("archive", "main"));
  EXPECT_TRUE(until([&] { return known().empty(); }));
}

TEST_F(AnAlarmEndpoint, RetractsAllWhenItsProcessEnds) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  sut.reset();
  EXPECT_TRUE(until([&] { return known().empty(); }));
}

TEST_F(AnAlarmEndpoint, RepeatsActiveAlarms) {
  ASSERT_TRUE(sut->raise(disk_full()));
  EXPECT_TRUE(until([&] {
    known();
    return samples >= 3;
  }));
}

TEST_F(AnAlarmEndpoint, IsGoneWhenItsLoopHangsAndBackWhenItRunsAgain) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  // Its own loop stands still while the test waits.
  boost::asio::io_context other;
  EXPECT_TRUE(tests::run_until(
      other, [&] { return known().empty(); }, 2 * endpoints::AlarmEndpoint::lease));
  EXPECT_TRUE(until([&] { return !known().empty(); }));
}

TEST_F(AnAlarmEndpoint, OpensNoWriterBeforeTheFirstAlarm) {
  ASSERT_TRUE(sut->clear("archive", "main"));
  EXPECT_TRUE(reader.matched().empty());
  ASSERT_TRUE(sut->raise(disk_full()));
  EXPECT_TRUE(until([&] { return !reader.matched().empty(); }));
}

}  // namespace
}  // namespace millrace::fabric
