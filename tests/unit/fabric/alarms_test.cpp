#include "fabric/observer/alarms.hpp"

#include <map>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/alarm_table.hpp"
#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/wire/reader.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

using std::chrono_literals::operator""s;
using testing::EndsWith;
using testing::IsEmpty;
using testing::SizeIs;

const Alarm archiver{
    .key = {.responder = {.bytes = {7}}}, .program = "archiver", .host = "press-pc", .pid = 17};
const Time noon{std::chrono::hours(12)};

Alarm disk_full(const std::string& subject = {}) {
  return {
      .key = {.kind = "archive", .subject = subject}, .text = "disk full", .advice = "make room"};
}

TEST(AnAlarmTable, PublishesANewAlarmOnceWithItsProcess) {
  AlarmTable sut(archiver);
  sut.raise(disk_full(), noon);
  const auto changes = sut.changes();
  ASSERT_THAT(changes.to_publish, SizeIs(1));
  const Alarm& published = changes.to_publish.front();
  EXPECT_EQ(published.key, (AlarmKey{archiver.key.responder, "archive", ""}));
  EXPECT_EQ(published.program, "archiver");
  EXPECT_EQ(published.host, "press-pc");
  EXPECT_EQ(published.pid, 17U);
  EXPECT_EQ(published.since, noon);
  EXPECT_EQ(published.text, "disk full");
  sut.raise(disk_full(), noon + 1s);
  EXPECT_THAT(sut.changes().to_publish, IsEmpty());
}

TEST(AnAlarmTable, KeepsTheBeginningOfAnAlarmWhenItsTextChanges) {
  AlarmTable sut(archiver);
  sut.raise(disk_full(), noon);
  static_cast<void>(sut.changes());
  Alarm worse = disk_full();
  worse.text = "disk gone";
  sut.raise(worse, noon + 60s);
  const auto changes = sut.changes();
  ASSERT_THAT(changes.to_publish, SizeIs(1));
  EXPECT_EQ(changes.to_publish.front().text, "disk gone");
  EXPECT_EQ(changes.to_publish.front().since, noon);
}

TEST(AnAlarmTable, RetractsOnlyWhatIsOver) {
  AlarmTable sut(archiver);
  sut.raise(disk_full("a"), noon);
  sut.raise(disk_full("b"), noon);
  static_cast<void>(sut.changes());
  sut.clear("archive", "a");
  sut.clear("archive", "never raised");
  const auto changes = sut.changes();
  EXPECT_THAT(changes.to_publish, IsEmpty());
  ASSERT_THAT(changes.to_dispose, SizeIs(1));
  EXPECT_EQ(changes.to_dispose.front().key.subject, "a");
  EXPECT_THAT(sut.published(), SizeIs(1));
}

TEST(AnAlarmTable, PublishesNothingThatEndedBeforeItsPublication) {
  AlarmTable sut(archiver);
  sut.raise(disk_full(), noon);
  sut.clear("archive");
  EXPECT_THAT(sut.changes().to_publish, IsEmpty());
  EXPECT_TRUE(sut.empty());
}

TEST(AnAlarmTable, PublishesTheWorstOfManyAndCountsTheRest) {
  AlarmTable sut(archiver);
  for (int i = 0; i < 100; ++i) {
    Alarm alarm = disk_full(std::to_string(i));
    alarm.level = i == 99 ? AlarmLevel::problem : AlarmLevel::warning;
    sut.raise(alarm, noon);
  }
  static_cast<void>(sut.changes());
  EXPECT_THAT(sut.published(), SizeIs(AlarmTable::most));
  EXPECT_TRUE(sut.published().contains({archiver.key.responder, "archive", "99"}));
  const Alarm& rest = sut.published().at({archiver.key.responder, "more", ""});
  EXPECT_EQ(rest.text, "69 more alarms are not published one by one");
  EXPECT_EQ(rest.level, AlarmLevel::warning);
  for (int i = 0; i < 90; ++i) {
    sut.clear("archive", std::to_string(i));
  }
  static_cast<void>(sut.changes());
  EXPECT_THAT(sut.published(), SizeIs(10));
}

// Texts and advice are shortened when they are sent (fabric/wire).
TEST(AnAlarmTable, ShortensTooLongNamesVisibly) {
  AlarmTable sut(archiver);
  Alarm wordy = disk_full();
  wordy.key.kind = std::string("a\0b", 3);
  for (int i = 0; i < 200; ++i) {
    wordy.key.subject += "ü";
  }
  sut.raise(wordy, noon);
  const Alarm published = sut.changes().to_publish.at(0);
  EXPECT_LE(published.key.subject.size(), 63U);
  EXPECT_THAT(published.key.subject, EndsWith("üü …"));
  EXPECT_EQ(published.key.kind, "a b");
}

