// The vendor's design, as its manual describes the SDK: each service process has its own ADS
// connection and polls every channel for a request with its UUID.
#include <atomic>
#include <memory>
#include <vector>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <fmt/format.h>

#include "cnc/ads/client.hpp"
#include "cnc/variables/service_interface.hpp"
#include "fabric/messages.hpp"
#include "tests/bench/gateway/peers.hpp"

namespace millrace::bench {

namespace {

namespace asio = boost::asio;
using cnc::variables::ServiceInterface;
using cnc::variables::ServiceVariable;

cnc::ads::ClientOptions client_options(const PeerOptions& options, std::uint32_t service) {
  cnc::ads::ClientOptions client;
  client.tcp_port = options.port;
  client.target = *cnc::ads::NetId::parse("127.0.0.1.1.1");
  client.source.net_id = *cnc::ads::NetId::parse(fmt::format("127.0.0.1.2.{}", service + 1));
  return client;
}

asio::awaitable<void> answer(ServiceInterface& channel) {
  auto uuid = co_await channel.read(ServiceVariable::uuid);
  if (!uuid || fabric::canonical_uuid(std::get<std::string>(*uuid)) != bench_uuid) {
    co_return;
  }
  auto request = co_await channel.read(ServiceVariable::request);
  if (!request) {
    co_return;
  }
  auto response = co_await channel.write(ServiceVariable::response, std::move(*request));
  auto cleared = co_await channel.write(ServiceVariable::request_state, std::uint32_t{0});
  auto released = co_await channel.write(ServiceVariable::response_state, std::uint32_t{1});
  if (!response || !cleared || !released) {
    throw std::runtime_error("the controller refuses a write");
  }
}

/// Reads all channels once a period.
asio::awaitable<void> poll(const PeerOptions& options, std::uint32_t number,
                           cnc::ads::Client& client) {
  auto connected = co_await client.connect();
  if (!connected) {
    throw std::runtime_error(connected.error().message.text);
  }
  std::vector<ServiceInterface> channels;
  for (std::uint32_t channel = 1; channel <= options.channels; ++channel) {
    channels.emplace_back(client, channel);
  }
  asio::steady_timer timer(co_await asio::this_coro::executor);
  if (number == 0) {
    peer_is_ready();
  }
  auto next = std::chrono::steady_clock::now();
  while (true) {
    for (ServiceInterface& channel : channels) {
      auto state = co_await channel.read(ServiceVariable::request_state);
      // Only the first one is called; the others have different UUIDs.
      if (number == 0 && state && std::get<std::uint32_t>(*state) != 0) {
        co_await answer(channel);
      }
    }
    next = std::max(next + std::chrono::milliseconds(options.period_ms),
                    std::chrono::steady_clock::now());
    timer.expires_at(next);
    co_await timer.async_wait(asio::use_awaitable);
  }
}

}  // namespace

void serve_polling(const PeerOptions& options) {
  asio::io_context io(1);
  std::vector<std::unique_ptr<cnc::ads::Client>> clients;
  for (std::uint32_t service = 0; service < std::max(options.number, 1U); ++service) {
    clients.push_back(
        std::make_unique<cnc::ads::Client>(io.get_executor(), client_options(options, service)));
    asio::co_spawn(io, poll(options, service, *clients.back()), [](std::exception_ptr error) {
      if (error) {
        std::rethrow_exception(error);
      }
    });
  }
  // Counts the controller's responses, once a second.
  asio::steady_timer timer(io);
  std::uint64_t before = 0;
  std::function<void()> count = [&] {
    timer.expires_after(std::chrono::seconds(1));
    timer.async_wait([&](boost::system::error_code) {
      std::uint64_t requests = 0;
      for (const auto& client : clients) {
        requests += client->counters().answered;
      }
      fmt::print("requests {}\n", requests - before);
      std::fflush(stdout);
      before = requests;
      count();
    });
  };
  count();
  io.run();
}

}  // namespace millrace::bench
