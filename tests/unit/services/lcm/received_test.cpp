#include "services/lcm/received.hpp"

#include <cstdint>

#include <boost/endian/conversion.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <millrace/drain_t.hpp>

#include "fabric/lcm/packet.hpp"
#include "tests/unit/services/lcm/messages.hpp"

namespace millrace::services::lcm {
namespace {

using fabric::lcm::encode;
using testing::ElementsAre;
using testing::HasSubstr;

call_t call(const std::string& id, std::int32_t attempt = 1) {
  call_t message;
  message.id = id;
  message.attempt = attempt;
  return message;
}

std::string why_not(const presence_t& message) {
  const auto sut = parse_presence(encode(message));
  return sut ? "" : sut.error();
}

TEST(Presence, NamesTheProgramAndItsCalls) {
  presence_t message = tests::presence(1'500'000, {call("5f-17"), call("5f-18.0a", 2)});
  message.uuid = "{560AACBF-6335-44A9-895A-8B27F3ED5E47}";
  message.channels = " cnc/1  press/* ";
  message.delivery = presence_t::AT_MOST_ONCE;
  message.concurrency = 3;
  message.draining = 1;
  const auto sut = parse_presence(encode(message));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->program, tests::program);
  EXPECT_EQ(sut->at.time_since_epoch(), std::chrono::milliseconds(1500));
  EXPECT_TRUE(sut->draining);
  EXPECT_THAT(sut->calls, ElementsAre(Attempt{"5f-17", 1}, Attempt{"5f-18.0a", 2}));
  const sdk::Announcement& as = sut->announcement;
  EXPECT_EQ(as.uuid, tests::uuid);
  EXPECT_EQ(as.name, "press");
  EXPECT_EQ(as.delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(as.concurrency, 3U);
  EXPECT_THAT(as.channels,
              ElementsAre(fabric::ChannelScope{"cnc", 1}, fabric::ChannelScope{"press", 0}));
}

TEST(Presence, IsRefusedWithTheReason) {
  const auto changed = [](auto change) {
    presence_t message = tests::presence(1);
    change(message);
    return why_not(message);
  };
  EXPECT_EQ(why_not(tests::presence(1)), "");
  EXPECT_THAT(changed([](auto& m) { m.program = 0; }), HasSubstr("its number is 0"));
  EXPECT_THAT(changed([](auto& m) { m.utime = 0; }), HasSubstr("its utime is 0"));
  EXPECT_THAT(changed([](auto& m) { m.utime = INT64_MAX; }), HasSubstr("its utime is 92"));
  EXPECT_THAT(changed([](auto& m) { m.uuid = ""; }), HasSubstr("its UUID is \"\""));
  EXPECT_THAT(changed([](auto& m) { m.uuid = "a*"; }), HasSubstr("its UUID is \"a*\""));
  EXPECT_THAT(changed([](auto& m) { m.uuid = "a\x1B[2J"; }), HasSubstr("\"a\\x1b[2J\""));
  EXPECT_THAT(changed([](auto& m) { m.uuid = std::string(44, 'a'); }), HasSubstr("1 to 43"));
  EXPECT_THAT(changed([](auto& m) { m.name = std::string(64, 'n'); }),
              HasSubstr("its name has 64 bytes; at most 63 fit"));
  EXPECT_THAT(changed([](auto& m) { m.channels = "cnc/0"; }),
              HasSubstr("'cnc/0' is not a channel"));
  EXPECT_THAT(changed([](auto& m) { m.concurrency = 0; }), HasSubstr("its concurrency is 0"));
  EXPECT_THAT(changed([](auto& m) { m.concurrency = 257; }), HasSubstr("expected 1 to 256"));
  EXPECT_THAT(changed([](auto& m) { m.delivery = 2; }), HasSubstr("its delivery is 2"));
  EXPECT_THAT(why_not(tests::presence(1, {call("nothing")})), HasSubstr("\"nothing\""));
  EXPECT_THAT(why_not(tests::presence(1, {call("5f-1.\x1b[2J")})), HasSubstr("\"5f-1.\\x1b[2J\""));
  EXPECT_THAT(why_not(tests::presence(1, {call("5f-1", 0)})), HasSubstr("\"5f-1\""));
}

/// lcm-gen's own decoder allocates memory for the announced number of calls.
TEST(Presence, MakesNoRoomForCallsThatAreNotThere) {
  std::string bytes = encode(tests::presence(1));
  bytes[8] = 0x7F;
  const auto huge = parse_presence(bytes);
  ASSERT_FALSE(huge);
  EXPECT_THAT(huge.error(), HasSubstr("it announces 2130706432 calls"));
  bytes[8] = static_cast<char>(0xFF);
  EXPECT_FALSE(parse_presence(bytes));
}

TEST(Presence, OfAnotherTypeOrCutShortIsNone) {
  const auto other = parse_presence(encode(drain_t{}));
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error(), HasSubstr("another type, or another version of millrace's"));
  const std::string whole = encode(tests::presence(1, {call("5f-17")}));
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse_presence(whole.substr(0, size))) << size;
  }
  EXPECT_THAT(parse_presence(whole + "x").error(), HasSubstr("1 bytes stand behind"));
}

TEST(Reply, HasTheFieldsOfTheMessage) {
  reply_t message = tests::reply("5f-17", "Maß", 7);
  message.kind = reply_t::INTERIM;
  const auto sut = parse_reply(encode(message));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->program, tests::program);
  EXPECT_EQ(sut->attempt, (Attempt{"5f-17", 1}));
  EXPECT_EQ(sut->kind, AnswerKind::interim);
  EXPECT_EQ(sut->text, "Maß");
  EXPECT_EQ(sut->state, 7);
}

TEST(Reply, IsRefusedWithTheReason) {
  reply_t message = tests::reply("5f-17", "");
  message.kind = 3;
  EXPECT_THAT(parse_reply(encode(message)).error(), HasSubstr("its kind is 3"));
  EXPECT_THAT(parse_reply(encode(tests::reply("17", ""))).error(), HasSubstr("\"17\""));
}

TEST(Reply, IsRefusedIfATextInItHasAnImpossibleLength) {
  const std::string whole = encode(tests::reply("5f-17", "text"));
  // The length of the call's id. 0 has no room for its NUL; lcm-gen's code would subtract one from
  // the smallest, and read 2 GB.
  for (const std::int32_t length : {0, -1, INT32_MIN, INT32_MAX}) {
    std::string bytes = whole;
    boost::endian::store_big_s32(reinterpret_cast<unsigned char*>(bytes.data() + 16), length);
    EXPECT_THAT(parse_reply(bytes).error(), HasSubstr("impossible length")) << length;
  }
}

TEST(TextOfLcm, IsTheControllersInItsOwnCodePage) {
  EXPECT_EQ(to_controller("Maß", Encoding::utf8).value(), "Ma\xDF");
  EXPECT_EQ(to_controller("Ma\xDF", Encoding::cp1252).value(), "Ma\xDF");
  EXPECT_THAT(to_controller("中", Encoding::utf8).error(), HasSubstr("U+4E2D"));
  EXPECT_EQ(from_controller("Ma\xDF", Encoding::utf8), "Maß");
  EXPECT_EQ(from_controller("Ma\xDF", Encoding::cp1252), "Ma\xDF");
}

}  // namespace
}  // namespace millrace::services::lcm

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
