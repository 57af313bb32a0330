#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <fmt/format.h>

#include "base/openssl/certificate.hpp"
#include "base/openssl/key.hpp"
#include "cnc/ads/client.hpp"
#include "cnc/ads/server.hpp"
#include "tests/bench/gateway/measurements.hpp"
#include "tests/bench/series.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"

namespace millrace::bench {

namespace {

namespace asio = boost::asio;
namespace ads = cnc::ads;

constexpr std::uint16_t port = 552;
constexpr ads::Index place{1, 1};
constexpr std::uint32_t size = 128;

/// A self-signed certificate.
struct Holder {
  explicit Holder(const std::string& name)
      : certificate(base::openssl::self_signed(
            key, {.organisation = "millrace",
                  .common_name = name,
                  .from = std::chrono::sys_days(std::chrono::year(2000) / 1 / 1),
                  .until = std::chrono::sys_days(std::chrono::year(2100) / 1 / 1)})) {}
  base::openssl::Key key = base::openssl::Key::generate_rsa();
  base::openssl::Certificate certificate;
};

/// A connection from a client to a server, and its results.
struct Way {
  std::string name;
  double most_ms = 0;
  ads::ServerOptions server{.tcp_port = 0};
  ads::ClientOptions client{};
  Series rates{};
  Series connects{};
};

Way plain_connection() {
  Way way{.name = "plain ADS", .most_ms = 0};
  way.client.target = way.server.session.net_id;
  return way;
}

Way psk_connection() {
  Way way = plain_connection();
  way.name = "pre-shared key";
  way.most_ms = 60;
  const ads::Psk psk{"millrace", "secret"};
  way.server.security = ads::ServerSecurity{.psk = psk};
  way.client.security = psk;
  return way;
}

Way certificate_connection() {
  Way way = plain_connection();
  way.name = "certificates";
  way.most_ms = 150;
  const Holder controller("controller");
  const Holder gateway("gateway");
  way.server.security =
      ads::ServerSecurity{.self_signed = ads::ServerSelfSigned{
                              controller.certificate.pem(), controller.key.pem(), {}, {}}};
  way.server.routes = std::make_shared<ads::Routes>();
  way.server.routes->add({way.client.source.net_id, gateway.certificate.fingerprint()});
  way.client.security = ads::SelfSigned{gateway.certificate.pem(), gateway.key.pem(),
                                        controller.certificate.fingerprint()};
  return way;
}

/// A controller in its own thread, which stands for its own process.
class Controller {
 public:
  explicit Controller(const ads::ServerOptions& options)
      : server_(io_.get_executor(), device_, options, base::program::no_log()) {
    device_.values[place] = ads::Bytes(size);
    thread_ = std::thread([this] { io_.run(); });
  }
  ~Controller() {
    io_.stop();
    thread_.join();
  }
  Controller(const Controller&) = delete;
  Controller& operator=(const Controller&) = delete;

  [[nodiscard]] std::uint16_t tcp_port() const { return server_.tcp_port(); }

 private:
  asio::io_context io_{1};
  ads::MemoryDevice device_;
  ads::Server server_;
  std::thread thread_;
};

void connect(asio::io_context& io, ads::Client& client) {
  const auto up = tests::wait_for(io, client.connect());
  if (!up) {
    throw std::runtime_error(up.error().message.text);
  }
}

asio::awaitable<void> read(ads::Client& client, std::size_t times) {
  while (times-- > 0) {
    const auto value = co_await client.read(port, place, size);
    if (!value || value->size() != size) {
      throw std::runtime_error("a read failed");
    }
  }
}

/// The same over one link by `at_once` readers at once, each `times` times.
void read(asio::io_context& io, ads::Client& client, std::size_t at_once, std::size_t times) {
  std::size_t readers = at_once;
  for (std::size_t i = 0; i < at_once; ++i) {
    asio::co_spawn(io, read(client, times), [&readers](std::exception_ptr error) {
      if (error) {
        std::rethrow_exception(error);
      }
      --readers;
    });
  }
  while (readers > 0) {
    io.run_one();
  }
}

void measure(Way& way, std::size_t at_once, std::size_t times) {
  const Controller controller(way.server);
  asio::io_context io(1);
  ads::ClientOptions options = way.client;
  options.tcp_port = controller.tcp_port();
  options.in_flight = at_once;
  ads::Client client(io.get_executor(), options);
  const auto called = Clock::now();
  connect(io, client);
  way.connects.add(Clock::now() - called);
  read(io, client, at_once, times / 10);
  const auto start = Clock::now();
  read(io, client, at_once, times);
  const std::chrono::duration<double> took = Clock::now() - start;
  way.rates.add_microseconds(static_cast<double>(at_once * times) / took.count());
  client.close();
}

}  // namespace

bool measure_secure_links() {
  constexpr std::size_t rounds = 10;
  constexpr std::size_t reads = 48'000;
  constexpr double goal = 0.75;
  bool met = true;
  std::vector<Way> all{plain_connection(), psk_connection(), certificate_connection()};
  fmt::print("ADS reads of {} bytes per second over one connection, medians of {} rounds\n", size,
             rounds);
  for (const std::size_t at_once : {1U, 16U}) {
    for (Way& way : all) {
      way.rates = {};
    }
    for (std::size_t round = 0; round < rounds; ++round) {
      for (Way& way : all) {
        measure(way, at_once, reads / (at_once == 1 ? 4 : at_once));
      }
    }
    const double plain = all.front().rates.median();
    for (Way& way : all) {
      const double ratio = way.rates.median() / plain;
      const bool is_plain = &way == &all.front();
      fmt::print(
          "  {:>2} at once, {:<16}{:>9.0f}{}\n", at_once, way.name + ":", way.rates.median(),
          is_plain ? "" : fmt::format("   ratio {:.2f}   {}", ratio, verdict(ratio, goal, false)));
      met = met && (is_plain || ratio >= goal);
    }
  }
  fmt::print("connect until the first answer, ms, medians\n");
  for (Way& way : all) {
    const double ms = way.connects.median() / 1000;
    fmt::print("  {:<16}{:.2f}{}\n", way.name + ":", ms,
               way.most_ms > 0 ? "   " + verdict(ms, way.most_ms, true) : "");
    met = met && (way.most_ms == 0 || ms <= way.most_ms);
  }
  return met;
}

}  // namespace millrace::bench
