#include "fabric/registry/registry.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr registry::EndpointHandle reader = 1;
constexpr registry::EndpointHandle writer = 2;
constexpr registry::EndpointHandle participant = 10;
constexpr registry::EndpointHandle other_participant = 11;

class RegistryTest : public testing::Test {
 protected:
  void see_both() {
    sut.reader_seen(reader, {identity, participant});
    sut.writer_seen(writer, {identity.id, participant});
  }

  InstanceIdentity identity{.id = InstanceId::random(), .uuid = "weather"};
  registry::Registry sut;
};

TEST_F(RegistryTest, WaitsForBothEndpointsToBeSeenAndMatched) {
  sut.reader_seen(reader, {identity, participant});
  sut.set_matched({reader, writer});
  EXPECT_THAT(sut.changes().ready, IsEmpty());
  sut.writer_seen(writer, {identity.id, participant});
  sut.set_matched({reader});
  EXPECT_THAT(sut.changes().ready, IsEmpty());
  sut.set_matched({reader, writer});
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
}

TEST_F(RegistryTest, TellsEachChangeOnce) {
  see_both();
  sut.set_matched({reader, writer});
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  const registry::Registry::Changes again = sut.changes();
  EXPECT_THAT(again.ready, IsEmpty());
  EXPECT_THAT(again.changed, IsEmpty());
  EXPECT_THAT(again.gone, IsEmpty());
}

TEST_F(RegistryTest, TellsThatAnIdentityChanged) {
  see_both();
  sut.set_matched({reader, writer});
  sut.changes();
  identity.draining = true;
  sut.reader_seen(reader, {identity, participant});
  EXPECT_THAT(sut.changes().changed, ElementsAre(identity));
}

TEST_F(RegistryTest, TellsThatAnInstanceIsGoneWithEitherEndpoint) {
  for (const registry::EndpointHandle lost : {reader, writer}) {
    see_both();
    sut.set_matched({reader, writer});
    sut.changes();
    sut.endpoint_gone(lost);
    EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  }
}

TEST_F(RegistryTest, TellsThatAnInstanceIsGoneWhenItsMatchEnds) {
  see_both();
  sut.set_matched({reader, writer});
  sut.changes();
  sut.set_matched({});
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
  sut.set_matched({reader, writer});
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
}

TEST_F(RegistryTest, TakesWhoeverIsSeenForReadyIfAsked) {
  sut.match_all();
  see_both();
  EXPECT_THAT(sut.changes().ready, ElementsAre(identity));
  sut.endpoint_gone(writer);
  EXPECT_THAT(sut.changes().gone, ElementsAre(identity.id));
}

TEST_F(RegistryTest, DoesNotPairEndpointsOfTwoProcesses) {
  sut.reader_seen(reader, {identity, participant});
  sut.writer_seen(writer, {identity.id, other_participant});
  sut.set_matched({reader, writer});
  EXPECT_THAT(sut.changes().ready, IsEmpty());
}

TEST_F(RegistryTest, TakesTheWordOfAnInstanceFromItsOwnWriterOnly) {
  see_both();
  sut.writer_seen(3, {InstanceId::random(), participant});
  EXPECT_TRUE(sut.speaks_for(writer, identity.id));
  EXPECT_FALSE(sut.speaks_for(3, identity.id)) << "another instance's writer";
  EXPECT_FALSE(sut.speaks_for(4, identity.id)) << "a writer that says nothing of itself";
}

TEST_F(RegistryTest, TakesNoWordFromAWriterThatOnlyCallsItselfTheInstances) {
  see_both();
  sut.writer_seen(3, {identity.id, other_participant});
  EXPECT_FALSE(sut.speaks_for(3, identity.id));
  EXPECT_TRUE(sut.speaks_for(writer, identity.id));
}

TEST_F(RegistryTest, TakesTheWordOfAWriterWhoseReaderIsNotSeenYet) {
  sut.writer_seen(writer, {identity.id, participant});
  EXPECT_TRUE(sut.speaks_for(writer, identity.id));
}

TEST_F(RegistryTest, TakesTheLastWordsOfAnInstanceThatLeft) {
  see_both();
  sut.endpoint_gone(reader);
  sut.endpoint_gone(writer);
  EXPECT_TRUE(sut.speaks_for(writer, identity.id));
  for (registry::EndpointHandle other = 1'000; other < 2'000; ++other) {
    sut.writer_seen(other, {InstanceId::random(), participant});
    sut.endpoint_gone(other);
  }
  EXPECT_FALSE(sut.speaks_for(writer, identity.id)) << "not for ever";
}

}  // namespace
}  // namespace millrace::fabric
