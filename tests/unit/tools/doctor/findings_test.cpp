#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/dds/entity.hpp"
#include "tests/support/hex_vectors.hpp"
#include "tools/doctor/announcement.hpp"
#include "tools/doctor/clock.hpp"
#include "tools/doctor/directory.hpp"
#include "tools/doctor/network.hpp"

namespace millrace::tools::doctor {
namespace {

using std::chrono_literals::operator""ms;
using testing::Contains;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::uint8_t> packet(const std::string& name) {
  return millrace::tests::hex_vector("doctor/announcements.hex", name);
}

TEST(AnAnnouncement, HasProgramHostAndProcessOfACycloneParticipant) {
  const auto sut = parse_announcement(packet("cyclone"));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->name, "sq1");
  EXPECT_EQ(sut->process, "millrace-square-root");
  EXPECT_EQ(sut->host, "vm");
  EXPECT_EQ(sut->pid, "20355");
  EXPECT_EQ(sut->prefix[0], 0x01);
  EXPECT_EQ(sut->prefix[11], 0x4b);
}

TEST(AnAnnouncement, OfTheOtherByteOrderWithInlineQosIsRead) {
  const auto sut = parse_announcement(packet("big_endian"));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->name, "other");
  EXPECT_EQ(sut->host, "");
}

TEST(AnAnnouncement, ShowsACertificateWithoutItsSubject) {
  const auto sut = parse_announcement(packet("trusted_cyclone"));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->name, "square_root");
  EXPECT_TRUE(sut->shows_certificate);
  EXPECT_EQ(sut->certificate, "");
  EXPECT_FALSE(parse_announcement(packet("cyclone"))->shows_certificate);
}

TEST(AnAnnouncement, HasTheSubjectOfItsCertificate) {
  const auto sut = parse_announcement(packet("trusted"));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->name, "other");
  EXPECT_TRUE(sut->shows_certificate);
  EXPECT_EQ(sut->certificate, "CN=gateway-1");
  EXPECT_EQ(sut->authority, "CN=plant identity");
}

TEST(AnAnnouncement, ThatIsCutAnywhereIsNone) {
  for (const char* name : {"cyclone", "big_endian", "trusted", "trusted_cyclone"}) {
    const auto whole = packet(name);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      EXPECT_FALSE(parse_announcement({whole.data(), size})) << name << " cut at " << size;
    }
  }
}

TEST(AnAnnouncement, IsNeitherAnotherWritersDataNorAnotherProtocol) {
  auto bytes = packet("cyclone");
  bytes[47] = 0xc7;  // A different built-in writer.
  EXPECT_FALSE(parse_announcement(bytes));
  bytes = packet("cyclone");
  bytes[0] = 'X';
  EXPECT_FALSE(parse_announcement(bytes));
}

TEST(AnAnnouncement, WithACountThatCannotBeIsReadAsFarAsItGoes) {
  auto bytes = packet("cyclone");
  bytes[88] = bytes[89] = bytes[90] = bytes[91] = 0xff;  // Properties.
  const auto sut = parse_announcement(bytes);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->process, "millrace-square-root");
  EXPECT_EQ(sut->name, "sq1");
}

fabric::Time at(std::chrono::nanoseconds time) {
  return fabric::Time(std::chrono::hours(1)) + time;
}

TEST(AClockComparison, AssumesTheAnswerInTheMiddleOfTheExchange) {
  ClockComparison sut;
  sut.add({at(0ms), at(5004ms), at(8ms)});
  ASSERT_TRUE(sut.result());
  EXPECT_EQ(sut.result()->ahead, 5000ms);
  EXPECT_EQ(sut.result()->error, 4ms);
}

TEST(AClockComparison, IsRightWithinItsErrorWhateverTheDelays) {
  for (const auto out : {0ms, 3ms, 10ms}) {  // Of a round trip of 10 ms.
    ClockComparison sut;
    sut.add({at(0ms), at(out - 700ms), at(10ms)});
    EXPECT_LE(std::chrono::abs(sut.result()->ahead + 700ms), sut.result()->error);
  }
}

TEST(AClockComparison, TrustsTheShortestExchange) {
  ClockComparison sut;
  sut.add({at(0ms), at(150ms), at(100ms)});
  sut.add({at(200ms), at(301ms), at(202ms)});
  sut.add({at(400ms), at(450ms), at(500ms)});
  EXPECT_EQ(sut.result()->ahead, 100ms);
  EXPECT_EQ(sut.result()->error, 1ms);
}

