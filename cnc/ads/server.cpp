#include "cnc/ads/server.hpp"

#include <chrono>
#include <list>
#include <stdexcept>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <fmt/format.h>

#include "base/program/barrier.hpp"
#include "cnc/ads/connection.hpp"
#include "cnc/ads/quietly.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using namespace std::chrono_literals;

// How long to wait when the system has no descriptor left for a new connection.
constexpr auto accept_pause = 100ms;

tcp::acceptor listen(const asio::any_io_executor& executor, const ServerOptions& options) {
  try {
    const tcp::endpoint endpoint(asio::ip::make_address(options.address), options.tcp_port);
    return {executor, endpoint};
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(fmt::format("cannot listen on {}:{}: {}", options.address,
                                         options.tcp_port, error.code().message()));
  }
}

}  // namespace

struct Server::Impl : std::enable_shared_from_this<Impl> {
  Impl(const asio::any_io_executor& executor, Device& served, ServerOptions wanted,
       base::program::Log destination)
      : device(served),
        options(std::move(wanted)),
        log(std::move(destination)),
        acceptor(listen(executor, options)),
        tcp_port(acceptor.local_endpoint().port()),
        pause(executor) {}

  static asio::awaitable<void> accept(std::shared_ptr<Impl> self);
  static asio::awaitable<void> serve(std::shared_ptr<Impl> self,
                                     std::shared_ptr<Connection> connection);
  static asio::awaitable<void> drain(std::shared_ptr<Impl> self,
                                     std::shared_ptr<asio::steady_timer> over);
  void admit(tcp::socket socket);
  void stop();

  Device& device;
  ServerOptions options;
  base::program::Log log;
  tcp::acceptor acceptor;
  std::uint16_t tcp_port;
  asio::steady_timer pause;
  std::list<std::shared_ptr<Connection>> connections;
  Lingering lingering;
};

asio::awaitable<void> Server::Impl::accept(std::shared_ptr<Impl> self) {
  while (self->acceptor.is_open()) {
    auto [error, socket] = co_await self->acceptor.async_accept(quietly);
    if (!self->acceptor.is_open()) {
      co_return;
    }
    if (error) {
      self->log->warn("cannot accept a connection: {}", error.message());
      self->pause.expires_after(accept_pause);
      co_await self->pause.async_wait(quietly);
      continue;
    }
    if (!self->options.faults.refuse_connections) {
      self->admit(std::move(socket));
    }
  }
}

void Server::Impl::admit(tcp::socket socket) {
  auto connection =
      std::make_shared<Connection>(std::move(socket), device, options,
                                   options.notifications_survive ? &lingering : nullptr, log);
  log->debug("{}: connected", connection->peer());
  for (const auto& older : connections) {
    if (options.one_connection_per_address && older->address() == connection->address()) {
      log->info("{}: connection closed by us: {} is newer", older->peer(), connection->peer());
      older->close();
    }
  }
  asio::co_spawn(acceptor.get_executor(), serve(shared_from_this(), std::move(connection)),
                 base::program::rethrow_from_loop);
}

asio::awaitable<void> Server::Impl::serve(std::shared_ptr<Impl> self,
                                          std::shared_ptr<Connection> connection) {
  const auto place = self->connections.insert(self->connections.end(), connection);
  co_await connection->run();
  self->connections.erase(place);
}

/// Ends the wait when everything has left.
asio::awaitable<void> Server::Impl::drain(std::shared_ptr<Impl> self,
                                          std::shared_ptr<asio::steady_timer> over) {
  const auto there = self->connections;
  for (const auto& connection : there) {
    co_await Connection::drained(connection);
  }
  over->cancel();
}

void Server::Impl::stop() {
  boost::system::error_code ignored;
  acceptor.close(ignored);
  pause.cancel();
  for (const auto& connection : connections) {
    connection->close();
  }
}

Server::Server(const asio::any_io_executor& executor, Device& device, ServerOptions options,
               base::program::Log log)
    : impl_(std::make_shared<Impl>(executor, device, std::move(options), std::move(log))) {
  asio::co_spawn(executor, Impl::accept(impl_), base::program::rethrow_from_loop);
}

Server::~Server() {
  impl_->stop();
}

std::uint16_t Server::tcp_port() const {
  return impl_->tcp_port;
}

std::size_t Server::connections() const {
  return impl_->connections.size();
}

void Server::set_faults(const Faults& faults) {
  impl_->options.faults = faults;
}

void Server::drain(std::chrono::milliseconds limit, std::function<void(bool)> done) {
  const auto over = std::make_shared<asio::steady_timer>(impl_->acceptor.get_executor(), limit);
  over->async_wait([self = impl_, over, done = std::move(done)](boost::system::error_code error) {
    if (self->acceptor.is_open()) {
      done(error == asio::error::operation_aborted);
    }
  });
  asio::co_spawn(impl_->acceptor.get_executor(), Impl::drain(impl_, over),
                 base::program::rethrow_from_loop);
}

void Server::stop() {
  impl_->stop();
}

}  // namespace millrace::cnc::ads
