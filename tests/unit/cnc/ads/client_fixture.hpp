// A client at one end of a loopback connection, and a raw peer that the test controls at the other.
#pragma once

#include <memory>
#include <optional>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

#include "cnc/ads/client.hpp"
#include "cnc/ads/response.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/cnc/ads/raw_peer.hpp"

namespace millrace::cnc::ads {

/// The future result of a coroutine that runs in parallel with the test.
template <typename T>
using Later = std::shared_ptr<std::optional<T>>;

class ClientFixture : public testing::Test {
 protected:
  using Connected = tl::expected<DeviceState, LinkError>;
  using Data = Result<Bytes>;

  ClientFixture() : listener(io.get_executor()) {
    options.tcp_port = listener.tcp_port();
    options.target = *NetId::parse("127.0.0.1.1.1");
    options.timeout = std::chrono::seconds(10);
  }

  /// Call it before the first use of the client.
  Client& make_client() { return sut.emplace(io.get_executor(), options); }

  template <typename T>
  Later<T> start(boost::asio::awaitable<T> work) {
    auto result = std::make_shared<std::optional<T>>();
    boost::asio::co_spawn(io, tests::keep(std::move(work), *result),
                          [result](std::exception_ptr) {});
    return result;
  }
  template <typename T>
  T finish(const Later<T>& later) {
    if (!tests::run_until(io, [&] { return later->has_value(); })) {
      throw std::runtime_error("the coroutine did not end");
    }
    return **later;
  }

  /// A connected client, and its peer.
  RawPeer establish() {
    auto connected = start(make_client().connect());
    auto peer = accept();
    send(peer, response_to(*receive(peer), encode_state(DeviceState{5, 0})));
    EXPECT_TRUE(finish(connected));
    return peer;
  }
  Later<Data> start_read(std::uint32_t length = 8) { return start(sut->read(552, {1, 1}, length)); }

  RawPeer accept() { return tests::wait_for(io, listener.accept()); }
  std::optional<Bytes> receive(RawPeer& peer) { return tests::wait_for(io, peer.receive()); }
  void send(RawPeer& peer, Bytes bytes) { tests::wait_for(io, peer.send(std::move(bytes))); }

  static Header header_of(const Bytes& frame) {
    return decode_packet(BytesView(frame).subspan(frame_header_size))->header;
  }
  static Bytes response_to(const Bytes& request, const Bytes& payload,
                           ErrorCode error = ErrorCode::none) {
    return encode_packet(response_header(header_of(request), error), payload);
  }

  boost::asio::io_context io;
  RawListener listener;
  ClientOptions options;
  std::optional<Client> sut;
};

}  // namespace millrace::cnc::ads
