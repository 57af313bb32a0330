// How a client handles valid and invalid responses of controllers. The invalid ones were seen on
// real controllers, or make widely used ADS libraries hang or return wrong data.
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <gmock/gmock.h>

#include "cnc/ads/request.hpp"
#include "cnc/ads/server.hpp"
#include "tests/unit/cnc/ads/client_fixture.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"

namespace millrace::cnc::ads {
namespace {

using namespace std::chrono_literals;

const Bytes eight_bytes{1, 2, 3, 4, 5, 6, 7, 8};

// In each test a read of 8 bytes is pending when the peer does something unusual.
class ClientRequest : public ClientFixture {
 protected:
  void begin() {
    peer.emplace(establish());
    read = start_read(8);
    request = *receive(*peer);
  }
  void answer_properly() { send(*peer, response_to(request, encode_data(eight_bytes))); }
  void expect_success() {
    answer_properly();
    const auto data = finish(read);
    ASSERT_TRUE(data) << describe(data.error());
    EXPECT_EQ(*data, eight_bytes);
    EXPECT_TRUE(sut->up());
  }
  ErrorCode error() {
    const auto data = finish(read);
    return data ? ErrorCode::none : data.error();
  }
  Header foreign_request(std::uint16_t port, std::uint32_t id) {
    const Address target{options.source.net_id, port};
    return {
        target, {options.target, 10000}, Command::read_state, flags::ads_command, ErrorCode::none,
        id};
  }

  std::optional<RawPeer> peer;
  Later<Data> read;
  Bytes request;
};

TEST_F(ClientRequest, SendsTheRequestedRead) {
  begin();
  EXPECT_EQ(header_of(request).command, Command::read);
  const auto payload = BytesView(request).subspan(frame_header_size + packet_header_size);
  const auto decoded = decode_request(Command::read, payload);
  EXPECT_EQ(std::get<ReadRequest>(*decoded).index, (Index{1, 1}));
  EXPECT_EQ(std::get<ReadRequest>(*decoded).length, 8U);
  expect_success();
}

TEST_F(ClientRequest, DoesNotMistakeARequestWithThePendingIdForItsAnswer) {
  begin();
  send(*peer,
       encode_packet(foreign_request(options.source.port, header_of(request).invoke_id), {}));
  EXPECT_TRUE(header_of(*receive(*peer)).is_response());
  expect_success();
}

TEST_F(ClientRequest, IgnoresARouterNote) {
  begin();
  send(*peer, encode_frame(FrameKind::router_note, Bytes(4)));
  expect_success();
  EXPECT_EQ(sut->counters().foreign, 1U);
}

TEST_F(ClientRequest, RefusesMoreDataThanRequested) {
  begin();
  send(*peer, response_to(request, encode_data(Bytes(16))));
  EXPECT_EQ(error(), ErrorCode::protocol_error);
  EXPECT_TRUE(sut->up());
}

TEST_F(ClientRequest, UnderstandsAHundredAnswersInOneSegmentOutOfOrder) {
  options.in_flight = 100;
  auto far = establish();
  std::vector<Later<Data>> reads;
  std::vector<Bytes> requests;
  for (std::uint8_t i = 0; i < 100; ++i) {
    reads.push_back(start_read());
    requests.push_back(*receive(far));
  }
  Bytes segment;
  for (std::uint8_t i = 100; i-- > 0;) {
    const auto frame = response_to(requests[i], encode_data(Bytes{i}));
    segment.insert(segment.end(), frame.begin(), frame.end());
  }
  send(far, segment);
  for (std::uint8_t i = 0; i < 100; ++i) {
    EXPECT_EQ(*finish(reads[i]), Bytes{i});
  }
}

TEST_F(ClientRequest, KeepsToItsWindow) {
  options.in_flight = 1;
  begin();
  auto second = start_read();
  answer_properly();
  finish(read);
  const auto next = *receive(*peer);
  EXPECT_NE(header_of(next).invoke_id, header_of(request).invoke_id);
  send(*peer, response_to(next, encode_data(Bytes{9})));
  EXPECT_EQ(*finish(second), Bytes{9});
}

TEST_F(ClientRequest, DropsAnAnswerThatComesTooLate) {
  options.timeout = 20ms;
  begin();
  EXPECT_EQ(error(), ErrorCode::timeout);
  answer_properly();
  read = start_read();
  request = *receive(*peer);
  expect_success();
  EXPECT_EQ(sut->counters().timeouts, 1U);
  EXPECT_EQ(sut->counters().late, 1U);
}

TEST_F(ClientRequest, CanBeCancelled) {
  begin();
  boost::asio::cancellation_signal cancel;
  const auto result = std::make_shared<std::optional<Data>>();
  boost::asio::co_spawn(
      io, tests::keep(sut->read(552, {1, 1}, 8), *result),
      boost::asio::bind_cancellation_slot(cancel.slot(), [result](std::exception_ptr) {}));
  receive(*peer);
  cancel.emit(boost::asio::cancellation_type::terminal);
  EXPECT_EQ(finish(result).error(), ErrorCode::cancelled);
  expect_success();
}

TEST_F(ClientRequest, ExchangesEveryCommandWithTheServer) {
  MemoryDevice device;
  device.values[{1, 1}] = eight_bytes;
  ServerOptions server_options;
  server_options.tcp_port = 0;
  Server server(io.get_executor(), device, server_options, base::program::no_log());
  options.tcp_port = server.tcp_port();
  EXPECT_EQ(finish(start(make_client().connect()))->ads, 5);
  EXPECT_EQ(finish(start(sut->info(552)))->name, "memory");
  EXPECT_EQ(finish(start(sut->state(552)))->ads, 5);
  EXPECT_EQ(*finish(start_read()), eight_bytes);
  EXPECT_EQ(*finish(start(sut->read_write(552, {1, 1}, 8, Bytes{7}))), eight_bytes);
  EXPECT_TRUE(finish(start(sut->write(552, {1, 1}, Bytes{1, 2}))));
  EXPECT_EQ(*finish(start_read()), (Bytes{1, 2}));
  EXPECT_EQ(finish(start(sut->write(552, {9, 9}, {}))).error(), ErrorCode::invalid_group);
  EXPECT_EQ(finish(start(sut->state(999))).error(), ErrorCode::target_port_not_found);
}

}  // namespace
}  // namespace millrace::cnc::ads
