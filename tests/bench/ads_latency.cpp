// The cost of an ADS read by name compared with the bare TCP round trip of the same bytes over
// Asio, on the loopback interface, in the same run. Client and server have a thread each, as two
// processes would.
//
//   ads_latency [ROUNDS [READS_PER_ROUND]]
//
// Prints medians and 99th percentiles in microseconds and the ratio of the medians; exit code 1 if
// it is above 2.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <fmt/format.h>

#include "cnc/ads/client.hpp"
#include "cnc/ads/server.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"
#include "tests/bench/series.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"

namespace {

namespace asio = boost::asio;
namespace ads = millrace::cnc::ads;
namespace variables = millrace::cnc::variables;
using asio::ip::tcp;
using millrace::bench::Clock;
using millrace::bench::Series;

constexpr auto quietly = asio::as_tuple(asio::use_awaitable);
constexpr double goal = 2.0;
constexpr std::string_view name = "V.G.SERVICE.REQUEST";
constexpr std::uint32_t value_size = 128;
// The sizes of that read's frames.
constexpr std::size_t request_size = 6 + 32 + 16 + name.size() + 1;
constexpr std::size_t response_size = 6 + 32 + 8 + value_size;

// A controller with one variable.
class OneVariable : public ads::MemoryDevice {
 public:
  ads::Result<ads::Bytes> read_write(std::uint16_t, ads::Index, std::uint32_t,
                                     ads::BytesView data) override {
    const auto stream = variables::decode_name(data);
    if (!stream || stream->name != name) {
      return tl::make_unexpected(ads::ErrorCode::symbol_not_found);
    }
    return ads::Bytes(value_size);
  }
};

asio::awaitable<void> echo(tcp::acceptor& acceptor) {
  auto [error, socket] = co_await acceptor.async_accept(quietly);
  socket.set_option(tcp::no_delay(true));
  std::array<char, request_size> request;
  const std::array<char, response_size> response{};
  while (!error) {
    const auto in = asio::buffer(request);
    const auto [read_error, read_size] = co_await asio::async_read(socket, in, quietly);
    if (read_error) {
      co_return;
    }
    const auto out = asio::buffer(response);
    co_await asio::async_write(socket, out, quietly);
  }
}

// Both servers, in one thread.
class Servers {
 public:
  Servers()
      : acceptor_(io_, tcp::endpoint(asio::ip::address_v4::loopback(), 0)),
        server_(io_.get_executor(), with_sums_, {.tcp_port = 0}, millrace::base::program::no_log()),
        raw_port_(acceptor_.local_endpoint().port()) {
    asio::co_spawn(io_, echo(acceptor_), asio::detached);
    thread_ = std::thread([this] { io_.run(); });
  }
  ~Servers() {
    io_.stop();
    thread_.join();
  }
  Servers(const Servers&) = delete;
  Servers& operator=(const Servers&) = delete;

  [[nodiscard]] std::uint16_t raw_port() const { return raw_port_; }
  [[nodiscard]] std::uint16_t ads_port() const { return server_.tcp_port(); }

 private:
  asio::io_context io_{1};
  OneVariable device_;
  ads::SumCommands with_sums_{device_};
  tcp::acceptor acceptor_;
  ads::Server server_;
  std::uint16_t raw_port_;
  std::thread thread_;
};

void print(const char* what, Series& times) {
  fmt::print("{:<22}{:>10.1f}{:>10.1f}\n", what, times.median(), times.p99());
}

asio::awaitable<void> ping(tcp::socket& socket, int count, Series& series) {
  const std::array<char, request_size> request{};
  std::array<char, response_size> response;
  for (int i = 0; i < count; ++i) {
    const auto start = Clock::now();
    const auto out = asio::buffer(request);
    co_await asio::async_write(socket, out, asio::use_awaitable);
    const auto in = asio::buffer(response);
    co_await asio::async_read(socket, in, asio::use_awaitable);
    series.add(Clock::now() - start);
  }
}

asio::awaitable<void> read_by_name(ads::Client& client, int count, Series& series) {
  const ads::Index index{variables::decoder_group + 1, variables::offset::read_by_name};
  for (int i = 0; i < count; ++i) {
    const auto start = Clock::now();
    auto stream = variables::encode_name(name);
    const auto value =
        co_await client.read_write(variables::sda_port, index, value_size, std::move(stream));
    series.add(Clock::now() - start);
    if (!value || value->size() != value_size) {
      throw std::runtime_error("a read failed");
    }
  }
}

asio::awaitable<void> measure(const Servers& servers, int rounds, int count, Series& raw,
                              Series& named) {
  const auto executor = co_await asio::this_coro::executor;
  tcp::socket socket(executor);
  const tcp::endpoint raw_endpoint(asio::ip::address_v4::loopback(), servers.raw_port());
  co_await socket.async_connect(raw_endpoint, asio::use_awaitable);
  socket.set_option(tcp::no_delay(true));
  ads::ClientOptions options;
  options.tcp_port = servers.ads_port();
  options.target = ads::NetId{{127, 0, 0, 1, 1, 1}};
  ads::Client client(executor, options);
  const auto connected = co_await client.connect();
  if (!connected) {
    throw std::runtime_error(connected.error().message.text);
  }
  Series warm_up;
  co_await ping(socket, count, warm_up);
  co_await read_by_name(client, count, warm_up);
  for (int round = 0; round < rounds; ++round) {
    co_await ping(socket, count, raw);
    co_await read_by_name(client, count, named);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::max(std::atoi(argv[1]), 1) : 5;
  const int count = argc > 2 ? std::max(std::atoi(argv[2]), 1) : 10'000;
  Series raw;
  Series named;
  {
    const Servers servers;
    asio::io_context io(1);
    asio::co_spawn(io, measure(servers, rounds, count, raw, named), [](std::exception_ptr error) {
      if (error) {
        std::rethrow_exception(error);
      }
    });
    io.run();
  }
  fmt::print("{} x {} round trips of {} and {} bytes, in microseconds\n", rounds, count,
             request_size, response_size);
  fmt::print("{:<22}{:>10}{:>10}\n", "", "median", "p99");
  print("raw TCP ping-pong", raw);
  print("ADS read by name", named);
  const auto ratio = named.median() / raw.median();
  fmt::print("ratio of the medians  {:>10.2f}   goal: at most {:.1f}\n", ratio, goal);
  return ratio <= goal ? EXIT_SUCCESS : EXIT_FAILURE;
}
