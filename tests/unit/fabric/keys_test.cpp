#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/dds/made_id.hpp"
#include "fabric/key_owners.hpp"
#include "fabric/reply_keys.hpp"
#include "fabric/wire/key_limit.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric::wire {
namespace {

TEST(KeyLimit, LimitsTheKeysOfEachWriterAndNamesTheOneThatHasMore) {
  KeyLimit sut(2);
  EXPECT_TRUE(sut.admits(1, 11));
  EXPECT_TRUE(sut.admits(1, 12));
  EXPECT_EQ(sut.take_flooding(), std::nullopt);
  EXPECT_FALSE(sut.admits(1, 13));
  EXPECT_TRUE(sut.admits(1, 12));
  EXPECT_TRUE(sut.admits(2, 13)) << "another writer has its own room";
  EXPECT_EQ(sut.take_flooding(), 1U);
  EXPECT_EQ(sut.take_flooding(), std::nullopt);
}

// A regression: only the last one was named.
TEST(KeyLimit, NamesEachWriterThatHasMore) {
  KeyLimit sut(1);
  for (const dds_instance_handle_t writer : {1U, 2U}) {
    EXPECT_TRUE(sut.admits(writer, 11));
    EXPECT_FALSE(sut.admits(writer, 12));
  }
  EXPECT_EQ(sut.take_flooding(), 1U);
  EXPECT_EQ(sut.take_flooding(), 2U);
  EXPECT_EQ(sut.take_flooding(), std::nullopt);
}

TEST(KeyLimit, ForgetsTheMostSilentOfTooManyWriters) {
  KeyLimit sut(1);
  for (dds_instance_handle_t writer = 1; writer <= KeyLimit::most_writers + 1; ++writer) {
    EXPECT_TRUE(sut.admits(writer, 7));
  }
  EXPECT_FALSE(sut.admits(2, 8));
  EXPECT_TRUE(sut.admits(1, 8));
}

TEST(KeyLimit, HasRoomAgainForAKeyThatNoWriterHasAnyMore) {
  KeyLimit sut(1);
  EXPECT_TRUE(sut.admits(1, 11));
  EXPECT_TRUE(sut.admits(2, 11));
  sut.forget(11, sut.admitted());
  EXPECT_TRUE(sut.admits(1, 12));
  EXPECT_TRUE(sut.admits(2, 12));
}

// Its writer has written it again, before the reader took the loss of all its writers.
TEST(KeyLimit, ForgetsNoKeyOfWhichASampleHasComeSince) {
  KeyLimit sut(1);
  EXPECT_TRUE(sut.admits(1, 11));
  const auto before = sut.admitted();
  EXPECT_TRUE(sut.admits(1, 11));
  sut.forget(11, before);
  EXPECT_FALSE(sut.admits(1, 12));
}

/// A reader, and a writer of more and more keys in another process.
class AReader : public testing::Test {
 protected:
  void match() {
    boost::asio::io_context context;
    ASSERT_TRUE(tests::run_until(context, [&] { return !stranger.matched().empty(); }));
  }
  /// Each `key` gives a different one.
  static Reply reply(std::size_t key) {
    return {.key = {.machine = "cnc", .channel = 1}, .call = {.epoch = key, .number = 1}};
  }
  /// The samples that have arrived when `done`.
  template <typename Done>
  void take_until(const Done& done) {
    boost::asio::io_context context;
    ASSERT_TRUE(tests::run_until(context, [&] {
      for (const Taken<Reply>& taken : sut.take()) {
        samples += taken.valid ? 1 : 0;
      }
      flood = flood ? flood : sut.take_flooding();
      return done();
    })) << samples;
  }

  [[nodiscard]] std::string name_of_there() const {
    dds_guid_t guid{};
    EXPECT_EQ(dds_get_guid(there.handle(), &guid), DDS_RETCODE_OK);
    return dds::guid_prefix(guid);
  }

