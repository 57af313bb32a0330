#include "cnc/ads/discovery_server.hpp"

#include <array>
#include <stdexcept>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/ip/udp.hpp>
#include <fmt/format.h>

#include "base/loop/loop.hpp"
#include "base/program/barrier.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using base::loop::quietly;

udp::socket listen_on(const asio::any_io_executor& executor, const DiscoveryOptions& options) {
  try {
    return {executor, {asio::ip::make_address(options.address), options.port}};
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(fmt::format("cannot listen on UDP {}:{}: {}", options.address,
                                         options.port, error.code().message()));
  }
}

}  // namespace

struct DiscoveryServer::Impl {
  Impl(const asio::any_io_executor& executor, DiscoveryOptions wanted,
       base::program::Log destination)
      : options(std::move(wanted)),
        log(std::move(destination)),
        socket(listen_on(executor, options)),
        port(socket.local_endpoint().port()) {}

  static asio::awaitable<void> serve(std::shared_ptr<Impl> self);
  /// Nullopt if the bytes are not a request.
  [[nodiscard]] std::optional<Datagram> answer(BytesView bytes, const udp::endpoint& peer) const;
  [[nodiscard]] ErrorCode add_route(const RouteRequest& route) const;

  DiscoveryOptions options;
  base::program::Log log;
  udp::socket socket;
  std::uint16_t port;
};

asio::awaitable<void> DiscoveryServer::Impl::serve(std::shared_ptr<Impl> self) {
  std::array<std::uint8_t, max_datagram> bytes{};
  udp::endpoint peer;
  while (self->socket.is_open()) {
    const auto room = asio::buffer(bytes);
    const auto [error, size] = co_await self->socket.async_receive_from(room, peer, quietly);
    if (error) {
      continue;  // closed, or a response that could not be delivered
    }
    const auto answer = self->answer(BytesView(bytes).first(size), peer);
    if (answer) {
      const Bytes encoded = encode(*answer);
      const auto content = asio::buffer(encoded);
      co_await self->socket.async_send_to(content, peer, quietly);
    }
  }
}

std::optional<Datagram> DiscoveryServer::Impl::answer(BytesView bytes,
                                                      const udp::endpoint& peer) const {
  const auto request = decode_datagram(bytes);
  if (!request || request->is_response) {
    return std::nullopt;
  }
  if (request->service == DiscoveryService::identify) {
    return identify_response(*request, options.identity);
  }
  const auto route = route_request_of(*request);
  if (!route) {
    return std::nullopt;
  }
  const ErrorCode status = add_route(*route);
  if (status != ErrorCode::none) {
    log->warn("{}: no route for {}: wrong user or password", peer.address().to_string(),
              route->net_id.to_string());
  }
  return route_response(*request, options.identity, status);
}

ErrorCode DiscoveryServer::Impl::add_route(const RouteRequest& route) const {
  const bool may =
      !options.user.empty() && route.user == options.user && route.password == options.password;
  if (!may || !options.routes) {
    return ErrorCode::access_denied_index;
  }
  options.routes->add({route.net_id, {}});
  return ErrorCode::none;
}

DiscoveryServer::DiscoveryServer(const asio::any_io_executor& executor, DiscoveryOptions options,
                                 base::program::Log log)
    : impl_(std::make_shared<Impl>(executor, std::move(options), std::move(log))) {
  asio::co_spawn(executor, Impl::serve(impl_), base::program::rethrow_from_loop);
}

DiscoveryServer::~DiscoveryServer() {
  boost::system::error_code ignored;
  impl_->socket.close(ignored);
}

std::uint16_t DiscoveryServer::port() const {
  return impl_->port;
}

}  // namespace millrace::cnc::ads
