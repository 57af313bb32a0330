#include "fabric/alarm_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/observer/alarms.hpp"

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
  const Alarm& told = changes.to_publish.front();
  EXPECT_EQ(told.key, (AlarmKey{archiver.key.responder, "archive", ""}));
  EXPECT_EQ(told.program, "archiver");
  EXPECT_EQ(told.host, "press-pc");
  EXPECT_EQ(told.pid, 17U);
  EXPECT_EQ(told.since, noon);
  EXPECT_EQ(told.text, "disk full");
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
  EXPECT_THAT(sut.told(), SizeIs(1));
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
  EXPECT_THAT(sut.told(), SizeIs(AlarmTable::most));
  EXPECT_TRUE(sut.told().contains({archiver.key.responder, "archive", "99"}));
  const Alarm& rest = sut.told().at({archiver.key.responder, "more", ""});
  EXPECT_EQ(rest.text, "69 more alarms are not published one by one");
  EXPECT_EQ(rest.level, AlarmLevel::warning);
  for (int i = 0; i < 90; ++i) {
    sut.clear("archive", std::to_string(i));
  }
  static_cast<void>(sut.changes());
  EXPECT_THAT(sut.told(), SizeIs(10));
}

TEST(AnAlarmTable, ShortensTooLongTextsVisibly) {
  AlarmTable sut(archiver);
  Alarm wordy = disk_full();
  wordy.text.clear();
  for (int i = 0; i < 200; ++i) {
    wordy.text += "ü";
  }
  wordy.advice = std::string("a\0b", 3);
  sut.raise(wordy, noon);
  const Alarm told = sut.changes().to_publish.at(0);
  EXPECT_LE(told.text.size(), 255U);
  EXPECT_THAT(told.text, EndsWith("üü …"));
  EXPECT_EQ(told.advice, "a b");
}

TEST(AlarmOwners, KeepAlarmsOfSeveralWritersWithOneKey) {
  observer::AlarmOwners sut;
  EXPECT_EQ(sut.said(archiver.key, 1), archiver.key);
  EXPECT_FALSE(sut.is_shared(archiver.key));
  const AlarmKey beside = sut.said(archiver.key, 2);
  EXPECT_NE(beside, archiver.key);
  EXPECT_EQ(beside.kind, archiver.key.kind);
  EXPECT_TRUE(sut.is_shared(archiver.key));
  EXPECT_EQ(sut.said(archiver.key, 1), archiver.key);
  EXPECT_EQ(sut.said(archiver.key, 2), beside);
  EXPECT_EQ(sut.over(archiver.key, 2), beside);
  EXPECT_FALSE(sut.is_shared(archiver.key));
  EXPECT_EQ(sut.over(archiver.key, 1), archiver.key);
  EXPECT_EQ(sut.said(archiver.key, 2), archiver.key) << "no writer has it any more";
}

TEST(AlarmOwners, CountADisposedSampleAsAnAlarmOnlyWhileSeveralWritersHaveItsKey) {
  observer::AlarmOwners sut;
  sut.said(archiver.key, 1);
  const auto own = sut.take(archiver.key, 1, true, false);
  ASSERT_TRUE(own);
  EXPECT_TRUE(own->is_over);
  sut.said(archiver.key, 1);
  sut.said(archiver.key, 2);
  const auto shared = sut.take(archiver.key, 1, true, false);
  ASSERT_TRUE(shared);
  EXPECT_FALSE(shared->is_over);
  EXPECT_EQ(shared->key, archiver.key);
  EXPECT_FALSE(sut.take(archiver.key, 1, false, true)) << "it has no alarm";
}

TEST(AlarmOwners, EndOnlyTheAlarmOfAWriterThatIsGone) {
  observer::AlarmOwners sut;
  sut.said(archiver.key, 1);
  const AlarmKey beside = sut.said(archiver.key, 2);
  EXPECT_THAT(sut.gone({1, 2}), testing::IsEmpty());
  EXPECT_THAT(sut.gone({2}), testing::ElementsAre(archiver.key));
  EXPECT_EQ(sut.said(archiver.key, 2), beside);
  EXPECT_EQ(sut.said(archiver.key, 1), archiver.key) << "it has returned";
  EXPECT_THAT(sut.gone({1}), testing::ElementsAre(beside));
  EXPECT_THAT(sut.gone({}), testing::IsEmpty()) << "DDS reports the only one";
}

TEST(ALongText, IsCutBetweenCharactersAndNeverSilently) {
  EXPECT_EQ(shortened("abc", 3), "abc");
  EXPECT_EQ(shortened("abcdefgh", 7), "abc …");
  EXPECT_EQ(shortened("aüüüü", 8), "aü …");
}

}  // namespace
}  // namespace millrace::fabric
