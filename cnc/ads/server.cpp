#include "cnc/ads/server.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <list>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <boost/asio/co_spawn.hpp>
#include <fmt/format.h>

#include "base/loop/hosts.hpp"
#include "base/loop/loop.hpp"
#include "base/program/barrier.hpp"
#include "cnc/ads/connection.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using namespace std::chrono_literals;

/// Pause between log lines about excess connections, so that they do not fill the log.
constexpr auto refusal_pause = 10s;

std::optional<TlsContext> tls_context(const ServerOptions& options) {
  if (!options.security) {
    return std::nullopt;
  }
  auto context = TlsContext::server(*options.security);
  if (!context) {
    throw std::runtime_error(fmt::format("no Secure ADS: {}", context.error()));
  }
  return std::move(*context);
}

tcp::acceptor listen(const asio::any_io_executor& executor, const ServerOptions& options) {
  try {
    const tcp::endpoint endpoint(asio::ip::make_address(options.address), options.tcp_port);
    return {executor, endpoint};
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(fmt::format("cannot listen on {}:{}: {}", options.address,
                                         options.tcp_port, error.code().message()));
  }
}

/// A Secure ADS connection before its client is known.
struct Handshake {
  asio::ip::address address;
  std::weak_ptr<Stream> stream{};
  void close() const {
    boost::system::error_code ignored;
    if (const auto open = stream.lock()) {
      open->socket().close(ignored);
    }
  }
};

}  // namespace

struct Server::Impl : std::enable_shared_from_this<Impl> {
  Impl(const asio::any_io_executor& executor, Device& served, ServerOptions wanted,
       base::program::Log destination)
      : device(served),
        options(std::move(wanted)),
        log(std::move(destination)),
        tls(tls_context(options)),
        routes(options.routes ? options.routes : std::make_shared<Routes>()),
        acceptor(listen(executor, options)),
        tcp_port(acceptor.local_endpoint().port()) {}

  using Connections = std::list<std::shared_ptr<Connection>>;
  static asio::awaitable<void> serve(std::shared_ptr<Impl> self, Connections::iterator place);
  static asio::awaitable<void> drain(std::shared_ptr<Impl> self,
                                     std::shared_ptr<asio::steady_timer> over);
  void admit(tcp::socket socket);
  static asio::awaitable<void> welcome(std::shared_ptr<Impl> self, tcp::socket socket);
  void admit(Transport transport, const SessionOptions& session);
  [[nodiscard]] SessionOptions plain_session() const;
  [[nodiscard]] bool comes_too_soon();
  [[nodiscard]] bool full() const;
  /// Closes a half-open connection; false if there is none.
  bool make_room();
  void report_refused(const Connection& connection);
  void stop();

  Device& device;
  ServerOptions options;
  base::program::Log log;
  std::optional<TlsContext> tls;
  std::shared_ptr<Routes> routes;
  tcp::acceptor acceptor;
  std::uint16_t tcp_port;
  Connections connections;
  /// For the fault that limits their rate: when the last Secure ADS connection came.
  std::optional<std::chrono::steady_clock::time_point> last_secure;
  /// The oldest in front.
  std::vector<std::shared_ptr<Handshake>> handshakes;
  /// Refused connections since the last log line about one.
  std::size_t refused = 0;
  std::chrono::steady_clock::time_point next_refusal_line{};
  Lingering lingering;
};

void Server::Impl::admit(tcp::socket socket) {
  if (!tls) {
    admit(plain_transport(std::move(socket)), plain_session());
  } else {
    if (handshakes.size() >= options.max_connections) {
      const auto given_up = base::loop::most_dispensable(
          handshakes, [](const Handshake& handshake) { return handshake.address; });
      std::erase(handshakes, given_up);
      given_up->close();
    }
    asio::co_spawn(acceptor.get_executor(), welcome(shared_from_this(), std::move(socket)),
                   base::program::rethrow_from_loop);
  }
}

SessionOptions Server::Impl::plain_session() const {
  SessionOptions session = options.session;
  if (options.routes) {
    session.routes.push_back(session.net_id);  // an empty list would admit all clients
    for (const Route& route : options.routes->all()) {
      session.routes.push_back(route.net_id);
    }
  }
  return session;
}

