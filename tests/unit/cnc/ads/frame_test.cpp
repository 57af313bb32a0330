#include "cnc/ads/frame.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/address.hpp"
#include "cnc/ads/error.hpp"
#include "tests/support/hex_vectors.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::HasSubstr;

constexpr std::size_t max_frame = 1000;

Bytes frame_vector(const std::string& name) {
  return tests::hex_vector("ads/frames.hex", name);
}

const Address sender{{{127, 0, 0, 1, 2, 1}}, 32750};
const Address receiver{{{127, 0, 0, 1, 1, 1}}, 552};

std::string error_of(const Bytes& bytes) {
  FrameReader sut(max_frame);
  sut.feed(bytes);
  const auto frame = sut.next();
  return frame ? "no error" : frame.error().message;
}

TEST(FrameReader, HandsOutAWholeFrame) {
  FrameReader sut(max_frame);
  sut.feed(frame_vector("read_request"));
  const auto frame = sut.next();
  ASSERT_TRUE(frame && *frame);
  EXPECT_EQ((*frame)->kind, FrameKind::ads);
  EXPECT_EQ((*frame)->body.size(), 44U);
  EXPECT_EQ(sut.pending(), 0U);
  EXPECT_FALSE(*sut.next());
}

TEST(FrameReader, WaitsForTheLastByte) {
  FrameReader sut(max_frame);
  const auto bytes = frame_vector("read_request");
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    ASSERT_FALSE(*sut.next()) << i;
    sut.feed(BytesView(bytes).subspan(i, 1));
  }
  EXPECT_TRUE(*sut.next());
}

TEST(FrameReader, HandsOutAHundredFramesOfOneSegment) {
  FrameReader sut(max_frame);
  Bytes segment;
  const auto frame = frame_vector("read_request");
  for (int i = 0; i < 100; ++i) {
    segment.insert(segment.end(), frame.begin(), frame.end());
  }
  sut.feed(segment);
  int count = 0;
  while (*sut.next()) {
    ++count;
  }
  EXPECT_EQ(count, 100);
}

TEST(FrameReader, RefusesALengthAboveItsLimitWithoutWaitingForTheBytes) {
  EXPECT_THAT(error_of(frame_vector("announces_4_gib")),
              HasSubstr("announces 4294967295 bytes; at most 1000"));
}

TEST(FrameReader, AcceptsALengthAtItsLimit) {
  FrameReader sut(44);
  sut.feed(frame_vector("read_request"));
  EXPECT_TRUE(*sut.next());
}

TEST(FrameReader, RefusesAnAdsFrameWithoutRoomForItsHeader) {
  EXPECT_THAT(error_of(frame_vector("too_short_for_ams")), HasSubstr("31 bytes is too short"));
}

TEST(FrameReader, RefusesWhatIsNoAmsTcp) {
  EXPECT_THAT(error_of(frame_vector("http")), HasSubstr("at most 1000"));
  EXPECT_THAT(error_of(encode_frame(FrameKind{0x4547}, Bytes(100))),
              HasSubstr("kind 0x4547 with 100 bytes"));
}

TEST(FrameReader, PassesRouterFrames) {
  FrameReader sut(max_frame);
  sut.feed(frame_vector("port_connect"));
  const auto frame = sut.next();
  ASSERT_TRUE(frame && *frame);
  EXPECT_EQ((*frame)->kind, FrameKind::port_connect);
  EXPECT_EQ((*frame)->body.size(), 2U);
}

/// The same frames in the format of Secure ADS.
Bytes headerless(const std::vector<std::string>& names) {
  Bytes bytes;
  for (const auto& name : names) {
    append_frames(bytes, frame_vector(name), Framing::headerless);
  }
  return bytes;
}

TEST(HeaderlessFrames, AreThoseOfAmsTcpWithoutTheirHeaders) {
  const Bytes request = frame_vector("read_request");
  const Bytes response = frame_vector("read_response");
  Bytes expected(request.begin() + frame_header_size, request.end());
  expected.insert(expected.end(), response.begin() + frame_header_size, response.end());
  Bytes together = request;
  together.insert(together.end(), response.begin(), response.end());
  Bytes sut;
  append_frames(sut, together, Framing::headerless);
  EXPECT_EQ(sut, expected);
}

TEST(HeaderlessFrames, AreFoundByTheLengthInTheirAmsHeaders) {
  FrameReader sut(max_frame, Framing::headerless);
  sut.feed(headerless({"read_request", "read_response"}));
  const auto first = sut.next();
  ASSERT_TRUE(first && *first);
  EXPECT_EQ((*first)->kind, FrameKind::ads);
  EXPECT_EQ(decode_packet((*first)->body)->header.command, Command::read);
  const auto second = sut.next();
  ASSERT_TRUE(second && *second);
  EXPECT_TRUE(decode_packet((*second)->body)->header.is_response());
  EXPECT_EQ(sut.pending(), 0U);
}

TEST(HeaderlessFrames, AreWaitedForToTheLastByte) {
  FrameReader sut(max_frame, Framing::headerless);
  const auto bytes = headerless({"read_request"});
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    ASSERT_FALSE(*sut.next()) << i;
    sut.feed(BytesView(bytes).subspan(i, 1));
  }
  EXPECT_TRUE(*sut.next());
}

