#include "cnc/ads/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/request.hpp"
#include "cnc/ads/response.hpp"
#include "tests/support/hex_vectors.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const Address client{{{127, 0, 0, 1, 2, 1}}, 32750};
const Address controller{{{127, 0, 0, 1, 1, 1}}, 552};

class SessionTest : public testing::Test {
 protected:
  SessionTest() { device.values[{0x122301, 0x48}] = {1, 0, 0, 0}; }

  static Bytes vector(const std::string& name) { return tests::hex_vector("ads/frames.hex", name); }
  tl::expected<Bytes, ProtocolError> react(const Bytes& frame) {
    ByteReader in(frame);
    const FrameKind kind{in.u16()};
    in.u32();
    return Session(device, options).react({kind, in.rest()}, {});
  }
  Bytes react_to(const Header& header, const Bytes& payload = {}) {
    return react(encode_packet(header, payload)).value_or(Bytes{});
  }
  static Header header_of(const Bytes& frame) {
    return decode_packet(BytesView(frame).subspan(frame_header_size))->header;
  }

  MemoryDevice device;
  SessionOptions options;
};

TEST_F(SessionTest, AnswersARead) {
  EXPECT_EQ(*react(vector("read_request")), vector("read_response"));
}

TEST_F(SessionTest, AnswersAnUnknownAmsPortWithError6AndNoData) {
  Header header{controller, client, Command::read, flags::ads_command, ErrorCode::none, 7};
  header.target.port = 999;
  const auto response = react_to(header);
  EXPECT_EQ(header_of(response).error, ErrorCode::target_port_not_found);
  EXPECT_EQ(response.size(), frame_header_size + packet_header_size);
  EXPECT_EQ(device.calls, 0);
}

TEST_F(SessionTest, AnswersAForeignNetIdWithError7) {
  options.net_id = *NetId::parse("5.5.5.5.1.1");
  EXPECT_EQ(header_of(*react(vector("read_request"))).error, ErrorCode::target_machine_not_found);
}

TEST_F(SessionTest, DropsOrClosesForAForeignNetIdIfConfigured) {
  options.net_id = *NetId::parse("5.5.5.5.1.1");
  options.foreign_target = ForeignTarget::drop;
  EXPECT_THAT(*react(vector("read_request")), IsEmpty());
  options.foreign_target = ForeignTarget::close;
  const auto sut = react(vector("read_request"));
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error().message, HasSubstr("a frame for 127.0.0.1.1.1, but this is 5.5.5.5.1.1"));
}

TEST_F(SessionTest, ExecutesButDoesNotAnswerARequestThatWantsNoReturn) {
  const Header header{controller,          client,
                      Command::read_state, flags::ads_command | flags::no_return,
                      ErrorCode::none,     7};
  EXPECT_THAT(react_to(header), IsEmpty());
  EXPECT_EQ(device.calls, 1);
}

TEST_F(SessionTest, IgnoresResponses) {
  EXPECT_THAT(*react(vector("read_response")), IsEmpty());
  EXPECT_EQ(device.calls, 0);
}

TEST_F(SessionTest, ClosesForLengthsThatDisagree) {
  EXPECT_FALSE(react(vector("lengths_disagree")));
}

TEST_F(SessionTest, AnswersABrokenPayloadAndContinues) {
  const Header header{controller, client, Command::read, flags::ads_command, ErrorCode::none, 7};
  const auto response = react_to(header, {1, 2, 3});
  const auto packet = decode_packet(BytesView(response).subspan(frame_header_size));
  EXPECT_EQ(decode_data(packet->data, 4).error(), ErrorCode::invalid_size);
  EXPECT_EQ(packet->data.size(), 8U);
}

TEST_F(SessionTest, AnswersAnUnknownCommand) {
  const Header header{controller, client, Command{77}, flags::ads_command, ErrorCode::none, 7};
  const auto response = react_to(header);
  const auto packet = decode_packet(BytesView(response).subspan(frame_header_size));
  EXPECT_EQ(decode_result(packet->data).error(), ErrorCode::service_not_supported);
}

TEST_F(SessionTest, AssignsAnAmsPortLikeARouter) {
  Session sut(device, options);
  const Bytes any{0, 0};
  const auto first = sut.react({FrameKind::port_connect, any}, {});
  const auto second = sut.react({FrameKind::port_connect, any}, {});
  EXPECT_EQ(first->size(), 14U);
  EXPECT_NE(*first, *second);
  const Bytes wanted{0xEE, 0x7F};
  EXPECT_EQ(*sut.react({FrameKind::port_connect, wanted}, {}), vector("port_connected"));
}

TEST_F(SessionTest, ReturnsItsNetIdLikeARouter) {
  EXPECT_EQ(react(encode_frame(FrameKind::get_local_net_id, {}))->size(), frame_header_size + 6);
}

TEST_F(SessionTest, SkipsOtherRouterFrames) {
  EXPECT_THAT(*react(encode_frame(FrameKind::router_note, Bytes(4))), IsEmpty());
  EXPECT_THAT(*react(encode_frame(FrameKind{0x1234}, {})), IsEmpty());
}

