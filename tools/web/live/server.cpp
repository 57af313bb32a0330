#include "tools/web/live/server.hpp"

#include <algorithm>
#include <ctime>
#include <iterator>
#include <list>
#include <optional>
#include <stdexcept>
#include <vector>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "base/loop/hosts.hpp"
#include "base/loop/loop.hpp"
#include "base/program/barrier.hpp"
#include "tools/web/live/connection.hpp"

namespace millrace::tools::web::live {

namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

tcp::acceptor listen(const asio::any_io_executor& executor, const ServerOptions& options) {
  try {
    return {executor, {asio::ip::make_address(options.address), options.port}};
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(
        fmt::format("cannot listen on {}:{}: {}; --listen chooses another address or port",
                    options.address, options.port, error.code().message()));
  }
}

std::optional<asio::ssl::context> tls_context(const ServerOptions& options) {
  if (options.certificate.empty()) {
    return std::nullopt;
  }
  std::optional<asio::ssl::context> context(asio::ssl::context::tls_server);
  context->set_options(asio::ssl::context::default_workarounds | asio::ssl::context::no_sslv2 |
                       asio::ssl::context::no_sslv3 | asio::ssl::context::no_tlsv1 |
                       asio::ssl::context::no_tlsv1_1);
  boost::system::error_code error;
  context->use_certificate_chain_file(options.certificate, error);
  if (error) {
    throw std::runtime_error(
        fmt::format("--tls-cert {}: {}; expected a certificate and its chain, in PEM",
                    options.certificate, error.message()));
  }
  context->use_private_key_file(options.key, asio::ssl::context::pem, error);
  if (error) {
    throw std::runtime_error(
        fmt::format("--tls-key {}: {}; expected the key of --tls-cert, in PEM, without a password",
                    options.key, error.message()));
  }
  if (::SSL_CTX_check_private_key(context->native_handle()) != 1) {
    throw std::runtime_error(fmt::format("--tls-key {}: it is not the key of --tls-cert {}",
                                         options.key, options.certificate));
  }
  return context;
}

std::optional<fabric::Time> end_of(SSL_CTX* context) {
  const X509* certificate = ::SSL_CTX_get0_certificate(context);
  std::tm time{};
  if (certificate == nullptr || ::ASN1_TIME_to_tm(::X509_get0_notAfter(certificate), &time) != 1) {
    return std::nullopt;
  }
  return std::chrono::system_clock::from_time_t(::timegm(&time));
}

}  // namespace

struct Server::Impl : std::enable_shared_from_this<Impl> {
  Impl(const asio::any_io_executor& executor, ServerOptions wanted, const http::Site& site,
       base::program::Log destination)
      : options(std::move(wanted)),
        tls(tls_context(options)),
        log(std::move(destination)),
        feeds(options.most_browsers),
        workers(executor),
        shared{site, options, workers, feeds, counts, greeting, log},
        acceptor(listen(executor, options)),
        port(acceptor.local_endpoint().port()) {}

  static asio::awaitable<void> serve(std::shared_ptr<Impl> self,
                                     std::shared_ptr<Connection> connection);
  void admit(tcp::socket socket);
  bool make_room();
  void stop();

  ServerOptions options;
  std::optional<asio::ssl::context> tls;
  base::program::Log log;
  ServerCounts counts;
  std::function<std::string()> greeting = [] { return std::string(); };
  Feeds feeds;
  Workers workers;
  Shared shared;
  tcp::acceptor acceptor;
  std::uint16_t port;
  /// The oldest in front.
  std::list<std::shared_ptr<Connection>> connections;
};

void Server::Impl::admit(tcp::socket socket) {
  ++counts.accepted;
  if (connections.size() >= options.most_connections && !make_room()) {
    ++counts.displaced;
    return;  // All others are busy; the new socket closes here.
  }
  boost::system::error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  auto connection = make_connection(std::move(socket), tls ? &*tls : nullptr, shared);
  asio::co_spawn(acceptor.get_executor(), serve(shared_from_this(), std::move(connection)),
                 base::program::rethrow_from_loop);
}

bool Server::Impl::make_room() {
  std::vector<std::shared_ptr<Connection>> idle;
  std::ranges::copy_if(connections, std::back_inserter(idle),
                       [](const auto& connection) { return connection->idle_since().has_value(); });
  std::ranges::stable_sort(idle, {},
                           [](const auto& connection) { return connection->idle_since(); });
  const auto given_up = base::loop::most_dispensable(
      idle, [](const Connection& connection) { return connection.peer(); });
  if (given_up == nullptr) {
    return false;
  }
  ++counts.displaced;
  given_up->close();
  connections.remove(given_up);
  return true;
}

asio::awaitable<void> Server::Impl::serve(std::shared_ptr<Impl> self,
                                          std::shared_ptr<Connection> connection) {
  self->connections.push_back(connection);
  co_await connection->run();
  // It may have been removed already, to make room.
  self->connections.remove(connection);
}

void Server::Impl::stop() {
  boost::system::error_code ignored;
  acceptor.close(ignored);
  for (const auto& connection : connections) {
    connection->close();
  }
  // Work refers to objects that are destroyed after the server.
  workers.stop();
}

Server::Server(const asio::any_io_executor& executor, ServerOptions options, const http::Site& site,
               base::program::Log log)
    : impl_(std::make_shared<Impl>(executor, std::move(options), site, std::move(log))) {
  asio::co_spawn(executor,
                 base::loop::accept_each(
                     impl_->acceptor, impl_->log,
                     [impl = impl_](tcp::socket socket) { impl->admit(std::move(socket)); }),
                 base::program::rethrow_from_loop);
}

Server::~Server() {
  impl_->stop();
}

void Server::on_greeting(std::function<std::string()> greeting) {
  impl_->greeting = std::move(greeting);
}

void Server::publish(std::string_view event, std::string_view data) {
  impl_->feeds.publish(event_text(event, data));
}

std::uint16_t Server::port() const {
  return impl_->port;
}

tl::expected<std::string, std::string> Server::take_certificate() {
  if (!impl_->tls) {
    return "there is no certificate to read: this server does not use TLS";
  }
  try {
    // Open connections keep their own context.
    impl_->tls = tls_context(impl_->options);
  } catch (const std::runtime_error& error) {
    return tl::unexpected(std::string(error.what()));
  }
  return fmt::format("the certificate {} is used from now on", impl_->options.certificate);
}

std::optional<fabric::Time> Server::certificate_ends() const {
  return impl_->tls ? end_of(impl_->tls->native_handle()) : std::nullopt;
}

ServerCounts Server::counts() const {
  ServerCounts counts = impl_->counts;
  counts.connections = impl_->connections.size();
  counts.browsers = impl_->feeds.size();
  return counts;
}

std::string event_text(std::string_view event, std::string_view data) {
  return fmt::format("event: {}\ndata: {}\n\n", event, data);
}

}  // namespace millrace::tools::web::live