TEST(HeaderlessFrames, AreRefusedAboveTheLimitWithoutWaitingForTheBytes) {
  FrameReader sut(43, Framing::headerless);
  sut.feed(BytesView(headerless({"read_request"})).first(packet_header_size));
  const auto frame = sut.next();
  ASSERT_FALSE(frame);
  EXPECT_THAT(frame.error().message, HasSubstr("announces 44 bytes; at most 43"));
}

TEST(HeaderlessFrames, AreRefusedBehindAHeaderOfAmsTcp) {
  FrameReader sut(max_frame, Framing::headerless);
  sut.feed(frame_vector("read_request"));
  const auto frame = sut.next();
  ASSERT_FALSE(frame);
  EXPECT_THAT(frame.error().message, HasSubstr("AMS/TCP header"));
}

TEST(Packet, IsDecodedAndEncodedToTheSameBytes) {
  const auto bytes = frame_vector("read_request");
  const auto packet = decode_packet(BytesView(bytes).subspan(frame_header_size));
  ASSERT_TRUE(packet) << packet.error().message;
  EXPECT_EQ(packet->header,
            (Header{receiver, sender, Command::read, flags::ads_command, ErrorCode::none, 7}));
  EXPECT_EQ(packet->data.size(), 12U);
  EXPECT_EQ(encode_packet(packet->header, packet->data), bytes);
}

TEST(Packet, OfAResponseHasSwappedAddressesAndFlags5) {
  const auto request = frame_vector("read_request");
  const auto response = frame_vector("read_response");
  const auto packet = decode_packet(BytesView(request).subspan(frame_header_size));
  const auto sut = response_header(packet->header);
  EXPECT_TRUE(sut.is_response());
  EXPECT_EQ(encode_packet(sut, BytesView(response).subspan(38)), response);
}

TEST(Packet, OfARouterErrorHasNoData) {
  const auto bytes = frame_vector("port_not_found");
  const auto packet = decode_packet(BytesView(bytes).subspan(frame_header_size));
  ASSERT_TRUE(packet);
  EXPECT_EQ(packet->header.error, ErrorCode::target_port_not_found);
  EXPECT_TRUE(packet->data.empty());
}

TEST(Packet, WithLengthsThatDisagreeIsRefused) {
  const auto bytes = frame_vector("lengths_disagree");
  const auto packet = decode_packet(BytesView(bytes).subspan(frame_header_size));
  ASSERT_FALSE(packet);
  EXPECT_THAT(packet.error().message, HasSubstr("announces 240 bytes of data, its frame holds 4"));
}

TEST(Packet, CutShortIsRefused) {
  const auto bytes = frame_vector("read_request");
  EXPECT_FALSE(decode_packet(BytesView(bytes).subspan(frame_header_size, 31)));
}

TEST(NetId, IsSixNumbersWithDots) {
  const auto sut = NetId::parse("5.62.130.0.1.255");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->bytes, (std::array<std::uint8_t, 6>{5, 62, 130, 0, 1, 255}));
  EXPECT_EQ(sut->to_string(), "5.62.130.0.1.255");
}

TEST(NetId, IsNothingElse) {
  for (const auto* text :
       {"", "1.2.3.4.5", "1.2.3.4.5.6.7", "1.2.3.4.5.256", "1.2.3.4.5.", "1.2.3.4.5.x",
        " 1.2.3.4.5.6", "1.2.3.4.5.6 ", "1..3.4.5.6", "1.2.3.4.5.-6", "host"}) {
    EXPECT_FALSE(NetId::parse(text)) << text;
  }
}

TEST(AdsError, HasItsNumberAndItsText) {
  EXPECT_EQ(describe(ErrorCode::symbol_not_found), "0x710 symbol not found");
  EXPECT_EQ(describe(ErrorCode{0x274D}), "0x274d TCP: connection refused");
}

TEST(AdsError, WithoutATextHasItsNumber) {
  EXPECT_EQ(describe(ErrorCode{0x7FF}), "ADS error 0x7ff");
  EXPECT_EQ(describe(ErrorCode{0xFFFE0000}), "ADS error 0xfffe0000");
}

TEST(AdsError, OfOurOwnHasItsTextOnly) {
  EXPECT_EQ(describe(ErrorCode::link_down), "not connected to the controller");
}

TEST(AdsError, OfOurOwnCannotComeFromTheWire) {
  EXPECT_EQ(from_wire(0xFFFF0001), ErrorCode::protocol_error);
  EXPECT_EQ(from_wire(0x745), ErrorCode::timeout);
}

TEST(AdsError, LeavesTheOutcomeOfAWriteUnknownUnlessTheControllerRefusedIt) {
  for (const auto code : {ErrorCode::timeout, ErrorCode::link_lost, ErrorCode::cancelled,
                          ErrorCode::device_timeout, ErrorCode::protocol_error}) {
    EXPECT_TRUE(leaves_outcome_unknown(code)) << describe(code);
    EXPECT_FALSE(is_refusal(code)) << describe(code);
  }
  for (const auto code : {ErrorCode::invalid_size, ErrorCode::symbol_not_found}) {
    EXPECT_FALSE(leaves_outcome_unknown(code)) << describe(code);
    EXPECT_TRUE(is_refusal(code)) << describe(code);
  }
  EXPECT_FALSE(leaves_outcome_unknown(ErrorCode::link_down)) << "nothing was sent";
  EXPECT_FALSE(leaves_outcome_unknown(ErrorCode::busy));
}

}  // namespace
}  // namespace millrace::cnc::ads