TEST_F(SessionTest, IsOverWhenTheClientReleasesItsPort) {
  Session sut(device, options);
  const Bytes port{0xEE, 0x7F};
  EXPECT_FALSE(sut.over());
  EXPECT_THAT(*sut.react({FrameKind::port_close, port}, {}), IsEmpty());
  EXPECT_TRUE(sut.over());
}

TEST_F(SessionTest, DoesASumOfManyItemsInSlicesWithTheSameAnswer) {
  SumCommands sums(device);
  Session sut(sums, options);
  constexpr std::uint32_t count = 2000;
  ByteWriter items;
  for (std::uint32_t i = 0; i < count; ++i) {
    items.u32(0x122301).u32(i % 2 == 0 ? 0x48 : 0x99).u32(4);
  }
  const Bytes data = items.take();
  const Header header{controller,         client,          Command::read_write,
                      flags::ads_command, ErrorCode::none, 7};
  const Bytes question =
      encode_packet(header, encode(ReadWriteRequest{{sum::read, count}, count * 8, data}));
  const BytesView body = BytesView(question).subspan(frame_header_size);
  EXPECT_THAT(*sut.react({FrameKind::ads, body}, {}), IsEmpty());
  Bytes answer;
  int slices = 0;
  while (sut.working()) {
    ++slices;
    answer = sut.go_on();
  }
  EXPECT_EQ(slices, 4);
  const auto whole = sums.read_write(552, {sum::read, count}, count * 8, data);
  EXPECT_EQ(answer, encode_packet(response_header(header), encode_data(whole)));
}

TEST_F(SessionTest, RefusesAnInconsistentLargeSumAtOnce) {
  SumCommands sums(device);
  Session sut(sums, options);
  const Bytes data(24'000);
  const Header header{controller,         client,          Command::read_write,
                      flags::ads_command, ErrorCode::none, 7};
  const Bytes question =
      encode_packet(header, encode(ReadWriteRequest{{sum::read, 9999}, 100, data}));
  const BytesView body = BytesView(question).subspan(frame_header_size);
  const auto answer = sut.react({FrameKind::ads, body}, {});
  EXPECT_FALSE(sut.working());
  EXPECT_EQ(*answer, encode_packet(response_header(header),
                                   encode_data(tl::make_unexpected(ErrorCode::invalid_size))));
}

// Notifications of a client over several connections.
class LingeringTest : public SessionTest {
 protected:
  static Frame frame_of(const Bytes& bytes) {
    ByteReader in(bytes);
    const FrameKind kind{in.u16()};
    in.u32();
    return {kind, in.rest()};
  }
  // A subscription of the client at `from`; cyclic samples of one byte.
  static Bytes subscribe(const Address& from) {
    const Header header{controller,      from, Command::add_notification, flags::ads_command,
                        ErrorCode::none, 7};
    constexpr std::uint32_t cyclic = 3;
    return encode_packet(header, ByteWriter()
                                     .u32(0x122301)
                                     .u32(0x48)
                                     .u32(4)
                                     .u32(cyclic)
                                     .u32(0)
                                     .u32(10'000)
                                     .zeros(16)
                                     .take());
  }
  static Bytes ask_for_state(const Address& from) {
    return encode_packet(
        {controller, from, Command::read_state, flags::ads_command, ErrorCode::none, 8}, {});
  }

  Lingering lingering;
};

TEST_F(LingeringTest, NotificationsGoOnWhenTheirClientComesBack) {
  Session first(device, options, &lingering);
  const Bytes subscription = subscribe(client);
  ASSERT_TRUE(first.react(frame_of(subscription), {}));
  const Bytes sample = first.poll({});
  first.end();
  Session sut(device, options, &lingering);
  EXPECT_FALSE(sut.next_due());
  const Bytes question = ask_for_state(client);
  ASSERT_TRUE(sut.react(frame_of(question), {}));
  EXPECT_EQ(sut.poll({}), sample);
}

TEST_F(LingeringTest, NotificationsAreNotForAnotherClient) {
  Session first(device, options, &lingering);
  const Bytes subscription = subscribe(client);
  ASSERT_TRUE(first.react(frame_of(subscription), {}));
  first.end();
  Session sut(device, options, &lingering);
  const Bytes question = ask_for_state({{{10, 0, 0, 9, 1, 1}}, 32750});
  ASSERT_TRUE(sut.react(frame_of(question), {}));
  EXPECT_FALSE(sut.next_due());
}

TEST_F(LingeringTest, NotificationsEndWithTheirConnectionOtherwise) {
  Session first(device, options);
  const Bytes subscription = subscribe(client);
  ASSERT_TRUE(first.react(frame_of(subscription), {}));
  first.end();
  Session sut(device, options);
  const Bytes question = ask_for_state(client);
  ASSERT_TRUE(sut.react(frame_of(question), {}));
  EXPECT_FALSE(sut.next_due());
}

}  // namespace
}  // namespace millrace::cnc::ads
