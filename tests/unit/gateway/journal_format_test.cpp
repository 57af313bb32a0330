#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "fabric/words.hpp"
#include "gateway/journal/format.hpp"
#include "gateway/journal/journal_state.hpp"

namespace millrace::gateway::journal {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr fabric::CallId first{0x5f3a9c0112d4, 1};
constexpr fabric::CallId second{0x5f3a9c0112d4, 2};

fabric::InstanceId instance(std::uint8_t number) {
  fabric::InstanceId id;
  id.bytes.fill(number);
  return id;
}

DispatchedEntry dispatched(fabric::CallId call, std::uint16_t channel, std::uint32_t attempt = 1) {
  return {call,
          {"cnc", channel},
          {"560AACBF", std::string("\xe4\x00z", 3), 0xFFFFFFFF},
          fabric::Time(std::chrono::nanoseconds(1'700'000'000'123'456'789)),
          fabric::Delivery::at_most_once,
          attempt,
          instance(static_cast<std::uint8_t>(attempt)),
          fabric::CompletionSignal::response};
}

std::vector<JournalEntry> one_of_each() {
  return {NumbersEntry{first.epoch, 1000},
          dispatched(first, 1),
          InterimEntry{first, 5},
          AnsweredEntry{first, {instance(1), 1, "1.414", 1}},
          ClearingEntry{first},
          EndedEntry{first},
          MessageEntry{{"press.alarms", 2},
                       1'000'000'000'000,
                       3,
                       std::string("\xe4\x00z", 3),
                       fabric::Time(std::chrono::nanoseconds(1'700'000'000'123'456'789))},
          MessageEndedEntry{{"press.alarms", 2}, 1'000'000'000'000},
          LastGetEntry{{"press.alarms", 2}, 3, 1'000'000'000'000},
          BlockedEntry{.key = {"cnc", 1},
                       .state = fabric::ChannelState::held,
                       .call = first,
                       .uuid = "560AACBF",
                       .since = fabric::Time(std::chrono::nanoseconds(1'700'000'000'123'456'789)),
                       .reason = base::messages::instance_lost("sq1 (pid 7 on hall)")},
          BlockedEntry{.key = {"cnc", 2}}};
}

std::string file_of(const std::vector<JournalEntry>& entries) {
  std::string file(magic);
  for (const JournalEntry& entry : entries) {
    file += encode(entry);
  }
  return file;
}

TEST(JournalFormat, ReadsEveryEntryBack) {
  const Contents sut = decode(file_of(one_of_each()));
  EXPECT_EQ(sut.entries, one_of_each());
  EXPECT_EQ(sut.damage, "");
}

TEST(JournalFormat, ReadsAReasonBackWithTheSentencesInIt) {
  const BlockedEntry entry{
      .key = {"cnc", 1},
      .state = fabric::ChannelState::held,
      .reason = base::messages::held_too_long(base::messages::instance_lost_held("sq1"))};
  EXPECT_EQ(std::get<BlockedEntry>(decode(file_of({entry})).entries.at(0)), entry);
}

TEST(JournalFormat, AcceptsAnEmptyFileAsANewJournal) {
  const Contents sut = decode("");
  EXPECT_THAT(sut.entries, IsEmpty());
  EXPECT_EQ(sut.damage, "");
}

TEST(JournalFormat, KeepsAllWholeRecordsOfAFileTornAtAnyByte) {
  const std::vector<JournalEntry> entries = one_of_each();
  const std::string whole = file_of(entries);
  std::size_t expected = 0;
  std::size_t next_end = magic.size() + encode(entries[0]).size();
  for (std::size_t length = magic.size(); length <= whole.size(); ++length) {
    if (length == next_end) {
      ++expected;
      next_end += expected < entries.size() ? encode(entries[expected]).size() : 1;
    }
    const Contents sut = decode(std::string_view(whole).substr(0, length));
    ASSERT_EQ(sut.entries.size(), expected) << length;
    ASSERT_LE(sut.good, length);
    ASSERT_EQ(sut.damage.empty(), sut.good == length) << length;
  }
  EXPECT_EQ(expected, entries.size());
}

TEST(JournalFormat, StopsAtARecordWithAnyBitChanged) {
  const std::string whole = file_of(one_of_each());
  for (std::size_t i = magic.size(); i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    const Contents sut = decode(damaged);
    ASSERT_LT(sut.entries.size(), one_of_each().size()) << i;
    ASSERT_NE(sut.damage, "") << i;
    ASSERT_LE(sut.good, i);
  }
}

TEST(JournalFormat, StopsAtZeros) {
  const Contents sut = decode(file_of(one_of_each()) + std::string(4096, '\0'));
  EXPECT_EQ(sut.entries.size(), one_of_each().size());
  EXPECT_EQ(sut.damage, "a record has the impossible length of 0 bytes");
}

TEST(JournalFormat, RefusesAFileThatIsNoJournal) {
  const Contents sut = decode("# notes of a colleague");
  EXPECT_EQ(sut.good, 0U);
  EXPECT_EQ(sut.damage, "it does not begin like a journal of this version");
}

class JournalStateTest : public testing::Test {
 protected:
  void apply(std::initializer_list<JournalEntry> entries) {
    for (const JournalEntry& entry : entries) {
      sut.apply(entry);
    }
  }
  JournalState sut;
};

TEST_F(JournalStateTest, OpensACallWithItsFirstAttemptAndClosesItAtItsEnd) {
  apply({dispatched(first, 1), dispatched(first, 1, 2)});
  ASSERT_EQ(sut.open_calls().size(), 1U);
  EXPECT_EQ(sut.open_calls().front().attempts.size(), 2U);
  apply({EndedEntry{first}});
  EXPECT_THAT(sut.open_calls(), IsEmpty());
}

TEST_F(JournalStateTest, RemembersHowFarAnAnswerIs) {
  apply({dispatched(first, 1), InterimEntry{first, 5},
         AnsweredEntry{first, {instance(1), 1, "1.414", 1}}, ClearingEntry{first}});
  const CallRecord call = sut.open_calls().front();
  EXPECT_THAT(call.shown, ElementsAre(5U));
  EXPECT_EQ(call.answer->text, "1.414");
  EXPECT_TRUE(call.clearing);
}

TEST_F(JournalStateTest, KeepsTheTwoNewestInterimStates) {
  apply({dispatched(first, 1), InterimEntry{first, 5}, InterimEntry{first, 6},
         InterimEntry{first, 7}});
  EXPECT_THAT(sut.open_calls().front().shown, ElementsAre(6U, 7U));
}

TEST_F(JournalStateTest, KeepsOneCallOfAChannelAtATime) {
  apply({dispatched(first, 1), dispatched(second, 1)});
  ASSERT_EQ(sut.open_calls().size(), 1U);
  EXPECT_EQ(sut.open_calls().front().id, second);
}

TEST_F(JournalStateTest, IgnoresWhatBelongsToNoOpenCall) {
  apply({ClearingEntry{first}, EndedEntry{first}, InterimEntry{first, 1}});
  EXPECT_THAT(sut.open_calls(), IsEmpty());
}

TEST_F(JournalStateTest, IsTheSameAfterItsSnapshot) {
  apply({NumbersEntry{first.epoch, 2000}, dispatched(first, 1), dispatched(first, 1, 2),
         InterimEntry{first, 5}, AnsweredEntry{first, {instance(2), 2, "1.414", 1}},
         ClearingEntry{first}, dispatched(second, 2)});
  JournalState again;
  for (const JournalEntry& entry : sut.snapshot()) {
    again.apply(entry);
  }
  EXPECT_EQ(again.open_calls(), sut.open_calls());
  EXPECT_EQ(again.numbers(), sut.numbers());
}

}  // namespace
}  // namespace millrace::gateway::journal