asio::awaitable<void> Server::Impl::welcome(std::shared_ptr<Impl> self, tcp::socket socket) {
  boost::system::error_code gone;
  const auto peer = socket.remote_endpoint(gone);
  if (gone) {
    co_return;
  }
  if (self->comes_too_soon()) {
    self->log->warn("{}:{}: connection closed by us: it comes too soon (fault)",
                    peer.address().to_string(), peer.port());
    co_return;
  }
  const auto handshake = std::make_shared<Handshake>(Handshake{peer.address()});
  self->handshakes.push_back(handshake);
  const auto admits = [self, address = peer.address().to_string()](const ConnectInfo& request,
                                                                   const TlsPeer& known) {
    return ads::admit(request, {known.fingerprint, known.common_name, address},
                      *self->options.security, *self->routes);
  };
  SecureWelcome how{
      *self->tls,
      admits,
      self->options.session.net_id,
      self->options.handshake_timeout,
      self->options.secure_faults,
      [handshake](std::weak_ptr<Stream> stream) { handshake->stream = std::move(stream); }};
  auto welcomed = co_await welcome_securely(std::move(socket), std::move(how));
  std::erase(self->handshakes, handshake);
  if (!self->acceptor.is_open()) {
    co_return;
  }
  if (!welcomed) {
    self->log->warn("{}:{}: connection closed by us: {}", peer.address().to_string(), peer.port(),
                    welcomed.error());
    co_return;
  }
  // A client of Secure ADS may send only from its own NetId.
  SessionOptions session = self->options.session;
  session.routes = {welcomed->client};
  self->admit(std::move(welcomed->transport), session);
}

void Server::Impl::admit(Transport transport, const SessionOptions& session) {
  auto connection =
      std::make_shared<Connection>(std::move(transport), device, options, session,
                                   options.notifications_survive ? &lingering : nullptr, log);
  log->debug("{}: connected", connection->peer());
  for (const auto& older : connections) {
    if (options.one_connection_per_address && older->address() == connection->address()) {
      log->info("{}: connection closed by us: {} is newer", older->peer(), connection->peer());
      older->close();
    }
  }
  if (full() && !make_room()) {
    report_refused(*connection);
    return;
  }
  const auto place = connections.insert(connections.end(), std::move(connection));
  asio::co_spawn(acceptor.get_executor(), serve(shared_from_this(), place),
                 base::program::rethrow_from_loop);
}

bool Server::Impl::comes_too_soon() {
  const auto now = std::chrono::steady_clock::now();
  const auto before = std::exchange(last_secure, now);
  return before && now - *before < options.secure_faults.least_pause;
}

// A closed connection stays in the list until its coroutines have ended.
bool Server::Impl::full() const {
  const auto open = std::ranges::count_if(
      connections, [](const auto& connection) { return !connection->closed(); });
  return static_cast<std::size_t>(open) >= options.max_connections;
}

bool Server::Impl::make_room() {
  std::vector<std::shared_ptr<Connection>> half_open;
  std::ranges::copy_if(connections, std::back_inserter(half_open),
                       [](const auto& connection) { return connection->half_open(); });
  const auto given_up = base::loop::most_dispensable(
      half_open, [](const Connection& connection) { return connection.address(); });
  if (given_up == nullptr) {
    return false;
  }
  log->info("{}: connection closed by us: it has sent no frame, and {} connections are open",
            given_up->peer(), options.max_connections);
  given_up->close();
  return true;
}

void Server::Impl::report_refused(const Connection& connection) {
  ++refused;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_refusal_line) {
    return;
  }
  log->warn("{}: connection refused: {} are open, which is the limit{}", connection.peer(),
            options.max_connections,
            refused > 1 ? fmt::format("; {} others since the last such line", refused - 1) : "");
  refused = 0;
  next_refusal_line = now + refusal_pause;
}

asio::awaitable<void> Server::Impl::serve(std::shared_ptr<Impl> self, Connections::iterator place) {
  const auto connection = *place;
  co_await connection->run();
  self->connections.erase(place);
}

/// Ends the wait when all output is sent.
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
