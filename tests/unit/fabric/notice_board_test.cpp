#include "fabric/notice_board.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/observer/notices.hpp"

namespace millrace::fabric {
namespace {

using std::chrono_literals::operator""s;
using testing::EndsWith;
using testing::IsEmpty;
using testing::SizeIs;

const Notice archiver{
    .key = {.responder = {.bytes = {7}}}, .program = "archiver", .host = "press-pc", .pid = 17};
const Time noon{std::chrono::hours(12)};

Notice disk_full(const std::string& subject = {}) {
  return {
      .key = {.kind = "archive", .subject = subject}, .text = "disk full", .advice = "make room"};
}

TEST(ANoticeBoard, TellsANewNoticeOnceAndWhoSaysIt) {
  NoticeBoard sut(archiver);
  sut.raise(disk_full(), noon);
  const auto changes = sut.changes();
  ASSERT_THAT(changes.to_tell, SizeIs(1));
  const Notice& told = changes.to_tell.front();
  EXPECT_EQ(told.key, (NoticeKey{archiver.key.responder, "archive", ""}));
  EXPECT_EQ(told.program, "archiver");
  EXPECT_EQ(told.host, "press-pc");
  EXPECT_EQ(told.pid, 17U);
  EXPECT_EQ(told.since, noon);
  EXPECT_EQ(told.text, "disk full");
  sut.raise(disk_full(), noon + 1s);
  EXPECT_THAT(sut.changes().to_tell, IsEmpty());
}

TEST(ANoticeBoard, KeepsSinceWhenItIsSoWhateverItSaysNow) {
  NoticeBoard sut(archiver);
  sut.raise(disk_full(), noon);
  static_cast<void>(sut.changes());
  Notice worse = disk_full();
  worse.text = "disk gone";
  sut.raise(worse, noon + 60s);
  const auto changes = sut.changes();
  ASSERT_THAT(changes.to_tell, SizeIs(1));
  EXPECT_EQ(changes.to_tell.front().text, "disk gone");
  EXPECT_EQ(changes.to_tell.front().since, noon);
}

TEST(ANoticeBoard, TakesBackWhatIsOverAndOnlyThat) {
  NoticeBoard sut(archiver);
  sut.raise(disk_full("a"), noon);
  sut.raise(disk_full("b"), noon);
  static_cast<void>(sut.changes());
  sut.clear("archive", "a");
  sut.clear("archive", "never raised");
  const auto changes = sut.changes();
  EXPECT_THAT(changes.to_tell, IsEmpty());
  ASSERT_THAT(changes.to_take_back, SizeIs(1));
  EXPECT_EQ(changes.to_take_back.front().key.subject, "a");
  EXPECT_THAT(sut.told(), SizeIs(1));
}

TEST(ANoticeBoard, SaysNothingOfWhatWasOverBeforeItWasTold) {
  NoticeBoard sut(archiver);
  sut.raise(disk_full(), noon);
  sut.clear("archive");
  EXPECT_THAT(sut.changes().to_tell, IsEmpty());
  EXPECT_TRUE(sut.empty());
}

TEST(ANoticeBoard, TellsTheWorstOfManyAndCountsTheRest) {
  NoticeBoard sut(archiver);
  for (int i = 0; i < 100; ++i) {
    Notice notice = disk_full(std::to_string(i));
    notice.level = i == 99 ? NoticeLevel::problem : NoticeLevel::warning;
    sut.raise(notice, noon);
  }
  static_cast<void>(sut.changes());
  EXPECT_THAT(sut.told(), SizeIs(NoticeBoard::most));
  EXPECT_TRUE(sut.told().contains({archiver.key.responder, "archive", "99"}));
  const Notice& rest = sut.told().at({archiver.key.responder, "more", ""});
  EXPECT_EQ(rest.text, "69 more, not told one by one");
  EXPECT_EQ(rest.level, NoticeLevel::warning);
  for (int i = 0; i < 90; ++i) {
    sut.clear("archive", std::to_string(i));
  }
  static_cast<void>(sut.changes());
  EXPECT_THAT(sut.told(), SizeIs(10));
}

TEST(ANoticeBoard, ShortensWhatDoesNotFitWhereEverybodySeesIt) {
  NoticeBoard sut(archiver);
  Notice wordy = disk_full();
  wordy.text.clear();
  for (int i = 0; i < 200; ++i) {
    wordy.text += "ü";
  }
  wordy.advice = std::string("a\0b", 3);
  sut.raise(wordy, noon);
  const Notice told = sut.changes().to_tell.at(0);
  EXPECT_LE(told.text.size(), 255U);
  EXPECT_THAT(told.text, EndsWith("üü …"));
  EXPECT_EQ(told.advice, "a b");
}

TEST(NoticeOwners, KeepWhatAnotherWriterSaysUnderTheSameKeyBesideIt) {
  observer::NoticeOwners sut;
  EXPECT_EQ(sut.said(archiver.key, 1), archiver.key);
  EXPECT_FALSE(sut.is_shared(archiver.key));
  const NoticeKey beside = sut.said(archiver.key, 2);
  EXPECT_NE(beside, archiver.key);
  EXPECT_EQ(beside.kind, archiver.key.kind);
  EXPECT_TRUE(sut.is_shared(archiver.key));
  EXPECT_EQ(sut.said(archiver.key, 1), archiver.key);
  EXPECT_EQ(sut.said(archiver.key, 2), beside);
  EXPECT_EQ(sut.over(archiver.key, 2), beside);
  EXPECT_FALSE(sut.is_shared(archiver.key));
  EXPECT_EQ(sut.over(archiver.key, 1), archiver.key);
  EXPECT_EQ(sut.said(archiver.key, 2), archiver.key) << "nobody says it any more";
}

TEST(NoticeOwners, TakeADisposedSampleForANoticeOnlyWhileSeveralWritersHaveItsKey) {
  observer::NoticeOwners sut;
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
  EXPECT_FALSE(sut.take(archiver.key, 1, false, true)) << "it says nothing";
}

TEST(NoticeOwners, GiveNoNoticeToTheOneBesideWhenItsWriterIsGone) {
  observer::NoticeOwners sut;
  sut.said(archiver.key, 1);
  const NoticeKey beside = sut.said(archiver.key, 2);
  EXPECT_THAT(sut.gone({1, 2}), testing::IsEmpty());
  EXPECT_THAT(sut.gone({2}), testing::ElementsAre(archiver.key));
  EXPECT_EQ(sut.said(archiver.key, 2), beside);
  EXPECT_EQ(sut.said(archiver.key, 1), archiver.key) << "it is there again";
  EXPECT_THAT(sut.gone({1}), testing::ElementsAre(beside));
  EXPECT_THAT(sut.gone({}), testing::IsEmpty()) << "DDS says so of the only one";
}

TEST(ALongText, IsCutBetweenCharactersAndNeverInSilence) {
  EXPECT_EQ(shortened("abc", 3), "abc");
  EXPECT_EQ(shortened("abcdefgh", 7), "abc …");
  EXPECT_EQ(shortened("aüüüü", 8), "aü …");
}

}  // namespace
}  // namespace millrace::fabric