TEST(AlarmOwners, KeepAlarmsOfSeveralWritersWithOneKey) {
  observer::AlarmOwners sut;
  EXPECT_EQ(sut.on_alarm(archiver.key, 1), archiver.key);
  EXPECT_FALSE(sut.is_shared(archiver.key));
  const AlarmKey beside = sut.on_alarm(archiver.key, 2);
  EXPECT_NE(beside, archiver.key);
  EXPECT_EQ(beside.kind, archiver.key.kind);
  EXPECT_TRUE(sut.is_shared(archiver.key));
  EXPECT_EQ(sut.on_alarm(archiver.key, 1), archiver.key);
  EXPECT_EQ(sut.on_alarm(archiver.key, 2), beside);
  EXPECT_EQ(sut.over(archiver.key, 2), beside);
  EXPECT_FALSE(sut.is_shared(archiver.key));
  EXPECT_EQ(sut.over(archiver.key, 1), archiver.key);
  EXPECT_EQ(sut.on_alarm(archiver.key, 2), archiver.key) << "no writer has it any more";
}

TEST(AlarmOwners, CountADisposedSampleAsAnAlarmOnlyWhileSeveralWritersHaveItsKey) {
  observer::AlarmOwners sut;
  sut.on_alarm(archiver.key, 1);
  const auto own = sut.take(archiver.key, 1, true, false);
  ASSERT_TRUE(own);
  EXPECT_TRUE(own->is_over);
  sut.on_alarm(archiver.key, 1);
  sut.on_alarm(archiver.key, 2);
  const auto shared = sut.take(archiver.key, 1, true, false);
  ASSERT_TRUE(shared);
  EXPECT_FALSE(shared->is_over);
  EXPECT_EQ(shared->key, archiver.key);
  EXPECT_FALSE(sut.take(archiver.key, 1, false, true)) << "it has no alarm";
}

TEST(AlarmOwners, EndOnlyTheAlarmOfAWriterThatIsGone) {
  observer::AlarmOwners sut;
  sut.on_alarm(archiver.key, 1);
  const AlarmKey beside = sut.on_alarm(archiver.key, 2);
  EXPECT_THAT(sut.gone({1, 2}), testing::IsEmpty());
  EXPECT_THAT(sut.gone({2}), testing::ElementsAre(archiver.key));
  EXPECT_EQ(sut.on_alarm(archiver.key, 2), beside);
  EXPECT_EQ(sut.on_alarm(archiver.key, 1), archiver.key) << "it has returned";
  EXPECT_THAT(sut.gone({1}), testing::ElementsAre(beside));
  EXPECT_THAT(sut.gone({}), testing::IsEmpty()) << "DDS reports the only one";
}

TEST(ALongText, IsCutBetweenCharactersAndNeverSilently) {
  EXPECT_EQ(shortened("abc", 3), "abc");
  EXPECT_EQ(shortened("abcdefgh", 7), "abc …");
  EXPECT_EQ(shortened("aüüüü", 8), "aü …");
}

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
        alarms.erase(taken.value.key);
      } else if (taken.valid) {
        ++samples;
        alarms.insert_or_assign(taken.value.key, taken.value);
      }
    }
    return alarms;
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
  std::map<AlarmKey, Alarm> alarms;
  int samples = 0;
  std::optional<endpoints::AlarmEndpoint> sut;
};

TEST_F(AnAlarmEndpoint, PublishesAllFieldsOfAnAlarm) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  const Alarm& got = alarms.begin()->second;
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

TEST_F(AnAlarmEndpoint, TakesNothingBackThatItLeaves) {
  ASSERT_TRUE(sut->raise(disk_full()));
  ASSERT_TRUE(until([&] { return !known().empty(); }));
  sut->leave_alarms();
  sut.reset();
  std::optional<wire::InstanceState> end;
  ASSERT_TRUE(until([&] {
    for (const wire::Taken<Alarm>& taken : reader.take()) {
      if (taken.instance_state != wire::InstanceState::alive) {
        end = taken.instance_state;
      }
    }
    return end.has_value();
  }));
  EXPECT_EQ(end, wire::InstanceState::no_writers) << "a disposed alarm is over";
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
