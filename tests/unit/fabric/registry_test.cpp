#include "fabric/registry/registry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using namespace std::chrono_literals;

constexpr registry::EndpointHandle reader = 1;
constexpr registry::EndpointHandle reply_writer = 2;
constexpr registry::EndpointHandle process = 10;
constexpr registry::EndpointHandle other_participant = 11;
constexpr registry::EndpointHandle beats = 5;
constexpr SteadyTime start{std::chrono::hours(1)};

class RegistryTest : public testing::Test {
 protected:
  void see_both() {
    sut.reader_seen(reader, {identity, process}, start);
    sut.writer_seen(reply_writer, {identity.id, process});
  }
  void match(bool is = true) {
    sut.matched(reader, is);
    sut.matched(reply_writer, is);
  }
  /// Ready, and beating from `start` on.
  void beating() {
    identity.lease = 500ms;
    see_both();
    match();
    sut.beat_writer_seen(beats, process);
    sut.changes();
  }

  InstanceIdentity identity{.id = InstanceId::random(), .uuid = "weather"};
  registry::Registry sut;
};

TEST_F(RegistryTest, WaitsForBothEndpointsToBeSeenAndMatched) {
  sut.reader_seen(reader, {identity, process}, start);
  sut.matched(reader, true);
  EXPECT_THAT(sut.changes().ready, IsEmpty());
  sut.writer_seen(reply_writer, {identity.id, process});
  EXPECT_THAT(sut.changes().ready, IsEmpty());
  sut.matched(reply_writer, true);
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
}

TEST_F(RegistryTest, KnowsAMatchThatIsThereBeforeTheEndpointIsSeen) {
  match();
  see_both();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
}

TEST_F(RegistryTest, TellsEachChangeOnce) {
  see_both();
  match();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  const registry::Registry::Changes again = sut.changes();
  EXPECT_THAT(again.ready, IsEmpty());
  EXPECT_THAT(again.changed, IsEmpty());
  EXPECT_THAT(again.gone, IsEmpty());
}

TEST_F(RegistryTest, TellsThatAnIdentityChanged) {
  see_both();
  match();
  sut.changes();
  identity.draining = true;
  sut.reader_seen(reader, {identity, process}, start);
  EXPECT_THAT(sut.changes().changed, ElementsAre(identity));
}

TEST_F(RegistryTest, TellsAChangeOfAnIdentityOnce) {
  see_both();
  match();
  sut.changes();
  identity.draining = true;
  sut.reader_seen(reader, {identity, process}, start);
  sut.changes();
  match();
  EXPECT_THAT(sut.changes().changed, IsEmpty());
}

