#include "fabric/lcm/packet.hpp"

#include <gtest/gtest.h>

namespace millrace::fabric::lcm {
namespace {

using namespace std::string_literals;

/// As liblcm 1.3.1 sends it: lcm_publish(lcm, "REQ", "hello", 5), the second of a process.
const std::string from_liblcm = "LC02\0\0\0\x01REQ\0hello"s;

TEST(LcmPacket, IsWhatLiblcmSends) {
  const auto sut = parse_packet(from_liblcm);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->number, 1U);
  EXPECT_EQ(sut->channel, "REQ");
  EXPECT_EQ(sut->message, "hello");
  EXPECT_EQ(format_packet(*sut), from_liblcm);
}

TEST(LcmPacket, MayHaveAnEmptyMessageAndTheLongestName) {
  const std::string name(63, 'c');
  const std::string datagram = format_packet({.channel = name});
  const auto sut = parse_packet(datagram);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->channel, name);
  EXPECT_EQ(sut->message, "");
}

TEST(LcmPacket, IsNoneWithoutItsMagicAndTheEndOfItsName) {
  EXPECT_EQ(parse_packet("").error(), PacketFault::foreign);
  EXPECT_EQ(parse_packet("LC02\0\0\0"s).error(), PacketFault::foreign);
  EXPECT_EQ(parse_packet("LC01\0\0\0\x01REQ\0hello"s).error(), PacketFault::foreign);
  EXPECT_EQ(parse_packet("LC02\0\0\0\x01REQ"s).error(), PacketFault::foreign);
  const std::string name(64, 'c');
  EXPECT_EQ(parse_packet("LC02\0\0\0\x01"s + name + "\0"s).error(), PacketFault::foreign);
}

TEST(LcmPacket, OfALongMessageNamesItsChannelInItsFirstPart) {
  const std::string first = "LC03\0\0\0\x01\0\x01\0\0\0\0\0\0\0\0\0\x02REPLY\0data"s;
  EXPECT_EQ(parse_packet(first).error(), PacketFault::fragment);
  EXPECT_EQ(channel_of_fragment(first), "REPLY");
  const std::string second = "LC03\0\0\0\x01\0\x01\0\0\0\0\xFF\0\0\x01\0\x02REPLY\0data"s;
  EXPECT_EQ(channel_of_fragment(second), std::nullopt);
  EXPECT_EQ(channel_of_fragment(first.substr(0, 22)), std::nullopt);
  EXPECT_EQ(channel_of_fragment(from_liblcm), std::nullopt);
}

}  // namespace
}  // namespace millrace::fabric::lcm
