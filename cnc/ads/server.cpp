#include "cnc/ads/server.hpp"

#include <algorithm>
#include <chrono>
#include <list>
#include <stdexcept>

#include <boost/asio/co_spawn.hpp>
#include <fmt/format.h>

#include "base/loop/accept.hpp"
#include "base/program/barrier.hpp"
#include "cnc/ads/connection.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using namespace std::chrono_literals;

/// Of the lines about connections that are too many, so that they fill no log.
constexpr auto refusal_pause = 10s;

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
        tcp_port(acceptor.local_endpoint().port()) {}

  using Connections = std::list<std::shared_ptr<Connection>>;
  static asio::awaitable<void> serve(std::shared_ptr<Impl> self, Connections::iterator place);
  static asio::awaitable<void> drain(std::shared_ptr<Impl> self,
                                     std::shared_ptr<asio::steady_timer> over);
  void admit(tcp::socket socket);
  [[nodiscard]] bool full() const;
  void say_refused(const Connection& connection);
  void stop();

  Device& device;
  ServerOptions options;
  base::program::Log log;
  tcp::acceptor acceptor;
  std::uint16_t tcp_port;
  Connections connections;
  /// Since the last line about one.
  std::size_t refused = 0;
  std::chrono::steady_clock::time_point next_refusal_line{};
  Lingering lingering;
};

void Server::Impl::admit(tcp::socket socket) {
  auto connection =
      std::make_shared<Connection>(plain_transport(std::move(socket)), device, options,
                                   options.notifications_survive ? &lingering : nullptr, log);
  log->debug("{}: connected", connection->peer());
  for (const auto& older : connections) {
    if (options.one_connection_per_address && older->address() == connection->address()) {
      log->info("{}: connection closed by us: {} is newer", older->peer(), connection->peer());
      older->close();
    }
  }
  if (full()) {
    say_refused(*connection);
    return;
  }
  const auto place = connections.insert(connections.end(), std::move(connection));
  asio::co_spawn(acceptor.get_executor(), serve(shared_from_this(), place),
                 base::program::rethrow_from_loop);
}

// One that is closed stays in the list until its coroutines have ended.
bool Server::Impl::full() const {
  const auto open =
      std::ranges::count_if(connections, [](const auto& one) { return !one->closed(); });
  return static_cast<std::size_t>(open) >= options.max_connections;
}

void Server::Impl::say_refused(const Connection& connection) {
  ++refused;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_refusal_line) {
    return;
  }
  log->warn("{}: connection refused: {} are open, which is the limit (max_connections){}",
            connection.peer(), options.max_connections,
            refused > 1 ? fmt::format("; {} others since the last such line", refused - 1) : "");
  refused = 0;
  next_refusal_line = now + refusal_pause;
}

asio::awaitable<void> Server::Impl::serve(std::shared_ptr<Impl> self, Connections::iterator place) {
  const auto connection = *place;
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
  for (const auto& connection : connections) {
    connection->close();
  }
}

Server::Server(const asio::any_io_executor& executor, Device& device, ServerOptions options,
               base::program::Log log)
    : impl_(std::make_shared<Impl>(executor, device, std::move(options), std::move(log))) {
  asio::co_spawn(executor,
                 base::loop::accept_each(impl_->acceptor, impl_->log,
                                         [impl = impl_](tcp::socket socket) {
                                           if (!impl->options.faults.refuse_connections) {
                                             impl->admit(std::move(socket));
                                           }
                                         }),
                 base::program::rethrow_from_loop);
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
