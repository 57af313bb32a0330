#include "tools/doctor/announcement.hpp"

#include <gtest/gtest.h>

#include "tests/support/hex_vectors.hpp"

namespace millrace::tools::doctor {
namespace {

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

}  // namespace
}  // namespace millrace::tools::doctor
