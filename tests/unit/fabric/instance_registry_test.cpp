#include "fabric/registry/instance_registry.hpp"

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
constexpr registry::EndpointHandle heartbeats = 5;
constexpr SteadyTime start{std::chrono::hours(1)};

class InstanceRegistryTest : public testing::Test {
 protected:
  void discover_both() {
    sut.reader_seen(reader, {identity, process}, start);
    sut.writer_seen(reply_writer, {identity.id, process, identity.uuid});
  }
  void match(bool is = true) {
    sut.matched(reader, is);
    sut.matched(reply_writer, is);
  }
  /// Ready, with heartbeats from `start` on.
  void with_heartbeats() {
    identity.lease = 500ms;
    discover_both();
    match();
    sut.heartbeat_writer_seen(heartbeats, process);
    sut.changes();
  }

  InstanceIdentity identity{.id = InstanceId::random(), .uuid = "weather"};
  registry::InstanceRegistry sut;
};

TEST_F(InstanceRegistryTest, WaitsForBothEndpointsToBeSeenAndMatched) {
  sut.reader_seen(reader, {identity, process}, start);
  sut.matched(reader, true);
  EXPECT_THAT(sut.changes().ready, IsEmpty());
  sut.writer_seen(reply_writer, {identity.id, process, identity.uuid});
  EXPECT_THAT(sut.changes().ready, IsEmpty());
  sut.matched(reply_writer, true);
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
}

TEST_F(InstanceRegistryTest, AcceptsAMatchThatComesBeforeTheEndpoint) {
  match();
  discover_both();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
}

TEST_F(InstanceRegistryTest, ReportsEachChangeOnce) {
  discover_both();
  match();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  const registry::InstanceRegistry::Changes again = sut.changes();
  EXPECT_THAT(again.ready, IsEmpty());
  EXPECT_THAT(again.changed, IsEmpty());
  EXPECT_THAT(again.gone, IsEmpty());
}

TEST_F(InstanceRegistryTest, ReportsAChangedIdentity) {
  discover_both();
  match();
  sut.changes();
  identity.draining = true;
  sut.reader_seen(reader, {identity, process}, start);
  EXPECT_THAT(sut.changes().changed, ElementsAre(identity));
}

TEST_F(InstanceRegistryTest, ReportsAChangedIdentityOnce) {
  discover_both();
  match();
  sut.changes();
  identity.draining = true;
  sut.reader_seen(reader, {identity, process}, start);
  sut.changes();
  match();
  EXPECT_THAT(sut.changes().changed, IsEmpty());
}