  static constexpr std::size_t most = 8'192;
  TwoProcesses processes;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
  Reader<Reply> sut{here, "millrace/*", Keep::all};
  Writer<Reply> stranger{there, "millrace/weather"};
  std::size_t samples = 0;
  std::optional<std::string> flood;
};

TEST_F(AReader, AcceptsNoMoreKeysOfAWriterThanItsTopicAllowsAndNamesTheWriter) {
  match();
  for (std::size_t key = 1; key <= most + 64; ++key) {
    ASSERT_TRUE(stranger.write(reply(key)));
  }
  take_until([&] { return samples >= most && flood; });
  EXPECT_EQ(samples, most);
  ASSERT_TRUE(flood.has_value());
  EXPECT_THAT(*flood,
              testing::MatchesRegex("participant [0-9a-f:]+ writes more than 8192 DDS instances "
                                    "on millrace/v5/reply: further ones are dropped"));
}

TEST_F(AReader, KnowsTheMakerOfAnIdFromItsGuid) {
  match();
  boost::asio::io_context context;
  ASSERT_TRUE(tests::run_until(context, [&] { return !sut.matched().empty(); }));
  const dds_instance_handle_t writer = sut.matched().front();
  const InstanceId id = dds::make_id(there);
  EXPECT_TRUE(sut.made_id(writer, id));
  EXPECT_FALSE(sut.made_id(writer, InstanceId::random()));
  EXPECT_NE(id, dds::make_id(there));
}

// A regression: its line in the log had no name.
TEST_F(AReader, NamesAWriterThatHasLeft) {
  match();
  {
    Writer<Reply> leaving(there, "millrace/weather");
    boost::asio::io_context context;
    ASSERT_TRUE(tests::run_until(context, [&] { return !leaving.matched().empty(); }));
    for (std::size_t key = 1; key <= most + 64; ++key) {
      ASSERT_TRUE(leaving.write(reply(key)));
    }
  }
  boost::asio::io_context context;
  ASSERT_TRUE(tests::run_until(context, [&] { return sut.matched().size() == 1; }));
  flood = sut.take_flooding();
  ASSERT_TRUE(flood.has_value());
  EXPECT_THAT(*flood, testing::StartsWith("participant " + name_of_there() + " writes more than"));
}

// An instance that answers for months has answered more and more callers.
TEST_F(AReader, AcceptsAWriterWithoutEndThatUnregistersItsOldKeys) {
  match();
  for (std::size_t key = 1; key <= most + 1'024; ++key) {
    ASSERT_TRUE(stranger.write(reply(key)));
    stranger.unregister(reply(key));
    if (key % 64 == 0) {
      ASSERT_NO_FATAL_FAILURE(take_until([&] { return samples >= key; }));
    }
  }
  EXPECT_EQ(flood, std::nullopt);
}

// Cyclone keeps such a key without asking the reader.
TEST_F(AReader, NamesAWriterThatDisposesEverNewKeys) {
  match();
  for (std::size_t key = 1; key <= most + 64; ++key) {
    stranger.withdraw(reply(key));
  }
  take_until([&] { return flood.has_value(); });
}

}  // namespace
}  // namespace millrace::fabric::wire

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Sut = KeyOwners<int, int>;

constexpr auto first_come = [](int, const Sut::Sample&) { return 0; };
/// The value itself is the rank.
constexpr auto lowest = [](int, const Sut::Sample& sample) { return sample.value; };

TEST(KeyOwners, AreTheFirstWriters) {
  Sut sut;
  EXPECT_TRUE(sut.update(1, 10, 5, first_come));
  EXPECT_FALSE(sut.update(1, 11, 6, first_come));
  EXPECT_TRUE(sut.update(1, 10, 7, first_come));
  EXPECT_TRUE(sut.update(2, 11, 8, first_come));
  EXPECT_EQ(sut.find(1)->value, 7);
  EXPECT_EQ(sut.find(3), nullptr);
}

TEST(KeyOwners, AreThoseThatRankFirst) {
  Sut sut;
  EXPECT_TRUE(sut.update(1, 10, 5, lowest));
  EXPECT_FALSE(sut.update(1, 11, 5, lowest));
  EXPECT_TRUE(sut.update(1, 11, 4, lowest));
  EXPECT_EQ(sut.find(1)->writer, 11U);
}

TEST(KeyOwners, AreOthersOnceTheRanksHaveChanged) {
  Sut sut;
  sut.update(1, 10, 5, lowest);
  sut.update(1, 11, 6, lowest);
  sut.update(2, 10, 5, lowest);
  EXPECT_THAT(sut.rank_again(lowest), IsEmpty());
  EXPECT_THAT(sut.rank_again([](int, const Sut::Sample& sample) { return -sample.value; }),
              ElementsAre(1));
  EXPECT_EQ(sut.find(1)->writer, 11U);
}

TEST(KeyOwners, AreForgottenWhenTheyAreGone) {
  Sut sut;
  sut.update(1, 10, 5, first_come);
  sut.update(1, 11, 6, first_come);
  sut.update(2, 11, 7, first_come);
  sut.update(2, 10, 8, first_come);
  sut.update(3, 10, 9, first_come);
  EXPECT_THAT(sut.forget([](auto writer) { return writer == 10; }), ElementsAre(1, 3));
  EXPECT_EQ(sut.find(1)->value, 6);
  EXPECT_EQ(sut.find(2)->value, 7);
  EXPECT_EQ(sut.find(3), nullptr);
}

TEST(KeyOwners, AreNotKeptOutByManyOthers) {
  Sut sut;
  for (Sut::Handle writer = 1; writer <= 2 * Sut::most_writers; ++writer) {
    sut.update(1, writer, 9, lowest);
  }
  EXPECT_TRUE(sut.update(1, 99, 1, lowest));
}

RequestKey reply_key(std::uint64_t epoch) {
  return {.key = {"cnc", 1}, .epoch = epoch, .instance = {}};
}

TEST(ReplyKeys, AdmitExpectedRepliesHoweverManyOthersThereAre) {
  ReplyKeys sut;
  for (std::uint64_t i = 0; i < ReplyKeys::most_others; ++i) {
    EXPECT_TRUE(sut.admits(reply_key(1000 + i)));
  }
  EXPECT_EQ(sut.dropped(), 0U);
  EXPECT_FALSE(sut.admits(reply_key(7)));
  sut.ask(reply_key(7));
  EXPECT_TRUE(sut.admits(reply_key(7)));
  EXPECT_TRUE(sut.admits(reply_key(1000))) << "a known key needs no room of its own";
  EXPECT_FALSE(sut.admits(reply_key(8)));
  EXPECT_EQ(sut.dropped(), 2U);
}

}  // namespace
}  // namespace millrace::fabric