TEST_F(RegistryTest, KeepsAnInstanceReadyOfWhoseReplyWritersOneIsGone) {
  constexpr registry::EndpointHandle second = 3;
  see_both();
  sut.writer_seen(second, {identity.id, process});
  match();
  sut.changes();
  sut.endpoint_gone(second);
  EXPECT_THAT(sut.changes().gone, IsEmpty());
  sut.endpoint_gone(reply_writer);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(RegistryTest, TellsThatAnInstanceIsGoneWithEitherEndpoint) {
  for (const registry::EndpointHandle lost : {reader, reply_writer}) {
    see_both();
    match();
    sut.changes();
    sut.endpoint_gone(lost);
    EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  }
}

TEST_F(RegistryTest, TellsThatAnInstanceIsGoneWhenItsMatchEnds) {
  see_both();
  match();
  sut.changes();
  match(false);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  match();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
}

TEST_F(RegistryTest, TakesWhoeverIsSeenForReadyIfAsked) {
  sut.match_all();
  see_both();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  sut.endpoint_gone(reply_writer);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(RegistryTest, DoesNotPairEndpointsOfTwoProcesses) {
  sut.reader_seen(reader, {identity, process}, start);
  sut.writer_seen(reply_writer, {identity.id, other_participant});
  match();
  EXPECT_THAT(sut.changes().ready, IsEmpty());
}

TEST_F(RegistryTest, TakesTheWordOfAnInstanceFromItsOwnWriterOnly) {
  see_both();
  sut.writer_seen(3, {InstanceId::random(), process});
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
  EXPECT_FALSE(sut.speaks_for(3, identity.id)) << "another instance's writer";
  EXPECT_FALSE(sut.speaks_for(4, identity.id)) << "a reply_writer that says nothing of itself";
}

TEST_F(RegistryTest, TakesNoWordFromAWriterThatOnlyCallsItselfTheInstances) {
  see_both();
  sut.writer_seen(3, {identity.id, other_participant});
  EXPECT_FALSE(sut.speaks_for(3, identity.id));
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(RegistryTest, TakesTheWordOfAWriterWhoseReaderIsNotSeenYet) {
  sut.writer_seen(reply_writer, {identity.id, process});
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(RegistryTest, TakesTheLastWordsOfAnInstanceThatLeft) {
  see_both();
  sut.endpoint_gone(reader);
  sut.endpoint_gone(reply_writer);
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
  for (registry::EndpointHandle other = 1'000; other < 2'000; ++other) {
    sut.writer_seen(other, {InstanceId::random(), process});
    sut.endpoint_gone(other);
  }
  EXPECT_FALSE(sut.speaks_for(reply_writer, identity.id)) << "not for ever";
}

TEST_F(RegistryTest, TakesAProcessThatIsSilentForGoneAndForReadyWhenItIsHeardAgain) {
  beating();
  for (int beat = 1; beat <= 5; ++beat) {
    EXPECT_TRUE(sut.beat(beats, start + beat * 100ms));
    sut.on_time(start + beat * 100ms);
  }
  EXPECT_THAT(sut.changes().gone, IsEmpty());
  while (sut.next_time() && *sut.next_time() < start + 900ms) {
    sut.on_time(*sut.next_time());
  }
  EXPECT_THAT(sut.changes().gone, IsEmpty()) << "not before four fifths of its lease";
  ASSERT_EQ(sut.next_time(), start + 900ms);
  sut.on_time(start + 900ms);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  EXPECT_EQ(sut.next_time(), std::nullopt);
  sut.beat(beats, start + 2s);
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  EXPECT_EQ(sut.next_time(), start + 2400ms);
}

TEST_F(RegistryTest, LooksForSilenceWhenTheFirstOfSeveralProcessesMayBeSilent) {
  for (const auto& [often, seldom] :
       {std::pair(process, other_participant), std::pair(other_participant, process)}) {
    registry::Registry several;
    const InstanceIdentity one{.id = InstanceId::random(), .uuid = "weather", .lease = 500ms};
    const InstanceIdentity other{.id = InstanceId::random(), .uuid = "weather", .lease = 10s};
    several.reader_seen(reader, {one, often}, start);
    several.reader_seen(reader + 1, {other, seldom}, start);
    several.beat_writer_seen(beats, often);
    several.beat(beats, start + 200ms);
    several.on_time(start + 400ms);
    EXPECT_EQ(several.next_time(), start + 600ms);
  }
}

TEST_F(RegistryTest, ExpectsABeatOnlyOfWhoPromisesIt) {
  see_both();
  match();
  sut.changes();
  EXPECT_EQ(sut.next_time(), std::nullopt);
  sut.on_time(start + 1h);
  EXPECT_THAT(sut.changes().gone, IsEmpty());
}

TEST_F(RegistryTest, ForgivesSilenceInWhichNobodyListened) {
  beating();
  sut.stood_still(5s);
  sut.on_time(start + 5s + 300ms);
  EXPECT_THAT(sut.changes().gone, IsEmpty());
  sut.on_time(start + 5s + 400ms);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(RegistryTest, GivesEverybodyAWholeIntervalAfterAStandstill) {
  beating();
  sut.start_over(start + 5s);
  sut.on_time(start + 5s + 399ms);
  EXPECT_THAT(sut.changes().gone, IsEmpty());
  sut.on_time(start + 5s + 400ms);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(RegistryTest, TakesABeatForItsOwnProcessOnly) {
  beating();
  constexpr registry::EndpointHandle strange = 6;
  sut.beat_writer_seen(strange, other_participant);
  EXPECT_FALSE(sut.beat(strange, start + 300ms)) << "it has no instances";
  EXPECT_FALSE(sut.beat(7, start + 300ms)) << "nobody has seen it";
  EXPECT_FALSE(sut.beats_for(strange, identity.id));
  EXPECT_TRUE(sut.beats_for(beats, identity.id));
  sut.on_time(start + 400ms);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(RegistryTest, SaysOfWhomThereIsNothingLeft) {
  see_both();
  EXPECT_THAT(sut.take_vanished(), IsEmpty());
  sut.endpoint_gone(reply_writer);
  EXPECT_THAT(sut.take_vanished(), IsEmpty());
  sut.endpoint_gone(reader);
  EXPECT_THAT(sut.take_vanished(), ElementsAre(identity.id));
  EXPECT_FALSE(sut.is_seen(identity.id));
}

// Whoever announced an instance's id after it could say that it drains, or answer its calls.
TEST_F(RegistryTest, TakesTheWordOfTheProcessThatAnnouncedAnInstanceFirst) {
  using Seen = registry::Registry::Seen;
  see_both();
  match();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  constexpr registry::EndpointHandle false_reader = 0;
  constexpr registry::EndpointHandle false_writer = 8;
  InstanceIdentity forged = identity;
  forged.draining = true;
  EXPECT_EQ(sut.reader_seen(false_reader, {forged, other_participant}, start), Seen::second);
  sut.writer_seen(false_writer, {identity.id, other_participant});
  sut.matched(false_reader, true);
  sut.matched(false_writer, true);
  const auto changes = sut.changes();
  EXPECT_THAT(changes.changed, IsEmpty());
  EXPECT_THAT(changes.gone, IsEmpty());
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
  EXPECT_FALSE(sut.speaks_for(false_writer, identity.id));
  // What the first one says of itself anew does not put it behind the other.
  InstanceIdentity renamed = identity;
  renamed.name = "renamed";
  EXPECT_EQ(sut.reader_seen(reader, {renamed, process}, start), Seen::taken);
  EXPECT_THAT(sut.changes().changed, ElementsAre(renamed));
  sut.endpoint_gone(reader);
  EXPECT_THAT(sut.changes().changed, ElementsAre(forged)) << "it is there alone now";
}

TEST_F(RegistryTest, HasRoomForSoManyEndpointsAndNoMore) {
  using Seen = registry::Registry::Seen;
  constexpr registry::EndpointHandle first = 100;
  std::size_t readers = 0;
  std::size_t writers = 0;
  for (std::size_t i = 0; i < registry::Registry::most_endpoints + 10; ++i) {
    InstanceIdentity one{.id = InstanceId::random(), .uuid = "weather"};
    readers += sut.reader_seen(first + 2 * i, {one, process}, start) == Seen::taken ? 1U : 0U;
    writers += sut.writer_seen(first + 2 * i + 1, {one.id, process}) == Seen::taken ? 1U : 0U;
  }
  EXPECT_EQ(readers, registry::Registry::most_endpoints);
  EXPECT_EQ(writers, registry::Registry::most_endpoints);
  sut.endpoint_gone(first);
  EXPECT_EQ(sut.reader_seen(reader, {identity, process}, start), Seen::taken);
}

TEST_F(RegistryTest, AskedForNamesTakesNobodyWhoHasProvedNothing) {
  sut.ask_for_names();
  see_both();
  match();
  EXPECT_THAT(sut.changes().ready, IsEmpty());
  EXPECT_FALSE(sut.speaks_for(reply_writer, identity.id));
  sut.named(process, "square-root");
  const auto ready = sut.changes().ready;
  ASSERT_EQ(ready.size(), 1U);
  EXPECT_EQ(ready.front().certificate, "square-root");
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(RegistryTest, KnowsANameThatIsProvedBeforeTheInstanceIsSeen) {
  sut.ask_for_names();
  sut.named(process, "square-root");
  see_both();
  match();
  EXPECT_EQ(sut.changes().ready.size(), 1U);
}

TEST_F(RegistryTest, TakesWhoIsRevokedForGoneAndDropsHisWord) {
  sut.ask_for_names();
  sut.named(process, "square-root");
  see_both();
  match();
  sut.changes();
  sut.named(process, std::nullopt);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  EXPECT_FALSE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(RegistryTest, HearsTheLastWordsOfWhoHasLeft) {
  sut.ask_for_names();
  sut.named(process, "square-root");
  see_both();
  match();
  sut.changes();
  sut.name_gone(process);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(RegistryTest, SaysOnceThatSomebodyHasProvedNothing) {
  sut.ask_for_names();
  see_both();
  match();
  EXPECT_THAT(sut.take_unproven(), IsEmpty());
  ASSERT_EQ(sut.next_time(), start + registry::Registry::proof_time);
  sut.on_time(start + registry::Registry::proof_time);
  EXPECT_THAT(sut.take_unproven(), ElementsAre(std::pair(identity.id, identity.uuid)));
  sut.on_time(start + 2 * registry::Registry::proof_time);
  EXPECT_THAT(sut.take_unproven(), IsEmpty());
  // A foreign program may show its badge last.
  sut.named(process, "square-root");
  EXPECT_EQ(sut.changes().ready.size(), 1U);
}

TEST_F(RegistryTest, SaysThatSomebodyHasProvedNothingHoweverMuchHeAnnounces) {
  sut.ask_for_names();
  see_both();
  const InstanceIdentity more{.id = InstanceId::random(), .uuid = "weather"};
  sut.reader_seen(3, {more, process}, start + registry::Registry::proof_time / 2);
  sut.on_time(start + registry::Registry::proof_time);
  EXPECT_EQ(sut.take_unproven().size(), 2U);
}

TEST_F(RegistryTest, SaysOnceThatSomebodyWhoBeatsHasProvedNothing) {
  constexpr SteadyTime late = start + registry::Registry::proof_time;
  identity.lease = 500ms;
  sut.ask_for_names();
  see_both();
  sut.beat_writer_seen(beats, process);
  sut.beat(beats, late);
  sut.on_time(late);
  EXPECT_EQ(sut.take_unproven().size(), 1U);
  sut.on_time(late + 400ms);
  EXPECT_THAT(sut.take_unproven(), IsEmpty());
}

TEST_F(RegistryTest, IsNotKeptFromTheRightOneByWhoHasProvedNothing) {
  sut.ask_for_names();
  constexpr registry::EndpointHandle squatter = 7;
  sut.reader_seen(squatter, {identity, other_participant}, start);
  sut.matched(squatter, true);
  sut.named(process, "square-root");
  see_both();
  match();
  EXPECT_EQ(sut.changes().ready.size(), 1U);
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

}  // namespace
}  // namespace millrace::fabric
