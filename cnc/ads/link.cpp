#include "cnc/ads/link.hpp"

#include <array>
#include <chrono>

#include <boost/asio/co_spawn.hpp>
#include <fmt/format.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "base/messages/catalogue.hpp"
#include "base/program/barrier.hpp"

namespace millrace::cnc::ads {

namespace {

namespace asio = boost::asio;
namespace messages = base::messages;
using asio::ip::tcp;
using messages::Message;

// Limit of the output for a controller that sends requests but does not read; beyond it we do not
// read from it either.
constexpr std::size_t max_output = std::size_t{1} << 20U;

// Time for the controller to read the last frames. It needs about a millisecond; a controller that
// hangs blocks the others for no longer than this.
constexpr std::chrono::milliseconds farewell{50};

// Whether closing the socket sends what its peer has not received yet, as late as the network
// allows, or drops it.
void set_close_drops(tcp::socket& socket, bool drops) {
  boost::system::error_code ignored;
  socket.set_option(asio::socket_base::linger(drops, 0), ignored);
}

// The peer's system has acknowledged all that was sent.
bool all_received(tcp::socket& socket) {
  int bytes = 0;
  return ::ioctl(socket.native_handle(), SIOCOUTQ, &bytes) == 0 && bytes == 0;
}

std::string address_of(const tcp::socket& socket) {
  boost::system::error_code error;
  const auto endpoint = socket.local_endpoint(error);
  return error ? "our address" : endpoint.address().to_string();
}

}  // namespace

Link::Link(Transport transport, std::size_t max_frame, std::chrono::milliseconds undelivered_for,
           LinkHandlers handlers)
    : transport_(std::move(transport)),
      reader_(max_frame, transport_.framing),
      outbox_(transport_, max_output),
      handlers_(std::move(handlers)),
      local_address_(address_of(transport_.stream->socket())) {
  tcp::socket& connection = transport_.stream->socket();
  // Also for a process that is killed.
  set_close_drops(connection, true);
  const auto limit = static_cast<unsigned>(undelivered_for.count());
  // Ignored if it fails: the socket is closed already, and the first read reports that.
  static_cast<void>(::setsockopt(connection.native_handle(), IPPROTO_TCP, TCP_USER_TIMEOUT, &limit,
                                 sizeof limit));
}

void Link::start() {
  const auto executor = transport_.stream->socket().get_executor();
  asio::co_spawn(executor, receive(shared_from_this()), base::program::rethrow_from_loop);
  asio::co_spawn(executor, write(shared_from_this()), base::program::rethrow_from_loop);
}

asio::awaitable<void> Link::receive(std::shared_ptr<Link> self) {
  std::array<std::uint8_t, chunk_size> chunk{};
  while (!self->outbox_.stopped()) {
    co_await self->outbox_.room();
    const auto buffer = asio::buffer(chunk);
    const auto [error, size] = co_await self->transport_.stream->read_some(buffer);
    if (error) {
      self->end({LinkEnd::Cause::closed_by_peer, error.message()});
      co_return;
    }
    self->reader_.feed(BytesView(chunk).first(size));
    const auto understood = self->hand_out_frames();
    if (!understood) {
      self->end({LinkEnd::Cause::broken_protocol, understood.error().message});
    }
  }
}

asio::awaitable<void> Link::write(std::shared_ptr<Link> self) {
  const auto error = co_await self->outbox_.run();
  self->end({LinkEnd::Cause::closed_by_peer, error.message()});
}

tl::expected<void, ProtocolError> Link::hand_out_frames() {
  while (!outbox_.stopped()) {
    const auto next = reader_.next();
    if (!next) {
      return tl::make_unexpected(next.error());
    }
    const auto& frame = next.value();
    if (!frame) {
      return {};
    }
    if (frame->kind != FrameKind::ads) {
      handlers_.router_frame();
      continue;
    }
    const auto packet = decode_packet(frame->body);
    if (!packet) {
      return tl::make_unexpected(packet.error());
    }
    handlers_.packet(*packet);
  }
  return {};
}

void Link::send_last(BytesView frames) {
  if (outbox_.stopped() || outbox_.size() > 0) {
    return;
  }
  Bytes last;
  append_frames(last, frames, transport_.framing);
  transport_.stream->send_now(last);
  tcp::socket& connection = transport_.stream->socket();
  boost::system::error_code ignored;
  connection.shutdown(tcp::socket::shutdown_send, ignored);
  const int socket = connection.native_handle();
  // Closing a socket with unread data, or receiving data after that, resets the connection and may
  // lose what was sent. So wait until the other side closes.
  const auto end = std::chrono::steady_clock::now() + farewell;
  std::array<std::uint8_t, chunk_size> unread{};
  for (auto left = farewell; left.count() > 0;
       left = std::chrono::duration_cast<std::chrono::milliseconds>(
           end - std::chrono::steady_clock::now())) {
    pollfd readable{.fd = socket, .events = POLLIN, .revents = 0};
    if (::poll(&readable, 1, static_cast<int>(left.count())) != 1 ||
        ::recv(socket, unread.data(), unread.size(), MSG_DONTWAIT) <= 0) {
      return;
    }
  }
}

void Link::end(const LinkEnd& end) {
  outbox_.stop();
  tcp::socket& connection = transport_.stream->socket();
  if (all_received(connection)) {
    set_close_drops(connection, false);
  }
  boost::system::error_code ignored;
  connection.close(ignored);
  const auto ended = std::exchange(handlers_.ended, nullptr);
  if (ended && end.cause != LinkEnd::Cause::closed_by_us) {
    ended(end);
  }
}

namespace {

std::string peer(const ClientOptions& options) {
  return fmt::format("{}:{}", options.host, options.tcp_port);
}

std::string seconds(std::chrono::duration<double> time) {
  return fmt::format("{:.1f}", time.count());
}

// What a router says of a controller that it cannot reach.
Message undelivered(const ClientOptions& options, ErrorCode error) {
  switch (error) {
    case ErrorCode::target_port_not_found:
      return messages::port_not_served(peer(options), options.probe_port);
    case ErrorCode::target_machine_not_found:
      return messages::net_id_unknown(peer(options), options.target.to_string());
    default:
      return messages::port_not_reached(peer(options), options.probe_port, describe(error));
  }
}

}  // namespace

LinkError explain_end(const ClientOptions& options, const LinkEnd& end, bool again) {
  if (end.cause == LinkEnd::Cause::broken_protocol) {
    return {ErrorCode::protocol_error, messages::no_ads(peer(options), end.detail)};
  }
  if (end.cause == LinkEnd::Cause::silent) {
    const std::string time = seconds(end.silent_for);
    return {ErrorCode::timeout,
            end.late ? messages::controller_answers_late(peer(options), end.late->count(), time)
                     : messages::controller_does_not_answer(peer(options), time),
            end.silent_for};
  }
  if (end.cause == LinkEnd::Cause::undelivered) {
    return {end.error, undelivered(options, end.error), end.silent_for};
  }
  return {ErrorCode::link_lost, again ? messages::closed_connection_again(peer(options), end.detail)
                                      : messages::closed_connection(peer(options), end.detail)};
}

LinkError explain_no_state(const ClientOptions& options, ErrorCode answer, const LinkEnd& end,
                           const std::string& local_address) {
  const auto source = options.source.net_id.to_string();
  const auto target = options.target.to_string();
  if (end.cause == LinkEnd::Cause::broken_protocol) {
    return {ErrorCode::protocol_error, messages::no_ads(peer(options), end.detail)};
  }
  switch (answer) {
    case ErrorCode::link_lost:
      if (end.cause == LinkEnd::Cause::closed_by_us) {
        return explain_no_connection(options, messages::closed_while_connecting());
      }
      return {answer, messages::route_missing(peer(options), source, local_address)};
    case ErrorCode::timeout:
      return {answer,
              messages::accepts_and_is_silent(peer(options), target, source, local_address)};
    default:
      if (is_undelivered(answer)) {
        return {answer, undelivered(options, answer)};
      }
      return {answer, messages::state_not_reported(peer(options), describe(answer))};
  }
}

LinkError explain_no_connection(const ClientOptions& options, const Message& reason) {
  return {ErrorCode::link_down, messages::about(peer(options), reason)};
}

}  // namespace millrace::cnc::ads
