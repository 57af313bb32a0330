#include "tests/unit/cnc/ads/raw_peer.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

constexpr auto quietly = asio::as_tuple(asio::use_awaitable);

}  // namespace

asio::awaitable<RawPeer> RawPeer::connect(std::uint16_t tcp_port) {
  const auto executor = co_await asio::this_coro::executor;
  tcp::socket socket(executor);
  const tcp::endpoint endpoint(asio::ip::address_v4::loopback(), tcp_port);
  co_await socket.async_connect(endpoint, asio::use_awaitable);
  socket.set_option(tcp::no_delay(true));
  co_return RawPeer(std::move(socket));
}

asio::awaitable<void> RawPeer::send(Bytes bytes) {
  co_await asio::async_write(socket_, asio::buffer(bytes), asio::use_awaitable);
}

asio::awaitable<std::optional<Bytes>> RawPeer::receive() {
  Bytes frame(frame_header_size);
  const auto header = asio::buffer(frame);
  const auto [header_error, header_size] = co_await asio::async_read(socket_, header, quietly);
  if (header_error) {
    co_return std::nullopt;
  }
  ByteReader in(frame);
  in.u16();
  frame.resize(frame_header_size + in.u32());
  const auto body = asio::buffer(frame) + frame_header_size;
  const auto [body_error, body_size] = co_await asio::async_read(socket_, body, quietly);
  if (body_error) {
    co_return std::nullopt;
  }
  co_return frame;
}

RawListener::RawListener(const asio::any_io_executor& executor)
    : acceptor_(executor, tcp::endpoint(asio::ip::address_v4::loopback(), 0)) {}

asio::awaitable<RawPeer> RawListener::accept() {
  tcp::socket socket = co_await acceptor_.async_accept(asio::use_awaitable);
  socket.set_option(tcp::no_delay(true));
  co_return RawPeer(std::move(socket));
}

}  // namespace millrace::cnc::ads
