#include "tools/web/plant/call_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/text/ascii.hpp"
#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::web::plant {
namespace {

using recording::Entry;
using recording::tests::one_call;
using recording::tests::square_root;
using testing::IsEmpty;
using testing::SizeIs;

void add(CallStore& store, const std::vector<Entry>& entries) {
  for (const Entry& entry : entries) {
    store.add(entry);
  }
}

std::vector<Entry> failed_call(std::uint64_t number) {
  std::vector<Entry> entries = one_call(number, static_cast<double>(number));
  std::get<fabric::Reply>(entries[3].sample).code = fabric::ServiceCode::failed;
  return entries;
}

std::vector<std::uint64_t> numbers(const std::vector<const EndedCall*>& calls) {
  std::vector<std::uint64_t> numbers;
  for (const EndedCall* call : calls) {
    numbers.push_back(call->call.id.number);
  }
  return numbers;
}

TEST(ACallStore, HasTheTimelineOfACallThatEndedAndOfOneThatDidNot) {
  CallStore sut;
  add(sut, one_call(17, 0));
  EXPECT_THAT(sut.timeline({0x5f, 17}).steps, SizeIs(7));
  std::vector<Entry> begun = one_call(18, 10);
  begun.resize(3);
  add(sut, begun);
  EXPECT_THAT(sut.timeline({0x5f, 18}).steps, SizeIs(2));
  EXPECT_THAT(sut.timeline({0x5f, 19}).steps, IsEmpty());
}

TEST(ACallStore, FindsATextInRequestOrResponseInAnyCase) {
  CallStore sut;
  std::vector<Entry> entries = one_call(1, 0);
  std::get<fabric::Event>(entries[0].sample).text = "M\xe4\xdf T12";
  add(sut, entries);
  add(sut, one_call(2, 20));
  EXPECT_THAT(numbers(sut.list({.text = "mäß t12"}, 10)), testing::ElementsAre(1));
  EXPECT_THAT(numbers(sut.list({.text = "1.414"}, 10)), testing::ElementsAre(2, 1));
  EXPECT_THAT(sut.list({.text = "t13"}, 10), IsEmpty());
  EXPECT_EQ(base::text::small_letters("T12 mÄ"), "t12 mÄ");
}

TEST(ACallStore, ListsTheNewestFirstAndOnlyTheSelected) {
  CallStore sut;
  add(sut, one_call(1, 0));
  add(sut, failed_call(2));
  add(sut, one_call(3, 20));
  EXPECT_THAT(numbers(sut.list({}, 10)), testing::ElementsAre(3, 2, 1));
  EXPECT_THAT(numbers(sut.list({}, 2)), testing::ElementsAre(3, 2));
  EXPECT_THAT(numbers(sut.list({.failed = true}, 10)), testing::ElementsAre(2));
  EXPECT_THAT(numbers(sut.list({.machine = "cnc", .channel = 1, .uuid = square_root}, 10)),
              SizeIs(3));
  EXPECT_THAT(sut.list({.machine = "lathe"}, 10), IsEmpty());
  EXPECT_THAT(sut.list({.channel = 2}, 10), IsEmpty());
  EXPECT_THAT(numbers(sut.list({.result = "failed"}, 10)), testing::ElementsAre(2));
  EXPECT_THAT(numbers(sut.list({.result = "answered"}, 10)), testing::ElementsAre(3, 1));
}

TEST(ACallStore, KeepsFailedOnesLongerThanOthers) {
  CallStore sut({.ended = 2, .failed = 2});
  for (std::uint64_t i = 1; i <= 3; ++i) {
    add(sut, failed_call(i));
  }
  for (std::uint64_t i = 4; i <= 8; ++i) {
    add(sut, one_call(i, static_cast<double>(i)));
  }
  EXPECT_THAT(numbers(sut.list({}, 10)), testing::ElementsAre(8, 7, 3, 2));
  EXPECT_THAT(sut.timeline({0x5f, 1}).steps, IsEmpty());
  EXPECT_THAT(sut.timeline({0x5f, 4}).steps, IsEmpty());
  EXPECT_THAT(sut.timeline({0x5f, 2}).steps, SizeIs(7));
  EXPECT_EQ(sut.oldest()->call.id.number, 2U);
}

TEST(ACallStore, KeepsNoMoreCallsThatNeverEndThanItHasRoomFor) {
  CallStore sut({.open = 3});
  for (std::uint64_t i = 1; i <= 100; ++i) {
    std::vector<Entry> begun = one_call(i, static_cast<double>(i));
    begun.resize(3);
    add(sut, begun);
  }
  EXPECT_THAT(sut.timeline({0x5f, 97}).steps, IsEmpty());
  EXPECT_THAT(sut.timeline({0x5f, 98}).steps, SizeIs(2));
}

TEST(ACallStore, RecordsAFailureThatComesAfterTheEnd) {
  CallStore sut;
  std::vector<Entry> entries = failed_call(1);
  const Entry reply = entries[3];
  entries.erase(entries.begin() + 3);
  add(sut, entries);
  EXPECT_THAT(sut.list({.failed = true}, 10), IsEmpty());
  sut.add(reply);
  EXPECT_THAT(sut.list({.failed = true}, 10), SizeIs(1));
}

std::vector<Entry> call_with_state(std::uint64_t number, std::uint32_t state) {
  std::vector<Entry> entries = one_call(number, static_cast<double>(number));
  std::get<fabric::Reply>(entries[3].sample).state = state;
  std::get<fabric::Event>(entries[5].sample).state = state;
  return entries;
}

TEST(ACallStore, DistinguishesAnAnswerWithAnotherStateFromANormalOneAndAFailure) {
  CallStore sut({}, {.more = {{square_root, {2}}}});
  add(sut, one_call(1, 0));
  add(sut, call_with_state(2, 2));
  add(sut, call_with_state(3, 99));
  add(sut, failed_call(4));
  EXPECT_THAT(numbers(sut.list({.other_state = true}, 10)), testing::ElementsAre(3));
  EXPECT_THAT(numbers(sut.list({.failed = true}, 10)), testing::ElementsAre(4));
  EXPECT_THAT(numbers(sut.list({.failed = true, .other_state = true}, 10)),
              testing::ElementsAre(4, 3));
  EXPECT_EQ(sut.ended({0x5f, 1})->result(), "answered");
  EXPECT_EQ(sut.ended({0x5f, 2})->result(), "answered");
  EXPECT_EQ(sut.ended({0x5f, 3})->result(), "other_state");
  EXPECT_EQ(sut.ended({0x5f, 4})->result(), "failed");
}

TEST(ACallStore, CountsACallAsAnsweredAfterASecondAttempt) {
  CallStore sut;
  std::vector<Entry> entries = one_call(1, 0);
  Entry lost = entries[2];
  std::get<fabric::Event>(lost.sample).kind = fabric::EventKind::lost;
  for (std::size_t i = 3; i < 6; ++i) {
    if (auto* event = std::get_if<fabric::Event>(&entries[i].sample)) {
      event->attempt = 2;
    } else {
      std::get<fabric::Reply>(entries[i].sample).attempt = 2;
    }
  }
  entries.insert(entries.begin() + 3, lost);
  add(sut, entries);
  EXPECT_EQ(sut.ended({0x5f, 1})->result(), "answered");
  EXPECT_EQ(sut.ended({0x5f, 1})->call.attempt(), 2U);
}

TEST(ACallStore, CountsWhatNoServiceAnsweredAsFailed) {
  CallStore sut;
  std::vector<Entry> withdrawn = one_call(1, 0);
  withdrawn.resize(3);
  Entry end = withdrawn[2];
  std::get<fabric::Event>(end.sample).kind = fabric::EventKind::withdrawn;
  withdrawn.push_back(end);
  add(sut, withdrawn);
  EXPECT_THAT(sut.list({.failed = true}, 10), SizeIs(1));
}

}  // namespace
}  // namespace millrace::tools::web::plant
