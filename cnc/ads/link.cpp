#include "cnc/ads/link.hpp"

#include <array>
#include <chrono>

#include <boost/asio/co_spawn.hpp>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include "base/program/barrier.hpp"

namespace millrace::cnc::ads {

namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

// Limit of the output for a controller that sends requests but does not read; beyond it we do not
// read from it either.
constexpr std::size_t max_output = std::size_t{1} << 20U;

// Time for the controller to read the last frames. It needs about a millisecond; a controller that
// hangs blocks the others for no longer than this.
constexpr std::chrono::milliseconds farewell{50};

std::string address_of(const tcp::socket& socket) {
  boost::system::error_code error;
  const auto endpoint = socket.local_endpoint(error);
  return error ? "our address" : endpoint.address().to_string();
}

}  // namespace

Link::Link(Transport transport, std::size_t max_frame, LinkHandlers handlers)
    : transport_(std::move(transport)),
      reader_(max_frame, transport_.framing),
      outbox_(transport_, max_output),
      handlers_(std::move(handlers)),
      local_address_(address_of(transport_.stream->socket())) {}

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
  boost::system::error_code ignored;
  transport_.stream->socket().close(ignored);
  const auto ended = std::exchange(handlers_.ended, nullptr);
  if (ended && end.cause != LinkEnd::Cause::closed_by_us) {
    ended(end);
  }
}

namespace {

std::string peer(const ClientOptions& options) {
  return fmt::format("{}:{}", options.host, options.tcp_port);
}

std::string no_ads(const ClientOptions& options, const std::string& detail) {
  return fmt::format("{} breaks the ADS protocol: {}: is this the port of an ADS router?",
                     peer(options), detail);
}

// What a router says of a controller that it cannot reach.
std::string undelivered(const ClientOptions& options, ErrorCode error) {
  switch (error) {
    case ErrorCode::target_port_not_found:
      return fmt::format("{} answers, but nothing serves its AMS port {}: does the CNC run?",
                         peer(options), options.probe_port);
    case ErrorCode::target_machine_not_found:
      return fmt::format(
          "{} answers, but does not know NetId {}: is the NetId of the controller right?",
          peer(options), options.target.to_string());
    default:
      return fmt::format("{} answers, but its router does not reach AMS port {}: {}", peer(options),
                         options.probe_port, describe(error));
  }
}

}  // namespace

LinkError explain_end(const ClientOptions& options, const LinkEnd& end, bool again) {
  if (end.cause == LinkEnd::Cause::broken_protocol) {
    return {ErrorCode::protocol_error, no_ads(options, end.detail)};
  }
  if (end.cause == LinkEnd::Cause::silent) {
    return {ErrorCode::timeout, fmt::format("{} {}", peer(options), end.detail), end.silent_for};
  }
  if (end.cause == LinkEnd::Cause::undelivered) {
    return {end.error, undelivered(options, end.error), end.silent_for};
  }
  if (again) {
    return {
        ErrorCode::link_lost,
        fmt::format("{} closed the connection ({}) again, and accepts new ones: is there another "
                    "ADS client on this host? A controller keeps one connection to each "
                    "address, the newest",
                    peer(options), end.detail)};
  }
  return {ErrorCode::link_lost,
          fmt::format("{} closed the connection ({})", peer(options), end.detail)};
}

LinkError explain_no_state(const ClientOptions& options, ErrorCode answer, const LinkEnd& end,
                           const std::string& local_address) {
  const auto source = options.source.net_id.to_string();
  const auto target = options.target.to_string();
  if (end.cause == LinkEnd::Cause::broken_protocol) {
    return {ErrorCode::protocol_error, no_ads(options, end.detail)};
  }
  switch (answer) {
    case ErrorCode::link_lost:
      if (end.cause == LinkEnd::Cause::closed_by_us) {
        return explain_no_connection(options, "closed while connecting");
      }
      return {
          answer,
          fmt::format("route missing: {} closed the connection before the first answer; it needs "
                      "a route from NetId {} to {}",
                      peer(options), source, local_address)};
    case ErrorCode::timeout:
      return {
          answer,
          fmt::format("{} accepted the connection but does not answer: is {} its NetId, and does "
                      "its route from NetId {} lead to {}?",
                      peer(options), target, source, local_address)};
    default:
      if (is_undelivered(answer)) {
        return {answer, undelivered(options, answer)};
      }
      return {answer,
              fmt::format("{} does not report its state: {}", peer(options), describe(answer))};
  }
}

LinkError explain_no_connection(const ClientOptions& options, const std::string& reason) {
  return {ErrorCode::link_down, fmt::format("{}: {}", peer(options), reason)};
}

}  // namespace millrace::cnc::ads