TEST_F(InstanceRegistryTest, KeepsAnInstanceReadyOfWhoseReplyWritersOneIsGone) {
  constexpr registry::EndpointHandle second = 3;
  discover_both();
  sut.writer_seen(second, {identity.id, process, identity.uuid});
  match();
  sut.changes();
  sut.endpoint_gone(second);
  EXPECT_THAT(sut.changes().gone, IsEmpty());
  sut.endpoint_gone(reply_writer);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(InstanceRegistryTest, ReportsThatAnInstanceIsGoneWithEitherEndpoint) {
  for (const registry::EndpointHandle lost : {reader, reply_writer}) {
    discover_both();
    match();
    sut.changes();
    sut.endpoint_gone(lost);
    const auto changes = sut.changes();
    EXPECT_THAT(changes.gone, ElementsAre(identity.id));
    EXPECT_THAT(changes.silent, IsEmpty());
  }
}

TEST_F(InstanceRegistryTest, TellsASilentInstanceFromOneThatIsGone) {
  with_heartbeats();
  sut.on_time(start + 1h);
  const auto silent = sut.changes();
  EXPECT_THAT(silent.gone, ElementsAre(identity.id));
  EXPECT_THAT(silent.silent, ElementsAre(identity.id));
  EXPECT_THAT(silent.left, IsEmpty());
  sut.endpoint_gone(reader);
  const auto left = sut.changes();
  EXPECT_THAT(left.gone, IsEmpty());
  EXPECT_THAT(left.left, ElementsAre(identity.id));
  sut.endpoint_gone(reply_writer);
  EXPECT_THAT(sut.changes().left, IsEmpty());
}

TEST_F(InstanceRegistryTest, ReportsThatAnInstanceIsGoneWhenItsMatchEnds) {
  discover_both();
  match();
  sut.changes();
  match(false);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  match();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
}

TEST_F(InstanceRegistryTest, CountsEachDiscoveredInstanceAsReadyIfConfigured) {
  sut.match_all();
  discover_both();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  sut.endpoint_gone(reply_writer);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(InstanceRegistryTest, DoesNotPairEndpointsOfTwoProcesses) {
  sut.reader_seen(reader, {identity, process}, start);
  sut.writer_seen(reply_writer, {identity.id, other_participant, identity.uuid});
  match();
  EXPECT_THAT(sut.changes().ready, IsEmpty());
}

TEST_F(InstanceRegistryTest, AcceptsSamplesOfAnInstanceFromItsOwnWriterOnly) {
  discover_both();
  sut.writer_seen(3, {InstanceId::random(), process});
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
  EXPECT_FALSE(sut.speaks_for(3, identity.id)) << "another instance's writer";
  EXPECT_FALSE(sut.speaks_for(4, identity.id)) << "a reply writer without an identity";
}

TEST_F(InstanceRegistryTest, AcceptsNoSampleFromAWriterThatPretendsToBeTheInstances) {
  discover_both();
  match();
  sut.writer_seen(3, {identity.id, other_participant, identity.uuid});
  EXPECT_FALSE(sut.speaks_for(3, identity.id));
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(InstanceRegistryTest, AcceptsSamplesOfAWriterWhoseReaderIsNotDiscoveredYet) {
  sut.writer_seen(reply_writer, {identity.id, process, identity.uuid});
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(InstanceRegistryTest, AcceptsTheLastSamplesOfAnInstanceThatLeft) {
  discover_both();
  sut.endpoint_gone(reader);
  sut.endpoint_gone(reply_writer);
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
  for (registry::EndpointHandle other = 1'000; other < 2'000; ++other) {
    sut.writer_seen(other, {InstanceId::random(), process});
    sut.endpoint_gone(other);
  }
  EXPECT_FALSE(sut.speaks_for(reply_writer, identity.id)) << "not for ever";
}

TEST_F(InstanceRegistryTest, CountsASilentProcessAsGoneAndAsReadyAtItsNextHeartbeat) {
  with_heartbeats();
  for (int heartbeat = 1; heartbeat <= 5; ++heartbeat) {
    EXPECT_TRUE(sut.heartbeat(heartbeats, start + heartbeat * 100ms));
    sut.on_time(start + heartbeat * 100ms);
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
  sut.heartbeat(heartbeats, start + 2s);
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  EXPECT_EQ(sut.next_time(), start + 2400ms);
}

class ABusyProcess : public InstanceRegistryTest {
 protected:
  ABusyProcess() {
    identity.busy_lease = 500ms;
    identity.lease = 1500ms;
    discover_both();
    match();
    sut.heartbeat_writer_seen(heartbeats, process);
    sut.changes();
  }
  /// When it counts as gone, if nothing else happens.
  SteadyTime::duration gone_after() {
    for (;;) {
      const SteadyTime next = sut.next_time().value();
      sut.on_time(next);
      if (!sut.changes().gone.empty()) {
        return next - start;
      }
    }
  }
};

TEST_F(ABusyProcess, IsGoneAfterItsBusyLeaseAndAnIdleOneLater) {
  sut.heartbeat(heartbeats, start + 1s, true);
  EXPECT_EQ(gone_after(), 1400ms);
  sut.heartbeat(heartbeats, start + 2s, false);
  ASSERT_THAT(sut.changes().ready, ElementsAre(identity));
  EXPECT_EQ(gone_after(), 3200ms);
}

TEST_F(ABusyProcess, StaysBusyWhereAHeartbeatListsNoInstances) {
  sut.heartbeat(heartbeats, start + 1s, true);
  sut.heartbeat(heartbeats, start + 1100ms);
  EXPECT_EQ(gone_after(), 1500ms);
}

TEST_F(ABusyProcess, MustSendAHeartbeatSoonAfterARequest) {
  sut.heartbeat(heartbeats, start + 1s, false);
  sut.requested(identity.id, start + 1300ms);
  sut.requested(identity.id, start + 1600ms);
  EXPECT_EQ(gone_after(), 1700ms) << "the first request counts";
}

TEST_F(ABusyProcess, MayMissTheRequestAndSendTheHeartbeatOfAnIdleOne) {
  sut.heartbeat(heartbeats, start + 1s, false);
  sut.requested(identity.id, start + 1010ms);
  sut.on_time(start + 1410ms);
  sut.heartbeat(heartbeats, start + 1410ms, false);
  EXPECT_EQ(gone_after(), 2610ms);
}

TEST_F(ABusyProcess, HasItsTimeAfterARequestAgainAfterAStandstill) {
  sut.heartbeat(heartbeats, start, false);
  sut.requested(identity.id, start + 300ms);
  sut.stood_still(1s);
  sut.start_over(start + 1500ms);
  EXPECT_EQ(gone_after(), 1925ms);
}

TEST_F(InstanceRegistryTest, ChecksForSilenceWhenTheFirstOfSeveralProcessesMayBeSilent) {
  for (const auto& [often, seldom] :
       {std::pair(process, other_participant), std::pair(other_participant, process)}) {
    registry::InstanceRegistry several;
    const InstanceIdentity frequent{.id = InstanceId::random(), .uuid = "weather", .lease = 500ms};
    const InstanceIdentity other{.id = InstanceId::random(), .uuid = "weather", .lease = 10s};
    several.reader_seen(reader, {frequent, often}, start);
    several.reader_seen(reader + 1, {other, seldom}, start);
    several.heartbeat_writer_seen(heartbeats, often);
    several.heartbeat(heartbeats, start + 200ms);
    several.on_time(start + 400ms);
    EXPECT_EQ(several.next_time(), start + 600ms);
  }
}

TEST_F(InstanceRegistryTest, ExpectsNoHeartbeatFromAnInstanceWithoutALease) {
  discover_both();
  match();
  sut.changes();
  EXPECT_EQ(sut.next_time(), std::nullopt);
  sut.on_time(start + 1h);
  EXPECT_THAT(sut.changes().gone, IsEmpty());
}

TEST_F(InstanceRegistryTest, IgnoresSilenceDuringAStandstill) {
  with_heartbeats();
  sut.stood_still(5s);
  sut.on_time(start + 5s + 300ms);
  EXPECT_THAT(sut.changes().gone, IsEmpty());
  sut.on_time(start + 5s + 400ms);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(InstanceRegistryTest, GivesEachProcessAWholeIntervalAfterAStandstill) {
  with_heartbeats();
  sut.start_over(start + 5s);
  sut.on_time(start + 5s + 399ms);
  EXPECT_THAT(sut.changes().gone, IsEmpty());
  sut.on_time(start + 5s + 400ms);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(InstanceRegistryTest, CountsAHeartbeatForItsOwnProcessOnly) {
  with_heartbeats();
  constexpr registry::EndpointHandle strange = 6;
  sut.heartbeat_writer_seen(strange, other_participant);
  EXPECT_FALSE(sut.heartbeat(strange, start + 300ms)) << "it has no instances";
  EXPECT_FALSE(sut.heartbeat(7, start + 300ms)) << "it was never seen";
  EXPECT_FALSE(sut.heartbeats_for(strange, identity.id));
  EXPECT_TRUE(sut.heartbeats_for(heartbeats, identity.id));
  sut.on_time(start + 400ms);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(InstanceRegistryTest, NamesTheInstancesThatNeedAWriterOfRequestsOnceTheyAreProved) {
  const auto home = [&](std::optional<std::string> uuid) {
    return ElementsAre(std::pair(identity.id, std::move(uuid)));
  };
  discover_both();
  EXPECT_THAT(sut.touched_homes(), home(std::nullopt));
  sut.matched(reply_writer, true);
  EXPECT_THAT(sut.touched_homes(), home(identity.uuid));
  sut.changes();
  EXPECT_THAT(sut.touched_homes(), IsEmpty());
  sut.endpoint_gone(reply_writer);
  EXPECT_THAT(sut.touched_homes(), home(identity.uuid)) << "its last requests may be withdrawn";
  sut.endpoint_gone(reader);
  EXPECT_THAT(sut.touched_homes(), home(std::nullopt));
  EXPECT_FALSE(sut.has_home(identity.id));
}

/// DDS matches none of its endpoints, since its certificate does not allow them.
class AnUnprovedAnnouncement : public InstanceRegistryTest {
 protected:
  static constexpr registry::EndpointHandle false_reader = 7;
  static constexpr registry::EndpointHandle false_writer = 8;
  static constexpr registry::EndpointHandle false_heartbeats = 9;

  void SetUp() override {
    sut.reader_seen(false_reader, {identity, other_participant}, start);
    sut.writer_seen(false_writer, {identity.id, other_participant, identity.uuid});
    sut.heartbeat_writer_seen(false_heartbeats, other_participant);
  }
};

// A regression: after a restart of the gateway no call was answered while the attacker was there.
TEST_F(AnUnprovedAnnouncement, TakesNoInstanceAway) {
  EXPECT_FALSE(sut.has_home(identity.id));
  EXPECT_FALSE(sut.is_home(other_participant, identity.id));
  EXPECT_FALSE(sut.heartbeats_for(false_heartbeats, identity.id));
  discover_both();
  match();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  EXPECT_TRUE(sut.is_home(process, identity.id));
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
  EXPECT_FALSE(sut.speaks_for(false_writer, identity.id));
}

// A regression: for tools each announcement counted.
TEST_F(AnUnprovedAnnouncement, IsNoInstanceForAToolThatMatchesWriters) {
  sut.match_readers();
  EXPECT_THAT(sut.changes().ready, IsEmpty());
  discover_both();
  sut.matched(reply_writer, true);
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  EXPECT_FALSE(sut.is_home(other_participant, identity.id));
}

TEST_F(AnUnprovedAnnouncement, IsNotProvedByAWriterOfAnotherUuid) {
  constexpr registry::EndpointHandle of_its_own = 12;
  sut.match_readers();
  sut.writer_seen(of_its_own, {identity.id, other_participant, "its own"});
  sut.matched(of_its_own, true);
  EXPECT_FALSE(sut.is_home(other_participant, identity.id));
  // What it announces after the match proves nothing either.
  sut.writer_seen(of_its_own, {identity.id, other_participant, identity.uuid});
  EXPECT_FALSE(sut.is_home(other_participant, identity.id));
}

TEST_F(AnUnprovedAnnouncement, DisplacesNoInstanceFromAFullTable) {
  constexpr registry::EndpointHandle first = 100;
  for (std::size_t i = 0; i < registry::InstanceRegistry::most_endpoints; ++i) {
    sut.reader_seen(first + 3 * i,
                    {{.id = InstanceId::random(), .uuid = "none"}, other_participant}, start);
    sut.writer_seen(first + 3 * i + 1, {InstanceId::random(), other_participant, "none"});
    sut.heartbeat_writer_seen(first + 3 * i + 2, other_participant);
  }
  discover_both();
  match();
  sut.heartbeat_writer_seen(heartbeats, process);
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  EXPECT_TRUE(sut.heartbeats_for(heartbeats, identity.id));
}

// A service may announce any id in its own UUID, and would take the instance away after a restart
// of the gateway.
TEST_F(InstanceRegistryTest, PrefersTheProcessThatMadeTheId) {
  const InstanceIdentity thief{.id = identity.id, .uuid = "its own"};
  sut.reader_seen(7, {thief, other_participant}, start);
  sut.writer_seen(8, {thief.id, other_participant, thief.uuid});
  sut.matched(7, true);
  sut.matched(8, true);
  EXPECT_THAT(sut.changes().ready, ElementsAre(thief));
  sut.reader_seen(reader, {identity, process, true}, start);
  sut.writer_seen(reply_writer, {identity.id, process, identity.uuid});
  match();
  const auto changes = sut.changes();
  EXPECT_THAT(changes.gone, ElementsAre(identity.id));
  EXPECT_THAT(changes.ready, ElementsAre(identity));
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
  EXPECT_FALSE(sut.speaks_for(8, identity.id));
}

TEST_F(InstanceRegistryTest, CountsAnIdWithAnotherUuidAsAnotherInstance) {
  discover_both();
  match();
  sut.changes();
  const InstanceIdentity other{.id = identity.id, .uuid = "press"};
  sut.reader_seen(7, {other, other_participant}, start);
  sut.writer_seen(8, {other.id, other_participant, other.uuid});
  sut.matched(7, true);
  sut.matched(8, true);
  EXPECT_THAT(sut.changes().changed, IsEmpty());
  sut.endpoint_gone(reader);
  const auto changes = sut.changes();
  EXPECT_THAT(changes.gone, ElementsAre(identity.id));
  EXPECT_THAT(changes.ready, ElementsAre(other));
  EXPECT_THAT(changes.changed, IsEmpty());
}

// A regression: a process that announced the id of an instance later could publish that it drains,
// or answer its calls.
TEST_F(InstanceRegistryTest, AcceptsTheProcessThatProvedAnInstanceFirst) {
  using Seen = registry::InstanceRegistry::Seen;
  discover_both();
  match();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  constexpr registry::EndpointHandle false_reader = 0;
  constexpr registry::EndpointHandle false_writer = 8;
  InstanceIdentity forged = identity;
  forged.draining = true;
  EXPECT_EQ(sut.reader_seen(false_reader, {forged, other_participant}, start), Seen::second);
  sut.writer_seen(false_writer, {identity.id, other_participant, identity.uuid});
  sut.matched(false_reader, true);
  sut.matched(false_writer, true);
  const auto changes = sut.changes();
  EXPECT_THAT(changes.changed, IsEmpty());
  EXPECT_THAT(changes.gone, IsEmpty());
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
  EXPECT_FALSE(sut.speaks_for(false_writer, identity.id));
  // A new announcement by the first process does not make the other one the first.
  InstanceIdentity renamed = identity;
  renamed.name = "renamed";
  EXPECT_EQ(sut.reader_seen(reader, {renamed, process}, start), Seen::taken);
  EXPECT_THAT(sut.changes().changed, ElementsAre(renamed));
  sut.endpoint_gone(reader);
  EXPECT_THAT(sut.changes().changed, ElementsAre(forged)) << "it is the only one now";
}

TEST_F(InstanceRegistryTest, LimitsTheNumberOfEndpoints) {
  using Seen = registry::InstanceRegistry::Seen;
  constexpr registry::EndpointHandle first = 100;
  std::size_t readers = 0;
  std::size_t writers = 0;
  for (std::size_t i = 0; i < registry::InstanceRegistry::most_endpoints + 10; ++i) {
    InstanceIdentity entry{.id = InstanceId::random(), .uuid = "weather"};
    readers += sut.reader_seen(first + 2 * i, {entry, process}, start) == Seen::taken ? 1U : 0U;
    writers += sut.writer_seen(first + 2 * i + 1, {entry.id, process}) == Seen::taken ? 1U : 0U;
  }
  EXPECT_EQ(readers, registry::InstanceRegistry::most_endpoints);
  EXPECT_EQ(writers, registry::InstanceRegistry::most_endpoints);
  sut.endpoint_gone(first);
  EXPECT_EQ(sut.reader_seen(reader, {identity, process}, start), Seen::taken);
}

TEST_F(InstanceRegistryTest, AcceptsNoUnauthenticatedInstanceIfConfigured) {
  sut.require_authentication();
  discover_both();
  match();
  EXPECT_THAT(sut.changes().ready, IsEmpty());
  EXPECT_FALSE(sut.speaks_for(reply_writer, identity.id));
  sut.authenticated(process, "square-root");
  const auto ready = sut.changes().ready;
  ASSERT_EQ(ready.size(), 1U);
  EXPECT_EQ(ready.front().certificate, "square-root");
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(InstanceRegistryTest, AcceptsAnAuthenticationThatComesBeforeTheInstance) {
  sut.require_authentication();
  sut.authenticated(process, "square-root");
  discover_both();
  match();
  EXPECT_EQ(sut.changes().ready.size(), 1U);
}

TEST_F(InstanceRegistryTest, CountsARevokedInstanceAsGoneAndDropsItsSamples) {
  sut.require_authentication();
  sut.authenticated(process, "square-root");
  discover_both();
  match();
  sut.changes();
  sut.authenticated(process, std::nullopt);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  EXPECT_FALSE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(InstanceRegistryTest, AcceptsTheLastSamplesOfAnAuthenticatedInstanceThatLeft) {
  sut.require_authentication();
  sut.authenticated(process, "square-root");
  discover_both();
  match();
  sut.changes();
  sut.authenticated_gone(process);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

TEST_F(InstanceRegistryTest, ReportsAnUnauthenticatedInstanceOnce) {
  sut.require_authentication();
  discover_both();
  match();
  EXPECT_THAT(sut.take_unauthenticated(), IsEmpty());
  ASSERT_EQ(sut.next_time(), start + registry::InstanceRegistry::authentication_timeout);
  sut.on_time(start + registry::InstanceRegistry::authentication_timeout);
  EXPECT_THAT(sut.take_unauthenticated(), ElementsAre(std::pair(identity.id, identity.uuid)));
  sut.on_time(start + 2 * registry::InstanceRegistry::authentication_timeout);
  EXPECT_THAT(sut.take_unauthenticated(), IsEmpty());
  // A foreign program may publish its identity last.
  sut.authenticated(process, "square-root");
  EXPECT_EQ(sut.changes().ready.size(), 1U);
}

TEST_F(InstanceRegistryTest, ReportsAnUnauthenticatedProcessWhateverItAnnounces) {
  sut.require_authentication();
  discover_both();
  const InstanceIdentity more{.id = InstanceId::random(), .uuid = "weather"};
  sut.reader_seen(3, {more, process},
                  start + registry::InstanceRegistry::authentication_timeout / 2);
  sut.on_time(start + registry::InstanceRegistry::authentication_timeout);
  EXPECT_EQ(sut.take_unauthenticated().size(), 2U);
}

TEST_F(InstanceRegistryTest, ReportsAnUnauthenticatedProcessWithHeartbeatsOnce) {
  constexpr SteadyTime late = start + registry::InstanceRegistry::authentication_timeout;
  identity.lease = 500ms;
  sut.require_authentication();
  discover_both();
  sut.heartbeat_writer_seen(heartbeats, process);
  sut.heartbeat(heartbeats, late);
  sut.on_time(late);
  EXPECT_EQ(sut.take_unauthenticated().size(), 1U);
  sut.on_time(late + 400ms);
  EXPECT_THAT(sut.take_unauthenticated(), IsEmpty());
}

TEST_F(InstanceRegistryTest, AcceptsTheAuthenticatedInstanceBesideAnUnauthenticatedOne) {
  sut.require_authentication();
  constexpr registry::EndpointHandle squatter = 7;
  sut.reader_seen(squatter, {identity, other_participant}, start);
  sut.matched(squatter, true);
  sut.authenticated(process, "square-root");
  discover_both();
  match();
  EXPECT_EQ(sut.changes().ready.size(), 1U);
  EXPECT_TRUE(sut.speaks_for(reply_writer, identity.id));
}

}  // namespace
}  // namespace millrace::fabric