TEST(AClockComparison, HasNoResultBeforeAnAnswerWithATime) {
  ClockComparison sut;
  sut.add({at(0ms), fabric::Time{}, at(8ms)});
  sut.add({at(8ms), at(4ms), at(0ms)});
  EXPECT_FALSE(sut.result());
}

TEST(TheNetwork, HasALoopbackInterface) {
  EXPECT_THAT(interfaces_here(), Contains(Field(&Interface::loopback, true)));
}

TEST(TheDomainsOfAHost, AreReadFromItsOpenPorts) {
  // 7400 = 1CE8: domain 0; 7650 = 1DE2: domain 1; 7910 = 1EE6: first program of domain 2; 5353.
  EXPECT_THAT(domains_in("  sl  local_address rem_address   st tx_queue rx_queue\n"
                         "  7: 00000000:1CE8 00000000:0000 07 00000000:00000000\n"
                         "  8: 0100007F:1DE2 00000000:0000 07 00000000:00000000\n"
                         "  9: 00000000:1EE6 00000000:0000 07 00000000:00000000\n"
                         " 10: 00000000:14E9 00000000:0000 07 00000000:00000000\n"),
              ElementsAre(0, 1, 2));
}

TEST(TheDomainsOfAHost, AreNotOtherPorts) {
  // 7405: between the ports of domain 0. 65400 = FF78 would be domain 232.
  EXPECT_THAT(domains_in("  7: 00000000:1CED 0\n  8: 00000000:FF78 0\n"), IsEmpty());
  EXPECT_THAT(domains_in(""), IsEmpty());
  EXPECT_THAT(domains_in("garbage\n7: 0000:\n8: 0:XYZ\n"), IsEmpty());
}

TEST(TheInterfacesOfAHost, OnWhichProgramsListenAreReadFromItsGroups) {
  EXPECT_THAT(listening_interfaces_in("Idx\tDevice    : Count Querier\tGroup    Users Timer\n"
                                      "1\tlo        :     2      V3\n"
                                      "\t\t\t\t0100FFEF     1 0:00000000\t\t0\n"
                                      "\t\t\t\t010000E0     1 0:00000000\t\t0\n"
                                      "4\teth0      :     1      V3\n"
                                      "\t\t\t\t010000E0     1 0:00000000\t\t0\n"),
              ElementsAre("lo"));
  EXPECT_THAT(listening_interfaces_in(""), IsEmpty());
}

constexpr EndpointQos durable{.reliable = true, .durability = DDS_DURABILITY_TRANSIENT_LOCAL};

TEST(TheQosOfTwoEndpoints, FitsItself) {
  EXPECT_THAT(misfits(durable, durable), IsEmpty());
}

TEST(TheQosOfTwoEndpoints, FitsIfMoreIsOfferedThanRequested) {
  const EndpointQos modest{.reliable = false, .durability = DDS_DURABILITY_VOLATILE};
  EXPECT_THAT(misfits(durable, modest), IsEmpty());
}

TEST(TheQosOfTwoEndpoints, NamesEveryPolicyThatOffersTooLittle) {
  const EndpointQos modest{.reliable = false, .durability = DDS_DURABILITY_VOLATILE};
  EXPECT_THAT(
      misfits(modest, durable),
      ElementsAre(HasSubstr("reliability: best effort is offered, reliable is requested"),
                  HasSubstr("durability: volatile is offered, transient local is requested")));
  EndpointQos strict = durable;
  strict.deadline = 5'000'000;
  strict.exclusive = true;
  strict.liveliness = DDS_LIVELINESS_MANUAL_BY_TOPIC;
  strict.lease = 1'000'000;
  strict.by_source_time = true;
  EXPECT_THAT(misfits(durable, strict),
              ElementsAre(HasSubstr("deadline: none is offered, 5 ms"), HasSubstr("ownership"),
                          HasSubstr("liveliness: automatic"), HasSubstr("liveliness lease"),
                          HasSubstr("destination order")));
  EndpointQos slow = durable;
  slow.latency_budget = 1;
  EXPECT_THAT(misfits(slow, durable), ElementsAre(HasSubstr("latency budget")));
}

TEST(TheQosOfTwoEndpoints, HasTheStandardsDefaults) {
  const fabric::dds::Qos qos(dds_create_qos());
  EXPECT_TRUE(qos_of(*qos, true).reliable);
  EXPECT_FALSE(qos_of(*qos, false).reliable);
  EXPECT_EQ(qos_of(*qos, true).durability, std::uint32_t{DDS_DURABILITY_VOLATILE});
}

}  // namespace
}  // namespace millrace::tools::doctor
